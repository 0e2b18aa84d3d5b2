"""Why a maneuver stands in an advice, as values: from the state of the learner and, where there is one, from its log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import Action
from pal_advisor.maneuvers.evidence import path_of
from pal_advisor.maneuvers.mirror import home_of, is_symmetric, one_of_two, reflected, reflected_category
from pal_advisor.maneuvers.model import Model
from pal_advisor.maneuvers.names import shortfalls
from pal_advisor.maneuvers.population import UNBORN

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from hil.explaining.history import LearningHistory, Performed
    from hil.mcaplog.records import TeamVerdictRecord
    from pal_advisor.maneuvers import AdviceEntry, Origin, Pal
    from pal_advisor.maneuvers.population import Category, Genome, Population

MOST_RIVALS: Final = 4
"""Runners-up that are told of: with the best these are as many as the exam tests."""


@dataclass(frozen=True)
class Candidacy:
    """A maneuver that was tried in a situation, and what is known of it there.

    Attributes:
        actions: The maneuver.
        phase: Phase in which it arose.
        born: Generation of that phase in which it arose, from 0; None where that is not known.
        origin: How it arose.
        parents: The maneuvers that it descends from.
        value: Fitness expected of it by all that is known.
        error: Standard error of that.
        performed: How often it was performed itself.
        rated: How often what turns the wheels in the same way was performed and rated.
        mean: Mean fitness of these; None where there are none.
        mean_error: Standard error of that; None likewise.
        foretold: Fitness that the model foretells from its parts, its own mean left aside; None without a model.
        foretold_error: Standard error of that; None likewise.
        lacking: For each of the five names of the book what it lacks, in words; nothing where it has earned the name.
        history: What the log tells of it; None where there is none, or it tells nothing.
    """

    actions: tuple[Action, ...]
    phase: int
    born: int | None
    origin: Origin
    parents: tuple[tuple[Action, ...], ...]
    value: float
    error: float
    performed: int
    rated: int
    mean: float | None
    mean_error: float | None
    foretold: float | None
    foretold_error: float | None
    lacking: Mapping[str, tuple[str, ...]]
    history: Performed | None


@dataclass(frozen=True)
class Explanation:
    """Why the maneuver of one entry of an advice is there.

    Attributes:
        entry: The entry.
        known: There is a state of the learner that knows the situation; without one all that follows is empty.
        chosen: What is known of its maneuver; None where it was never tried in this run.
        parents: What is known of each of the maneuvers that it descends from; those that nothing is known of are missing.
        rivals: The best of the others in this situation, best first; of those that turn the wheels alike one.
        ahead: Others that the learner holds for better by cautious fitness: 0 but for an advice that was edited.
        tried: Maneuvers that were performed in this situation.
        performances: Performances in this situation.
        phase: Phase of the last generation bred for this situation.
        generation: Number of that, from 0.
        mirrored: It is the mirror image of what is kept for the mirror image of the situation.
        shared: The situation and its mirror image share what is known.
        folded: The situation is its own mirror image, and a maneuver and its mirror image are one in it.
        caution: Standard errors that the value of a maneuver is lessened by when maneuvers are ordered.
        runs: Coachings that are known, of those that the advice was put together from; 0 where it is of one.
        run: Number of the one of them that all this is of, from 1; 0 where that is not known, or it is of one.
        verdicts: What the team exam found out about whole advices, and about this situation, in order.
    """

    entry: AdviceEntry
    known: bool = False
    chosen: Candidacy | None = None
    parents: tuple[Candidacy, ...] = ()
    rivals: tuple[Candidacy, ...] = ()
    ahead: int = 0
    tried: int = 0
    performances: int = 0
    phase: int = 0
    generation: int = 0
    mirrored: bool = False
    shared: bool = False
    folded: bool = False
    caution: float = 0.0
    runs: int = 0
    run: int = 0
    verdicts: tuple[TeamVerdictRecord, ...] = ()


def explain(entries: Iterable[AdviceEntry], pal: Pal | None, history: LearningHistory | None = None) -> list[Explanation]:
    """Say why the maneuvers of an advice are there.

    Args:
        entries: Its entries.
        pal: The learner as it was when the advice was made, which is left as it is; None where nobody knows.
        history: What was asked for and what came of it; None without a log.

    Returns:
        An explanation of each entry, in order.
    """
    return [Explanation(entry) if pal is None else _Situation(entry, pal, history).explanation() for entry in entries]


class _Situation:
    """The situation of an entry, as a learner knows it."""

    def __init__(self, entry: AdviceEntry, pal: Pal, history: LearningHistory | None) -> None:
        self._entry = entry
        self._pal = pal
        self._history = history
        self._category: Category = entry.previous, entry.current
        self._population, self._mirrored = pal.population(self._category)
        mirror, symmetric = pal.settings.mirror, is_symmetric(self._category)
        self._shared, self._folded = mirror and not symmetric, mirror and symmetric

    def explanation(self) -> Explanation:
        population = self._population
        if population is None:
            return Explanation(self._entry, shared=self._shared, folded=self._folded)
        genome = self._home(tuple(int(action) for action in self._entry.actions))
        candidate = population.archive.get(genome)
        others = self._others(population, genome)
        return Explanation(
            self._entry,
            known=True,
            chosen=None if candidate is None else self._candidacy(population, genome),
            parents=tuple(self._relatives(population, () if candidate is None else candidate.parents)),
            rivals=tuple(self._candidacy(population, one) for one, _ in others[:MOST_RIVALS]),
            ahead=sum(better for _, better in others),
            tried=sum(one.performed > 0 for one in population.archive.values()),
            performances=sum(one.performed for one in population.archive.values()),
            phase=population.phase,
            generation=population.generation,
            mirrored=self._mirrored,
            shared=self._shared,
            folded=self._folded,
            caution=self._pal.settings.caution,
        )

    @staticmethod
    def _others(population: Population, genome: Genome) -> list[tuple[Genome, bool]]:
        """Those that turn the wheels in other ways, each way once, best first; and whether each comes before the maneuver."""
        seen, found, better = {path_of(genome)}, [], genome in population.archive
        for one in population.best(len(population.archive)):
            better = better and path_of(one) != path_of(genome)
            if path_of(one) not in seen:
                seen.add(path_of(one))
                found.append((one, better))
        return found

    def _home(self, genome: Genome) -> Genome:
        """A maneuver of this situation as its population keeps it."""
        genome = reflected(genome) if self._mirrored else genome
        return one_of_two(genome) if self._folded else genome

    def _here(self, genome: Genome) -> tuple[Action, ...]:
        """A maneuver that the population keeps, as it is performed in this situation."""
        return tuple(Action(gene) for gene in (reflected(genome) if self._mirrored else genome))

    def _relatives(self, population: Population, genomes: Sequence[Genome]) -> Iterable[Candidacy]:
        """What is known of some ancestors, here or, where pairs of stimuli are told apart, where phase 1 was learnt."""
        general, mirrored = self._pal.population(self._pal.category(self._entry.current, None))
        for genome in genomes:
            if genome in population.archive:
                yield self._candidacy(population, genome)
            elif general is not None and mirrored == self._mirrored and genome in general.archive:
                yield self._candidacy(general, genome)

    def _candidacy(self, population: Population, genome: Genome) -> Candidacy:
        candidate, known, evidence = population.archive[genome], population.known(genome), population.evidence
        own = evidence.own_mean(genome)
        foretold = evidence.by_parts(genome) if isinstance(evidence, Model) else (None, None)
        return Candidacy(
            actions=self._here(genome),
            phase=candidate.phase,
            born=None if candidate.born == UNBORN else candidate.born,
            origin=candidate.origin,
            parents=tuple(self._here(parent) for parent in candidate.parents),
            value=known.value,
            error=known.error,
            performed=candidate.performed,
            rated=0 if own is None else own.count,
            mean=None if own is None else own.mean,
            mean_error=None if own is None else own.error,
            foretold=foretold[0],
            foretold_error=foretold[1],
            lacking=shortfalls(self._here(genome), candidate.engagement),
            history=self._performed(genome),
        )

    def _performed(self, genome: Genome) -> Performed | None:
        """What the log tells of a maneuver here and, where the two are one, in the mirror image of the situation."""
        if self._history is None:
            return None
        home = home_of(self._category)[0] if self._shared else self._category
        found = self._history.of(*home, [Action(gene) for gene in genome])
        if self._shared:
            image = self._history.of(*reflected_category(home), [Action(gene) for gene in reflected(genome)])
            return image if found is None else found if image is None else found + image
        return found
