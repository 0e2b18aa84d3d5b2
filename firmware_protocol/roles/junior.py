"""What one can ask of a Junior, and what it brings. Each returns a ticket at once; the answer comes with time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import PeerError
from firmware_protocol.maneuver_fields import ManeuverFields, to_fields
from firmware_protocol.messages import (
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    ContestCommand,
    JuniorContest,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    JuniorMemoryWrite,
    JuniorSensors,
    JuniorWheels,
    RefereeState,
    RobotAck,
    RobotStatus,
    State,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.peer.exchanges.commands import NumberedExchange, reason_in_words
from firmware_protocol.peer.exchanges.performing import PerformExchange
from firmware_protocol.peer.role import Role
from firmware_protocol.vocabulary import ANY_STIMULUS, MAX_ACTIONS, Maneuver, Outcome

if TYPE_CHECKING:
    from firmware_protocol.events import Received
    from firmware_protocol.peer.exchanges.commands import Numbering
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer

SLOW_REFEREE: Final = 0.4
"""Interval of a referee's reports on a slow line, in s; what it decides it tells at once all the same."""

JUNIOR: Final = Role(
    name="Junior",
    product=0,
    readings=JuniorSensors,
    streams={JuniorSensors: 0.02, RobotStatus: 1.0},
    slowest=0.2,
    results=frozenset({JuniorManeuverResult}),
    undisturbed=frozenset({State.COUNTDOWN, State.CONTEST}),
    companions={REFEREE_COMPONENT: {RefereeState: SLOW_REFEREE}},
)
"""The sumo robot."""

_REFLEX_TIMES: Final = ("REFLEX_BACK", "REFLEX_TURN")
LONGEST_REFLEX: Final = sum(parameter.maximum * 1e-3 for parameter in JUNIOR_PARAMETERS if parameter.name in _REFLEX_TIMES)
"""How long the floor reflex may prolong a maneuver, whatever its parameters are set to, in s."""
EMPTY: Final = ManeuverFields(period=0.0, options=0, count=0, actions=(0,) * MAX_ACTIONS)
"""The maneuver of a slot that is erased."""


def perform(peer: Peer, maneuver: Maneuver) -> Ticket[JuniorManeuverResult]:
    """Perform a maneuver; it replaces one that is being performed.

    Args:
        peer: The robot.
        maneuver: What to do.
    """
    message = JuniorManeuver(0, 0, **to_fields(maneuver), target_system=peer.system, target_component=ROBOT_COMPONENT)
    extra = LONGEST_REFLEX if maneuver.floor_reflex else 0.0
    return peer.ask(ManeuverExchange(message, peer.numbering, extra), JUNIOR)


def drive(peer: Peer, left: float, right: float, duration: float) -> Ticket[RobotAck]:
    """Turn the wheels; an earlier drive command that is still unanswered is given up.

    Args:
        peer: The robot.
        left: Left wheel, share of full, -1..1.
        right: Right wheel, likewise.
        duration: The wheels stop after this time, in s.
    """
    message = JuniorWheels(0, 0, (left, right), duration, peer.system, ROBOT_COMPONENT)
    peer.drop(DriveExchange, PeerError("a newer drive command has replaced this one"))
    return peer.ask(DriveExchange("driving", message, peer.numbering), JUNIOR)


def write_memory(peer: Peer, previous: int, current: int, maneuver: Maneuver) -> Ticket[RobotAck]:
    """Store a maneuver on the robot.

    Args:
        peer: The robot.
        previous: Previous stimulus, or `ANY_STIMULUS`.
        current: Present stimulus.
        maneuver: What to perform then.
    """
    return _write(peer, "writing to its memory", previous, current, to_fields(maneuver))


def erase_memory(peer: Peer, previous: int = ANY_STIMULUS, current: int = ANY_STIMULUS) -> Ticket[RobotAck]:
    """Erase one slot, or (by default) all.

    Args:
        peer: The robot.
        previous: Previous stimulus of the slot.
        current: Present stimulus of the slot.
    """
    return _write(peer, "erasing its memory", previous, current, EMPTY)


def read_memory(peer: Peer, index: int = 255, previous: int = ANY_STIMULUS, current: int = 0) -> Ticket[JuniorMemoryEntry]:
    """Read one slot; refused with `Reason.NOT_FOUND` where there is none.

    Args:
        peer: The robot.
        index: Number of the used slot, from 0; 255 looks it up by the two stimuli.
        previous: Previous stimulus.
        current: Present stimulus.
    """
    message = JuniorMemoryRead(0, 0, peer.system, ROBOT_COMPONENT, index, previous, current)
    return peer.ask(MemoryReadExchange("reading its memory", message, peer.numbering), JUNIOR)


def contest(peer: Peer, command: ContestCommand, countdown: float = 5.0) -> Ticket[RobotAck]:
    """Start or stop autonomous play from memory.

    Args:
        peer: The robot.
        command: Start or stop.
        countdown: Time to the first move, in s.
    """
    name = "starting a contest" if command is ContestCommand.START else "stopping the contest"
    message = JuniorContest(0, 0, countdown, peer.system, ROBOT_COMPONENT, command)
    return peer.ask(NumberedExchange(name, message, peer.numbering), JUNIOR)


def _write(peer: Peer, name: str, previous: int, current: int, fields: ManeuverFields) -> Ticket[RobotAck]:
    target = {"target_system": peer.system, "target_component": ROBOT_COMPONENT}
    message = JuniorMemoryWrite(0, 0, **fields, **target, previous=previous, current=current)
    return peer.ask(NumberedExchange(name, message, peer.numbering), JUNIOR)


class DriveExchange(NumberedExchange[RobotAck]):
    """JUNIOR_WHEELS: a newer one makes it pointless.

    Args:
        name: What is asked, in words.
        message: The message.
        numbering: Gives session and sequence.
    """

    def __init__(self, name: str, message: JuniorWheels, numbering: Numbering) -> None:
        super().__init__(name, message, numbering)
        self.urgent = not any(message.speed)


class ManeuverExchange(PerformExchange[JuniorManeuverResult]):
    """JUNIOR_MANEUVER: accepted first, then performed, then JUNIOR_MANEUVER_RESULT.

    Args:
        message: The maneuver.
        numbering: Gives session and sequence.
        extra: How long the floor reflex may prolong it, in s.
    """

    def __init__(self, message: JuniorManeuver, numbering: Numbering, extra: float) -> None:
        duration = message.period * message.count + extra
        super().__init__("the maneuver", message, numbering, JuniorManeuverResult, duration)

    def ended(self, result: JuniorManeuverResult) -> bool:
        """It is over, or was never begun."""
        if result.outcome == Outcome.REFUSED:
            self.refuse(*reason_in_words(result.reason))
        else:
            self.finish(result)
        return True


class MemoryReadExchange(NumberedExchange[JuniorMemoryEntry]):
    """JUNIOR_MEMORY_READ: answered by the entry, or by a refusal."""

    def accepted(self, ack: RobotAck, time: float) -> None:
        """Accepted is not yet answered: the entry is."""

    def answer(self, received: Received) -> bool:
        """Take the entry, or the refusal."""
        message = received.message
        if type(message) is JuniorMemoryEntry and (message.session, message.sequence) == (self.session, self.sequence):
            self.finish(message)
            return True
        return super().answer(received)
