"""One category's maneuvers: a population, rated one performance at a time, and the archive of all it ever tried."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import BASIC_ACTIONS, FINE_ACTIONS, Action
from pal_advisor.evolution import Genes, breed
from pal_advisor.maneuvers.names import Engagement

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pal_advisor.maneuvers.settings import PalSettings

Genome = tuple[int, ...]
"""A maneuver as action codes."""
Category = tuple[int, int]
"""A situation: (previous stimulus or ANY_STIMULUS, current stimulus), as wire codes."""

BASIC: Final = np.array(BASIC_ACTIONS, dtype=np.int64)
FINE: Final = np.array(FINE_ACTIONS, dtype=np.int64)
FINE_KIN: Final = {
    int(action): np.array([fine for fine in FINE_ACTIONS if fine.family == action.family], dtype=np.int64) for action in Action
}
"""For every action, the fine actions of its family."""


@dataclass
class Candidate:
    """A maneuver that was tried in one category, and how it was rated.

    Attributes:
        genome: Its actions, as codes.
        parents: The maneuvers it descends from.
        phase: Phase in which it arose.
        ratings: Performances rated.
        total: Sum of their fitness.
        squares: Sum of the squares of their fitness.
        engagement: What the performances looked like, for naming them.
    """

    genome: Genome
    parents: tuple[Genome, ...] = ()
    phase: int = 1
    ratings: int = 0
    total: float = 0.0
    squares: float = 0.0
    engagement: Engagement = field(default_factory=Engagement)

    @property
    def mean(self) -> float:
        """Mean fitness; 0 before the first rating."""
        return self.total / self.ratings if self.ratings else 0.0

    def rate(self, fitness: float, engagement: Engagement) -> None:
        """Take in one performance."""
        self.ratings += 1
        self.total += fitness
        self.squares += fitness * fitness
        self.engagement += engagement

    def to_list(self) -> list[Any]:
        """State as plain values."""
        return [
            list(self.genome), [list(parent) for parent in self.parents], self.phase, self.ratings, self.total, self.squares,
            self.engagement.to_list(),
        ]  # fmt: skip

    @classmethod
    def from_list(cls, data: Sequence[Any]) -> Candidate:
        """The inverse of `to_list`."""
        genome, parents, phase, ratings, total, squares, engagement = data
        return cls(
            tuple(genome), tuple(tuple(parent) for parent in parents), phase, ratings, total, squares,
            Engagement.from_list(engagement),
        )  # fmt: skip


class Population:
    """The candidates of one category in one phase.

    Args:
        genomes: First generation, shape (individuals, actions).
        phase: 1 (basic actions) or 2 (fine actions).
        parents: For each individual, the maneuvers it descends from.
    """

    def __init__(self, genomes: Genes, phase: int, parents: Sequence[tuple[Genome, ...]] | None = None) -> None:
        self.phase = phase
        self.generation = 0
        self.archive: dict[Genome, Candidate] = {}
        self.members: list[Genome] = []
        self._enter(genomes, parents or [()] * len(genomes))

    def _enter(self, genomes: Genes, parents: Sequence[tuple[Genome, ...]]) -> None:
        self.members = [tuple(int(gene) for gene in genome) for genome in genomes]
        for genome, descent in zip(self.members, parents, strict=True):
            if genome not in self.archive:
                self.archive[genome] = Candidate(genome, descent, self.phase)

    @classmethod
    def random(cls, phase: int, settings: PalSettings, rng: np.random.Generator) -> Population:
        """A population of random maneuvers."""
        shape = (settings.population, settings.actions)
        return cls(rng.choice(BASIC if phase == 1 else FINE, size=shape), phase)

    @classmethod
    def refined(cls, ancestors: Sequence[Genome], settings: PalSettings, rng: np.random.Generator) -> Population:
        """A population of phase 2: each action of phase-1 maneuvers replaced by a member of its family.

        The ancestors take turns; each of them is refined once at the least.
        """
        descent = [ancestors[index % len(ancestors)] for index in range(settings.population)]
        genomes = np.array([[rng.choice(FINE_KIN[gene]) for gene in genome] for genome in descent], dtype=np.int64)
        return cls(genomes, 2, [(ancestor,) for ancestor in descent])

    def spread(self) -> float:
        """Standard deviation of a single rating about its maneuver's mean, pooled over the category; 0 where unknown."""
        pool = [candidate for candidate in self.archive.values() if candidate.ratings > 1]
        freedom = sum(candidate.ratings - 1 for candidate in pool)
        if not freedom:
            return 0.0
        squares = sum(candidate.squares - candidate.ratings * candidate.mean**2 for candidate in pool)
        return math.sqrt(max(0.0, squares) / freedom)

    def scores(self, caution: float) -> dict[Genome, float]:
        """Cautious fitness of every rated maneuver: its mean less `caution` standard errors."""
        spread = self.spread()
        return {
            genome: candidate.mean - caution * spread / math.sqrt(candidate.ratings)
            for genome, candidate in self.archive.items()
            if candidate.ratings
        }

    def best(self, count: int, caution: float) -> list[Candidate]:
        """The `count` best maneuvers of all ever tried, best first."""
        scores = self.scores(caution)
        return [self.archive[genome] for genome in sorted(scores, key=lambda genome: -scores[genome])[:count]]

    def due(self, settings: PalSettings) -> Genome | None:
        """The next member to be rated; None when the generation is done.

        Rated in rounds: every member once, then the better half up to twice, the best quarter up to four times, and so on.
        """
        members = list(dict.fromkeys(self.members))
        for genome in members:
            if not self.archive[genome].ratings:
                return genome
        scores = self.scores(settings.caution)
        order = sorted(members, key=lambda genome: -scores[genome])
        for level in range(1, settings.rounds):
            for genome in order[: math.ceil(len(order) / 2**level)]:
                if self.archive[genome].ratings < 2**level:
                    return genome
        return None

    def step(self, settings: PalSettings, rng: np.random.Generator) -> None:
        """One GP step: replace the population by the next generation."""
        scores = self.scores(settings.caution)
        old = list(self.members)
        genomes, parents = breed(
            np.array(old, dtype=np.int64),
            np.array([scores[genome] for genome in old]),
            rng,
            elite=settings.elite,
            tournament_size=settings.tournament,
            crossover=settings.crossover,
            mutation=settings.mutation,
            alphabet=BASIC if self.phase == 1 else FINE,
            families=FINE_KIN if self.phase == 2 else None,
            in_family=settings.in_family if self.phase == 2 else 0.0,
        )
        self.generation += 1
        self._enter(genomes, [tuple(dict.fromkeys((old[a], old[b]))) for a, b in parents])

    def to_dict(self) -> dict[str, Any]:
        """State as plain values."""
        return {
            "phase": self.phase,
            "generation": self.generation,
            "members": [list(genome) for genome in self.members],
            "archive": [candidate.to_list() for candidate in self.archive.values()],
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Population:
        """The inverse of `to_dict`."""
        population = cls(np.array(data["members"], dtype=np.int64), data["phase"])
        population.generation = data["generation"]
        candidates = [Candidate.from_list(item) for item in data["archive"]]
        population.archive = {candidate.genome: candidate for candidate in candidates}
        return population
