"""Searches among the conditions: genetic (Liu & Wu 2001, Fig. 9.4), at random, and through all of them.

A search asks for evaluations in batches, and is told their fitness. Where a batch was cut, the same search with the same source
of chance, told the same, asks for the same again: what was told is its state.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from pal_advisor.evolution import Genes, breed, flip, roulette
from pal_advisor.fields import SettingsError, shown
from pal_advisor.surround.measures import Fitness
from pal_advisor.surround.search.conditions import (
    BOOK_WINNERS,
    CONDITIONS,
    Condition,
    condition_of,
    random_chromosome,
    repaired,
)
from pal_advisor.surround.search.found import ConditionResult, summary_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

MOST_POPULATION: Final = 10_000
MOST_GENERATIONS: Final = 100_000
MOST_REPEATS: Final = 10_000
MOST_BUDGET: Final = 10_000_000
CROSSOVER: Final = 0.6
"""p_c (Table 9.2)."""
ELITE: Final = 1
MOST_SEED: Final = 2**32 - 1
_SCHEDULE: Final = ((10, 0.2), (20, 0.06), (30, 0.005))
"""Before which generation a bit is turned over with which probability (Eq. 9.9)."""
_LAST_RATE: Final = 0.001


class SearchName(StrEnum):
    """How conditions are searched."""

    GA = "ga"
    """By the book's genetic algorithm."""
    EXHAUSTIVE = "exhaustive"
    """All of them, several times each."""
    RANDOM = "random"
    """Drawn at random."""


