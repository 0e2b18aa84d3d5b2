"""Pal: online, multi-phase genetic programming of maneuvers (Liu & Wu 2001, ch. 10), by ask and tell."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import ANY_STIMULUS, Action, Maneuver
from pal_advisor.maneuvers.advice import EYES, Advice, AdviceEntry, make_maneuver
from pal_advisor.maneuvers.fitness import Performance, fitness
from pal_advisor.maneuvers.names import Engagement, names
from pal_advisor.maneuvers.population import Category, Genome, Population
from pal_advisor.maneuvers.settings import PalSettings

if TYPE_CHECKING:
    from collections.abc import Mapping

STATE_VERSION: Final = 1
BIT_GENERATORS: Final = ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64")


class StateError(ValueError):
    """A saved state can't be gone on from."""


@dataclass(frozen=True)
class Trial:
    """A maneuver to be performed, and what for.

    Attributes:
        id: Number of the trial, from 1.
        category: Situation it is meant for: (previous stimulus or ANY_STIMULUS, current stimulus).
        maneuver: What the robot shall do.
        phase: Phase of learning, 1 or 2.
        exam: One of the last tests of the best, not of a generation.
    """

    id: int
    category: Category
    maneuver: Maneuver
    phase: int
    exam: bool


@dataclass(frozen=True)
class GenerationRecord:
    """A GP step of one category: a point of its fitness curve.

    Attributes:
        category: (previous stimulus or ANY_STIMULUS, current stimulus).
        phase: Phase of learning, 1 or 2.
        generation: Number of the generation that has just been rated, from 0 in each phase.
        used: Maneuvers performed by then, all categories together.
        evaluations: Maneuvers performed by then in this category and phase.
        best: Highest mean fitness in the generation.
        mean: Mean fitness of the generation.
        maneuver: Names of the actions of the best.
    """

    category: Category
    phase: int
    generation: int
    used: int
    evaluations: int
    best: float
    mean: float
    maneuver: str


