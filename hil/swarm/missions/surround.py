"""The surround mission: joins the adviser of group reinforcement learning to the swarm host, and measures what comes of it.

A half-round of a class: all of it observe, the adviser chooses, all move at once, and what the observations that end the moves
say of the numbers within the radius used before is learnt from.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from firmware_protocol.errors import HilError
from firmware_protocol.messages import Reason
from firmware_protocol.vocabulary import RobotClass
from hil.swarm.missions.sensing import results_of
from hil.swarm.missions.surround_history import SurroundHistory
from hil.swarm.missions.surround_settings import Order
from hil.swarm.rounds import SwarmMoves
from pal_advisor.maneuvers import state_digest
from pal_advisor.surround import Motion, Results
from pal_advisor.surround.measures import (
    behaviour_frequency,
    mean_distance,
    measures_of,
    ranger_distance,
    share_outside,
    share_surrounded,
    stimulus_frequency,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil.swarm.host import SwarmHost
    from hil.swarm.missions.sensing import SightSource
    from hil.swarm.missions.surround_settings import SurroundSettings
    from pal_advisor.surround import Case, Moves, Sights, Surround, Tables

PLACES: Final = 4
"""Decimal places of positions that are told."""
TABLES_EVERY: Final = 10
"""Steps between two times that the tables of experience are told of."""


class MissionError(HilError):
    """A mission can't be gone on with."""


@dataclass(frozen=True)
class SurroundState:
    """How a mission stands after a step; of both classes, RANGERs first.

    Attributes:
        seed: Of the run.
        case: Name of the case that is played.
        area: Sides of the area, about the origin, in the book's units, as all lengths.
        body: Radius of a robot.
        step: Number of the step; 0 is the start.
        steps: How many there are to be.
        seconds: Time since the run began, in s.
        distance: D, the mean distance from a RANGER to the nearest WILD; None where there is none.
        ranger_distance: Mean distance between two RANGERs, likewise.
        share_surrounded: Share of WILDs that are surrounded; None where there is none.
        outside: Share of RANGERs outside the area, likewise.
        stimuli: How many robots met each stimulus (Eq. 7.2).
        behaviours: How many performed each behaviour (Eq. 7.4).
        positions: Where each robot has last said to be, to 1e-4, shape (robots, 2); NaN where it never has.
        tables: What has been learnt, as plain values, now and then; else None.
        measures: What is told of the run so far (`RunMeasures`), as plain values, as often; else None.
        digest: Of the adviser's whole state, 16 hexadecimal digits, as often; else empty.
    """

    seed: int
    case: str
    area: tuple[float, float]
    body: float
    step: int
    steps: int
    seconds: float
    distance: float | None
    ranger_distance: float | None
    share_surrounded: float | None
    outside: float | None
    stimuli: tuple[tuple[int, ...], tuple[int, ...]]
    behaviours: tuple[tuple[int, ...], tuple[int, ...]]
    positions: tuple[NDArray[np.float64], NDArray[np.float64]]
    tables: dict[str, Any] | None
    measures: dict[str, Any] | None
    digest: str


class SurroundObserver(Protocol):
    """Is told of every step: a log, a display."""

    def surround_state(self, state: SurroundState) -> None:
        """A step is over, or the mission begins."""
        ...


class _HalfRound:
    """What one class does in a round, by its players.

    Args:
        kind: The class.
        rows: Rows of its players.
        sights: What they see.
        moves: What they shall do.
    """

    def __init__(self, kind: RobotClass, rows: NDArray[np.int64], sights: Sights, moves: Moves) -> None:
        self.kind = kind
        self.rows = rows
        self.sights = sights
        self.moves = moves
        self.results: Results | None = None

    def take(self, results: Results, which: NDArray[np.bool_]) -> None:
        """Take in what became of the moves of some."""
        before = self.results or results
        self.results = Results(
            np.where(which, results.outcome, before.outcome),
            np.where(which, results.count_before, before.count_before),
            np.where(which, results.radius_before, before.radius_before),
        )


