"""What is measured of a surround mission, step by step, and kept over an interruption."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.surround.measures import FitnessSums, RunMeasures, RunTracker, measures_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.swarm.missions.surround import SurroundState
    from pal_advisor.fields import Fields
    from pal_advisor.surround import Case, Tables

SERIES = ("distance", "ranger_distance", "share_surrounded", "outside")
"""What is measured at the start and after every step."""
FAR = 1e9


class SurroundHistory:
    """What was measured.

    Args:
        rangers: How many RANGERs play.
        wilds: How many WILDs.
        sectors: How many behaviours there are.

    Attributes:
        tracker: Of what no single step tells.
        series: By name as in `SERIES`, T + 1 numbers each; None where there was nothing to measure.
        behaviours: How many RANGERs performed each behaviour, T lists.
        seconds: Time that it has taken, in s.
        fitness: What the fitness functions need.
    """

    def __init__(self, rangers: int, wilds: int, sectors: int) -> None:
        self.tracker = RunTracker((rangers, wilds))
        self.series: dict[str, list[float | None]] = {name: [] for name in SERIES}
        self.behaviours: list[list[int]] = []
        self.seconds = 0.0
        self.fitness = FitnessSums(sectors)
        self._way = np.zeros(rangers)
        self._at = np.full((rangers, 2), np.nan)

    @property
    def empty(self) -> bool:
        """Nothing has been measured, not even the start."""
        return not self.series["distance"]

    @property
    def steps(self) -> int:
        """Steps made."""
        return len(self.behaviours)

    @property
    def path(self) -> float | None:
        """Mean way of a RANGER, in straight steps, in the book's units; None where there is none."""
        return float(self._way.mean()) if len(self._way) else None

    def measures(self, tables: Tables) -> RunMeasures:
        """What is told of the whole run.

        Args:
            tables: What was learnt by its end.
        """
        return measures_of(self.tracker, self.series["distance"], tables)

    def take(self, state: SurroundState, rangers: NDArray[np.float64]) -> None:
        """Take in a step.

        Args:
            state: How the mission stands after it.
            rangers: Where the RANGERs are, shape (rangers, 2).
        """
        for name in SERIES:
            self.series[name].append(getattr(state, name))
        if state.step:
            self.behaviours.append(list(state.behaviours[0]))
        self._way += self._moves(rangers)
        self.place(rangers)
        self.seconds = state.seconds

    def moved(self, rangers: NDArray[np.float64]) -> float:
        """How far all RANGERs have come since they were placed last, in straight lines.

        Args:
            rangers: Where they are, shape (rangers, 2).
        """
        return float(self._moves(rangers).sum())

    def _moves(self, rangers: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far each has come; 0 for who was or is nobody knows where."""
        moves: NDArray[np.float64] = np.nan_to_num(np.linalg.norm(rangers - self._at, axis=1))
        return moves

    def place(self, rangers: NDArray[np.float64]) -> None:
        """The RANGERs are there, however they have come there.

        Args:
            rangers: Positions, shape (rangers, 2).
        """
        self._at = rangers.copy()

    def replace(self, kind: RobotClass, place: int) -> None:
        """Another robot has taken somebody's place: how it came to where it stands is no part of the run.

        Args:
            kind: The class.
            place: Whose, among those of the class.
        """
        self.tracker.replace(kind, place)
        if kind == RobotClass.RANGER:
            self._at[place] = np.nan

    def to_dict(self) -> dict[str, Any]:
        """As plain values; where the RANGERs are is no part of it."""
        return {
            **self.series,
            "behaviours": self.behaviours,
            "way": self._way.tolist(),
            "seconds": self.seconds,
            "fitness": self.fitness.to_dict(),
            "tracker": self.tracker.to_dict(),
        }

    @classmethod
    def from_fields(cls, fields: Fields, case: Case, sectors: int) -> SurroundHistory:
        """The inverse of `to_dict`.

        Args:
            fields: What it gave.
            case: The case that is played.
            sectors: How many behaviours there are.

        Raises:
            FieldError: A field is missing, unknown or wrong; of the kind that the fields raise.
        """
        history, rangers = cls(case.rangers, case.wilds, sectors), case.rangers
        behaviours = fields.elements("behaviours")
        for path in behaviours.names:
            row = behaviours.elements(path)
            if len(row.names) != sectors:
                raise fields.wrong(path, f"expected {sectors} numbers")
            history.behaviours.append([row.integer(each) for each in row.names])
        for name in SERIES:
            row = fields.elements(name)
            if len(row.names) != history.steps + 1:
                raise fields.wrong(name, f"expected {history.steps + 1} numbers, not {len(row.names)}")
            history.series[name] = [None if row.peek(each) is None else row.number(each, 0.0, FAR) for each in row.names]
        way = fields.elements("way")
        if len(way.names) != rangers:
            raise fields.wrong("way", f"expected {rangers} numbers, not {len(way.names)}")
        history._way[:] = [way.number(each, 0.0, FAR) for each in way.names]
        history.seconds = fields.number("seconds", 0.0)
        history.fitness = FitnessSums.from_fields(fields.table("fitness"), sectors)
        history.tracker = RunTracker.from_fields(fields.table("tracker"), (case.rangers, case.wilds))
        fields.done()
        return history
