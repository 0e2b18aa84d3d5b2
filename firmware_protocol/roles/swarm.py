"""What one can ask of a micro-robot, and what it brings. Each returns a ticket at once; the answer comes with time."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Final, TypeVar

from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    RobotAck,
    RobotStatus,
    SwarmFix,
    SwarmMove,
    SwarmObservation,
    SwarmRanges,
    SwarmSense,
)
from firmware_protocol.messages.swarm import LONG_RANGE
from firmware_protocol.peer.exchanges.commands import NumberedExchange, RequestExchange
from firmware_protocol.peer.exchanges.performing import PerformExchange
from firmware_protocol.peer.role import Role
from firmware_protocol.vocabulary import MoveOption, SwarmOutcome

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.events import Received
    from firmware_protocol.peer.exchanges.commands import Numbering
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.vocabulary import Move
    from firmware_protocol.wire.fields import Message

S = TypeVar("S", bound="SwarmObservation | SwarmRanges")


def ends_a_move(observation: SwarmObservation) -> bool:
    """Whether it says how a move ended; else it was asked for."""
    return observation.outcome != SwarmOutcome.NONE


MICRO_ROBOT: Final = Role(
    name="micro-robot",
    product=2,
    readings=RobotStatus,
    streams={RobotStatus: 1.0},
    slowest=5.0,
    results=frozenset({SwarmObservation}),
    is_result=ends_a_move,
)
"""One robot of a swarm. What it senses it says when it was asked, or has moved: no stream of it is needed."""

_END: Final = 1.0
"""What a move is given beyond its planned time, in s."""


def longest_time(move: Move, move_speed: float, turn_speed: float) -> float:
    """Longest time that a move may take: the robot ends it then (TIMED_OUT).

    Args:
        move: The move; it is taken to turn by half a turn where it turns at all.
        move_speed: The robot's MOVE_SPEED, in m/s.
        turn_speed: Its TURN_SPEED, in rad/s.

    Returns:
        In s: twice the planned time and 1 s, with PUSH three times.
    """
    turns = 1 if move.face is None else 2
    planned = turns * pi / turn_speed + move.distance / (move.speed or move_speed)
    return (3 if move.options & MoveOption.PUSH else 2) * planned + _END


def move(peer: Peer, what: Move, longest: float) -> Ticket[SwarmObservation]:
    """Have it move; it replaces a move under way.

    Args:
        peer: The robot.
        what: The move.
        longest: How long it may take, in s: `longest_time`.

    Returns:
        A ticket for the observation that ends the move, whatever ended it; it fails where the move was refused at once.
    """
    message = SwarmMove(
        0, 0, what.heading, what.distance, what.face, what.speed, peer.system, ROBOT_COMPONENT,
        what.sector, what.sectors, what.effort, what.options,
    )  # fmt: skip
    return peer.ask(MoveExchange(message, peer.numbering, longest), MICRO_ROBOT)


def sense(
    peer: Peer, radius: float, increment: float = 0.0, limit: float = LONG_RANGE, *, sectors: int = 8, ranges: int = 0
) -> Ticket[RobotAck]:
    """Say how its ring is read from now on, until it restarts.

    Args:
        peer: The robot.
        radius: Least radius R0, in m; `LONG_RANGE` sees all.
        increment: By which it grows until a robot of the other class is inside, in m; 0: it does not.
        limit: Greatest radius, in m; `LONG_RANGE`: none.
        sectors: How many sectors, 1 to 16.
        ranges: In how many directions ranges are measured, 0 to 32.
    """
    message = SwarmSense(0, 0, radius, increment, limit, peer.system, ROBOT_COMPONENT, sectors, ranges)
    return peer.ask(NumberedExchange("how to sense", message, peer.numbering), MICRO_ROBOT)


def observe(peer: Peer) -> Ticket[SwarmObservation]:
    """Have it read its ring and say what it observes. A robot that is only watched answers, too."""
    return peer.ask(AskExchange(SwarmObservation, peer), MICRO_ROBOT)


def measure_ranges(peer: Peer) -> Ticket[SwarmRanges]:
    """Have it measure ranges round about."""
    return peer.ask(AskExchange(SwarmRanges, peer), MICRO_ROBOT)


def ask_everybody(kind: type[SwarmObservation | SwarmRanges], count: int, host: int) -> CommandLong:
    """The request for an observation of every robot of a network at once: the messages alone answer it.

    Args:
        kind: What is wanted.
        count: Count of the asking, 1..65535: it comes back as the answers' sequence.
        host: Number of the host whose session is open with them; 0: somebody who watches.
    """
    return _request(0, kind, count, host)


def fix(peer: Peer, position: tuple[float, float], heading: float, age: float) -> bool:
    """Tell it where it is. It is not answered.

    Args:
        peer: The robot.
        position: Of its centre, x and y, in m.
        heading: Of its nose, in rad.
        age: How old that is, in s.

    Returns:
        False where it was not told, since no session is open.
    """
    if peer.session is None:
        return False
    peer.tell(SwarmFix(peer.session, position, heading, age, peer.system, ROBOT_COMPONENT))
    return True


def _request(system: int, kind: type[Message], count: int, host: int) -> CommandLong:
    return CommandLong(
        system, ROBOT_COMPONENT, Command.REQUEST_MESSAGE, param1=float(kind.ID), param2=float(count), param3=float(host)
    )


class MoveExchange(PerformExchange[SwarmObservation]):
    """SWARM_MOVE: accepted first, then performed, then SWARM_OBSERVATION.

    Args:
        message: The move.
        numbering: Gives session and sequence.
        longest: How long it may take, in s.
    """

    def __init__(self, message: SwarmMove, numbering: Numbering, longest: float) -> None:
        super().__init__("the move", message, numbering, SwarmObservation, longest)

    def ended(self, result: SwarmObservation) -> bool:
        """Take it if it ends a move; one that was asked for may have the same number."""
        return ends_a_move(result) and super().ended(result)


class AskExchange(RequestExchange[S]):
    """REQUEST_MESSAGE with a count, which the answer names: so an older answer is never taken for it.

    Args:
        kind: What is wanted.
        peer: The robot.
    """

    def __init__(self, kind: type[S], peer: Peer) -> None:
        super().__init__(kind, peer.system, ROBOT_COMPONENT, need_ack=False)
        self._peer = peer
        self._count = 0

    def messages(self) -> Sequence[Message]:
        """The request, counted at the first call."""
        if not self._count:
            self._count = self._peer.numbering.take_asking()
            self._command = _request(self._peer.system, self._wanted, self._count, self._peer.host)
        return super().messages()

    def answer(self, received: Received) -> bool:
        """Take the message with our count, or a refusal."""
        message = received.message
        if isinstance(message, SwarmObservation | SwarmRanges):
            asked = message.sequence == self._count and (isinstance(message, SwarmRanges) or not ends_a_move(message))
            return asked and super().answer(received)
        return super().answer(received)