class SurroundMission:
    """One run of the surround task.

    Args:
        host: Holds the rounds.
        settings: How it goes.
        case: The case that is played, with the robots that play.
        adviser: Learns, and tells where to move.
        sensing: Where sights come from.
        seed: Seed of the run.
        observers: Who is told of every step.
        history: Of the steps that were made before, where a run is gone on with.

    Attributes:
        adviser: As given.
        case: As given.
        settings: As given.
        host: As given.
        history: What was measured.
    """

    def __init__(
        self,
        host: SwarmHost,
        settings: SurroundSettings,
        case: Case,
        adviser: Surround,
        sensing: SightSource,
        *,
        seed: int,
        observers: Sequence[SurroundObserver] = (),
        history: SurroundHistory | None = None,
    ) -> None:
        self.host = host
        self.settings = settings
        self.case = case
        self.adviser = adviser
        self.history = history or SurroundHistory(case.rangers, case.wilds, settings.sectors)
        self._sensing = sensing
        self._seed = seed
        self._observers = observers
        self._begun = host.swarm.now()
        self._before = self.history.seconds
        self._met, self._performed = self._nothing()
        self._moved: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    @property
    def step_number(self) -> int:
        """Steps made."""
        return self.history.steps

    @property
    def finished(self) -> bool:
        """All steps have been made."""
        return self.step_number >= self.settings.steps

    def begin(self) -> None:
        """Measure where everybody is before the first step; a run that is gone on with has been begun."""
        self._begun = self.host.swarm.now()
        self.host.observe(self.host.everybody_there)
        if self.history.empty:
            self._measure(0)
        else:
            self.history.place(self._positions()[0])

    def step(self) -> None:
        """Make one step.

        Raises:
            QuorumError: Too few robots are there.
            LinkError: The last link is gone.
        """
        number = self.step_number + 1
        for kind, place in self.host.begin_step(number):
            self.history.replace(kind, place)
        began, self._moved = self._positions(), None
        self._met, self._performed = self._nothing()
        active = [kind for kind in RobotClass if self._moves(kind)]
        match self.settings.order:
            case Order.ALL:
                self._round(active)
            case Order.GROUP:
                for kind in active:
                    self._round([kind])
            case Order.SEQUENTIAL:
                for kind in active:
                    for place in range(len(self.host.players[kind])):
                        self._round([kind], place)
        self.host.catch_up()
        self.history.tracker.push(began, self._moved or self._positions(), self.settings.contact)
        self._measure(number)

    def digest(self) -> str:
        """Of the adviser's whole state, 16 hexadecimal digits."""
        return state_digest(self.adviser.state_dict())

    # --- a round -----------------------------------------------------------------------------------------------------

    def _moves(self, kind: RobotClass) -> bool:
        """A class has robots that move."""
        settings = self.adviser.groups[kind].settings
        return settings.robots > 0 and settings.motion != Motion.STATIONARY

    def _round(self, kinds: list[RobotClass], only: int | None = None) -> None:
        """Let classes observe, choose, move at once and learn; of one class one robot alone where one is given."""
        players = {kind: self.host.players[kind] for kind in kinds}
        wanted = {kind: np.full(len(rows), fill_value=only is None) for kind, rows in players.items()}
        if only is not None:
            wanted[kinds[0]][only] = True
        which = np.zeros(len(self.host.poses), dtype=np.bool_)
        for kind, rows in players.items():
            which[rows[wanted[kind]]] = True
        asked = self._sensing.to_ask(which & self.host.swarm.there)
        if not asked.any():
            return
        found = self.host.observe(asked)
        if kinds == [RobotClass.WILD]:
            self._see_pushed(only)
        halves = []
        for kind, rows in players.items():
            sights = self._sensing.sights(found, rows, kind, wanted[kind])
            halves.append(_HalfRound(kind, rows, sights, self.adviser.ask(kind, sights)))
        self._move(halves)
        for half in halves:
            self._count(half)
            if half.results is not None:
                self.adviser.tell(half.kind, half.results)

    def _move(self, halves: list[_HalfRound]) -> None:
        """Have the robots move; who is refused by the fence gets another move, once."""
        again = {half.kind: np.ones(len(half.rows), dtype=np.bool_) for half in halves}
        for attempt in range(2):
            moving = np.zeros(len(self.host.poses), dtype=np.bool_)
            sector = np.zeros(len(moving), dtype=np.int64)
            distance = np.zeros(len(moving))
            for half in halves:
                which = again[half.kind] & (half.moves.sector > 0)
                moving[half.rows[which]] = True
                sector[half.rows] = half.moves.sector
                distance[half.rows] = self.settings.step_of(half.kind)
            if not moving.any():
                return
            found = self.host.move(
                SwarmMoves(
                    moving,
                    distance=distance,
                    sector=np.where(moving, sector, 0),
                    sectors=self.settings.sectors,
                    options=int(self._sensing.options),
                )
            )
            for half in halves:
                counts = self._sensing.counts_after(found, half.rows, half.kind, half.sights)
                half.take(results_of(found, half.rows, counts), again[half.kind] & found.asked[half.rows])
                fenced = found.turned_down[half.rows] & (found.reasons[half.rows] == Reason.BAD_VALUE)
                again[half.kind] = fenced
                if fenced.any():
                    half.moves = self.adviser.redraw(half.kind, fenced)
            if attempt or not any(fenced.any() for fenced in again.values()):
                return

    def _nothing(self) -> tuple[list[NDArray[np.int64]], list[NDArray[np.int64]]]:
        """What nobody has met, and nobody has performed, by class."""
        sectors = self.settings.sectors
        none = np.zeros(0, dtype=np.int64)
        return [stimulus_frequency(none, sectors) for _ in RobotClass], [behaviour_frequency(none, sectors) for _ in RobotClass]

    def _count(self, half: _HalfRound) -> None:
        self._met[half.kind] = self._met[half.kind] + stimulus_frequency(half.moves.stimulus, self.settings.sectors)
        performed = behaviour_frequency(half.moves.behaviour, self.settings.sectors)
        self._performed[half.kind] = self._performed[half.kind] + performed

    # --- measuring ---------------------------------------------------------------------------------------------------

    def _positions(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where the RANGERs and the WILDs are, as they said last, in the book's units."""
        rangers, wilds = (self.host.poses[self.host.players[kind], :2] / self.settings.unit for kind in RobotClass)
        return rangers, wilds

    def _see_pushed(self, only: int | None) -> None:
        """RANGERs have moved, and WILDs, or one of them alone, are about to: take down where that has brought everybody."""
        now = self._positions()
        if self._moved is None:
            self._moved = now
        elif only is not None:
            self._moved[RobotClass.WILD][only] = now[RobotClass.WILD][only]

    def _told_of(self, near: float | None, tables: Tables) -> dict[str, Any]:
        """What is told of the run so far, with the step that is measured."""
        return measures_of(self.history.tracker, [*self.history.series["distance"], near], tables).to_dict()

    def _measure(self, number: int) -> None:
        rangers, wilds = self._positions()
        near, places = mean_distance(rangers, wilds), (np.round(rangers, PLACES), np.round(wilds, PLACES))
        known, knows = (group.experience.weights for group in self.adviser.groups)
        self.history.tracker.take(places, near, (known, knows))
        told = number % TABLES_EVERY == 0 or number == self.settings.steps
        tables = self.adviser.tables(str(self.case)) if told else None
        state = SurroundState(
            seed=self._seed,
            case=str(self.case),
            area=self.settings.area,
            body=self.settings.body,
            step=number,
            steps=self.settings.steps,
            seconds=self._before + self.host.swarm.now() - self._begun,
            distance=near,
            ranger_distance=ranger_distance(rangers),
            share_surrounded=share_surrounded(rangers, wilds, self.settings.r0),
            outside=share_outside(rangers, self.settings.area),
            stimuli=(tuple(self._met[0].tolist()), tuple(self._met[1].tolist())),
            behaviours=(tuple(self._performed[0].tolist()), tuple(self._performed[1].tolist())),
            positions=places,
            tables=None if tables is None else tables.to_dict(),
            measures=None if tables is None else self._told_of(near, tables),
            digest=self.digest() if told else "",
        )
        way = self.history.moved(rangers)
        self.history.take(state, rangers)
        if number:
            learnt = self.adviser.groups[RobotClass.RANGER].experience.weights
            self.history.fitness.take(rangers, wilds, way, self._met[RobotClass.RANGER], learnt)
        for observer in self._observers:
            observer.surround_state(state)
