"""The robots of one network as rows of arrays, for what many of them say all the time. No I/O, no clock.

What a robot says is looked at by its `FleetPeer` where it is news: the handshake, a heartbeat that is not as the one before, an
answer that the peer waits for. All else is taken down here, for all robots at once: when each was heard, what it said last,
what it answers to a round. Arrays have a row for each system id, 0 to 255.
"""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    RobotAck,
    RobotResultAck,
)
from firmware_protocol.peer.exchanges.commands import Numbering
from firmware_protocol.peer.fleets.steady import STEADY, SYSTEMS, SteadyMessages
from firmware_protocol.peer.timetable import NEVER, NOW
from firmware_protocol.peer.timing import SILENCE
from firmware_protocol.wire.batch import batch_of
from firmware_protocol.wire.rows import ROWS, Rows, rows_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from firmware_protocol.peer.fleets.fleet_peer import FleetPeer
    from firmware_protocol.peer.fleets.rounds import NetworkRound
    from firmware_protocol.wire.batch import Arrivals, Batch
    from firmware_protocol.wire.fields import Message

    Which = NDArray[np.bool_]
    """One truth value for each row."""
    Said = Message | tuple[type[Message], Rows]
    """What is to be sent: a message, or many of one kind."""

FEW: Final = 16
"""Fewer messages than this are sent sooner one by one."""
LOOK: Final = 0.25
"""Between two looks whether a robot has fallen silent, in s."""


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
        steady: What each says all the time.
        last: The last report of each kind that each robot sent; zeros before the first.
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
        self._answers: frozenset[type[Message]] = frozenset({*results, RobotAck})
        self.kinds = STEADY | self._answers
        self.steady = SteadyMessages()
        self.peers: dict[int, FleetPeer] = {}
        self.attended, self.usable = (np.zeros(SYSTEMS, bool) for _ in range(2))
        self.session, self.sequence = (np.zeros(SYSTEMS, np.int64) for _ in range(2))
        self.last: dict[type[Message], Rows] = {kind: np.zeros(SYSTEMS, ROWS[kind]) for kind in results}
        self.said: dict[type[Message], Which] = {kind: np.zeros(SYSTEMS, bool) for kind in results}
        self._us = (host_system, host_component)
        self._rounds: list[NetworkRound] = []
        self._acknowledge: list[tuple[NDArray[np.uint8], NDArray[np.uint16], NDArray[np.uint16]]] = []
        self._untold: list[tuple[type[Message], Rows]] = []
        self._look_due = NOW

    # --- who is there ------------------------------------------------------------------------------------------------

    def enter(self, peer: FleetPeer) -> None:
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

    def take(self, came: Arrivals) -> list[Received]:
        """Take what a chunk has brought.

        Args:
            came: It. Messages that are wanted as arrays may be among its objects: a few are taken sooner so.

        Returns:
            What is news for the robots' peers, and what nobody else takes, as objects, in the order in which it came.
        """
        news: list[tuple[int, Received]] = []
        frames: list[tuple[int, int, int, float]] = []
        answers: dict[type[Message], list[tuple[Received, int]]] = {}
        for place, event in zip(came.places, came.events, strict=True):
            if isinstance(event, Received):
                kind, system = type(event.message), event.system
                if event.component != ROBOT_COMPONENT:
                    news.append((place, event))
                    continue
                frames.append((place, system, event.sequence, event.time))
                told = not self.attended[system]
                if self.usable[system]:
                    if kind in STEADY:
                        told |= self.steady.note(kind, system, event.message)
                    elif kind in self._answers:
                        answers.setdefault(kind, []).append((event, place))
                    else:
                        told = True
                if told:
                    news.append((place, event))
        for batch in came.batches.values():
            self._take_batch(batch, frames, news)
        if came.batches:
            frames.sort()
            news.sort(key=itemgetter(0))
        for _, system, frame, time in frames:
            self.steady.count(system, frame, time)
        for kind, found in answers.items():
            self._hear(batch_of(kind, found))
        return [event for _, event in news]

    def _take_batch(self, batch: Batch, frames: list[tuple[int, int, int, float]], news: list[tuple[int, Received]]) -> None:
        """Take messages that came as arrays."""
        ours = batch.component == ROBOT_COMPONENT
        part = batch if ours.all() else batch.part(np.flatnonzero(ours))
        frames += zip(part.place.tolist(), part.system.tolist(), part.sequence.tolist(), part.time.tolist(), strict=True)
        ours &= self.usable[batch.system]
        told = ~ours | ~self.attended[batch.system]
        if ours.any():
            part = batch if ours.all() else batch.part(np.flatnonzero(ours))
            if batch.message in STEADY:
                told[ours] |= self.steady.note_rows(batch.message, part.system.tolist(), part.rows)
            else:
                self._hear(part)
        if told.any():
            news += (batch if told.all() else batch.part(np.flatnonzero(told))).objects()

    def _hear(self, batch: Batch) -> None:
        """Show acknowledgements and reports to the rounds, and have reports acknowledged that say how something ended."""
        rows, system = batch.rows, batch.system
        if batch.message is RobotAck:
            host, component = self._us
            target, part = rows["target_system"], rows["target_component"]
            mine = ((target == host) | (target == 0)) & ((part == component) | (part == 0))
            for one in self._rounds:
                one.acknowledged(batch, mine)
            return
        ends = self.results[batch.message](rows)
        mine = rows["session"] == self.session[system]
        for one in self._rounds:
            one.reported(batch, ends, mine)
        ended = ends & mine
        if ended.any():
            self._acknowledge.append((system[ended], rows["session"][ended], rows["sequence"][ended]))
        self.last[batch.message][system] = rows
        self.said[batch.message][system] = True

    def restarted(self, system: int) -> None:
        """The link is another one, or the robot has restarted: its frames are counted anew.

        Args:
            system: System id of the robot.
        """
        self.steady.forget(system)
        for said in self.said.values():
            said[system] = False

    def missed(self, duration: float) -> None:
        """Nobody has listened for a while: that is no silence of the robots'.

        Args:
            duration: How long, in s.
        """
        self.steady.heard[:] = [time + duration for time in self.steady.heard]

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
            out += self._result_acks()
        out += self._untold
        self._untold.clear()
        for one in self._rounds:
            if now >= one.next_due:
                out += one.due(now)
        if now >= self._look_due:
            self._look_due = now + LOOK
            heard = self.steady.heard
            for silent in [system for system in self.peers if taken_in - heard[system] >= SILENCE and self.usable[system]]:
                self.peers[silent].fell_silent(taken_in)
        return out

    def _result_acks(self) -> list[Said]:
        """Say that we have the reports that say how something ended."""
        system, session, sequence = (np.concatenate(column) for column in zip(*self._acknowledge, strict=True))
        self._acknowledge.clear()
        if len(system) < FEW:
            each = zip(session.tolist(), sequence.tolist(), system.tolist(), strict=True)
            return [RobotResultAck(*numbers, ROBOT_COMPONENT) for numbers in each]
        columns: dict[str, ArrayLike] = {
            "session": session, "sequence": sequence, "target_system": system, "target_component": ROBOT_COMPONENT,
        }  # fmt: skip
        return [(RobotResultAck, rows_of(RobotResultAck, len(system), columns))]
