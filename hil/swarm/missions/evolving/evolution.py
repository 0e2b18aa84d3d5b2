"""A search that goes on: what was asked for, what came of it, and what that says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from hil.seeds import Branch, generator
from hil.swarm.missions.evolving.evaluation import EvaluationResult, EvaluationTask
from pal_advisor.surround import Case
from pal_advisor.surround.measures import Fitness
from pal_advisor.surround.search import (
    BOOK_WINNERS,
    ConditionResult,
    Evaluation,
    Generation,
    SearchName,
    SearchSettings,
    new_search,
    summary_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.swarm.missions.surround_settings import SurroundSettings
    from pal_advisor.surround.search import Condition

DIGITS: Final = 6
"""Decimal places of what is told."""


@dataclass(frozen=True)
class Evaluated:
    """An evaluation that was made.

    Attributes:
        evaluation: What was asked for.
        result: What came of it.
        generation: Number of the generation that it was for, from 1; 0 where it was for a mean.
    """

    evaluation: Evaluation
    result: EvaluationResult
    generation: int = 0


class Evolution:
    """One search among the conditions, told one result after the other, in the order in which they were asked for.

    Told the same results it asks for the same: they are all that has to be kept to go on.

    Args:
        settings: How runs go; their case names robots and increment, and none of the letters that are searched.
        search: How the search goes.
        seed: Its seed.

    Attributes:
        settings: As given.
        seed: As given.
        done: What was evaluated, in order.
    """

    def __init__(self, settings: SurroundSettings, search: SearchSettings, seed: int) -> None:
        self.settings = settings
        self.seed = seed
        self.done: list[Evaluated] = []
        self._case = Case.parse(settings.case)
        self._search = new_search(search, generator(seed, Branch.SEARCH), seed)
        self._batch = self._search.ask()
        self._told: list[EvaluationResult] = []

    @property
    def search(self) -> SearchSettings:
        """How the search goes."""
        return self._search.settings

    @property
    def generations(self) -> list[Generation]:
        """Of a genetic search, those that are over."""
        return self._search.generations

    @property
    def finished(self) -> bool:
        """Nothing more is wanted."""
        return not self._batch

    @property
    def wanted(self) -> tuple[Evaluation, ...]:
        """What is wanted next, of which nothing has been told yet; none when it is over."""
        return self._batch[len(self._told) :]

    @property
    def expected(self) -> int:
        """How many evaluations there are in all, as far as that is known: which are run again shows in the end."""
        known = len(self.done) - len(self._told) + len(self._batch)
        searched = 0 if self.search.search is SearchName.EXHAUSTIVE else self.search.evaluations
        return max(known, searched + self.search.repeats)

    def case_of(self, condition: Condition) -> Case:
        """The case of a condition, with the robots that there are.

        Args:
            condition: The condition.
        """
        rest = f"C{self._case.increment}R{self._case.rangers}W{self._case.wilds}"
        return Case.parse(f"{condition}{rest}")

    def task_of(self, evaluation: Evaluation) -> EvaluationTask:
        """The run that an evaluation is.

        Args:
            evaluation: What is wanted.
        """
        return EvaluationTask(self.settings, self.case_of(evaluation.condition), evaluation.seed)

    def tell(self, result: EvaluationResult) -> Generation | None:
        """Take in what came of the first of those that are wanted.

        Args:
            result: It.

        Returns:
            The generation that is over by it, if one is.
        """
        before = len(self.generations)
        evaluation = self.wanted[0]
        self._told.append(result)
        full = len(self._told) == len(self._batch)
        number = before + 1 if self.search.search is SearchName.GA and before < self.search.generations else 0
        self.done.append(Evaluated(evaluation, result, number))
        if not full:
            return None
        self._search.tell([each.score(self.search.fitness) for each in self._told])
        self._told = []
        self._batch = self._search.ask()
        return self.generations[-1] if len(self.generations) > before else None

    # --- what was found ----------------------------------------------------------------------------------------------

    @property
    def means(self) -> dict[Condition, ConditionResult]:
        """Conditions that were run again with the same seeds, or all that were run where the search was cut."""
        return self._search.means or self.means_of(self.search.fitness)

    def means_of(self, fitness: Fitness) -> dict[Condition, ConditionResult]:
        """What all evaluations say of one fitness, by condition.

        Args:
            fitness: Which.
        """
        scores: dict[Condition, list[float]] = {}
        for each in self.done:
            scores.setdefault(each.evaluation.condition, []).append(each.result.score(fitness))
        return {condition: summary_of(condition, found) for condition, found in sorted(scores.items())}

    @property
    def best(self) -> ConditionResult | None:
        """The best that was found; None where nothing was evaluated."""
        return self._search.best or max(self.means.values(), key=lambda found: found.mean, default=None)

    @property
    def book(self) -> ConditionResult | None:
        """What the book's winner comes to; None where it was not run."""
        return self.means.get(BOOK_WINNERS[self.search.fitness])

    @property
    def seconds(self) -> float:
        """Robot time of all evaluations, in s."""
        return sum(each.result.seconds for each in self.done)

    @property
    def ranks(self) -> dict[Condition, int]:
        """Of an exhaustive search that is over, the place of every condition, the best first; else none."""
        if self.search.search is not SearchName.EXHAUSTIVE or not self.finished:
            return {}
        ordered = sorted(self.means.values(), key=lambda found: -found.mean)
        return {found.condition: place for place, found in enumerate(ordered, 1)}

    def facts(self) -> dict[str, Any]:
        """As `--json` has it."""
        best, book, ranks = self.best, self.book, self.ranks
        facts = {
            "fitness": self.search.fitness.value,
            "search": self.search.search.value,
            "seed": self.seed,
            "finished": self.finished,
            "steps": self.settings.steps,
            "evaluations": len(self.done),
            "repeats": self.search.repeats,
            "best": None if best is None else self._told_of(best, ranks),
            "generations": [self._generation(each) for each in self.generations],
            "book": None if book is None else self._told_of(book, ranks),
            "robot_seconds": round(self.seconds, 3),
        }
        if self.search.search is SearchName.EXHAUSTIVE:
            facts["table"] = self._table(ranks)
        return facts

    def _told_of(self, found: ConditionResult, ranks: dict[Condition, int]) -> dict[str, Any]:
        told = {
            "case": str(self.case_of(found.condition)),
            "mean": round(found.mean, DIGITS),
            "sd": round(found.sd, DIGITS),
            "n": found.n,
        }
        return {**told, "rank": ranks[found.condition]} if found.condition in ranks else told

    def _generation(self, generation: Generation) -> dict[str, Any]:
        elite = self._search.means.get(generation.elite)
        return {
            "best": round(generation.best, DIGITS),
            "mean": round(generation.mean, DIGITS),
            "elite": str(self.case_of(generation.elite)),
            "elite_mean": None if elite is None else round(elite.mean, DIGITS),
            "cases": [str(self.case_of(condition)) for condition in generation.conditions],
        }

    def _table(self, ranks: dict[Condition, int]) -> list[dict[str, Any]]:
        """All conditions with all four fitnesses: an exhaustive search serves them all."""
        by_fitness = {fitness: self.means_of(fitness) for fitness in Fitness}
        table = []
        for condition, found in self.means_of(self.search.fitness).items():
            row = self._told_of(found, ranks)
            row["fitnesses"] = {
                fitness.value: {"mean": round(means[condition].mean, DIGITS), "sd": round(means[condition].sd, DIGITS)}
                for fitness, means in by_fitness.items()
            }
            table.append(row)
        return table


def evolution_document(evolutions: Sequence[Evolution]) -> dict[str, Any]:
    """What came of searches, as `--json` has it, without files and wall time.

    Args:
        evolutions: The searches, at least one.
    """
    facts = [evolution.facts() for evolution in evolutions]
    return facts[0] if len(facts) == 1 else {"runs": facts}
