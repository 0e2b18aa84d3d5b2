"""Making a cell: coach, then play held-out bouts, and write down what happened."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import hil
from firmware_protocol.messages import BoutOutcome
from firmware_protocol.vocabulary import ANY_STIMULUS
from hil.book.sumo.methods import CORNER, EQUATION, SQUARE, Cell
from hil.seeds import Branch, bout_seed
from hil.sumo.bouts import Tally, play
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.controllers import AdviceController
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import Advice, AdviceEntry, Performance, fitness
from pal_advisor.maneuvers.advice import EYES
from simdevice.outline import Outline
from simdevice.sumo.opponents import OPPONENTS, mean_distance

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firmware_protocol.vocabulary import ActionTally, Maneuver, Stimulus
    from hil.sumo.bouts import Bout
    from hil.sumo.controllers import Driver
    from hil.sumo.junior import Junior
    from hil.sumo.referee import RefereeHandle
    from hil.sumo.ring import Encounter, Ring

JUDGE: Final = 77
"""Seed of the held-out bouts."""
SIDE: Final = 0.035
"""Side of the square that stands corner forward, in m: less than the 4 cm between the eyes, which look straight ahead or
outward."""

SHOWN: Final = 21
"""Held-out bouts of which one is shown."""

Plain = dict[str, Any]


@dataclass
class WatchedRing:
    """A ring, and what was performed in it.

    Attributes:
        ring: The ring.
        bouts: Of each bout what was performed: previous stimulus (None at the start), current one, maneuver, what came of it.
        refereed: See `Ring`.
        referee: Who is asked where everybody is; None: nobody.
        poses: At every start and after every maneuver: x, y, heading of Junior, the same of the opponent.
    """

    ring: Ring
    bouts: list[list[tuple[int | None, int, Maneuver, Encounter]]] = field(default_factory=list)
    refereed: bool = True
    referee: RefereeHandle | None = None
    poses: list[tuple[float, ...]] = field(default_factory=list)
    _previous: int | None = None
    _current: int = 0

    @property
    def opponent(self) -> str:
        """Name of the opponent."""
        return self.ring.opponent

    def begin(self, seed: int) -> Stimulus:
        """Begin a bout; see `Ring.begin`."""
        stimulus = self.ring.begin(seed)
        self.bouts.append([])
        self._previous, self._current = None, int(stimulus)
        self._look()
        return stimulus

    def engage(self, maneuver: Maneuver) -> Encounter:
        """Have a maneuver performed; see `Ring.engage`."""
        encounter = self.ring.engage(maneuver)
        self.bouts[-1].append((self._previous, self._current, maneuver, encounter))
        self._previous, self._current = self._current, int(encounter.stimulus)
        self._look()
        return encounter

    def _look(self) -> None:
        if self.referee is not None:
            state = self.referee.latest
            self.poses.append((*state.junior, state.junior_heading, *state.opponent, state.opponent_heading))

    def steer(self, driver: Driver) -> tuple[BoutOutcome, float]:
        """See `Ring.steer`."""
        return self.ring.steer(driver)

    def recover(self) -> None:
        """See `Ring.recover`."""
        self.ring.recover()


def made(cell: Cell) -> Plain:
    """Coach, and play.

    Args:
        cell: Which.

    Returns:
        What happened, as plain values: `steps` (all GP steps), `learning` (of each performance the eyes before it and its
        rating), `entries` of the advice, `wins`, `losses`, `time` (the median to win, in s), `play` (of each held-out bout
        its performances).
    """
    with robot_of(cell) as junior:
        learning = WatchedRing(open_ring(junior))
        coaching = Coaching(learning, new_pal(cell.settings, cell.seed), seed=cell.seed)
        coaching.run()
        advice = coaching.advice()
    seeds = [bout_seed(JUDGE, Branch.BOUTS, number) for number in range(1, cell.bouts + 1)]
    with robot_of(cell) as junior:
        held_out = WatchedRing(open_ring(junior))
        tally = Tally.of(cell.opponent, list(play(held_out, AdviceController(advice), seeds)))
    return {
        "cell": asdict(cell),
        "steps": [
            [*step.category, step.phase, step.used, round(step.best, 3), round(step.mean, 3)] for step in coaching.pal.history
        ],
        "learning": [
            [ANY_STIMULUS if previous is None else previous & EYES, current & EYES, rated(maneuver, encounter)]
            for bout in learning.bouts
            for previous, current, maneuver, encounter in bout
        ],
        "seconds": round(coaching.progress.robot_seconds, 1),
        "entries": [
            {key: value for key, value in entry.to_dict().items() if key != "parents"} | {"fitness": round(entry.fitness, 3)}
            for entry in advice.entries
        ],
        "wins": tally.wins,
        "losses": tally.losses,
        "time": tally.median_time_to_win,
        "play": [
            [[current & EYES, *told(maneuver, encounter)] for _, current, maneuver, encounter in bout]
            for bout in held_out.bouts
        ],
    }


def shown(row: Plain) -> Plain:
    """A bout to look at: of those that an advice wins the one that takes the median time, or where it wins none, of all.

    Args:
        row: What happened in a cell.

    Returns:
        `poses` after each maneuver and at the start (x, y, heading of Junior, the same of the opponent; m, rad), `words` on it.
    """
    cell = Cell(**row["cell"])
    advice = Advice(cell.settings, tuple(AdviceEntry.from_dict(entry) for entry in row["entries"]), cell.opponent, cell.seed)
    found: list[tuple[Bout, list[tuple[float, ...]]]] = []
    with robot_of(cell) as junior:
        for number in range(1, SHOWN + 1):
            ring = WatchedRing(open_ring(junior), referee=junior.referee)
            found += [
                (bout, ring.poses)
                for bout in play(ring, AdviceController(advice), [bout_seed(JUDGE, Branch.BOUTS, number)], number)
            ]
    won = [each for each in found if each[0].outcome is BoutOutcome.WIN]
    chosen = sorted(won or found, key=lambda each: each[0].time)
    bout, poses = chosen[len(chosen) // 2]
    outcome = "won" if won else bout.outcome.name.lower()
    return {
        "poses": [[round(value, 3) for value in pose] for pose in poses],
        "words": f"{outcome}, {bout.time:.1f} s",
    }


def rated(maneuver: Maneuver, encounter: Encounter) -> float:
    """Eq. 10.1 of a performance."""
    won = encounter.outcome is BoutOutcome.WIN
    return fitness(Performance(encounter.report.tallies, len(maneuver.actions), won=won), EQUATION)


def told(maneuver: Maneuver, encounter: Encounter) -> tuple[str, list[list[int]], float]:
    """What is kept of a performance: names of its actions, marks, rating."""
    spelled = " ".join(action.name for action in maneuver.actions)
    return spelled, marks(encounter.report.tallies), rated(maneuver, encounter)


def marks(tallies: tuple[ActionTally, ...]) -> list[list[int]]:
    """What is kept of the tallies of a performance: samples, eyes, edges, and longest presses in ms, of both sides each."""
    return [[t.samples, *t.eyes, *t.edges, *(round(1000 * press) for press in t.longest_press)] for t in tallies]


@contextmanager
def robot_of(cell: Cell) -> Iterator[Junior]:
    """A new emulated robot, armed, before the opponent of a cell.

    Args:
        cell: Which.

    Yields:
        The robot.
    """
    with stand_in(cell.opponent) as opponent, hil.connect(f"sim://junior?opponent={opponent}&seed={cell.seed}") as junior:
        junior.arm()
        yield junior


@contextmanager
def stand_in(opponent: str) -> Iterator[str]:
    """Have the square stand where the wedge does, for as long as the context lasts.

    Args:
        opponent: Name of an opponent, or `SQUARE`.

    Yields:
        Name of the opponent to connect to.
    """
    if opponent != SQUARE:
        yield opponent
        return
    wedge = OPPONENTS[CORNER]
    half = SIDE / 2**0.5
    outline = Outline(((half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half)))
    OPPONENTS[CORNER] = replace(wedge, outline=outline, grip=mean_distance(outline.vertices))
    try:
        yield CORNER
    finally:
        OPPONENTS[CORNER] = wedge
