"""How well a group has done over a run: the four fitness functions of Liu & Wu 2001, 9.2.2. Lengths are in the book's units."""

from __future__ import annotations

from enum import StrEnum
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from pal_advisor.surround.measures.steps import SURROUNDING, between, known, mean_distance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pal_advisor.fields import Fields


class Fitness(StrEnum):
    """What a group is to be good at."""

    CONTACT = "contact"
    """Every RANGER is near a WILD (Eq. 9.3)."""
    SURROUND = "surround"
    """Every WILD has three RANGERs near it (Eq. 9.5)."""
    CHASE = "chase"
    """RANGERs go straight to the WILDs: they move little (Eq. 9.7)."""
    FOCUS = "focus"
    """RANGERs learn about few stimuli, and are near a WILD (Eq. 9.8)."""


class FitnessSums:
    """What the fitness functions need of a run, summed up step by step, from step T0 = 1 on.

    Args:
        sectors: N.

    Attributes:
        steps: Steps taken in: T1, when the run is over.
        distance: Sum over the steps of D (Eq. 9.4).
        square: Sum of the squared mean distance of a WILD's three nearest RANGERs (Eqs. 9.5 and 9.6).
        way: How far all RANGERs have come (Eq. 9.7).
        weights: Sum of the weight vectors of the stimulus that most RANGERs met in each step (Eq. 9.8), shape (N,).
        known: In every step some RANGER's and some WILD's position was known.
    """

    def __init__(self, sectors: int) -> None:
        self.steps = 0
        self.distance = 0.0
        self.square = 0.0
        self.way = 0.0
        self.weights = np.zeros(sectors)
        self.known = True

    def take(
        self,
        rangers: NDArray[np.float64],
        wilds: NDArray[np.float64],
        way: float,
        met: NDArray[np.int64],
        weights: NDArray[np.float64],
    ) -> None:
        """Take in a step.

        Args:
            rangers: Where the RANGERs are after it, shape (rangers, 2); NaN where unknown.
            wilds: Where the WILDs are, likewise.
            way: How far all RANGERs came in it.
            met: How many RANGERs met each stimulus, shape (stimuli,).
            weights: The RANGERs' weights after it, shape (stimuli, N).
        """
        self.steps += 1
        distance, nearest = mean_distance(rangers, wilds), nearest_distance(rangers, wilds)
        if distance is None or nearest is None:
            self.known = False
        else:
            self.distance += distance
            self.square += nearest**2
        self.way += way
        if met.any():  # else nobody has met anything
            self.weights += weights[np.argmax(met)]

    def value(self, fitness: Fitness) -> float | None:
        """The fitness of the run so far.

        Args:
            fitness: Which.

        Returns:
            It; None where there is none: no step, or one in which nobody's position was known.
        """
        if not self.steps or not self.known:
            return None
        match fitness:
            case Fitness.CONTACT:
                return self._contact
            case Fitness.SURROUND:
                return 1.0 / self.square if self.square > 0.0 else 0.0
            case Fitness.CHASE:  # who does not move at all does not chase
                return 1.0 / sqrt(self.way) if self.way > 0.0 else 0.0
            case Fitness.FOCUS:
                feasible = self.weights[self.weights >= 0.0]
                spread = float(feasible.std()) if len(feasible) and np.ptp(feasible) > 0.0 else 0.0
                return self._contact * spread

    @property
    def _contact(self) -> float:
        """As Eq. 9.3 is printed: T1 - T0 over a sum of one term more."""
        return (self.steps - 1) / self.distance if self.distance > 0.0 else 0.0

    @property
    def values(self) -> dict[Fitness, float | None]:
        """All four."""
        return {fitness: self.value(fitness) for fitness in Fitness}

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "steps": self.steps,
            "distance": self.distance,
            "square": self.square,
            "way": self.way,
            "weights": self.weights.tolist(),
            "known": self.known,
        }

    @classmethod
    def from_fields(cls, fields: Fields, sectors: int) -> FitnessSums:
        """The inverse of `to_dict`.

        Args:
            fields: What it gave.
            sectors: N.

        Raises:
            FieldError: A field is missing, unknown or wrong; of the kind that the fields raise.
        """
        sums = cls(sectors)
        sums.steps = fields.integer("steps")
        sums.distance, sums.square, sums.way = (fields.number(name, 0.0) for name in ("distance", "square", "way"))
        row = fields.elements("weights")
        if len(row.names) != sectors:
            raise fields.wrong("weights", f"expected {sectors} numbers, not {len(row.names)}")
        sums.weights[:] = [row.number(path) for path in row.names]
        sums.known = fields.flag("known")
        fields.done()
        return sums


def nearest_distance(rangers: NDArray[np.float64], wilds: NDArray[np.float64], count: int = SURROUNDING) -> float | None:
    """The mean over WILDs of the mean distance of the nearest RANGERs (Eq. 9.6).

    Args:
        rangers: Positions, shape (rangers, 2); NaN where unknown.
        wilds: Positions, shape (wilds, 2), likewise.
        count: How many of the nearest; all where there are fewer.

    Returns:
        The mean; None without a RANGER or a WILD whose position is known.
    """
    rangers, wilds = known(rangers), known(wilds)
    if not len(rangers) or not len(wilds):
        return None
    distances = np.sort(between(wilds, rangers), axis=1)
    return float(distances[:, :count].mean())