@dataclass(frozen=True)
class SearchSettings:
    """How a search goes.

    Attributes:
        fitness: What is looked for.
        search: How.
        population: P, individuals of a generation (Table 9.2); a random search looks again at so many conditions.
        generations: G.
        repeats: Runs for each mean that is told in the end, and for each condition of an exhaustive search.
        budget: Evaluations of a random search; 0: as many as the genetic one has, P x G.

    Raises:
        SettingsError: A value makes no sense.
    """

    fitness: Fitness = Fitness.CONTACT
    search: SearchName = SearchName.GA
    population: int = 7
    generations: int = 40
    repeats: int = 10
    budget: int = 0

    def __post_init__(self) -> None:
        for name, low, high in (
            ("population", 2, MOST_POPULATION),
            ("generations", 1, MOST_GENERATIONS),
            ("repeats", 1, MOST_REPEATS),
            ("budget", 0, MOST_BUDGET),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise SettingsError(name, f"expected a whole number, {low} to {high}, not {shown(value)}")

    @property
    def evaluations(self) -> int:
        """How many evaluations the search itself makes, without those that are made again for means."""
        if self.search is SearchName.EXHAUSTIVE:
            return len(CONDITIONS) * self.repeats
        if self.search is SearchName.RANDOM and self.budget:
            return self.budget
        return self.population * self.generations


class Evaluation(NamedTuple):
    """A run that a search asks for.

    Attributes:
        condition: The condition.
        seed: Seed of the run.
    """

    condition: Condition
    seed: int


@dataclass(frozen=True)
class Generation:
    """What came of a generation.

    Attributes:
        number: From 1.
        conditions: Its individuals.
        scores: Their fitness.
    """

    number: int
    conditions: tuple[Condition, ...]
    scores: tuple[float, ...]

    @property
    def best(self) -> float:
        """Greatest fitness."""
        return max(self.scores)

    @property
    def mean(self) -> float:
        """Mean fitness."""
        return float(np.mean(self.scores))

    @property
    def elite(self) -> Condition:
        """The condition of the best; of the first of equals."""
        return self.conditions[self.scores.index(self.best)]


class Search(ABC):
    """A search among the conditions.

    First it makes its own evaluations, then it has those conditions that seem best, and the book's winner, run again: all of
    them with the same seeds, so that they are compared under the same circumstances and no longer by the luck of a single run.

    Args:
        settings: How it goes.
        rng: Source of chance.

    Attributes:
        settings: As given.
        generations: Of a genetic search, those that are over.
    """

    def __init__(self, settings: SearchSettings, rng: np.random.Generator) -> None:
        self.settings = settings
        self.generations: list[Generation] = []
        self._rng = rng
        self._again: tuple[Evaluation, ...] | None = None
        self._means: dict[Condition, ConditionResult] | None = None

    def ask(self) -> tuple[Evaluation, ...]:
        """The evaluations that are wanted next, which know nothing of each other.

        Returns:
            The evaluations, the same until they are told of; none when the search is over.
        """
        if not self._is_searched():
            return self._wanted()
        if self._means is not None:
            return ()
        if self._again is None:
            self._again = self._to_be_run_again()
        return self._again

    def tell(self, scores: Sequence[float]) -> None:
        """Take in what came of the evaluations that were asked for.

        Args:
            scores: Fitness of each, none negative.

        Raises:
            ValueError: There are more or fewer, or one is no such number.
        """
        evaluations = self.ask()
        if len(scores) != len(evaluations):
            raise ValueError(f"{len(evaluations)} evaluations were asked for, and {len(scores)} told of")
        if not all(np.isfinite(score) and score >= 0.0 for score in scores):
            raise ValueError("a fitness is a number, and not negative")
        if self._is_searched():
            self._means = _means(evaluations, scores)
        else:
            self._take(scores)

    @property
    def finished(self) -> bool:
        """Nothing more is wanted."""
        return not self.ask()

    @property
    def means(self) -> dict[Condition, ConditionResult]:
        """What several runs of the same seeds say, by condition; empty before the search is over."""
        return dict(self._means or {})

    @property
    def best(self) -> ConditionResult | None:
        """The best of those that were found and run again; None before the search is over."""
        found = [self.means[condition] for condition in self._finalists()] if self._means else []
        return max(found, key=lambda result: result.mean) if found else None

    @property
    def book(self) -> ConditionResult | None:
        """What the book's winner comes to; None before the search is over."""
        return self.means.get(BOOK_WINNERS[self.settings.fitness])

    def _to_be_run_again(self) -> tuple[Evaluation, ...]:
        """The last batch: all seeds of one condition after the other."""
        seeds = [_seed(self._rng) for _ in range(self.settings.repeats)]
        again = dict.fromkeys([*self._finalists(), BOOK_WINNERS[self.settings.fitness]])
        return tuple(Evaluation(condition, seed) for condition in again for seed in seeds)

    @abstractmethod
    def _is_searched(self) -> bool:
        """The search's own evaluations are over."""

    @abstractmethod
    def _wanted(self) -> tuple[Evaluation, ...]:
        """The next of its own evaluations."""

    @abstractmethod
    def _take(self, scores: Sequence[float]) -> None:
        """Take in what came of them."""

    @abstractmethod
    def _finalists(self) -> tuple[Condition, ...]:
        """The conditions that seem best."""


class GeneticSearch(Search):
    """The book's genetic algorithm: an elite of one, the others by roulette, one-point crossover, and mutation (Fig. 9.4).

    All individuals are run in every generation, the elite anew as well. Those that seem best are the elites of all generations.
    """

    def __init__(self, settings: SearchSettings, rng: np.random.Generator) -> None:
        super().__init__(settings, rng)
        self._population = np.stack([random_chromosome(rng) for _ in range(settings.population)])
        self._evaluations = self._drawn()

    def _drawn(self) -> tuple[Evaluation, ...]:
        return tuple(Evaluation(condition_of(chromosome), _seed(self._rng)) for chromosome in self._population)

    def _is_searched(self) -> bool:
        return len(self.generations) >= self.settings.generations

    def _wanted(self) -> tuple[Evaluation, ...]:
        return self._evaluations

    def _take(self, scores: Sequence[float]) -> None:
        number = len(self.generations) + 1
        self.generations.append(
            Generation(number, tuple(evaluation.condition for evaluation in self._evaluations), tuple(scores))
        )
        if self._is_searched():
            return
        self._population, _ = breed(
            self._population,
            np.array(scores),
            self._rng,
            elite=ELITE,
            select=roulette,
            crossover=CROSSOVER,
            vary=partial(_mutant, rate=mutation_rate(number)),
        )
        self._evaluations = self._drawn()

    def _finalists(self) -> tuple[Condition, ...]:
        return tuple(dict.fromkeys(generation.elite for generation in self.generations))


class RandomSearch(Search):
    """Conditions drawn at random; those that seem best are as many as a population has, by their mean."""

    def __init__(self, settings: SearchSettings, rng: np.random.Generator) -> None:
        super().__init__(settings, rng)
        places = rng.integers(len(CONDITIONS), size=settings.evaluations)
        self._evaluations = tuple(Evaluation(CONDITIONS[place], _seed(rng)) for place in places.tolist())
        self._found: dict[Condition, ConditionResult] = {}

    def _is_searched(self) -> bool:
        return bool(self._found)

    def _wanted(self) -> tuple[Evaluation, ...]:
        return self._evaluations

    def _take(self, scores: Sequence[float]) -> None:
        self._found = _means(self._evaluations, scores)

    def _finalists(self) -> tuple[Condition, ...]:
        found = sorted(self._found.values(), key=lambda result: -result.mean)
        return tuple(result.condition for result in found[: self.settings.population])


class ExhaustiveSearch(Search):
    """All conditions, each with the same seeds, which follow one another.

    Args:
        settings: How it goes.
        rng: Source of chance; it needs none.
        seed: The first seed.
    """

    def __init__(self, settings: SearchSettings, rng: np.random.Generator, seed: int) -> None:
        super().__init__(settings, rng)
        seeds = [(seed + number) % (MOST_SEED + 1) for number in range(settings.repeats)]
        self._again = tuple(Evaluation(condition, each) for condition in CONDITIONS for each in seeds)

    def _is_searched(self) -> bool:
        return True

    def _wanted(self) -> tuple[Evaluation, ...]:
        return ()

    def _take(self, scores: Sequence[float]) -> None:
        """Nothing is asked for but means."""

    def _finalists(self) -> tuple[Condition, ...]:
        return CONDITIONS


def new_search(settings: SearchSettings, rng: np.random.Generator, seed: int) -> Search:
    """A search that begins.

    Args:
        settings: How it goes.
        rng: Source of chance.
        seed: First seed of an exhaustive search.
    """
    match settings.search:
        case SearchName.GA:
            return GeneticSearch(settings, rng)
        case SearchName.RANDOM:
            return RandomSearch(settings, rng)
        case SearchName.EXHAUSTIVE:
            return ExhaustiveSearch(settings, rng, seed)


def mutation_rate(generation: int) -> float:
    """Probability that a bit is turned over (Eq. 9.9).

    Args:
        generation: Number of the generation, from 1.
    """
    return next((rate for end, rate in _SCHEDULE if generation < end), _LAST_RATE)


def _mutant(chromosome: Genes, rng: np.random.Generator, rate: float) -> Genes:
    return repaired(flip(chromosome, rng, rate), rng)


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(MOST_SEED, endpoint=True))


def _means(evaluations: Iterable[Evaluation], scores: Iterable[float]) -> dict[Condition, ConditionResult]:
    """What the evaluations say, by condition."""
    found: dict[Condition, list[float]] = {}
    for evaluation, score in zip(evaluations, scores, strict=True):
        found.setdefault(evaluation.condition, []).append(score)
    return {condition: summary_of(condition, each) for condition, each in found.items()}
