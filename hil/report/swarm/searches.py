"""The searches among conditions in a log: what was evaluated, and what that says of each condition."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from hil.statistics import Z95
from pal_advisor.surround import Case, CaseError
from pal_advisor.surround.measures import Fitness
from pal_advisor.surround.search import BOOK_WINNERS, CONDITIONS, Condition

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hil.mcaplog.records import SurroundConditionRecord, SurroundEvaluationRecord, SurroundGenerationRecord
    from hil.report.run_data import RunData

HIGHEST: Final = 1e9
"""No fitness is greater, and none is negative."""


@dataclass(frozen=True)
class ConditionMean:
    """What several runs say of a condition.

    Attributes:
        condition: The condition.
        mean: Mean of the fitness.
        half: Half of its 95 % interval; 0 for one run.
        runs: How many runs.
    """

    condition: Condition
    mean: float
    half: float
    runs: int

    def __str__(self) -> str:
        interval = f" ± {self.half:.3f}" if self.runs > 1 else ""
        return f"{self.condition}: {self.mean:.3f}{interval}"


@dataclass
class SearchRun:
    """One search.

    Attributes:
        seed: Its seed.
        fitness: What was searched for.
        evaluations: What was evaluated, in order.
        generations: Of a genetic search, its generations, in order.
        told: What was said of conditions when it was over.
    """

    seed: int
    fitness: Fitness
    evaluations: list[SurroundEvaluationRecord] = field(default_factory=list)
    generations: list[SurroundGenerationRecord] = field(default_factory=list)
    told: list[SurroundConditionRecord] = field(default_factory=list)

    @property
    def means(self) -> list[ConditionMean]:
        """What is known of each condition, the best first: of runs with the same seeds, where it has come to them."""
        found = {
            condition: ConditionMean(condition, one.mean, Z95 * one.sd / math.sqrt(one.runs), one.runs)
            for one in self.told
            if (condition := condition_of_case(one.case)) is not None and one.runs > 0 and _good(one.mean) and _good(one.sd)
        }
        return sorted((found or self._evaluated()).values(), key=lambda one: (-one.mean, one.condition))

    def _evaluated(self) -> dict[Condition, ConditionMean]:
        scores: dict[Condition, list[float]] = {}
        for one in self.evaluations:
            condition, score = condition_of_case(one.case), getattr(one, self.fitness.value)
            if condition is not None and score is not None and _good(score):
                scores.setdefault(condition, []).append(score)
        return {condition: _mean(condition, found) for condition, found in scores.items()}

    @property
    def best(self) -> ConditionMean | None:
        """The best that was found; None where nothing was."""
        return next(iter(self.means), None)

    @property
    def book(self) -> ConditionMean | None:
        """What the book's winner comes to; None where it was not run."""
        return next((one for one in self.means if one.condition == BOOK_WINNERS[self.fitness]), None)

    @property
    def exhaustive(self) -> bool:
        """All conditions that there are were evaluated."""
        return len(self.means) == len(CONDITIONS)


def searches_of(data: RunData) -> list[SearchRun]:
    """The searches in a log, in the order in which they began.

    Args:
        data: The log.
    """
    name = data.metadata.get("search", {}).get("fitness", "")
    fitness = Fitness(name) if name in set(Fitness) else Fitness.CONTACT
    found: dict[int, SearchRun] = {}
    for evaluation in data.evaluations:
        found.setdefault(evaluation.search_seed, SearchRun(evaluation.search_seed, fitness)).evaluations.append(evaluation)
    for generation in data.search_generations:
        if generation.search_seed in found:
            found[generation.search_seed].generations.append(generation)
    for condition in data.conditions:
        if condition.search_seed in found:
            found[condition.search_seed].told.append(condition)
    return list(found.values())


def condition_of_case(name: str) -> Condition | None:
    """The condition that a case is of; None where it is no case.

    Args:
        name: The case, by the book's name.
    """
    try:
        case = Case.parse(name)
    except CaseError:
        return None
    return Condition(int(case.wild_motion), case.distribution, case.learning, case.sensor_range)


def _mean(condition: Condition, scores: list[float]) -> ConditionMean:
    half = Z95 * float(np.std(scores, ddof=1)) / math.sqrt(len(scores)) if len(scores) > 1 else 0.0
    return ConditionMean(condition, float(np.mean(scores)), half, len(scores))


def level_means(means: Iterable[ConditionMean]) -> dict[str, float]:
    """Mean over the conditions that have a letter with a number, as `B2`.

    Args:
        means: What is known of the conditions.
    """
    scores: dict[str, list[float]] = {}
    for one in means:
        for letter, number in zip("BDLS", one.condition, strict=True):
            scores.setdefault(f"{letter}{number}", []).append(one.mean)
    return {level: float(np.mean(found)) for level, found in sorted(scores.items())}


def _good(value: float) -> bool:
    return 0.0 <= value <= HIGHEST
