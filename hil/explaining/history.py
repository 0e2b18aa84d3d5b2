"""What a log tells of every maneuver that was tried: what for, what was expected of it, and what came of it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import codes, stimulus_label
from hil.mcaplog.records import CreditRecord, DecisionRecord
from pal_advisor.maneuvers import Telling

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.vocabulary import Action
    from hil.mcaplog.reading.reader import LogEntry

TOPICS: Final = ("/pal/decision", "/pal/credit")
LONGEST_MOTIVE: Final = 40
"""Letters that are told of a motive that a log holds."""
MOST_MOTIVES: Final = 12

_Key = tuple[str, str, str]
"""Previous and current stimulus, and actions, as decisions are recorded."""


@dataclass
class Performed:
    """The performances of one maneuver in one situation, as far as a log has them.

    Attributes:
        motives: How often for which motive.
        exam: How many of them in the exam.
        expected: Fitness that was expected of it before its first performance; None where that is not in the log, or nothing
            was expected.
        error: Standard error of that.
        fitness: Final fitness of every performance, in order; what was never rated is missing.
    """

    motives: Counter[str] = field(default_factory=Counter)
    exam: int = 0
    expected: float | None = None
    error: float | None = None
    fitness: list[float] = field(default_factory=list)

    @property
    def count(self) -> int:
        """Performances in the log."""
        return self.motives.total()

    def __add__(self, other: Performed) -> Performed:
        told = self if self.expected is not None else other
        return Performed(
            self.motives + other.motives,
            self.exam + other.exam,
            told.expected,
            told.error,
            self.fitness + other.fitness,
        )


class LearningHistory:
    """Takes the decisions and credits of a log."""

    def __init__(self) -> None:
        self._asked: dict[int, DecisionRecord] = {}
        self._performed: dict[_Key, Performed] = {}

    def take(self, entry: LogEntry) -> None:
        """Take an entry."""
        value = entry.value
        if isinstance(value, DecisionRecord):
            self._asked[value.trial] = value
        elif isinstance(value, CreditRecord):
            asked = self._asked.get(value.trial)
            if asked is not None and value.telling == Telling.PERFORMED:
                self._count(asked)
            for trial, fitness in zip(value.rated, value.fitness, strict=False):
                rated = self._asked.pop(trial, None)
                if rated is not None:
                    self._performed.setdefault(_key_of(rated), Performed()).fitness.append(fitness)

    def _count(self, asked: DecisionRecord) -> None:
        performed = self._performed.setdefault(_key_of(asked), Performed())
        motive = asked.motive[:LONGEST_MOTIVE]
        if motive in performed.motives or len(performed.motives) < MOST_MOTIVES:
            performed.motives[motive] += 1
        performed.exam += asked.exam
        if asked.tried == 0 and performed.expected is None:
            performed.expected, performed.error = asked.expected, asked.error

    def of(self, previous: int, current: int, actions: Sequence[Action]) -> Performed | None:
        """What the log tells of a maneuver in a situation; None where it was never performed there.

        Args:
            previous: Previous stimulus as a wire code, or `ANY_STIMULUS`.
            current: Current stimulus as a wire code.
            actions: The maneuver.
        """
        return self._performed.get((stimulus_label(previous), stimulus_label(current), codes(actions)))

    @property
    def count(self) -> int:
        """Performances in the log, of all maneuvers."""
        return sum(one.count for one in self._performed.values())


def _key_of(asked: DecisionRecord) -> _Key:
    return asked.previous, asked.current, asked.actions
