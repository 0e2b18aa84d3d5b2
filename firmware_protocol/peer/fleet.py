"""The robots of one network as rows of arrays, for what many of them say all the time. No I/O, no clock.

What a robot says is looked at by its `Peer` where it is news: the handshake, a heartbeat that is not as the one before, an
answer that the peer waits for. All else is taken down here, for all robots at once: when each was heard, what it said last,
what it answers to a round. Arrays have a row for each system id, 0 to 255.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    Heartbeat,
    RobotAck,
    RobotResultAck,
    RobotStatus,
    SysStatus,
)
from firmware_protocol.peer.commands import Numbering
from firmware_protocol.peer.timetable import NEVER, NOW
from firmware_protocol.peer.timing import SILENCE
from firmware_protocol.wire.rows import ROWS, Rows, row_bytes, rows_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.peer.rounds import NetworkRound
    from firmware_protocol.wire.batch import Arrivals, Batch
    from firmware_protocol.wire.fields import Message

    Which = NDArray[np.bool_]
    """One truth value for each row."""
    Said = Message | tuple[type[Message], Rows]
    """What is to be sent: a message, or many of one kind."""

SYSTEMS: Final = 256
"""Rows of the arrays: one for each system id."""
LOOK: Final = 0.25
"""Between two looks whether a robot has fallen silent, in s."""
_CLOCK_SLACK: Final = 1.0
"""A robot's clock that goes back further than this has restarted, in s."""


class RowNumbering(Numbering):
    """Session and sequence of one robot, kept in the fleet's arrays.

    Args:
        fleet: The fleet.
        system: System id of the robot.
    """

    def __init__(self, fleet: Fleet, system: int) -> None:
        self._fleet = fleet
        self._system = system
        self.asking = 0x8000

    @property
    def session(self) -> int | None:
        """The open session; None before the handshake."""
        return int(self._fleet.session[self._system]) or None

    @session.setter
    def session(self, session: int | None) -> None:
        self._fleet.session[self._system] = session or 0

    @property
    def sequence(self) -> int:
        """The last sequence used."""
        return int(self._fleet.sequence[self._system])

    @sequence.setter
    def sequence(self, sequence: int) -> None:
        self._fleet.sequence[self._system] = sequence


