"""How much a robot may say on a slow line, and which line is too slow for any. No I/O, no clock.

The rule: what goes by itself takes half of the line at most, each way; the other half is for questions and answers. A robot
that is switched on says more than that at 38,400 baud or less, so the host asks it for less at the handshake.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import Heartbeat, RobotAlive, SysStatus, Timesync
from firmware_protocol.peer.exchanges.exchange import Retry
from firmware_protocol.peer.timing import HEARTBEAT_PERIOD, KEEP_ALIVE, TIMESYNC_PERIOD
from firmware_protocol.wire.mavlink_layout import CHECKSUM_LENGTH, HEADER_LENGTH, SIGNATURE_LENGTH
from firmware_protocol.wire.payload import PAYLOADS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.fields import Message

BITS_PER_BYTE: Final = 10
"""On a serial line: start bit, eight data bits, stop bit."""
SHARE: Final = 0.5
"""What goes by itself takes this share of the line at most, each way."""
SLOW_SYS_STATUS: Final = 10.0
"""Interval of SYS_STATUS, which a host does without, on a slow line, in s."""
_TICK: Final = 0.005
"""A robot's control period, in s: intervals are whole multiples."""
_HUNDREDS: Final = 100
_QUESTION_AND_ANSWER: Final = 240
"""Bytes that may have to pass before a question is answered: itself, what the robot is saying, the answer."""


@dataclass(frozen=True)
class Pace:
    """What is asked of a robot on a slow line.

    Attributes:
        role: What kind of robot it is for.
        capacity: What the line carries each way, in bytes/s.
        demand: What the robot says by itself when it is switched on, in bytes/s.
        streams: What the host needs, and the intervals in s.
        sys_status: Interval of SYS_STATUS, in s.
        retry: When a question is asked again.
    """

    role: Role
    capacity: float
    demand: float
    streams: Mapping[type[Message], float]
    sys_status: float
    retry: Retry

    @property
    def text(self) -> str:
        """What is done, in words."""
        readings = self.role.readings
        usual, now = self.role.streams[readings], self.streams[readings]
        return (
            f"the line carries {self.capacity:,.0f} bytes a second, and a robot says {self.demand:,.0f} by itself: it is asked "
            f"for sensor readings every {now * 1e3:.0f} ms, not {usual * 1e3:.0f}, and for SYS_STATUS every "
            f"{self.sys_status:.0f} s"
        )


def frame_length(message: type[Message], *, signed: bool) -> int:
    """Most bytes that a message takes on a MAVLink line.

    Args:
        message: Its class.
        signed: It is signed.
    """
    return HEADER_LENGTH + PAYLOADS[message.ID].length + CHECKSUM_LENGTH + SIGNATURE_LENGTH * signed


def bytes_per_second(streams: Mapping[type[Message], float], *, signed: bool) -> float:
    """Most bytes a second that messages take which are sent at intervals.

    Args:
        streams: Messages, and their intervals in s.
        signed: They are signed.
    """
    return sum(frame_length(message, signed=signed) / interval for message, interval in streams.items())


def by_itself(role: Role) -> dict[type[Message], float]:
    """What a robot says by itself when it is switched on, and the intervals in s (`core/stream.c`).

    Args:
        role: What kind of robot it is.
    """
    found: dict[type[Message], float] = {Heartbeat: 1.0, SysStatus: 1.0}
    return found | dict(role.streams)


def spared(role: Role) -> dict[type[Message], float]:
    """What it says on a slow line beside its readings, with what is beside it, and the intervals in s.

    Args:
        role: What kind of robot it is.
    """
    found = by_itself(role) | {SysStatus: SLOW_SYS_STATUS, Timesync: TIMESYNC_PERIOD}
    del found[role.readings]
    for slow in role.companions.values():
        found |= slow
    return found


def least_capacity(role: Role, *, signed: bool) -> float:
    """The slowest line on which a robot can be driven, in bytes/s each way.

    Args:
        role: What kind of robot it is.
        signed: Frames are signed.
    """
    up = bytes_per_second({**spared(role), role.readings: role.slowest}, signed=signed)
    down = {RobotAlive: KEEP_ALIVE, Heartbeat: HEARTBEAT_PERIOD, Timesync: TIMESYNC_PERIOD}
    return max(up, bytes_per_second(down, signed=signed)) / SHARE


def full_capacity(role: Role, *, signed: bool) -> float:
    """The slowest line on which a robot need not be asked for less than it says by itself, in bytes/s each way.

    Args:
        role: What kind of robot it is.
        signed: Frames are signed.
    """
    return bytes_per_second(by_itself(role), signed=signed) / SHARE


def baud_of(capacity: float) -> int:
    """The rate of a serial line that carries so many bytes a second, in bit/s, rounded up to hundreds.

    Args:
        capacity: In bytes/s.
    """
    return ceil(capacity * BITS_PER_BYTE / _HUNDREDS) * _HUNDREDS


def pace_for(role: Role, capacity: float, *, signed: bool) -> Pace | None:
    """What to ask of a robot on a line.

    Args:
        role: What kind of robot it is.
        capacity: What the line carries each way, in bytes/s; at least `least_capacity`.
        signed: Frames are signed.

    Returns:
        The pace; None where the line carries all that a robot says, and need not be spared.
    """
    if capacity >= full_capacity(role, signed=signed):
        return None
    left = capacity * SHARE - bytes_per_second(spared(role), signed=signed)
    periods = ceil(frame_length(role.readings, signed=signed) / max(left, 1.0) / _TICK)
    usual, passing = Retry(), _QUESTION_AND_ANSWER / capacity
    wait = usual.first + passing
    return Pace(
        role=role,
        capacity=capacity,
        demand=bytes_per_second(by_itself(role), signed=signed),
        streams={**role.streams, role.readings: max(periods * _TICK, role.streams[role.readings])},
        sys_status=SLOW_SYS_STATUS,
        retry=Retry(first=wait, longest=max(usual.longest, 2 * wait), hold=usual.hold + passing),
    )
