"""What robots of one network say all the time: of each, when it was heard and what it said last. No I/O, no clock.

Plain lists with an item for each system id: what is looked at one by one is looked at sooner so than in arrays.
"""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.messages import Heartbeat, RobotStatus, SysStatus
from firmware_protocol.wire.rows import Rows, column

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.wire.fields import Message

SYSTEMS: Final = 256
"""Items of the lists: one for each system id."""
NEVER_HEARD: Final = float("-inf")

_CLOCK_SLACK: Final = 1.0
"""A robot's clock that goes back further than this has restarted, in s."""
_FIELDS: Final[dict[type[Message], tuple[str, ...]]] = {
    Heartbeat: ("base_mode", "custom_mode", "system_status"),
    SysStatus: ("onboard_control_sensors_health", "voltage_battery"),
    RobotStatus: ("boot_count", "time", "session"),
}
"""What is looked at of each."""
STEADY: Final = frozenset(_FIELDS)
"""The messages."""


class SteadyMessages:
    """What was heard of each robot.

    Attributes:
        heard: When each was heard last, in s.
        good: Frames heard of each.
        lost: Frames of each that are missing by their numbers.
        late: Frames of each that came after a later one, or twice.
        health: What each said of its parts last (SYS_STATUS.onboard_control_sensors_health); None before.
        voltage: Of its battery, in mV; None before.
    """

    def __init__(self) -> None:
        self.heard = [NEVER_HEARD] * SYSTEMS
        self.good, self.lost, self.late = ([0] * SYSTEMS for _ in range(3))
        self.health: list[int | None] = [None] * SYSTEMS
        self.voltage: list[int | None] = [None] * SYSTEMS
        self._frame: list[int | None] = [None] * SYSTEMS
        self._beat: list[tuple[int, int, int] | None] = [None] * SYSTEMS
        self._life: list[tuple[int, float] | None] = [None] * SYSTEMS
        self._notes: dict[type[Message], tuple[Callable[..., bool], Callable[[Any], tuple[Any, ...]]]] = {
            Heartbeat: (self._note_heartbeat, attrgetter(*_FIELDS[Heartbeat])),
            SysStatus: (self._note_health, attrgetter(*_FIELDS[SysStatus])),
            RobotStatus: (self._note_life, attrgetter(*_FIELDS[RobotStatus])),
        }

    def count(self, system: int, frame: int, time: float) -> None:
        """A frame has come.

        Args:
            system: System id of the robot.
            frame: Its frame sequence number, 0..255.
            time: When, in s.
        """
        self.heard[system] = time
        self.good[system] += 1
        before = self._frame[system]
        if before is not None and (step := (frame - before) & 255) != 1:
            if not 0 < step < 128:
                self.late[system] += 1
                self.lost[system] = max(0, self.lost[system] - (step != 0))
                return
            self.lost[system] += step - 1
        self._frame[system] = frame

    def note(self, kind: type[Message], system: int, message: Message) -> bool:
        """Take a message down.

        Args:
            kind: Its class, one of `STEADY`.
            system: System id of the robot.
            message: The message.

        Returns:
            It is news: not as the one before.
        """
        note, values = self._notes[kind]
        return note(system, *values(message))

    def note_rows(self, kind: type[Message], systems: Sequence[int], rows: Rows) -> list[bool]:
        """Take many messages down, in their order.

        Args:
            kind: Their class, one of `STEADY`.
            systems: System ids of the robots.
            rows: The messages.

        Returns:
            Which are news.
        """
        note = self._notes[kind][0]
        columns = [column(kind, rows, name).tolist() for name in _FIELDS[kind]]
        return [note(*values) for values in zip(systems, *columns, strict=True)]

    def forget(self, system: int) -> None:
        """What a robot says next is news, and its frames are counted anew: it has restarted, or its link was gone.

        Args:
            system: Its system id.
        """
        self._frame[system] = self._beat[system] = self._life[system] = None

    def _note_heartbeat(self, system: int, *said: int) -> bool:
        if said == self._beat[system]:
            return False
        self._beat[system] = (said[0], said[1], said[2])
        return True

    def _note_health(self, system: int, health: int, voltage: int) -> bool:
        self.health[system], self.voltage[system] = health, voltage
        return False

    def _note_life(self, system: int, boots: int, time: float, session: int) -> bool:
        del session
        before = self._life[system]
        self._life[system] = boots, time
        return before is None or before[0] != boots or time < before[1] - _CLOCK_SLACK
