"""One situation's maneuvers: a population, rated one performance at a time, and the archive of all it ever tried."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import BASIC_ACTIONS, FINE_ACTIONS, Action
from pal_advisor.evolution import Genes, breed, mutate, tournament
from pal_advisor.fields import Fields
from pal_advisor.maneuvers.decisions import Origin
from pal_advisor.maneuvers.evidence import Estimate, Evidence, read_codes
from pal_advisor.maneuvers.mirror import one_of_two
from pal_advisor.maneuvers.model import Estimates, Model
from pal_advisor.maneuvers.names import SUMS, Engagement

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from firmware_protocol.vocabulary import ActionTally
    from pal_advisor.fields import FieldError
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
UNBORN: Final = -1
"""As the generation that a maneuver arose in: a saved state did not tell."""
_NAMES: Final = tuple(action.name for action in Action)


def spelled(genome: Genome) -> str:
    """The names of a maneuver's actions.

    Args:
        genome: The maneuver.
    """
    return " ".join([_NAMES[gene] for gene in genome])


@dataclass
class Candidate:
    """A maneuver that was tried, or is to be, in one situation.

    Attributes:
        genome: Its actions, as codes.
        parents: The maneuvers it descends from.
        phase: Phase in which it arose.
        performed: How often it was performed itself.
        engagement: What its performances looked like, for naming them.
        born: Generation of its phase in which it arose, from 0; UNBORN where that is not known.
    """

    genome: Genome
    parents: tuple[Genome, ...] = ()
    phase: int = 1
    performed: int = 0
    engagement: Engagement = field(default_factory=Engagement)
    born: int = UNBORN

    @property
    def origin(self) -> Origin:
        """How it arose: a new maneuver of two parents, of whom it is no plain crossing, has mutated too."""
        if self.born == UNBORN:
            return Origin.UNKNOWN
        if self.born == 0:
            return Origin.REFINED if self.parents else Origin.RANDOM
        if len(self.parents) < 2:
            return Origin.MUTATION
        mother, father = self.parents
        crossings = [mother[:cut] + father[cut:] for cut in range(1, len(mother))]
        crossed = any(self.genome in {crossing, one_of_two(crossing)} for crossing in crossings)
        return Origin.CROSSOVER if crossed else Origin.CROSSED_MUTANT

    def to_list(self) -> list[Any]:
        """State as plain values."""
        parents = [list(parent) for parent in self.parents]
        return [list(self.genome), parents, self.phase, self.performed, self.engagement.to_list(), self.born]

    @classmethod
    def from_list(cls, data: object, path: str, error: type[FieldError], actions: int, *, born: bool) -> Candidate:
        """The inverse of `to_list`.

        Args:
            data: Plain values.
            path: What they are within the whole.
            error: The error of a field.
            actions: Actions a maneuver has.
            born: The values tell in which generation it arose.

        Raises:
            FieldError: A field is missing or wrong; of the kind given.
        """
        names = ("genome", "parents", "phase", "performed", "engagement", *(["born"] if born else []))
        fields = Fields.row(data, names, path, error)
        parents = fields.elements("parents")
        return cls(
            read_codes(fields, "genome", actions, actions),
            tuple(read_codes(parents, at, actions, actions) for at in parents.names),
            fields.integer("phase", 1, 2),
            fields.integer("performed"),
            Engagement.from_fields(Fields.row(fields.take("engagement"), SUMS, fields.at("engagement"), error)),
            fields.integer("born", UNBORN) if born else UNBORN,
        )


class Population:
    """The maneuvers of one situation, over both phases.

    Args:
        settings: How to coach.
        symmetric: Of a maneuver and its mirror image only the one that turns left first is a member.

    Attributes:
        phase: 1 (basic actions) or 2 (fine actions); 0 before the first `begin`.
        generation: GP steps made in this phase.
        members: The present generation.
        archive: Every maneuver that was ever a member.
        evidence: All performances that have been rated: a model of them where the settings say so.
    """

    def __init__(self, settings: PalSettings, *, symmetric: bool = False) -> None:
        self.phase = 0
        self.generation = 0
        self.members: list[Genome] = []
        self.archive: dict[Genome, Candidate] = {}
        self.evidence: Evidence | Model = Model(settings.actions) if settings.surrogate else Evidence()
        self._settings = settings
        self._symmetric = symmetric
        self._numbers: dict[Genome, int] = {}
        self._rows: list[int] = []
        self._known: Estimates | None = None
        self._known_of = (-1, -1)

    def begin(self, phase: int, ancestors: Sequence[Genome], rng: np.random.Generator) -> None:
        """Begin a phase with a first generation.

        Args:
            phase: 1 or 2.
            ancestors: In phase 2, the winners of phase 1: they take turns in being refined, every action replaced by a
                member of its family. Empty: begin at random.
            rng: Source of chance.
        """
        self.phase = phase
        self.generation = 0
        members = self._settings.population
        if phase == 2 and ancestors:
            descent = [ancestors[index % len(ancestors)] for index in range(members)]
            genomes = np.array([[rng.choice(FINE_KIN[gene]) for gene in genome] for genome in descent], dtype=np.int64)
            self._enter(genomes, [(ancestor,) for ancestor in descent])
        else:
            genomes = rng.choice(BASIC if phase == 1 else FINE, size=(members, self._settings.actions))
            self._enter(genomes, [()] * members)

    def _enter(self, genomes: Genes, parents: Sequence[tuple[Genome, ...]]) -> None:
        self.members = [self._one(genome) for genome in genomes]
        for genome, descent in zip(self.members, parents, strict=True):
            if genome not in self.archive:
                self._keep(Candidate(genome, descent, self.phase, born=self.generation))

    def _one(self, genome: Genes) -> Genome:
        """A maneuver as it is kept."""
        codes: Genome = tuple(genome.tolist())
        return one_of_two(codes) if self._symmetric else codes

    def _keep(self, candidate: Candidate) -> None:
        self._numbers[candidate.genome] = len(self.archive)
        self.archive[candidate.genome] = candidate
        if isinstance(self.evidence, Model):
            self._rows.append(self.evidence.enter(candidate.genome))

    def perform(self, genome: Genome, tallies: Sequence[ActionTally]) -> None:
        """Note a performance, whose rating may come later.

        Args:
            genome: The maneuver.
            tallies: What the robot counted.
        """
        candidate = self.archive[genome]
        candidate.performed += 1
        candidate.engagement += Engagement.of(tallies)

    def rate(self, genome: Genome, performed: int, fitness: float) -> None:
        """Take in the rating of a performance.

        Args:
            genome: The maneuver.
            performed: How many of its actions were begun.
            fitness: How well it did.
        """
        whole = isinstance(self.evidence, Model)
        self.evidence.add(genome if whole else genome[:performed], fitness)

    def known(self, genome: Genome) -> Estimate:
        """What is known of a maneuver of the archive."""
        estimates, number = self._estimates(), self._numbers[genome]
        return Estimate(float(estimates.value[number]), float(estimates.error[number]), float(estimates.evidence[number]))

    def _estimates(self) -> Estimates:
        """What is known of every maneuver of the archive, in its order."""
        of = (self.evidence.count, len(self.archive))
        if self._known is None or of != self._known_of:
            if isinstance(self.evidence, Model):
                rows, found = np.array(self._rows, dtype=np.intp), self.evidence.estimates()
                self._known = Estimates(found.value[rows], found.error[rows], found.evidence[rows])
            else:
                told = self.evidence.estimates(self.archive)
                columns = np.array([(one.value, one.error, one.evidence) for one in told], dtype=np.float64).T
                self._known = Estimates(*columns)
            self._known_of = of
        return self._known

    def _scores(self) -> NDArray[np.float64]:
        """Cautious fitness of every maneuver of the archive: the value expected, less `caution` standard errors.

        Minus infinity for what is not known.
        """
        known = self._estimates()
        scores: NDArray[np.float64] = np.where(
            known.evidence >= KNOWN, known.value - self._settings.caution * known.error, -math.inf
        )
        return scores

    def best(self, count: int) -> list[Genome]:
        """The `count` best of all maneuvers known, best first."""
        if not self.archive:
            return []
        scores, genomes = self._scores(), list(self.archive)
        order = np.argsort(-scores, kind="stable")[:count]
        return [genomes[number] for number in order if scores[number] > -math.inf]

    def promising(self) -> Genome | None:
        """Of the best, the one that may be best of all: the greatest value expected plus one standard error.

        So the exam spends its tests on those that can still win it. None when nothing is known.
        """
        best = self.best(self._settings.exam_best)
        known = self._estimates()
        hopes = known.value + known.error
        return max(best, key=lambda genome: float(hopes[self._numbers[genome]]), default=None)

    def due(self) -> Genome | None:
        """The next member to be performed for its rating; None when the generation is done.

        In rounds: until each is known as well as by one performance, then the better half as by two, the best quarter as
        by four, and so on. Performances not yet rated count too.
        """
        untried = self.untried()
        return self.uncertain() if untried is None else untried

    def untried(self) -> Genome | None:
        """The next member that was never performed and is not known as well as by one performance; None: there is none."""
        for genome in dict.fromkeys(self.members):
            if not self.archive[genome].performed and self.evidence.of(genome) < 1.0:
                return genome
        return None

    def uncertain(self) -> Genome | None:
        """The next member that is not known as well as its round asks for, each being tried; None when there is none."""
        if self._settings.rounds < 2:
            return None
        members = list(dict.fromkeys(self.members))
        evidence, scores = self._estimates().evidence, self._scores()
        numbers = np.array([self._numbers[genome] for genome in members])
        order = numbers[np.argsort(-scores[numbers], kind="stable")]
        performed = {self._numbers[genome]: self.archive[genome].performed for genome in members}
        for level in range(1, self._settings.rounds):
            wanted = 2**level
            for number in order[: math.ceil(len(order) / wanted)]:
                if performed[number] < wanted and evidence[number] < wanted:
                    return next(genome for genome in members if self._numbers[genome] == number)
        return None

    def rated(self) -> bool:
        """Every member is known: a GP step can be made."""
        return all(self.evidence.of(genome) >= KNOWN for genome in self.members)

    def step(self, rng: np.random.Generator) -> None:
        """One GP step: replace the population by the next generation.

        Args:
            rng: Source of chance.
        """
        settings = self._settings
        scores = self._scores()
        old = list(self.members)
        second = self.phase == 2
        change = partial(
            mutate,
            rate=settings.mutation,
            alphabet=FINE if second else BASIC,
            families=FINE_KIN if second else None,
            in_family=settings.in_family if second else 0.0,
        )

        def vary(genome: Genes, rng: np.random.Generator) -> Genes:
            return np.array(self._one(change(genome, rng)), dtype=np.int64)

        model = self.evidence if isinstance(self.evidence, Model) and settings.brood > 1 else None
        if model is not None:
            model.renew()
        genomes, parents = breed(
            np.array(old, dtype=np.int64),
            scores[[self._numbers[genome] for genome in old]],
            rng,
            elite=settings.elite,
            select=partial(tournament, size=settings.tournament),
            crossover=settings.crossover,
            vary=vary,
            brood=1 if model is None else settings.brood,
            choose=None if model is None else partial(_most_promising, model, settings.curiosity),
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
    def from_fields(
        cls, fields: Fields, error: type[FieldError], settings: PalSettings, *, symmetric: bool, born: bool
    ) -> Population:
        """The inverse of `to_dict`.

        Args:
            fields: The fields of the plain values.
            error: The error of a field.
            settings: How to coach.
            symmetric: As for the class.
            born: The fields tell in which generation a maneuver arose.

        Raises:
            FieldError: A field is missing or wrong; of the kind given.
        """
        population = cls(settings, symmetric=symmetric)
        population.phase = fields.integer("phase", 1, 2)
        population.generation = fields.integer("generation")
        members = fields.elements("members")
        population.members = [read_codes(members, at, settings.actions, settings.actions) for at in members.names]
        if len(population.members) != settings.population:
            raise fields.wrong("members", f"expected {settings.population}, not {len(population.members)}")
        for at, item in fields.items("archive"):
            candidate = Candidate.from_list(item, at, error, settings.actions, born=born)
            if candidate.genome in population.archive:
                raise error(at, "this maneuver is there a second time")
            population._keep(candidate)
        for index, genome in enumerate(population.members):
            if genome not in population.archive:
                raise fields.wrong(f"members[{index}]", "it is not in the archive")
        evidence, at = fields.take("evidence"), fields.at("evidence")
        if isinstance(population.evidence, Model):
            population.evidence.restore(evidence, at, error)
        else:
            population.evidence = Evidence.from_list(evidence, at, error, settings.actions)
        fields.done()
        return population


def _most_promising(model: Model, curiosity: float, bred: Sequence[Genes], brood: Sequence[Genes]) -> int:
    """Which of a brood becomes a member: the greatest fitness foretold plus `curiosity` standard errors.

    One that has been bred before comes last.
    """
    foretold, doubt = model.foretell([genome.tolist() for genome in brood])
    taken = {genome.tobytes() for genome in bred}
    hopes = foretold + curiosity * np.sqrt(doubt)
    return int(np.argmax([-math.inf if genome.tobytes() in taken else hope for genome, hope in zip(brood, hopes, strict=True)]))
