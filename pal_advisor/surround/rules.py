"""What was learnt, in words, and the rules that the book reports (Liu & Wu 2001, Eq. 7.6 to 7.16)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.surround.stimuli import stimuli_of
from pal_advisor.surround.tables import behaviour_names

if TYPE_CHECKING:
    from pal_advisor.surround.tables import StimulusRecord, Tables

BOOK_SECTORS: Final = 8
"""The book's rules are of rings of eight sectors."""


@dataclass(frozen=True)
class BookRule:
    """A rule that the book reports.

    Attributes:
        name: Its name there.
        behaviours: The behaviour that is selected, or those that are coupled.
    """

    name: str
    behaviours: tuple[int, ...]

    @property
    def behaviour(self) -> str:
        """The behaviours as the book names them, as `B8` or `B1 x B8`."""
        return behaviour_names(self.behaviours)


BOOK_RULES: Final = {
    (RobotClass.RANGER, 1): BookRule("RA1", (1,)),
    (RobotClass.RANGER, 2): BookRule("RB1", (8,)),
    (RobotClass.RANGER, 3): BookRule("RB2", (1, 8)),
    (RobotClass.RANGER, 4): BookRule("RB3", (7,)),
    (RobotClass.RANGER, 7): BookRule("RB4", (1, 5)),
    (RobotClass.RANGER, 8): BookRule("RB5", (6, 7)),
    (RobotClass.WILD, 2): BookRule("RD2", (4,)),
    (RobotClass.WILD, 8): BookRule("RD1", (2,)),
    (RobotClass.WILD, 23): BookRule("RD3", (4, 6)),
}
"""By class and number of the stimulus. RD3's STIMULUS25, 01110101, has number 23 here, and the canonical pattern 01010111."""


@dataclass(frozen=True)
class Rule:
    """What robots of a class most likely do when they meet a stimulus.

    Attributes:
        kind: The class.
        stimulus: Number of the stimulus.
        pattern: Its canonical pattern.
        behaviours: Behaviours of the largest weight; empty where they can do nothing.
        weight: That weight.
        met: How often the stimulus was met.
        book: What the book reports; None where it reports nothing.
    """

    kind: RobotClass
    stimulus: int
    pattern: str
    behaviours: tuple[int, ...]
    weight: float
    met: int
    book: BookRule | None

    @property
    def words(self) -> str:
        """The rule as a sentence, as `one to the side of sector 8: go to it (B8)`; behaviours are counted as sectors are."""
        if not self.behaviours:
            return f"{_situation(self.pattern)}: stay"
        if len(self.behaviours) == len(self.pattern) > 1:
            return f"{_situation(self.pattern)}: no matter where (nothing learnt)"
        return f"{_situation(self.pattern)}: {_way(self.pattern, self.behaviours[0])} ({behaviour_names(self.behaviours)})"

    def __str__(self) -> str:
        line = f'STIMULUS{self.stimulus} "{self.words}", {self.weight:.2f}'
        return line if self.book is None else f"{line}; the book's {self.book.name}: {self.book.behaviour}"


def rules(tables: Tables, kind: RobotClass) -> list[Rule]:
    """The rules of one class, those met most first.

    Args:
        tables: What was learnt.
        kind: The class.
    """
    found = [_rule(tables.sectors, kind, stimulus, vector) for stimulus, vector in tables.of(kind).items()]
    return sorted(found, key=lambda rule: (-rule.met, rule.stimulus))


def _rule(sectors: int, kind: RobotClass, stimulus: int, vector: StimulusRecord) -> Rule:
    book = BOOK_RULES.get((kind, stimulus)) if sectors == BOOK_SECTORS else None
    pattern = stimuli_of(sectors).text(stimulus)
    return Rule(kind, stimulus, pattern, vector.best, max(vector.weights), vector.met, book)


def _occupied(pattern: str) -> list[int]:
    return [index + 1 for index, bit in enumerate(pattern) if bit == "1"]


def _situation(pattern: str) -> str:
    """Where others are, in words."""
    occupied = _occupied(pattern)
    if not occupied:
        return "nobody near"
    if len(occupied) == len(pattern) > 1:
        return "others all around"
    if len(occupied) == 1:
        return f"one to the side of sector {occupied[0]}"
    *first, last = occupied
    return f"others to the sides of sectors {', '.join(map(str, first))} and {last}"


def _way(pattern: str, behaviour: int) -> str:
    """Where a behaviour leads, in words. Whom only the grown radius shows is nearly always to the side of the last sector."""
    sectors, occupied = len(pattern), _occupied(pattern)
    ahead = occupied or [sectors]
    distance = min(min((behaviour - one) % sectors, (one - behaviour) % sectors) for one in ahead)
    if len(occupied) > 1:
        return f"{('go to those at', 'go past them at')[distance] if distance < 2 else 'turn away to'} {behaviour}"
    whom = "it" if occupied else "the nearest farther off"
    return f"go to {whom}" if distance == 0 else f"go past {whom}" if distance == 1 else f"turn away from {whom}"
