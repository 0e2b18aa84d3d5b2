"""The team exam: of advices learnt apart, the best by whole bouts, with the champions of others where they serve it better.

A maneuver is worth what it is worth among those that it meets in a bout: the champion of one run can do harm in the advice of
another. So nothing is taken from another run but what whole bouts have shown to be better, from the same poses. By ask and
tell: `wanted` advices are tried, `tell` says how they did, until `finished`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from pal_advisor.maneuvers.mirror import home_of, reflected_category

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.vocabulary import Maneuver
    from pal_advisor.maneuvers.advice import Advice, AdviceEntry
    from pal_advisor.maneuvers.population import Category

BETTER: Final = 0.005
"""A challenger takes a champion's place when its score is greater by more."""
TIME_COST: Final = 0.03
"""What a second of the mean time of a bout costs, in bouts won."""
BOUTS: Final = 120
"""Bouts that an advice is tried by, from poses that are the same for all."""


@dataclass(frozen=True)
class TeamScore:
    """How an advice did in its bouts.

    Attributes:
        wins: Bouts won.
        trials: Of how many, at least one.
        seconds: Time that they took, in s.
    """

    wins: int
    trials: int
    seconds: float

    @property
    def value(self) -> float:
        """Share of bouts won, less the cost of the time that a bout took in the mean."""
        return self.wins / self.trials - TIME_COST * self.seconds / self.trials


@dataclass(frozen=True)
class TeamVerdict:
    """What was found out about one advice that was tried.

    Attributes:
        run: Number of the run that it, or the champion in it, comes from, from 1.
        category: Situation whose champion was tried in the best advice so far; None: the run's whole advice was.
        score: How it did.
        kept: It is, or is part of, the best advice from then on.
    """

    run: int
    category: Category | None
    score: TeamScore
    kept: bool


class TeamExam:
    """Makes one advice of several.

    Args:
        advices: What each run has learnt, one or more, by settings that differ in nothing but the period.

    Attributes:
        verdicts: What was found out so far, in order.
    """

    def __init__(self, advices: Sequence[Advice]) -> None:
        if not advices:
            raise ValueError("an exam of no advice")
        self.verdicts: list[TeamVerdict] = []
        self._advices = list(advices)
        self._best = advices[0]
        self._score: TeamScore | None = None
        self._order: list[int] = []
        mirror = advices[0].settings.mirror
        found = {(entry.previous, entry.current) for advice in advices for entry in advice.entries}
        homes = {home_of(category)[0] if mirror else category for category in found}
        self._categories = sorted(homes, key=lambda category: (category[1], -category[0]))
        self._wanted: list[tuple[int, Category | None, Advice]] = [
            (run, None, advice) for run, advice in enumerate(self._advices)
        ]

    @property
    def wanted(self) -> tuple[Advice, ...]:
        """The advices that are to be tried now, each from the same poses as all others."""
        return tuple(advice for _, _, advice in self._wanted)

    @property
    def finished(self) -> bool:
        """Nothing is to be tried any more."""
        return not self._wanted

    @property
    def at_most(self) -> int:
        """So many advices will be tried from now on, at the most."""
        return len(self._wanted) + len(self._categories) * (len(self._advices) - 1)

    @property
    def best(self) -> Advice:
        """The best advice so far; that of the first run before anything was tried."""
        return self._best

    @property
    def score(self) -> TeamScore | None:
        """How the best advice did; None before anything was tried."""
        return self._score

    def tell(self, scores: Sequence[TeamScore]) -> None:
        """Take in how the wanted advices did.

        Args:
            scores: One for each of `wanted`, in order.

        Raises:
            ValueError: There are more or fewer.
        """
        tried = list(zip(self._wanted, scores, strict=True))
        (run, category, advice), score = max(tried, key=lambda one: one[1].value)  # the first of equals
        kept = self._score is None or score.value > self._score.value + BETTER
        for (one, place, _), found in tried:
            self.verdicts.append(TeamVerdict(one + 1, place, found, kept and (one, place) == (run, category)))
        if self._score is None:
            by_score = sorted(tried, key=lambda one: -one[1].value)
            self._order = [one for (one, _, _), _ in by_score if one != run]
        if kept:
            self._best, self._score = advice, score
        self._wanted = []
        while self._categories and not self._wanted:
            self._wanted = self._challengers(self._categories.pop(0))

    def _challengers(self, category: Category) -> list[tuple[int, Category | None, Advice]]:
        """The best advice with the champion of each other run in its place, where that is another maneuver or another pace."""
        found: list[tuple[int, Category | None, Advice]] = []
        seen = {_played(self._best, category)}
        for run in self._order:
            played = _played(self._advices[run], category)
            if played and played not in seen:
                seen.add(played)
                found.append((run, category, _joined(self._best, self._advices[run], category)))
        return found


def _places(advice: Advice, category: Category) -> tuple[Category, ...]:
    """The situation, and its mirror image where one stands for the other."""
    image = reflected_category(category)
    return (category, image) if advice.settings.mirror and image != category else (category,)


def _entries(advice: Advice, category: Category) -> tuple[AdviceEntry, ...]:
    places = _places(advice, category)
    return tuple(entry for entry in advice.entries if (entry.previous, entry.current) in places)


def _played(advice: Advice, category: Category) -> tuple[Maneuver, ...]:
    """What a robot is given in a situation."""
    return tuple(advice.maneuver(entry) for entry in _entries(advice, category))


def _joined(advice: Advice, other: Advice, category: Category) -> Advice:
    """An advice with another's champion of a situation, at the pace that the other learnt it at."""
    places = _places(advice, category)
    kept = [entry for entry in advice.entries if (entry.previous, entry.current) not in places]
    paces = [(entry, other.maneuver(entry).period) for entry in _entries(other, category)]
    taken = [replace(entry, period=None if period == advice.settings.period else period) for entry, period in paces]
    return replace(advice, entries=tuple(sorted([*kept, *taken], key=lambda entry: (entry.current, -entry.previous))))
