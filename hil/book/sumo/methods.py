"""What is coached for chapter 10: how, against whom, and with which seeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from pal_advisor.maneuvers import Objective, PalSettings
from pal_advisor.maneuvers.settings import BEFORE

if TYPE_CHECKING:
    from collections.abc import Mapping

BUDGET: Final = 1600
"""Maneuvers of a coaching."""
SEEDS: Final = 8
"""Coaching runs of each method against each opponent, with seeds from 1."""
LEAST_SEEDS: Final = 4
"""Of fewer nothing is told."""
BOUTS: Final = 50
"""Held-out bouts by each advice, the same for all."""
FLAT: Final = "flat-light"
HEAVY: Final = "flat-heavy"
CURVED: Final = "curved-light"
CORNER: Final = "corner-light"
POINT: Final = "point-light"
SQUARE: Final = "corner-square"
"""A corner as small as the book's: it stands where `corner-light` does, and has a shape of its own."""
OPPONENTS: Final = (FLAT, HEAVY, CURVED, CORNER, POINT)
"""In the order of the book, (a) to (e)."""

_BOOK: Final = {
    **BEFORE, "objective": Objective.CONTACT, "pairs": True, "rounds": 1, "greedy": 0.0, "credit": 0.0,
}  # fmt: skip
_PAIRS: Final = {**BEFORE, "objective": Objective.OUTCOME, "pairs": True, "loss": 12.0}
METHODS: Final[Mapping[str, Mapping[str, Any]]] = {
    "book": _BOOK,
    "book-single": {**_BOOK, "phases": "fine"},
    "outcome": _PAIRS,
    "outcome-single": {**_PAIRS, "phases": "fine"},
    "product": {},
    "product-single": {"phases": "fine"},
}
"""What each changes of the settings.

`book`: a maneuver is worth what Eq. 10.1 gives and nothing that follows it, each of a population is performed once, then a GP
step is made; phase 2 has a population for each pair of stimuli, and the sides are apart. `outcome`: with pairs as well, but
the other objective, and rated as it was before there was a model. `product`: the defaults. Each with both phases, and with
fine actions alone.
"""
PHASES_COMPARED: Final = (("book", "book-single"), ("outcome", "outcome-single"), ("product", "product-single"))
"""Methods that differ in their phases alone: both, one."""
EQUATION: Final = PalSettings(objective=Objective.CONTACT)
"""Eq. 10.1 with unit weights, by which every performance is rated here, whatever Pal was told to rate it by."""


@dataclass(frozen=True)
class Cell:
    """A coaching run, and what it is judged by.

    Attributes:
        method: Name of the method.
        opponent: Against whom.
        seed: Seed of the coaching.
        budget: Maneuvers.
        bouts: Held-out bouts.
    """

    method: str
    opponent: str
    seed: int
    budget: int = BUDGET
    bouts: int = BOUTS

    @property
    def settings(self) -> PalSettings:
        """How it is coached."""
        return PalSettings.from_dict({**METHODS[self.method], "budget": self.budget})
