"""One situation's maneuvers: a population, rated one performance at a time, and the archive of all it ever tried."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import BASIC_ACTIONS, FINE_ACTIONS, Action
from pal_advisor.evolution import Genes, breed
from pal_advisor.maneuvers.evidence import Estimate, Evidence
from pal_advisor.maneuvers.names import Engagement

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.vocabulary import ActionTally
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
KNOWN: Final = 0.5
"""Evidence, in performances, from which a maneuver counts as known."""


@dataclass
class Candidate:
    """A maneuver that was tried, or is to be, in one situation.

    Attributes:
        genome: Its actions, as codes.
        parents: The maneuvers it descends from.
        phase: Phase in which it arose.
        performed: How often it was performed itself.
        engagement: What its performances looked like, for naming them.
    """

    genome: Genome
    parents: tuple[Genome, ...] = ()
    phase: int = 1
    performed: int = 0
    engagement: Engagement = field(default_factory=Engagement)

    def to_list(self) -> list[Any]:
        """State as plain values."""
        parents = [list(parent) for parent in self.parents]
        return [list(self.genome), parents, self.phase, self.performed, self.engagement.to_list()]

    @classmethod
    def from_list(cls, data: Sequence[Any]) -> Candidate:
        """The inverse of `to_list`."""
        genome, parents, phase, performed, engagement = data
        return cls(tuple(genome), tuple(map(tuple, parents)), phase, performed, Engagement.from_list(engagement))


class Population:
    """The maneuvers of one situation, over both phases.

    Attributes:
        phase: 1 (basic actions) or 2 (fine actions); 0 before the first `begin`.
        generation: GP steps made in this phase.
        members: The present generation.
        archive: Every maneuver that was ever a member.
        evidence: All performances that have been rated.
    """

    def __init__(self) -> None:
        self.phase = 0
        self.generation = 0
        self.members: list[Genome] = []
        self.archive: dict[Genome, Candidate] = {}
        self.evidence = Evidence()
        self._known: dict[Genome, Estimate] = {}
        self._known_of = (-1, -1)

    def begin(self, phase: int, ancestors: Sequence[Genome], settings: PalSettings, rng: np.random.Generator) -> None:
        """Begin a phase with a first generation.

        Args:
            phase: 1 or 2.
            ancestors: In phase 2, the winners of phase 1: they take turns in being refined, every action replaced by a
                member of its family. Empty: begin at random.
            settings: How to coach.
            rng: Source of chance.
        """
        self.phase = phase
        self.generation = 0
        if phase == 2 and ancestors:
            descent = [ancestors[index % len(ancestors)] for index in range(settings.population)]
            genomes = np.array([[rng.choice(FINE_KIN[gene]) for gene in genome] for genome in descent], dtype=np.int64)
            self._enter(genomes, [(ancestor,) for ancestor in descent])
        else:
            genomes = rng.choice(BASIC if phase == 1 else FINE, size=(settings.population, settings.actions))
            self._enter(genomes, [()] * settings.population)

    def _enter(self, genomes: Genes, parents: Sequence[tuple[Genome, ...]]) -> None:
        self.members = [tuple(int(gene) for gene in genome) for genome in genomes]
        for genome, descent in zip(self.members, parents, strict=True):
            if genome not in self.archive:
                self.archive[genome] = Candidate(genome, descent, self.phase)

    def perform(self, genome: Genome, tallies: Sequence[ActionTally]) -> None:
        """Note a performance, whose rating may come later.

        Args:
            genome: The maneuver.
            tallies: What the robot counted.
        """
        candidate = self.archive[genome]
        candidate.performed += 1
        candidate.engagement += Engagement.of(tallies)

    def estimates(self) -> dict[Genome, Estimate]:
        """What is known of every maneuver of the archive."""
        of = (self.evidence.count, len(self.archive))
        if of != self._known_of:
            self._known = dict(zip(self.archive, self.evidence.estimates(self.archive), strict=True))
            self._known_of = of
        return self._known

    def scores(self, caution: float) -> dict[Genome, float]:
        """Cautious fitness: the value expected, less `caution` standard errors; minus infinity for what is not known."""
        return {
            genome: known.value - caution * known.error if known.evidence >= KNOWN else -math.inf
            for genome, known in self.estimates().items()
        }

    def best(self, count: int, caution: float) -> list[Genome]:
        """The `count` best of all maneuvers known, best first."""
        scores = self.scores(caution)
        order = sorted(scores, key=lambda genome: -scores[genome])[:count]
        return [genome for genome in order if scores[genome] > -math.inf]

    def promising(self, settings: PalSettings) -> Genome | None:
        """Of the best, the one that may be best of all: the greatest value expected plus one standard error.

        So the exam spends its tests on those that can still win it. None when nothing is known.
        """
        known = self.estimates()
        best = self.best(settings.exam_best, settings.caution)
        return max(best, key=lambda genome: known[genome].value + known[genome].error, default=None)

    def due(self, settings: PalSettings) -> Genome | None:
        """The next member to be performed for its rating; None when the generation is done.

        In rounds: until each is known as well as by one performance, then the better half as by two, the best quarter as
        by four, and so on. Performances not yet rated count too.
        """
        members = list(dict.fromkeys(self.members))
        for genome in members:
            if not self.archive[genome].performed and self.evidence.of(genome) < 1.0:
                return genome
        known = self.estimates()
        scores = self.scores(settings.caution)
        order = sorted(members, key=lambda genome: -scores[genome])
        for level in range(1, settings.rounds):
            wanted = 2**level
            for genome in order[: math.ceil(len(order) / wanted)]:
                if self.archive[genome].performed < wanted and known[genome].evidence < wanted:
                    return genome
        return None

    def rated(self) -> bool:
        """Every member is known: a GP step can be made."""
        return all(self.evidence.of(genome) >= KNOWN for genome in self.members)

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
            "evidence": self.evidence.to_list(),
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Population:
        """The inverse of `to_dict`."""
        population = cls()
        population.phase = data["phase"]
        population.generation = data["generation"]
        population.members = [tuple(genome) for genome in data["members"]]
        candidates = [Candidate.from_list(item) for item in data["archive"]]
        population.archive = {candidate.genome: candidate for candidate in candidates}
        population.evidence = Evidence.from_list(data["evidence"])
        return population
