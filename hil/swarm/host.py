"""The swarm host: holds the rounds of a mission, and knows who plays, where everybody is, and who is missing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from firmware_protocol.vocabulary import RobotClass

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil.swarm.cast import Cast
    from hil.swarm.rounds import Round, SwarmMoves


class HeldSwarm(Protocol):
    """What a mission needs of a swarm; `hil.swarm.handle.Swarm` has it.

    Attributes:
        kinds: Class of each robot, by row; -1: it has none.
        there: Who takes part in the next round, by row.
    """

    kinds: NDArray[np.int64]
    there: NDArray[np.bool_]

    @property
    def labels(self) -> tuple[str, ...]:
        """What each robot is called, by row."""
        ...

    def now(self) -> float:
        """Time of the last step, in s."""
        ...

    def observe(self, robots: NDArray[np.bool_]) -> Round:
        """Have robots say what they observe; see `Swarm.observe`."""
        ...

    def move(self, moves: SwarmMoves, *, deadline: float | None = None) -> Round:
        """Have robots move; see `Swarm.move`."""
        ...


class RoundObserver(Protocol):
    """Is told of every round: a log."""

    def round(self, took_place: Round, labels: Sequence[str], order: str, step: int = -1) -> None:
        """A round is over."""
        ...


@dataclass
class Absence:
    """A robot that was missing.

    Attributes:
        step: In which step it was missed.
        robot: Its name.
        until: In which step it was there again; None while it is not.
    """

    step: int
    robot: str
    until: int | None = None


class SwarmHost:
    """Holds the rounds of a mission.

    Args:
        swarm: The robots.
        cast: Who plays.
        deadline: Longest time of a round of moves, in s; None: as long as the robots may take.
        observers: Who is told of every round.

    Attributes:
        swarm: As given.
        step: Step of the mission, from 1.
        players: Rows of who plays now, by class: where a spare has taken somebody's place, its row.
        poses: Where every robot was when it last said so: x, y in m and heading in rad, by row; NaN: it has not.
        absences: Who was missing, in the order in which they were missed.
    """

    def __init__(
        self,
        swarm: HeldSwarm,
        cast: Cast,
        *,
        deadline: float | None = None,
        observers: Sequence[RoundObserver] = (),
    ) -> None:
        self.swarm = swarm
        self.step = 0
        self.players = {kind: rows.copy() for kind, rows in cast.players.items()}
        self.poses = np.full((len(swarm.kinds), 3), np.nan)
        self.absences: list[Absence] = []
        self._spares = {kind: rows.tolist() for kind, rows in cast.spares.items()}
        self._deadline = deadline
        self._observers = observers
        self._absent: dict[int, Absence] = {}
        self._rounds = 0
        self._moved_in = 0
        self._reported_in = np.full(len(self.poses), -1)

    @property
    def playing(self) -> NDArray[np.bool_]:
        """Who plays, by row, whether there or not."""
        which = np.zeros(len(self.poses), dtype=np.bool_)
        for rows in self.players.values():
            which[rows] = True
        return which

    @property
    def everybody_there(self) -> NDArray[np.bool_]:
        """Who plays and takes part in the next round, by row."""
        return self.playing & self.swarm.there

    def begin_step(self, step: int) -> list[tuple[RobotClass, int]]:
        """The next step begins: spares take the places of those that are missing.

        Args:
            step: Its number.

        Returns:
            Places that were taken: class, and which of its players.
        """
        self.step = step
        self._see_who_is_missing()
        taken = []
        for kind, rows in self.players.items():
            for place, row in enumerate(rows.tolist()):
                if self.swarm.there[row]:
                    continue
                spare = next((other for other in self._spares[kind] if self.swarm.there[other]), None)
                if spare is not None:
                    self._spares[kind].remove(spare)
                    self._spares[kind] = sorted([*self._spares[kind], row])
                    rows[place] = spare
                    taken.append((kind, place))
        return taken

    def observe(self, which: NDArray[np.bool_]) -> Round:
        """Have robots say what they observe.

        Args:
            which: Who, by row; those that are not there are left out.

        Raises:
            QuorumError: Too few are there.
            LinkError: The last link is gone.
        """
        found = self.swarm.observe(which)
        self._take(found, "observe")
        return found

    def move(self, moves: SwarmMoves) -> Round:
        """Have robots move.

        Args:
            moves: Their moves.

        Raises:
            QuorumError: Too few are there.
            LinkError: The last link is gone.
        """
        self._moved_in = self._rounds + 1
        found = self.swarm.move(moves, deadline=self._deadline)
        self._take(found, "move")
        return found

    def catch_up(self) -> None:
        """Ask those that play and have reported nothing since anybody last moved: they may have been pushed."""
        late = self.everybody_there & (self._reported_in < self._moved_in)
        if late.any():
            self.observe(late)

    def _take(self, found: Round, what: str) -> None:
        self._rounds += 1
        there = found.there
        self.poses[there, :2], self.poses[there, 2] = found.position[there], found.heading[there]
        self._reported_in[there] = self._rounds
        order = f"{what} {' and '.join(self._classes(found.asked))}"
        for observer in self._observers:
            observer.round(found, self.swarm.labels, order, self.step)
        self._see_who_is_missing()

    def _classes(self, which: NDArray[np.bool_]) -> list[str]:
        """Which classes are among some robots, in words."""
        return [f"{kind.name.lower()}s" for kind in RobotClass if (self.swarm.kinds[which] == kind).any()]

    def _see_who_is_missing(self) -> None:
        """Take down who is missing of those that play, and who is there again of those that were."""
        for row in np.flatnonzero(self.playing & ~self.swarm.there).tolist():
            if row not in self._absent:
                self._absent[row] = Absence(self.step, self.swarm.labels[row])
                self.absences.append(self._absent[row])
        for row in [row for row in self._absent if self.swarm.there[row]]:
            self._absent.pop(row).until = self.step
