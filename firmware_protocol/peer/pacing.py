"""How much a robot may say on a slow line, and which line is too slow for any. No I/O, no clock.

The rule: what goes by itself takes half of the line at most, each way; the other half is for questions and answers. A robot
that is switched on says more than that at 38,400 baud or less, so the host asks it for less at the handshake.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import Heartbeat, JuniorSensors, RefereeState, RobotAlive, RobotStatus, SysStatus, Timesync
from firmware_protocol.peer.exchange import Retry
from firmware_protocol.peer.peer import HEARTBEAT_PERIOD, KEEP_ALIVE, TIMESYNC_PERIOD
from firmware_protocol.peer.streams import JUNIOR_STREAMS
from firmware_protocol.wire.mavlink_layout import CHECKSUM_LENGTH, HEADER_LENGTH, SIGNATURE_LENGTH
from firmware_protocol.wire.payload import PAYLOADS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from firmware_protocol.wire.fields import Message

BITS_PER_BYTE: Final = 10
"""On a serial line: start bit, eight data bits, stop bit."""
SHARE: Final = 0.5
"""What goes by itself takes this share of the line at most, each way."""
SLOWEST_SENSORS: Final = 0.2
"""A robot that is seen less often than this is not worth driving, in s."""
SLOW_SYS_STATUS: Final = 10.0
"""Interval of SYS_STATUS, which a host does without, on a slow line, in s."""
SLOW_REFEREE: Final = 0.4
"""Interval of a referee's reports on a slow line, in s; what it decides it tells at once all the same."""
ROBOT_DEFAULTS: Final[Mapping[type[Message], float]] = {Heartbeat: 1.0, SysStatus: 1.0, **JUNIOR_STREAMS}
"""What a robot says by itself when it is switched on, and the intervals in s (`core/stream.c`)."""
SPARED: Final[Mapping[type[Message], float]] = {
    Heartbeat: 1.0,
    RobotStatus: JUNIOR_STREAMS[RobotStatus],
    SysStatus: SLOW_SYS_STATUS,
    Timesync: TIMESYNC_PERIOD,
    RefereeState: SLOW_REFEREE,
}
"""What it says on a slow line beside its sensors, with a referee's reports."""
_TICK: Final = 0.005
"""A robot's control period, in s: intervals are whole multiples."""
_HUNDREDS: Final = 100
_QUESTION_AND_ANSWER: Final = 240
"""Bytes that may have to pass before a question is answered: itself, what the robot is saying, the answer."""


@dataclass(frozen=True)
class Pace:
    """What is asked of a robot on a slow line.

    Attributes:
        capacity: What the line carries each way, in bytes/s.
        demand: What the robot says by itself when it is switched on, in bytes/s.
        streams: What the host needs, and the intervals in s.
        sys_status: Interval of SYS_STATUS, in s.
        referee: Interval of a referee's reports, in s.
        retry: When a question is asked again.
    """

    capacity: float
    demand: float
    streams: Mapping[type[Message], float]
    sys_status: float
    referee: float
    retry: Retry

    @property
    def text(self) -> str:
        """What is done, in words."""
        usual, now = JUNIOR_STREAMS[JuniorSensors], self.streams[JuniorSensors]
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


def least_capacity(*, signed: bool) -> float:
    """The slowest line on which a robot can be driven, in bytes/s each way.

    Args:
        signed: Frames are signed.
    """
    up = bytes_per_second({**SPARED, JuniorSensors: SLOWEST_SENSORS}, signed=signed)
    down = {RobotAlive: KEEP_ALIVE, Heartbeat: HEARTBEAT_PERIOD, Timesync: TIMESYNC_PERIOD}
    return max(up, bytes_per_second(down, signed=signed)) / SHARE


def full_capacity(*, signed: bool) -> float:
    """The slowest line on which a robot need not be asked for less than it says by itself, in bytes/s each way.

    Args:
        signed: Frames are signed.
    """
    return bytes_per_second(ROBOT_DEFAULTS, signed=signed) / SHARE


def baud_of(capacity: float) -> int:
    """The rate of a serial line that carries so many bytes a second, in bit/s, rounded up to hundreds.

    Args:
        capacity: In bytes/s.
    """
    return ceil(capacity * BITS_PER_BYTE / _HUNDREDS) * _HUNDREDS


def pace_for(capacity: float, *, signed: bool) -> Pace | None:
    """What to ask of a robot on a line.

    Args:
        capacity: What the line carries each way, in bytes/s; at least `least_capacity`.
        signed: Frames are signed.

    Returns:
        The pace; None where the line carries all that a robot says, and need not be spared.
    """
    if capacity >= full_capacity(signed=signed):
        return None
    left = capacity * SHARE - bytes_per_second(SPARED, signed=signed)
    periods = ceil(frame_length(JuniorSensors, signed=signed) / max(left, 1.0) / _TICK)
    usual, passing = Retry(), _QUESTION_AND_ANSWER / capacity
    wait = usual.first + passing
    return Pace(
        capacity=capacity,
        demand=bytes_per_second(ROBOT_DEFAULTS, signed=signed),
        streams={**JUNIOR_STREAMS, JuniorSensors: max(periods * _TICK, JUNIOR_STREAMS[JuniorSensors])},
        sys_status=SLOW_SYS_STATUS,
        referee=SLOW_REFEREE,
        retry=Retry(first=wait, longest=max(usual.longest, 2 * wait), hold=usual.hold + passing),
    )