class Fleet:
    """The robots of one network.

    Args:
        results: Messages by which robots report, and which rows of each say how something ended; the others were asked for.
        capacity: What the line carries each way, in bytes/s; None: nobody knows.
        host_system: System id of the host.
        host_component: Its component id.

    Attributes:
        kinds: Messages that are wanted as arrays.
        capacity: What the line carries each way, in bytes/s; None: nobody knows.
        peers: Who is looked after, by system id.
        attended: Whose steady messages are taken down here: its peer can be used, and waits for nothing.
        usable: Whose peer can be used.
        session: The open session with each; 0: none.
        sequence: Sequence of the last numbered message to each.
        heard: When each was heard last, in s.
        good: Frames heard of each.
        lost: Frames of each that are missing by their numbers.
        late: Frames of each that came after a later one, or twice.
        last: The last message of each kind that each robot said; zeros before the first.
        said: Whether there is one.
    """

    def __init__(
        self,
        results: Mapping[type[Message], Callable[[Rows], Which]],
        *,
        capacity: float | None = None,
        host_system: int = HOST_SYSTEM,
        host_component: int = HOST_COMPONENT,
    ) -> None:
        self.results = dict(results)
        self.capacity = capacity
        kept = (Heartbeat, SysStatus, RobotStatus, *results)
        self.kinds: frozenset[type[Message]] = frozenset({*kept, RobotAck})
        self.peers: dict[int, Peer] = {}
        self.attended, self.usable = (np.zeros(SYSTEMS, bool) for _ in range(2))
        self.session, self.sequence = (np.zeros(SYSTEMS, np.int64) for _ in range(2))
        self.heard = np.full(SYSTEMS, -np.inf)
        self.good, self.lost, self.late = (np.zeros(SYSTEMS, np.int64) for _ in range(3))
        self._frame = np.full(SYSTEMS, -1, np.int64)
        self.last: dict[type[Message], Rows] = {kind: np.zeros(SYSTEMS, ROWS[kind]) for kind in kept}
        self.said: dict[type[Message], Which] = {kind: np.zeros(SYSTEMS, bool) for kind in kept}
        self._us = (host_system, host_component)
        self._rounds: list[NetworkRound] = []
        self._acknowledge: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]] = []
        self._untold: list[tuple[type[Message], Rows]] = []
        self._look_due = NOW

    # --- who is there ------------------------------------------------------------------------------------------------

    def enter(self, peer: Peer) -> None:
        """Look after a robot.

        Args:
            peer: What is known of it.
        """
        self.peers[peer.system] = peer

    def leave(self, system: int) -> None:
        """Look after it no more.

        Args:
            system: Its system id.
        """
        self.peers.pop(system, None)
        self.attended[system] = self.usable[system] = False

    def numbering(self, system: int) -> Numbering:
        """Where session and sequence of a robot are kept.

        Args:
            system: Its system id.
        """
        return RowNumbering(self, system)

    def attend(self, system: int, *, usable: bool, waits: bool) -> None:
        """Take note of how things stand between a robot and its peer.

        Args:
            system: System id of the robot.
            usable: The peer can be used.
            waits: The peer waits for something that the robot is to say.
        """
        self.usable[system] = usable
        self.attended[system] = usable and not waits

    # --- in ----------------------------------------------------------------------------------------------------------

    def take(self, arrivals: Arrivals) -> list[Received]:
        """Take what a chunk has brought.

        Args:
            arrivals: It.

        Returns:
            What is news for the robots' peers, and of whom there is none, as objects, in the order in which it came.
        """
        news: list[tuple[int, Received]] = []
        self._count(arrivals)
        for kind, batch in arrivals.batches.items():
            ours = (batch.component == ROBOT_COMPONENT) & self.usable[batch.system]
            told = ~ours | ~self.attended[batch.system]
            if ours.any():
                part = batch if ours.all() else batch.part(np.flatnonzero(ours))
                odd = self._hear(kind, part)
                told[ours] |= odd
            if told.any():
                news += (batch if told.all() else batch.part(np.flatnonzero(told))).objects()
        for event, place in zip(arrivals.events, arrivals.places, strict=True):
            if isinstance(event, Received):
                news.append((place, event))
        news.sort(key=lambda item: item[0])
        return [event for _, event in news]

    def _hear(self, kind: type[Message], batch: Batch) -> Which:
        """Take messages of robots that can be used.

        Returns:
            Which of them their peers have to see.
        """
        rows, system = batch.rows, batch.system
        if kind is RobotAck:
            self._acknowledged(batch)
            return np.zeros(len(rows), bool)
        if kind in self.results:
            self._reported(kind, batch)
            odd = np.zeros(len(rows), bool)
        elif kind is Heartbeat:
            odd = ~self.said[kind][system] | (row_bytes(rows) != row_bytes(self.last[kind][system])).any(axis=1)
        elif kind is RobotStatus:
            before = self.last[kind][system]
            odd = ~self.said[kind][system] | (before["boot_count"] != rows["boot_count"])
            odd |= rows["time"] + _CLOCK_SLACK * 1e6 < before["time"]
        else:
            odd = np.zeros(len(rows), bool)
        self.last[kind][system] = rows
        self.said[kind][system] = True
        return odd

    def _acknowledged(self, batch: Batch) -> None:
        """Show acknowledgements to the rounds that wait for them."""
        rows, (system, component) = batch.rows, self._us
        mine = np.isin(rows["target_system"], (0, system)) & np.isin(rows["target_component"], (0, component))
        for one in self._rounds:
            one.acknowledged(batch, mine)

    def _reported(self, kind: type[Message], batch: Batch) -> None:
        """Show reports to the rounds, and have those acknowledged that say how something ended."""
        rows, system = batch.rows, batch.system.astype(np.int64)
        ends = self.results[kind](rows)
        mine = rows["session"] == self.session[system]
        for one in self._rounds:
            one.reported(batch, ends, mine)
        ended = ends & mine
        if ended.any():
            self._acknowledge.append(
                (system[ended], rows["session"][ended].astype(np.int64), rows["sequence"][ended].astype(np.int64))
            )

    def _count(self, arrivals: Arrivals) -> None:
        """Note who was heard, and which frames are missing."""
        batches = arrivals.batches.values()
        others = [
            (event.system, event.sequence, event.time, place)
            for event, place in zip(arrivals.events, arrivals.places, strict=True)
            if isinstance(event, Received) and event.component == ROBOT_COMPONENT
        ]
        parts = [(b.system, b.sequence, b.time, b.place) for b in batches if (b.component == ROBOT_COMPONENT).all()]
        parts += [
            (b.system[ours], b.sequence[ours], b.time[ours], b.place[ours])
            for b in batches
            if not (ours := b.component == ROBOT_COMPONENT).all()
        ]
        if others:
            columns = list(zip(*others, strict=True))
            parts.append((np.array(columns[0]), np.array(columns[1]), np.array(columns[2]), np.array(columns[3])))
        if not parts:
            return
        system, frame, time, place = (np.concatenate(column) for column in zip(*parts, strict=True))
        if not len(system):
            return
        order = np.lexsort((place, system))
        system, frame, time = system[order].astype(np.intp), frame[order].astype(np.int64), time[order]
        first = np.ones(len(system), bool)
        first[1:] = system[1:] != system[:-1]
        before = np.empty(len(system), np.int64)
        before[1:] = frame[:-1]
        before[first] = self._frame[system[first]]
        step = (frame - before) & 255
        step[before < 0] = 1
        late = (step == 0) | (step >= 128)
        np.add.at(self.good, system, 1)
        np.add.at(self.lost, system, np.where(late, 0, step - 1))
        np.add.at(self.late, system, late)
        last = np.append(first[1:], True)
        self._frame[system[last]] = frame[last]
        self.heard[system[last]] = time[last]

    def restarted(self, system: int) -> None:
        """The link is another one, or the robot has restarted: its frames are counted anew.

        Args:
            system: System id of the robot.
        """
        self._frame[system] = -1
        for said in self.said.values():
            said[system] = False

    def missed(self, duration: float) -> None:
        """Nobody has listened for a while: that is no silence of the robots'.

        Args:
            duration: How long, in s.
        """
        self.heard += duration

    # --- out ---------------------------------------------------------------------------------------------------------

    def tell(self, kind: type[Message], rows: Rows) -> None:
        """Say something that is not answered to many, with what is due next, which is at once.

        Args:
            kind: Class of the message.
            rows: What is said to each.
        """
        self._untold.append((kind, rows))

    def begin(self, one: NetworkRound) -> None:
        """Have a round take place; it stays until `end`.

        Args:
            one: The round.
        """
        self._rounds.append(one)

    def end(self, one: NetworkRound) -> None:
        """A round is over, or given up.

        Args:
            one: The round.
        """
        if one in self._rounds:
            self._rounds.remove(one)

    def next_due(self) -> float:
        """When `due` must be called next, in s; it may be called earlier."""
        if self._acknowledge or self._untold:
            return NOW
        return min([self._look_due if self.peers else NEVER, *(one.next_due for one in self._rounds)])

    def due(self, now: float, taken_in: float) -> Sequence[Said]:
        """What must be sent now.

        Args:
            now: Time in s.
            taken_in: What had come by this time has been taken in, in s.

        Returns:
            In order; it counts as sent.
        """
        out: list[Said] = []
        if self._acknowledge:
            system, session, sequence = (np.concatenate(column) for column in zip(*self._acknowledge, strict=True))
            self._acknowledge.clear()
            columns: dict[str, ArrayLike] = {
                "session": session, "sequence": sequence, "target_system": system, "target_component": ROBOT_COMPONENT,
            }  # fmt: skip
            out.append((RobotResultAck, rows_of(RobotResultAck, len(system), columns)))
        out += self._untold
        self._untold.clear()
        for one in self._rounds:
            if now >= one.next_due:
                out += one.due(now)
        if now >= self._look_due:
            self._look_due = now + LOOK
            for silent in np.flatnonzero(self.usable & (taken_in - self.heard >= SILENCE)).tolist():
                self.peers[silent].fell_silent(taken_in)
        return out
