"""What any robot says and hears, whatever its role: session, alive, acknowledgement, status."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Final

from firmware_protocol.messages.fields import Asker, AskerComponent, Sequence, Session, Target, TargetComponent
from firmware_protocol.wire.fields import Direction, Message, Wire


class State(IntEnum):
    """State of the firmware, as in HEARTBEAT.custom_mode."""

    DISARMED = 0
    READY = 1
    DRIVING = 2
    PERFORMING = 3
    COUNTDOWN = 4
    CONTEST = 5
    STOPPED = 6


class AckResult(IntEnum):
    """Answer to a numbered message."""

    ACCEPTED = 0
    REFUSED = 1


class Reason(IntEnum):
    """Why a command was refused, or a maneuver ended."""

    NONE = 0
    DISARMED = 1
    EMERGENCY_STOP = 2
    WRONG_SESSION = 3
    BAD_VALUE = 4
    BUSY = 5
    MEMORY_FULL = 6
    NOT_FOUND = 7
    WATCHDOG = 8
    BY_COMMAND = 9
    STORAGE_FAILED = 10
    OLD_SEQUENCE = 11
    NO_REFEREE = 12


Host = Annotated[int, Wire("u16", minimum=1, text="Number of the host's program, random per run, never 0")]


@dataclass(frozen=True)
class RobotSession(Message, id=47110, direction=Direction.DOWN, numbered=True):
    """Open a session: the robot stops, disarms, and from now on takes numbered messages of this session only.

    `host` is the number of the program that opens it: by that the host keeps alive what it has armed (ROBOT_ALIVE), and by
    that it says, in `param3` when it arms, whose session it is. An emergency stop stays engaged and a contest goes on. The
    sequence of this message is 0; the same session again is only acknowledged.
    """

    session: Session
    sequence: Sequence
    host: Host
    target_system: Target
    target_component: TargetComponent
    major: Annotated[int, Wire("u8", text="Protocol version of the host")]
    minor: Annotated[int, Wire("u8", text="Likewise, the minor version: the newest that both speak")]


@dataclass(frozen=True)
class RobotResultAck(Message, id=47111, direction=Direction.DOWN):
    """The host has the result of this command: no need to repeat it."""

    session: Session
    sequence: Sequence
    target_system: Target
    target_component: TargetComponent


@dataclass(frozen=True)
class RobotAlive(Message, id=47112, direction=Direction.DOWN):
    """The host is there: every robot that it has armed, and whose session it holds, may go on moving.

    One message for all robots of a network, every 40 ms while one of them is armed. Not numbered, not answered; on CAN a
    single frame.
    """

    host: Host
    target_system: Target = 0
    target_component: TargetComponent = 0


@dataclass(frozen=True)
class RobotAck(Message, id=47108, direction=Direction.UP):
    """The answer to every numbered message."""

    message: Annotated[int, Wire("u16", text="Id of the message answered")]
    session: Session
    sequence: Sequence
    target_system: Asker
    target_component: AskerComponent
    result: Annotated[int, Wire("u8", enum=AckResult, text="Accepted or refused")]
    reason: Annotated[int, Wire("u8", enum=Reason, newer=True, text="Why it was refused")]


@dataclass(frozen=True)
class RobotStatus(Message, id=47109, direction=Direction.UP):
    """Counters of the robot, 1 Hz and on request."""

    time: Annotated[float, Wire("u64", "s", 1e-6, text="Time since boot")]
    maneuvers: Annotated[int, Wire("u32", text="Maneuvers begun since boot")]
    good: Annotated[int, Wire("u32", text="Good frames received")]
    bad_checksum: Annotated[int, Wire("u32", text="Frames with a bad checksum")]
    unknown: Annotated[int, Wire("u32", text="Frames refused by their header: unknown id, impossible length")]
    lost: Annotated[int, Wire("u32", text="Frames missing by their sequence number")]
    boot_count: Annotated[int, Wire("u16", text="Times the robot has started; survives power-off")]
    session: Session
    sequence: Annotated[int, Wire("u16", text="Last numbered message accepted")]
    state: Annotated[int, Wire("u8", enum=State, text="What the robot is doing")]
    not_signed: Annotated[int, Wire("u16", extension=True, text="Frames refused for want of a signature; stops at 65535")] = 0
    bad_signature: Annotated[int, Wire("u16", extension=True, text="Likewise, for a wrong one")] = 0
    replayed: Annotated[int, Wire("u16", extension=True, text="Likewise, for the time in it: replayed, or too old")] = 0


ROBOT_MESSAGES: Final[tuple[type[Message], ...]] = (RobotAck, RobotStatus, RobotSession, RobotResultAck, RobotAlive)
"""What any robot says and hears, whatever its role."""
