"""Cases of the surround task by the book's names, as `B1C1D3L1R25S1W8` (Liu & Wu 2001, Tables 7.1 and 9.1)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from pal_advisor.fields import shown
from pal_advisor.surround.experience import INCREMENTS

MOST_ROBOTS: Final = 9999
"""A case has no more robots of a class."""
DEFAULTS: Final = {"B": 1, "C": 1, "D": 3, "L": 1, "R": 25, "S": 1, "W": 8}
"""What a letter that is left out means."""
_HIGHEST: Final = {"B": 3, "D": 4, "L": 4, "R": MOST_ROBOTS, "S": 2, "W": MOST_ROBOTS}
_LOWEST: Final = {"R": 0, "W": 0}
_MEANINGS: Final = {
    "B": "how WILDs move", "C": "increment", "D": "distribution and wall", "L": "learning and selection", "R": "RANGERs",
    "S": "range of the sensors", "W": "WILDs",
}  # fmt: skip


class CaseError(ValueError):
    """A name is none of a case; the message says which letter is wrong, and what there is."""


class WildMotion(IntEnum):
    """How WILDs move: the letter B."""

    LEARNING = 1
    """They learn to get away."""
    STATIONARY = 2
    RANDOM = 3


@dataclass(frozen=True)
class Case:
    """The conditions of a run.

    Attributes:
        wild_motion: B, how WILDs move.
        increment: C, number of the increment (`INCREMENTS`).
        distribution: D: 1 decentralised, 2 the same with a wall, 3 centralised, 4 the same with a wall.
        learning: L: 1 smoothed weights and selection by probability, 2 smoothed and by maximum, 3 original weights and by
            probability, 4 original and by maximum.
        rangers: R, how many RANGERs.
        sensor_range: S: 1 short, 2 long.
        wilds: W, how many WILDs.
    """

    wild_motion: WildMotion = WildMotion.LEARNING
    increment: int = 1
    distribution: int = 3
    learning: int = 1
    rangers: int = 25
    sensor_range: int = 1
    wilds: int = 8

    def __str__(self) -> str:
        task = f"B{self.wild_motion:d}C{self.increment}D{self.distribution}L{self.learning}"
        return f"{task}R{self.rangers}S{self.sensor_range}W{self.wilds}"

    @classmethod
    def parse(cls, name: str) -> Case:
        """The case of a name.

        Args:
            name: Letters in any order, each with a number; one that is left out has its default (`DEFAULTS`).

        Raises:
            CaseError: A letter is unknown, there twice, without a number, or out of range.
        """
        value = {**DEFAULTS, **letters(name)}
        return cls(
            wild_motion=WildMotion(value["B"]),
            increment=value["C"],
            distribution=value["D"],
            learning=value["L"],
            rangers=value["R"],
            sensor_range=value["S"],
            wilds=value["W"],
        )

    @property
    def wall(self) -> bool:
        """The area is closed by a wall."""
        return self.distribution in {2, 4}

    @property
    def centralised(self) -> bool:
        """The WILDs begin close together."""
        return self.distribution in {3, 4}

    @property
    def smoothing(self) -> bool:
        """function2 is part of shape (Eq. 6.14)."""
        return self.learning in {1, 2}

    @property
    def by_maximum(self) -> bool:
        """The largest weight is selected (Eq. 6.19), and not by probability (Eq. 6.18)."""
        return self.learning in {2, 4}

    @property
    def long_range(self) -> bool:
        """Sensors see all robots, however far (Eq. 6.2)."""
        return self.sensor_range == 2


def letters(name: str) -> dict[str, int]:
    """The letters that a name has, in its order.

    Args:
        name: As for `Case.parse`.

    Raises:
        CaseError: As for `Case.parse`.
    """
    found: dict[str, int] = {}
    rest = name.strip().upper()
    while rest:
        letter = rest[0]
        if letter not in _MEANINGS:
            known = ", ".join(f"{each} {meaning}" for each, meaning in _MEANINGS.items())
            raise CaseError(f"case {shown(name)}: {shown(letter)} is no letter of a case; there are {known}")
        meant = f"case {shown(name)}: {letter} ({_MEANINGS[letter]})"
        number = re.match("[0-9]{1,9}", rest[1:])
        if number is None:
            raise CaseError(f"{meant} needs a number, {_valid(letter)}")
        if letter in found:
            raise CaseError(f"{meant} is there twice")
        found[letter] = int(number[0])
        if not _is_valid(letter, found[letter]):
            raise CaseError(f"{meant} is {_valid(letter)}, not {number[0]}")
        rest = rest[1 + number.end() :]
    return found


def _is_valid(letter: str, value: int) -> bool:
    if letter == "C":
        return value in INCREMENTS
    return _LOWEST.get(letter, 1) <= value <= _HIGHEST[letter]


def _valid(letter: str) -> str:
    if letter == "C":
        return "one of " + ", ".join(map(str, sorted(INCREMENTS)))
    return f"{_LOWEST.get(letter, 1)} to {_HIGHEST[letter]}"