class Pal:
    """The advice giver: `ask` for a maneuver, have it performed, `tell` how it went, until `finished`.

    Args:
        settings: How to coach.
        rng: Source of chance; its state is part of Pal's.
    """

    def __init__(self, settings: PalSettings, rng: np.random.Generator) -> None:
        self.settings = settings
        self.history: list[GenerationRecord] = []
        self.used = 0
        self._rng = rng
        self._asked = 0
        self._open: Trial | None = None
        self._populations: dict[int, dict[Category, Population]] = {1: {}, 2: {}}

    @property
    def finished(self) -> bool:
        """The budget is used up."""
        return self.used >= self.settings.budget

    @property
    def phase(self) -> int:
        """Phase of learning, 1 or 2; the exam belongs to the last phase."""
        return {"basic": 1, "fine": 2}.get(self.settings.phases) or (1 if self.used < self._first_phase() else 2)

    @property
    def exam(self) -> bool:
        """Learning is over; the best are being tested."""
        return self.used >= self._learning()

    def _learning(self) -> int:
        """Maneuvers before the exam."""
        return self.settings.budget - round(self.settings.exam_share * self.settings.budget)

    def _first_phase(self) -> int:
        return round(self.settings.phase_share * self._learning())

    def category(self, current: int, previous: int | None) -> Category:
        """The situation that a pair of stimuli belongs to, in the present phase.

        Args:
            current: Current stimulus.
            previous: Previous stimulus; None where there was none.
        """
        mask = 15 if self.settings.arms_in_stimulus else EYES
        if self.settings.pairs and self.phase == 2 and previous is not None:
            return previous & mask, current & mask
        return ANY_STIMULUS, current & mask

    def ask(self, current: int, previous: int | None) -> Trial:
        """The next maneuver to be performed; asking again drops a trial that was never told of.

        Args:
            current: What the robot senses now (a `Stimulus`).
            previous: What it sensed when its last maneuver began; None at the beginning of a bout.

        Raises:
            RuntimeError: The budget is used up.
        """
        if self.finished:
            raise RuntimeError("the budget is used up")
        category = self.category(current, previous)
        genome = self._next(category)
        self._asked += 1
        maneuver = make_maneuver(tuple(Action(gene) for gene in genome), self.settings)
        self._open = Trial(self._asked, category, maneuver, self.phase, self.exam)
        return self._open

    def tell(self, trial: Trial, performance: Performance) -> list[GenerationRecord]:
        """Take in how a trial went.

        Args:
            trial: What `ask` gave last.
            performance: What became of it.

        Returns:
            GP steps made because of it.

        Raises:
            ValueError: The trial is not the one that is open.
            ObjectiveError: The objective needs something that nobody measured.
        """
        self._close(trial)
        population = self._populations[trial.phase][trial.category]
        genome = tuple(int(action) for action in trial.maneuver.actions)
        rating = fitness(performance, self.settings)
        population.archive[genome].rate(rating, Engagement.of(performance.tallies))
        self.used += 1
        if trial.exam or population.due(self.settings) is not None:
            return []
        record = self._record(trial.category, population)
        self.history.append(record)
        population.step(self.settings, self._rng)
        return [record]

    def discard(self, trial: Trial) -> None:
        """Forget a trial that could not be performed; it uses no budget.

        Args:
            trial: What `ask` gave last.

        Raises:
            ValueError: The trial is not the one that is open.
        """
        self._close(trial)

    def _close(self, trial: Trial) -> None:
        if self._open is None or trial.id != self._open.id:
            raise ValueError(f"trial {trial.id} is not open")
        self._open = None

    def _next(self, category: Category) -> Genome:
        population = self._population(category)
        if self.exam:
            best = population.best(self.settings.exam_best, self.settings.caution)
            if best:
                return min(best, key=lambda candidate: candidate.ratings).genome
        due = population.due(self.settings)
        if due is None:  # every member is known from earlier generations: rate the least known again
            due = min(population.members, key=lambda genome: population.archive[genome].ratings)
        return due

    def _population(self, category: Category) -> Population:
        phase = self.phase
        populations = self._populations[phase]
        if category not in populations:
            ancestors = self._ancestors(category) if phase == 2 else []
            if ancestors:
                populations[category] = Population.refined(ancestors, self.settings, self._rng)
            else:
                populations[category] = Population.random(phase, self.settings, self._rng)
        return populations[category]

    def _ancestors(self, category: Category) -> list[Genome]:
        """Phase-1 winners of the current stimulus."""
        first = self._populations[1].get((ANY_STIMULUS, category[1]))
        return [candidate.genome for candidate in first.best(self.settings.exam_best, self.settings.caution)] if first else []

    def _record(self, category: Category, population: Population) -> GenerationRecord:
        means = [population.archive[genome].mean for genome in population.members]
        best = int(np.argmax(means))
        return GenerationRecord(
            category=category,
            phase=population.phase,
            generation=population.generation,
            used=self.used,
            evaluations=sum(candidate.ratings for candidate in population.archive.values()),
            best=means[best],
            mean=float(np.mean(means)),
            maneuver=" ".join(Action(gene).name for gene in population.members[best]),
        )

    def advice(self, *, opponent: str = "", seed: int | None = None) -> Advice:
        """The best maneuver of every situation that came up, by cautious fitness; phase 2 goes before phase 1.

        Args:
            opponent: Against whom, for the record.
            seed: Seed of the coaching, for the record.
        """
        winners = {}
        for phase in (1, 2):
            for category, population in self._populations[phase].items():
                best = population.best(1, self.settings.caution)
                if best:
                    winners[category] = best[0]
        entries = []
        for (previous, current), candidate in sorted(winners.items(), key=lambda item: (item[0][1], -item[0][0])):
            actions = tuple(Action(gene) for gene in candidate.genome)
            entries.append(
                AdviceEntry(
                    previous=previous,
                    current=current,
                    actions=actions,
                    fitness=candidate.mean,
                    evaluations=candidate.ratings,
                    phase=candidate.phase,
                    parents=tuple(" ".join(Action(gene).name for gene in parent) for parent in candidate.parents),
                    names=tuple(names(actions, candidate.engagement)),
                )
            )
        return Advice(self.settings, tuple(entries), opponent, seed)

    def state_dict(self) -> dict[str, Any]:
        """Everything a resumed run needs, as plain values; a trial that is open counts as not yet asked for."""
        return {
            "version": STATE_VERSION,
            "settings": self.settings.to_dict(),
            "rng": _plain(self._rng.bit_generator.state),
            "used": self.used,
            "asked": self._asked,
            "history": [{**asdict(record), "category": list(record.category)} for record in self.history],
            "populations": [
                {"phase": phase, "category": list(category), **population.to_dict()}
                for phase, populations in self._populations.items()
                for category, population in populations.items()
            ],
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Pal:
        """The inverse of `state_dict`.

        Raises:
            StateError: The state is of another version or damaged.
        """
        if state.get("version") != STATE_VERSION:
            raise StateError(f"state of version {state.get('version')!r}; this program goes on from {STATE_VERSION}")
        try:
            pal = cls(PalSettings.from_dict(state["settings"]), _generator(state["rng"]))
            pal.used = int(state["used"])
            pal._asked = int(state["asked"])
            pal.history = [GenerationRecord(**{**item, "category": tuple(item["category"])}) for item in state["history"]]
            for item in state["populations"]:
                pal._populations[item["phase"]][tuple(item["category"])] = Population.from_dict(item)
        except (KeyError, TypeError, ValueError) as error:
            raise StateError(f"the saved state is damaged: {error!r}") from error
        return pal


def _generator(state: Mapping[str, Any]) -> np.random.Generator:
    if state["bit_generator"] not in BIT_GENERATORS:
        raise StateError(f"unknown generator {state['bit_generator']!r}")
    bits = getattr(np.random, state["bit_generator"])()
    bits.state = {**state}
    return np.random.Generator(bits)


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Arrays (which some generators keep in their state) as lists."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value
