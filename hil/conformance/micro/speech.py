"""What a host says to a micro-robot: moves, how to sense, and what it observes; and what stands around it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, TypeVar, cast

from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    TABLE_COMPONENT,
    Command,
    CommandLong,
    Reason,
    RobotAck,
    SwarmMove,
    SwarmObservation,
    SwarmRanges,
    SwarmSense,
    TablePlace,
)
from firmware_protocol.messages.swarm import LONG_RANGE
from firmware_protocol.roles.swarm_table import table_system
from firmware_protocol.vocabulary import MoveOption, ObservationFlag, SwarmOutcome
from hil.conformance.orders import named
from hil.conformance.probe import PATIENCE, TRIES
from hil.conformance.registry import NotRunError, given, require
from hil.conformance.talk import Talk

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

S = TypeVar("S", "SwarmObservation", "SwarmRanges")

LONGEST: Final = 10.0
"""No move of a check takes longer, in s."""
_PLACE_TIME: Final = 0.15
"""Within this, a fix has told of a place that somebody was put in, in s."""


def turned(angle: float) -> float:
    """The same angle between -pi and pi."""
    return math.remainder(angle, math.tau)


class MicroSpeech(Talk):
    """A host that knows a micro-robot's own messages.

    Attributes:
        told_to_sense: The ring is not read as the parameters say, until it restarts.
    """

    told_to_sense = False
    _askings = 0
    _placings = 0

    # --- moves -----------------------------------------------------------------------------------------------------------

    def move(
        self,
        heading: float | None = None,
        distance: float = 0.0,
        *,
        face: float | None = None,
        speed: float = 0.0,
        sector: int = 0,
        sectors: int = 0,
        options: int = 0,
    ) -> SwarmMove:
        """Move; not sent.

        Args:
            heading: Which way, in rad; None: the sector says it.
            distance: In m.
            face: Heading to turn to when there, in rad; None: none.
            speed: In m/s; 0: MOVE_SPEED.
            sector: Sector along whose bisector to drive; 0: none.
            sectors: How many there are.
            options: Bits of MoveOption.
        """
        return self.numbered(
            SwarmMove, heading=None if heading is None else turned(heading), distance=distance,
            face=None if face is None else turned(face), speed=speed, sector=sector, sectors=sectors, effort=0,
            options=int(options),
        )  # fmt: skip

    def reported(self, what: Message, timeout: float = LONGEST, *, start: int = 0) -> SwarmObservation:
        """Wait for the observation that ends a move, and acknowledge it."""
        return cast("SwarmObservation", self.ended(what, timeout, start=start))

    def moved(self, what: SwarmMove, outcome: SwarmOutcome = SwarmOutcome.ARRIVED, when: str = "") -> SwarmObservation:
        """Have it move, and see how that ends.

        Args:
            what: The move; it must be accepted.
            outcome: How it must end.
            when: What is special, in words.
        """
        self.expect(what, Reason.NONE, when)
        told = self.reported(what)
        words = f"a move {when} " if when else "a move "
        require(told.outcome == outcome, f"{words}ended {self.outcome(told)}, {named(Reason, told.reason)}, not {outcome.name}")
        return told

    # --- what it senses ----------------------------------------------------------------------------------------------------

    def need_ring(self) -> None:
        """See that a ring of sensors is fitted.

        Raises:
            NotRunError: None is.
        """
        if not self.parameters_found.get("RING"):
            raise NotRunError("no ring is fitted")

    def sense(
        self, radius: float, increment: float = 0.0, limit: float = LONG_RANGE, *, sectors: int = 8, ranges: int = 0
    ) -> None:
        """Say how the ring is read; it must be accepted."""
        self.told_to_sense = True
        self.expect(
            self.numbered(SwarmSense, radius=radius, increment=increment, limit=limit, sectors=sectors, ranges=ranges),
            Reason.NONE,
        )

    def asking(self, kind: type[Message], *, host: int = 0, system: int | None = None) -> CommandLong:
        """The request for an observation; not sent. Its count is the next one.

        Args:
            kind: SWARM_OBSERVATION or SWARM_RANGES.
            host: The asking host's number; 0: a watcher.
            system: Whom to ask; None is the robot under test, 0 are all.
        """
        self._askings += 1
        whom = self.system if system is None else system
        what = float(kind.ID), float(self._askings), float(host)
        return CommandLong(whom, ROBOT_COMPONENT, Command.REQUEST_MESSAGE, 0, *what)

    def asked(self, kind: type[S], *, host: int = 0) -> S:
        """Ask the robot until it says what it observes, or measures.

        Args:
            kind: SWARM_OBSERVATION or SWARM_RANGES.
            host: The asking host's number; 0: a watcher.

        Raises:
            CheckFailedError: It does not say it.
        """
        request = self.asking(kind, host=host)
        answer = self.ask(request, kind, lambda m: m.sequence == round(request.param2) and _is_asked(m))
        return given(answer, f"{kind.NAME} was asked for and did not come with the count of the asking")

    def observe(self, *, host: int = 0) -> SwarmObservation:
        """Ask what it observes; see `asked`."""
        return self.asked(SwarmObservation, host=host)

    def need_fix(self) -> SwarmObservation:
        """See that the robot finds its position itself, and where it is.

        Raises:
            NotRunError: It does not.
        """
        seen = self.observe()
        if seen.flags & ObservationFlag.DEAD_RECKONING:
            raise NotRunError("it does not find its position itself")
        return seen

    # --- the second robot ----------------------------------------------------------------------------------------------------

    def second_pose(self) -> SwarmObservation:
        """Where the second robot is, as it says itself.

        Raises:
            NotRunError: It does not say so, or finds no position.
        """
        request = self.asking(SwarmObservation, system=self.second)
        for _ in range(TRIES):
            start = len(self.beside)
            self.send(request)
            end = self.now() + PATIENCE
            while (left := end - self.now()) > 1e-9:
                self.step(left)
                for event in self.beside[start:]:
                    said = event.message
                    if isinstance(said, SwarmObservation) and said.sequence == round(request.param2) and _is_asked(said):
                        if said.flags & ObservationFlag.DEAD_RECKONING:
                            raise NotRunError(f"robot {self.second} does not know its position")
                        return said
        raise NotRunError(f"robot {self.second} did not say where it is")

    def set_beside(self, distance: float, bearing: float = 0.0) -> None:
        """Have the second robot stand at a distance and a bearing.

        An emulated table puts it there. Elsewhere the robot under test drives until it is so: it must have been armed.

        Args:
            distance: Between the centres, in m.
            bearing: From the nose of the robot under test, in rad.

        Raises:
            NotRunError: Somebody does not know where he is.
        """
        seen = self.need_fix()
        x, y = seen.position
        if self.table:
            way = seen.heading + bearing
            self._place((x + distance * math.cos(way), y + distance * math.sin(way)))
            self.spend(_PLACE_TIME)
            return
        there = self.second_pose().position
        away = math.atan2(y - there[1], x - there[0])
        left = math.hypot(x - there[0], y - there[1]) - distance
        back = int(MoveOption.BACKWARD) if left < 0 else 0
        self.moved(self.move(away if left < 0 else away + math.pi, abs(left), face=away + math.pi - bearing, options=back))

    def _place(self, position: tuple[float, float]) -> None:
        """Have the table put the second robot somewhere.

        Raises:
            NotRunError: The table does not do it.
        """
        self._placings += 1
        message = TablePlace(
            self.session, self._placings, position, 0.0, table_system(self.wire), TABLE_COMPONENT, self.second or 0
        )
        for _ in range(TRIES):
            start = len(self.beside)
            self.send(message)
            end = self.now() + PATIENCE
            while (left := end - self.now()) > 1e-9:
                self.step(left)
                for event in self.beside[start:]:
                    said = event.message
                    if isinstance(said, RobotAck) and (said.message, said.sequence) == (TablePlace.ID, message.sequence):
                        if said.reason != Reason.NONE:
                            raise NotRunError(f"the table did not place robot {self.second}: {named(Reason, said.reason)}")
                        return
        raise NotRunError(f"the table did not place robot {self.second}")


def _is_asked(message: SwarmObservation | SwarmRanges) -> bool:
    """It was asked for, and ends no move."""
    return isinstance(message, SwarmRanges) or message.outcome == SwarmOutcome.NONE
