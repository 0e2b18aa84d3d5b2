"""Pal: online, multi-phase genetic programming of maneuvers (Liu & Wu 2001, ch. 10), by ask and tell."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import ANY_STIMULUS, Action, Maneuver
from pal_advisor.fields import FieldError, Fields, shown
from pal_advisor.maneuvers.advice import EYES, Advice, AdviceEntry, make_maneuver
from pal_advisor.maneuvers.credit import Trace, Waiting
from pal_advisor.maneuvers.evidence import read_codes
from pal_advisor.maneuvers.fitness import Performance, fitness, full_rate
from pal_advisor.maneuvers.names import names
from pal_advisor.maneuvers.population import Category, Genome, Population
from pal_advisor.maneuvers.settings import PalSettings, SettingsError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

STATE_VERSION: Final = 1
BIT_GENERATORS: Final = ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64")
_MT_WORDS: Final = 624
_STATE_LIMITS: Final = {"has_uint32": 1, "uinteger": 2**32 - 1, "pos": _MT_WORDS, "buffer_pos": 4}
"""Greatest values in the state of a generator."""


class StateError(FieldError):
    """A saved state can't be gone on from: a field is missing, unknown or wrong."""


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
        evaluations: Performances rated by then in this category.
        best: Highest fitness expected of one of the generation.
        mean: Mean of the fitness expected of each of the generation.
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

    Attributes:
        settings: How to coach.
        history: Every GP step so far.
        used: Maneuvers performed so far.
    """

    def __init__(self, settings: PalSettings, rng: np.random.Generator) -> None:
        self.settings = settings
        self.history: list[GenerationRecord] = []
        self.used = 0
        self._rng = rng
        self._asked = 0
        self._open: Trial | None = None
        self._greedy = False
        self._trace = Trace(settings.credit, full_rate(settings))
        self._populations: dict[Category, Population] = {}

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
        genome = self._next(self._population(category))
        self._asked += 1
        maneuver = make_maneuver(tuple(Action(gene) for gene in genome), self.settings)
        self._open = Trial(self._asked, category, maneuver, self.phase, self.exam)
        return self._open

    def _next(self, population: Population) -> Genome:
        """The exam tests the promising; learning performs the best known now and then, and else the next to be rated."""
        settings = self.settings
        if self.exam:
            promising = population.promising(settings)
            if promising is not None:
                return promising
        elif self._greedy:
            for best in population.best(1, settings.caution):
                return best
        due = population.due(settings)
        if due is not None:
            return due
        # All have been performed, but not all are rated yet.
        return min(population.members, key=lambda genome: population.archive[genome].performed)

    def _population(self, category: Category) -> Population:
        """The population of a situation, in the present phase."""
        population = self._populations.setdefault(category, Population())
        if population.phase != self.phase:
            general = self._populations.get((ANY_STIMULUS, category[1]))
            ancestors = general.best(self.settings.exam_best, self.settings.caution) if general else []
            population.begin(self.phase, ancestors, self.settings, self._rng)
        return population

    def tell(self, trial: Trial, performance: Performance) -> list[GenerationRecord]:
        """Take in how a trial went.

        Args:
            trial: What `ask` gave last.
            performance: What became of it.

        Returns:
            GP steps made because of it.

        Raises:
            ValueError: The trial is not the one that is open, or no action was performed.
            ObjectiveError: The objective needs something that nobody measured.
        """
        if not performance.tallies:
            raise ValueError("a performance has one action at the least; discard a trial that was not performed")
        rating = fitness(performance, self.settings)
        self._close(trial)
        genome = tuple(int(action) for action in trial.maneuver.actions)
        self._populations[trial.category].perform(genome, performance.tallies)
        self.used += 1
        duration = performance.time(self.settings.period)
        final = self._trace.add(Waiting(trial.category, genome, len(performance.tallies), rating, duration))
        if performance.over or performance.won or performance.lost or self.finished:
            final += self._trace.close(won=performance.won)
        for waiting in final:
            self._populations[waiting.category].evidence.add(waiting.genome[: waiting.performed], waiting.fitness)
        self._greedy = bool(self._rng.random() < self.settings.greedy)
        if trial.exam:
            return []
        return self._step([trial.category, *(waiting.category for waiting in final)])

    def _step(self, categories: Iterable[Category]) -> list[GenerationRecord]:
        """Make a GP step for each of these situations whose generation is done."""
        records = []
        for category in dict.fromkeys(categories):
            population = self._populations[category]
            if population.phase == self.phase and population.due(self.settings) is None and population.rated():
                records.append(self._record(category, population))
                population.step(self.settings, self._rng)
        self.history += records
        return records

    def interrupt(self) -> list[GenerationRecord]:
        """The bout was broken off and will be begun anew: what waits for credit from what would have followed gets none.

        Returns:
            GP steps made because of it.
        """
        final = self._trace.close(won=False)
        for waiting in final:
            self._populations[waiting.category].evidence.add(waiting.genome[: waiting.performed], waiting.fitness)
        return [] if self.exam else self._step(waiting.category for waiting in final)

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

    def _record(self, category: Category, population: Population) -> GenerationRecord:
        known = population.estimates()
        values = [known[genome].value for genome in population.members]
        best = int(np.argmax(values))
        return GenerationRecord(
            category=category,
            phase=population.phase,
            generation=population.generation,
            used=self.used,
            evaluations=population.evidence.count,
            best=values[best],
            mean=float(np.mean(values)),
            maneuver=" ".join(Action(gene).name for gene in population.members[best]),
        )

    def advice(self, *, opponent: str = "", seed: int | None = None) -> Advice:
        """The best maneuver of every situation that came up, by cautious fitness.

        Args:
            opponent: Against whom, for the record.
            seed: Seed of the coaching, for the record.
        """
        entries = []
        for (previous, current), population in sorted(self._populations.items(), key=lambda item: (item[0][1], -item[0][0])):
            for genome in population.best(1, self.settings.caution):
                candidate = population.archive[genome]
                actions = tuple(Action(gene) for gene in genome)
                entries.append(
                    AdviceEntry(
                        previous=previous,
                        current=current,
                        actions=actions,
                        fitness=population.estimates()[genome].value,
                        evaluations=candidate.performed,
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
            "greedy": self._greedy,
            "trace": self._trace.to_list(),
            "history": [{**asdict(record), "category": list(record.category)} for record in self.history],
            "populations": [
                {"category": list(category), **population.to_dict()} for category, population in self._populations.items()
            ],
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Pal:
        """The inverse of `state_dict`.

        Raises:
            StateError: The state is of another version, or a field of it is missing, unknown or wrong.
        """
        fields = Fields(state, "", StateError)
        version = fields.take("version")
        if version != STATE_VERSION:
            raise fields.wrong("version", f"{shown(version)} is not known; this program goes on from {STATE_VERSION}")
        pal = cls(_settings(fields.take("settings")), _generator(fields.take("rng")))
        pal.used = fields.integer("used", 0, pal.settings.budget)
        pal._asked = fields.integer("asked", pal.used)
        pal.history = [_step(item, at) for at, item in fields.items("history")]
        pal._greedy = fields.flag("greedy")
        trace = list(fields.items("trace"))
        for at, item in fields.items("populations"):
            population = Fields(item, at, StateError)
            category = _category(population, arms=pal.settings.arms_in_stimulus)
            if category in pal._populations:
                raise population.wrong("category", f"a second population of {list(category)}")
            pal._populations[category] = Population.from_fields(population, StateError, pal.settings)
        fields.done()
        pal._trace.restore([pal._waiting(item, at) for at, item in trace])
        return pal

    def _waiting(self, data: object, path: str) -> Waiting:
        """A performance that waits for credit."""
        fields = Fields.row(data, ("category", "genome", "performed", "fitness", "age"), path, StateError)
        category = _category(fields, arms=self.settings.arms_in_stimulus)
        if category not in self._populations:
            raise fields.wrong("category", f"there is no population of {list(category)}")
        genome = read_codes(fields, "genome", self.settings.actions, self.settings.actions)
        performed = fields.integer("performed", 1, len(genome))
        return Waiting(category, genome, performed, fields.number("fitness"), fields.number("age", 0.0))


def _settings(data: object) -> PalSettings:
    if not isinstance(data, dict):
        raise StateError("settings", f"expected a table, not {shown(data)}")
    try:
        return PalSettings.from_dict(data)
    except SettingsError as error:
        raise StateError(f"settings.{error.field}", str(error).partition(": ")[2]) from error


def _category(fields: Fields, *, arms: bool = True) -> Category:
    """The situation that a field `category` names."""
    value = fields.take("category")
    most = 15 if arms else EYES
    if not isinstance(value, list) or len(value) != 2 or any(type(code) is not int for code in value):
        raise fields.wrong("category", f"expected [previous, current], as codes of stimuli, not {shown(value)}")
    for index, code in enumerate(value):
        if not 0 <= code <= most and (index or code != ANY_STIMULUS):
            or_any = "" if index else f", or {ANY_STIMULUS} for any"
            raise fields.wrong(f"category[{index}]", f"expected a stimulus, 0 to {most}{or_any}, not {shown(code)}")
    return value[0], value[1]


def _step(data: object, path: str) -> GenerationRecord:
    """A GP step that was made."""
    fields = Fields(data, path, StateError)
    record = GenerationRecord(
        category=_category(fields),
        phase=fields.integer("phase", 1, 2),
        generation=fields.integer("generation"),
        used=fields.integer("used"),
        evaluations=fields.integer("evaluations"),
        best=fields.number("best"),
        mean=fields.number("mean"),
        maneuver=fields.text("maneuver"),
    )
    fields.done()
    return record


def _generator(state: object) -> np.random.Generator:
    """A source of chance that goes on where another stood.

    Every part of its state is compared with that of a new one: numpy believes whatever it is given.
    """
    fields = Fields(state, "rng", StateError)
    name = fields.take("bit_generator")
    if name not in BIT_GENERATORS:
        raise fields.wrong("bit_generator", f"no generator is called {shown(name)}")
    bits = getattr(np.random, name)()
    given = {"bit_generator": name, **_numbers(fields, _plain(bits.state))}
    try:
        bits.state = given
    except (OverflowError, ValueError) as error:
        raise fields.wrong("state", f"no state of {name}: {shown(str(error))}") from error
    return np.random.Generator(bits)


def _numbers(fields: Fields, like: Mapping[str, Any]) -> dict[str, Any]:
    """The state of a generator, whole numbers of the right count and size."""
    found: dict[str, Any] = {}
    for name, value in like.items():
        if name == "bit_generator":
            continue
        if isinstance(value, dict):
            found[name] = _numbers(fields.table(name), value)
        elif isinstance(value, list):
            item = fields.elements(name)
            if len(item.names) != len(value):
                raise fields.wrong(name, f"expected {len(value)} numbers, not {len(item.names)}")
            word = np.iinfo(np.uint32 if len(value) == _MT_WORDS else np.uint64)
            found[name] = np.array([item.integer(at, 0, int(word.max)) for at in item.names], dtype=word.dtype)
        else:
            found[name] = fields.integer(name, 0, _STATE_LIMITS.get(name, 2**128 - 1))
    fields.done()
    return found


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Arrays (which some generators keep in their state) as lists."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value
