"""Crediting what follows: a maneuver is worth its own fitness and, fading with time, that of the maneuvers after it.

Eq. 10.1 of Liu & Wu 2001 sums over the actions of one maneuver. Here the sum runs on into the maneuvers that follow in
the same bout, with weights that fade: a turn that brings the opponent into view is paid by the push it made possible. After
a bout won, what would have followed counts in full, as undone actions do; after a bout lost, nothing follows.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pal_advisor.maneuvers.population import Category, Genome

FADED: Final = 0.05
"""What counts less than this is left out."""


@dataclass
class Waiting:
    """A performance whose credit is still growing.

    Attributes:
        category: The situation.
        genome: The maneuver.
        performed: How many of its actions were begun.
        fitness: Fitness so far.
        age: Time from its beginning to the end of the latest performance, in s.
        trial: Number of the trial; 0 where a saved state did not tell.
    """

    category: Category
    genome: Genome
    performed: int
    fitness: float
    age: float
    trial: int


WAITING_FIELDS: Final = ("category", "genome", "performed", "fitness", "age", "trial")
"""What a performance that waits is saved as, in order."""


class Share(NamedTuple):
    """What a trial was credited with, once.

    Attributes:
        trial: Number of the trial.
        credit: Fitness it was given.
    """

    trial: int
    credit: float


class Trace:
    """Performances of the present bout that still earn credit.

    Args:
        credit: Share that counts of what happens one second later, 0 to less than 1.
        full_rate: Fitness a second after a bout won.
    """

    def __init__(self, credit: float, full_rate: float) -> None:
        self._credit = credit
        self._full_rate = full_rate
        self._waiting: deque[Waiting] = deque()

    def add(self, performance: Waiting) -> tuple[list[Share], list[Waiting]]:
        """Take in the latest performance, its age its duration, and credit those before it.

        Returns:
            What each of them was credited with, the latest with its own fitness, and the performances whose fitness is
            final now; oldest first.
        """
        shares = []
        for earlier in self._waiting:
            share = Share(earlier.trial, performance.fitness * self._weight(earlier.age))
            earlier.fitness += share.credit
            earlier.age += performance.age
            shares.append(share)
        shares.append(Share(performance.trial, performance.fitness))
        self._waiting.append(performance)
        final = []
        while self._waiting and self._weight(self._waiting[0].age) < FADED:
            final.append(self._waiting.popleft())
        return shares, final

    def close(self, *, won: bool) -> tuple[list[Share], list[Waiting]]:
        """End the bout.

        Args:
            won: What would have followed counts in full.

        Returns:
            What each performance that waited was credited with, if anything, and all of these performances; oldest first.
        """
        shares = []
        final = list(self._waiting)
        self._waiting.clear()
        if won and self._credit > 0.0:
            rest = self._full_rate / -math.log(self._credit)  # the integral of full_rate * credit**t from 0 on
            for performance in final:
                share = Share(performance.trial, rest * self._weight(performance.age))
                performance.fitness += share.credit
                shares.append(share)
        return shares, final

    def _weight(self, age: float) -> float:
        return float(self._credit**age)

    def to_list(self) -> list[Any]:
        """State as plain values."""
        return [[list(w.category), list(w.genome), w.performed, w.fitness, w.age, w.trial] for w in self._waiting]

    def restore(self, performances: Iterable[Waiting]) -> None:
        """Go on with performances that a saved run left, oldest first."""
        self._waiting = deque(performances)
