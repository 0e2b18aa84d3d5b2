"""Pal: online, multi-phase genetic programming of maneuvers (Liu & Wu 2001, ch. 10), by ask and tell."""

from __future__ import annotations

from dataclasses import asdict
from math import nan
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from pal_advisor.fields import Fields, StateError
from pal_advisor.generators import plain, read_generator
from pal_advisor.maneuvers.advice import EYES, Advice, AdviceEntry, make_maneuver
from pal_advisor.maneuvers.credit import WAITING_FIELDS, Share, Trace, Waiting
from pal_advisor.maneuvers.decisions import (
    START,
    Credit,
    GenerationRecord,
    Motive,
    Telling,
    Trial,
    asked_digest,
    state_digest,
    told_digest,
)
from pal_advisor.maneuvers.evidence import read_codes
from pal_advisor.maneuvers.fitness import Performance, fitness, full_rate
from pal_advisor.maneuvers.mirror import home_of, is_symmetric, reflected, reflected_category
from pal_advisor.maneuvers.names import names
from pal_advisor.maneuvers.population import Category, Genome, Population, spelled
from pal_advisor.maneuvers.settings import MOST_BUDGET
from pal_advisor.maneuvers.state import (
    read_category,
    read_digest,
    read_settings,
    read_step,
    read_version,
    version_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from pal_advisor.maneuvers.settings import PalSettings


MOST_EXAM_VISITS: Final = 25
"""In the exam a situation keeps a maneuver no longer, where no bout ends: as many as a bout of 15 s has."""


class Pal:
    """The advice giver: `ask` for a maneuver, have it performed, `tell` how it went, until `finished`.

    Args:
        settings: How to coach.
        rng: Source of chance; its state is part of Pal's.
        ancestors: Maneuvers learnt before, by situation (see `ancestors_of`): with both phases of learning each is refined in
            phase 2 as the winners of phase 1 are, in turn with these. None of them is a member itself.

    Attributes:
        settings: How to coach.
        history: Every GP step so far.
        used: Maneuvers performed so far.
        seconds: Time that the robot has performed so far, in s; a state keeps it where the budget is one of robot time.
        digest: Of all decisions told of, 16 hexadecimal digits: a trial that is open does not count.
        rating: What the performance that it was told of last was worth by itself; NaN before.
        credited: What was credited when it was last told something; None before.
    """

    def __init__(
        self, settings: PalSettings, rng: np.random.Generator, ancestors: Mapping[Category, Genome] | None = None
    ) -> None:
        self.settings = settings
        self._ancestors = dict(ancestors or {})
        self.history: list[GenerationRecord] = []
        self.used = 0
        self.seconds = 0.0
        self.digest = START
        self.rating = nan
        self.credited: Credit | None = None
        self._rng = rng
        self._asked = 0
        self._open: Trial | None = None
        self._greedy = False
        self._kept: dict[Category, tuple[Genome, int]] = {}
        self._trace = Trace(settings.credit, full_rate(settings))
        self._populations: dict[Category, Population] = {}

    @property
    def finished(self) -> bool:
        """The budget is used up."""
        return self._spent >= self._all

    @property
    def phase(self) -> int:
        """Phase of learning, 1 or 2; the exam belongs to the last phase."""
        return {"basic": 1, "fine": 2}.get(self.settings.phases) or (1 if self._spent < self._first_phase() else 2)

    @property
    def exam(self) -> bool:
        """Learning is over; the best are being tested."""
        return self._spent >= self._learning()

    @property
    def _spent(self) -> int:
        """What of the budget is used: maneuvers, or ms."""
        return round(1000.0 * self.seconds) if self.settings.robot_time else self.used

    @property
    def _all(self) -> int:
        return round(1000.0 * self.settings.robot_time) or self.settings.budget

    def _learning(self) -> int:
        """What of the budget is used before the exam."""
        return self._all - round(self.settings.exam_share * self._all)

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
        home, mirrored = self._home(category)
        population = self._population(home)
        kept, motive = self._next(home, population)
        self._asked += 1
        phase, exam, candidate = self.phase, self.exam, population.archive[kept]
        known = population.known(kept) if self.settings.surrogate else None
        genome = reflected(kept) if mirrored else kept
        self._open = Trial(
            id=self._asked,
            category=category,
            maneuver=make_maneuver(tuple(Action(gene) for gene in genome), self.settings),
            phase=phase,
            exam=exam,
            generation=population.generation,
            motive=motive,
            origin=candidate.origin,
            parents=tuple([spelled(reflected(parent) if mirrored else parent) for parent in candidate.parents]),
            tried=candidate.performed,
            expected=None if known is None else known.value,
            error=None if known is None else known.error,
            mirrored=mirrored,
            digest=asked_digest(
                self.digest,
                self._rng,
                trial=self._asked,
                category=category,
                genome=genome,
                phase=phase,
                exam=exam,
                generation=population.generation,
                motive=motive,
            ),
        )
        return self._open

    def population(self, category: Category) -> tuple[Population | None, bool]:
        """What is known of a situation, to be looked into and left as it is.

        Args:
            category: The situation.

        Returns:
            The population that serves it, None where it never came up; and whether its maneuvers are to be reflected for it.
        """
        home, mirrored = self._home(category)
        return self._populations.get(home), mirrored

    def _home(self, category: Category) -> tuple[Category, bool]:
        """The situation whose population serves a situation, and whether its maneuvers are to be reflected for it."""
        return home_of(category) if self.settings.mirror else (category, False)

    def _next(self, home: Category, population: Population) -> tuple[Genome, Motive]:
        """The exam tests the promising; learning performs the best known now and then, and else the next to be rated.

        Before all this, what the situation keeps for a while in this bout.
        """
        kept, left = self._kept.get(home, ((), 0))
        if left:
            return kept, Motive.EXAM if self.exam else Motive.AGAIN
        if self.exam:
            promising = population.promising()
            if promising is not None:
                return promising, Motive.EXAM
        elif self._greedy:
            for best in population.best(1):
                return best, Motive.BEST
        untried = population.untried()
        if untried is not None:
            return untried, Motive.UNTRIED
        uncertain = population.uncertain()
        if uncertain is not None:
            return uncertain, Motive.EVIDENCE
        # All are known, or have been performed and wait for their rating.
        return min(population.members, key=lambda genome: population.archive[genome].performed), Motive.DONE

    def _keep(self, home: Category, genome: Genome, *, exam: bool) -> None:
        """Note what a situation keeps after a performance, for how many visits in the same bout."""
        _, left = self._kept.get(home, ((), 0))
        if left:
            self._kept[home] = genome, left - 1
        elif exam:
            self._kept[home] = genome, (MOST_EXAM_VISITS - 1) * self.settings.exam_whole_bout
        else:
            self._kept[home] = genome, self.settings.again

    def _population(self, home: Category) -> Population:
        """The population of a situation, in the present phase."""
        population = self._populations.get(home)
        if population is None:
            population = self._populations[home] = self._new_population(home)
        if population.phase != self.phase:
            general = self._populations.get((ANY_STIMULUS, home[1]))
            ancestors = general.best(self.settings.exam_best) if general else []
            if home in self._ancestors and self.settings.phases == "multi":
                ancestors.insert(0, self._ancestors[home])
            population.begin(self.phase, ancestors, self._rng)
        return population

    def _new_population(self, home: Category) -> Population:
        return Population(self.settings, symmetric=self._folds(home))

    def _folds(self, home: Category) -> bool:
        """A maneuver and its mirror image are one in this situation."""
        return self.settings.mirror and is_symmetric(home)

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
        self.rating = rating
        home, mirrored = self._home(trial.category)
        genome = tuple(int(action) for action in trial.maneuver.actions)
        if mirrored:
            genome = reflected(genome)
        self._populations[home].perform(genome, performance.tallies)
        self._keep(home, genome, exam=trial.exam)
        self.used += 1
        self.seconds += performance.performed
        duration = performance.time(self.settings.period)
        shares, final = self._trace.add(Waiting(home, genome, len(performance.tallies), rating, duration, trial.id))
        if performance.over or performance.won or performance.lost or self.finished:
            rest, last = self._trace.close(won=performance.won)
            shares += rest
            final += last
            self._kept.clear()
        self._rate(final)
        self._greedy = bool(self._rng.random() < self.settings.greedy)
        records = [] if trial.exam else self._step([home, *(waiting.category for waiting in final)])
        self.digest = trial.digest
        self._credit(Telling.PERFORMED, trial.id, shares, final)
        return records

    def _rate(self, final: Iterable[Waiting]) -> None:
        """Performances whose fitness is final are evidence."""
        for waiting in final:
            self._populations[waiting.category].rate(waiting.genome, waiting.performed, waiting.fitness)

    def _credit(self, telling: Telling, trial: int, shares: Sequence[Share], final: Sequence[Waiting]) -> None:
        """Keep for others what was credited, and digest it."""
        trials, credits_ = tuple([share.trial for share in shares]), tuple([share.credit for share in shares])
        rated, values = tuple([waiting.trial for waiting in final]), tuple([waiting.fitness for waiting in final])
        self.digest = told_digest(
            self.digest,
            self._rng,
            telling=telling,
            trial=trial,
            trials=trials,
            credits=credits_,
            rated=rated,
            fitness=values,
        )
        self.credited = Credit(telling, trial, trials, credits_, rated, values, self.digest)

    def _step(self, categories: Iterable[Category]) -> list[GenerationRecord]:
        """Make a GP step for each of these situations whose generation is done."""
        records = []
        for category in dict.fromkeys(categories):
            population = self._populations[category]
            if population.phase == self.phase and population.due() is None and population.rated():
                records.append(self._record(category, population))
                population.step(self._rng)
        self.history += records
        return records

    def interrupt(self) -> list[GenerationRecord]:
        """The bout was broken off and will be begun anew: what waits for credit from what would have followed gets none.

        Returns:
            GP steps made because of it.
        """
        _, final = self._trace.close(won=False)
        self._kept.clear()
        self._rate(final)
        records = [] if self.exam else self._step(waiting.category for waiting in final)
        self._credit(Telling.INTERRUPTED, 0, [], final)
        return records

    def discard(self, trial: Trial) -> None:
        """Forget a trial that could not be performed; it uses no budget, and the digest is as if it had not been asked for.

        Args:
            trial: What `ask` gave last.

        Raises:
            ValueError: The trial is not the one that is open.
        """
        self._close(trial)
        self.credited = Credit(Telling.DISCARDED, trial.id, (), (), (), (), self.digest)

    def _close(self, trial: Trial) -> None:
        if self._open is None or trial.id != self._open.id:
            raise ValueError(f"trial {trial.id} is not open")
        self._open = None

    def _record(self, category: Category, population: Population) -> GenerationRecord:
        values = [population.known(genome).value for genome in population.members]
        best = int(np.argmax(values))
        return GenerationRecord(
            category=category,
            phase=population.phase,
            generation=population.generation,
            used=self.used,
            evaluations=population.evidence.count,
            best=values[best],
            mean=float(np.mean(values)),
            maneuver=spelled(population.members[best]),
        )

    def advice(self, *, opponent: str = "", seed: int | None = None) -> Advice:
        """The best maneuver of every situation that came up, by cautious fitness.

        Args:
            opponent: Against whom, for the record.
            seed: Seed of the coaching, for the record.
        """
        entries = []
        for home, population in self._populations.items():
            for genome in population.best(1):
                entries.append(self._entry(home, population, genome, mirrored=False))
                if self.settings.mirror and not is_symmetric(home):
                    entries.append(self._entry(home, population, genome, mirrored=True))
        entries.sort(key=lambda entry: (entry.current, -entry.previous))
        return Advice(self.settings, tuple(entries), opponent, seed)

    @staticmethod
    def _entry(home: Category, population: Population, genome: Genome, *, mirrored: bool) -> AdviceEntry:
        """What is handed out for a situation, or for its mirror image."""
        candidate = population.archive[genome]
        previous, current = reflected_category(home) if mirrored else home
        actions = tuple(Action(gene) for gene in (reflected(genome) if mirrored else genome))
        return AdviceEntry(
            previous=previous,
            current=current,
            actions=actions,
            fitness=population.known(genome).value,
            evaluations=candidate.performed,
            phase=candidate.phase,
            parents=tuple(spelled(reflected(parent) if mirrored else parent) for parent in candidate.parents),
            names=tuple(names(actions, candidate.engagement)),
        )

    def state_dict(self) -> dict[str, Any]:
        """Everything a resumed run needs, as plain values; a trial that is open counts as not yet asked for."""
        settings = self.settings.to_saved()
        version = version_of(settings)
        kept = [[list(home), list(genome), left] for home, (genome, left) in self._kept.items() if left]
        return {
            "version": version,
            "settings": settings,
            "rng": plain(self._rng.bit_generator.state),
            "used": self.used,
            "asked": self._asked - (self._open is not None),
            "digest": self.digest,
            "greedy": self._greedy,
            **({"kept": kept} if version >= 3 else {}),
            **({"ancestors": [[list(home), list(one)] for home, one in self._ancestors.items()]} if self._ancestors else {}),
            **({"seconds": self.seconds} if self.settings.robot_time else {}),
            "trace": self._trace.to_list(),
            "history": [{**asdict(record), "category": list(record.category)} for record in self.history],
            "populations": [
                {"category": list(category), **population.to_dict()} for category, population in self._populations.items()
            ],
        }

    def state_digest(self) -> str:
        """Digest of everything a resumed run needs, 16 hexadecimal digits: takes milliseconds."""
        return state_digest(self.state_dict())

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Pal:
        """The inverse of `state_dict`.

        Raises:
            StateError: The state is of another version, or a field of it is missing, unknown or wrong.
        """
        fields = Fields(state, "", StateError)
        version = read_version(fields)
        pal = cls(read_settings(fields.take("settings")), read_generator(fields.table("rng")))
        pal.digest = read_digest(fields, version)
        pal.used = fields.integer("used", 0, MOST_BUDGET if pal.settings.robot_time else pal.settings.budget)
        pal.seconds = fields.number("seconds", 0.0) if pal.settings.robot_time else 0.0
        pal._asked = fields.integer("asked", pal.used)
        pal.history = [read_step(item, at) for at, item in fields.items("history")]
        pal._greedy = fields.flag("greedy")
        trace = list(fields.items("trace"))
        for at, item in fields.items("populations"):
            population = Fields(item, at, StateError)
            category = read_category(population, arms=pal.settings.arms_in_stimulus)
            if category in pal._populations:
                raise population.wrong("category", f"a second population of {list(category)}")
            if pal._home(category)[1]:
                raise population.wrong("category", f"{list(category)} has no population of its own: its mirror image has")
            pal._populations[category] = Population.from_fields(
                population, StateError, pal.settings, symmetric=pal._folds(category), born=version >= 2
            )
        if version >= 3:
            pal._kept = dict(pal._keeping(item, at) for at, item in fields.items("kept"))
        if fields.has("ancestors"):
            pal._ancestors = dict(pal._ancestor(item, at) for at, item in fields.items("ancestors"))
        fields.done()
        pal._trace.restore([pal._waiting(item, at, version) for at, item in trace])
        return pal

    def _ancestor(self, data: object, path: str) -> tuple[Category, Genome]:
        """A maneuver learnt before, and its situation."""
        fields = Fields.row(data, ("category", "genome"), path, StateError)
        category = read_category(fields, arms=self.settings.arms_in_stimulus)
        return category, read_codes(fields, "genome", self.settings.actions, self.settings.actions)

    def _keeping(self, data: object, path: str) -> tuple[Category, tuple[Genome, int]]:
        """A maneuver that a situation keeps for a while."""
        fields = Fields.row(data, ("category", "genome", "left"), path, StateError)
        category = read_category(fields, arms=self.settings.arms_in_stimulus)
        population = self._populations.get(category)
        if population is None:
            raise fields.wrong("category", f"there is no population of {list(category)}")
        genome = read_codes(fields, "genome", self.settings.actions, self.settings.actions)
        if genome not in population.archive:
            raise fields.wrong("genome", "it is not in the archive")
        return category, (genome, fields.integer("left", 1))

    def _waiting(self, data: object, path: str, version: int) -> Waiting:
        """A performance that waits for credit."""
        names = WAITING_FIELDS if version >= 2 else WAITING_FIELDS[:-1]
        fields = Fields.row(data, names, path, StateError)
        category = read_category(fields, arms=self.settings.arms_in_stimulus)
        if category not in self._populations:
            raise fields.wrong("category", f"there is no population of {list(category)}")
        genome = read_codes(fields, "genome", self.settings.actions, self.settings.actions)
        performed = fields.integer("performed", 1, len(genome))
        trial = fields.integer("trial") if fields.has("trial") else 0
        return Waiting(category, genome, performed, fields.number("fitness"), fields.number("age", 0.0), trial)


def ancestors_of(advice: Advice, settings: PalSettings) -> dict[Category, Genome]:
    """The maneuvers of an advice by the situations whose populations they may be ancestors in.

    Args:
        advice: What was learnt before.
        settings: How Pal is to coach: where left and right are alike, one of two situations has a population.
    """
    found: dict[Category, Genome] = {}
    for entry in advice.entries:
        category = entry.previous, entry.current
        if len(entry.actions) == settings.actions and (not settings.mirror or home_of(category)[0] == category):
            found[category] = tuple(int(action) for action in entry.actions)
    return found
