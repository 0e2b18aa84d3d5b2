"""Sensors and wheels as ROS 2 joint states, one topic for each unit: viewers plot them by name without being told how.

sensor_msgs/msg/JointState in CDR, little-endian, as the OMG's DDS-RTPS lays it out: a header of four bytes, numbers aligned
to their size counted from behind that header, text with its length and a closing NUL.
"""

from __future__ import annotations

from math import nan
from struct import Struct
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from firmware_protocol.messages import JuniorSensors

JOINT_STATE: Final = "sensor_msgs/msg/JointState"
DEFINITION: Final = b"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
PLOTS: Final[dict[str, tuple[str, ...]]] = {
    "/junior/plot/eyes": ("eye_left", "eye_right"),
    "/junior/plot/floor": ("floor_left", "floor_right"),
    "/junior/plot/wheels": ("wheel_left", "wheel_right"),
    "/junior/plot/battery": ("battery",),
}
"""Topics, and the names in them. Positions are eyes and floor sensors in ADC counts, wheels in m travelled since boot, the
battery in V; of the wheels there are velocities, in m/s."""
INTERVAL: Final = 0.2
"""Log time between joint states, in s."""
BATTERY_INTERVAL: Final = 1.0
"""Likewise of the battery."""
_BEFORE: Final = b"\0\1\0\0"


def _text(text: str) -> bytes:
    raw = text.encode() + b"\0"
    padding = b"\0" * (-len(raw) % 4)
    return Struct("<I").pack(len(raw)) + raw + padding


class _Layout:
    """How a joint state of some names is packed: positions, and velocities where there are any; no efforts."""

    def __init__(self, names: tuple[str, ...], *, moving: bool) -> None:
        count = Struct("<I").pack(len(names))
        named = _text("") + count + b"".join(map(_text, names)) + count
        self._middle = named + b"\0" * (-(8 + len(named)) % 8)
        speeds = f"I4x{len(names)}d" if moving else "I"
        self._speeds = (len(names),) if moving else (0,)
        self._struct = Struct(f"<4siI{len(self._middle)}s{len(names)}d{speeds}I")

    def pack(self, time: float, positions: tuple[float, ...], velocities: tuple[float, ...] = ()) -> bytes:
        seconds, nanoseconds = divmod(round(time * 1e9), 1_000_000_000)
        head = _BEFORE, seconds, nanoseconds, self._middle
        return self._struct.pack(*head, *positions, *self._speeds, *velocities, 0)


_EYES, _FLOOR, _WHEELS, _BATTERY = PLOTS
_LAYOUTS: Final = {topic: _Layout(names, moving=topic == _WHEELS) for topic, names in PLOTS.items()}


class JointPlots:
    """What of a robot's readings is to be plotted when."""

    def __init__(self) -> None:
        self._plotted_at = -INTERVAL
        self._battery_at = -BATTERY_INTERVAL
        self._before: JuniorSensors | None = None

    def due(self, time: float, sensors: JuniorSensors) -> list[tuple[str, bytes]]:
        """The joint states that are due.

        Args:
            time: Log time in s.
            sensors: What the robot sensed.

        Returns:
            Topics and joint states.
        """
        if time - self._plotted_at < INTERVAL - 1e-6:
            return []
        self._plotted_at = time
        speeds, self._before = self._speeds(sensors), sensors
        found = [
            (_EYES, _LAYOUTS[_EYES].pack(time, sensors.eye)),
            (_FLOOR, _LAYOUTS[_FLOOR].pack(time, sensors.floor)),
            (_WHEELS, _LAYOUTS[_WHEELS].pack(time, sensors.travel, speeds)),
        ]
        if time - self._battery_at >= BATTERY_INTERVAL - 1e-6:
            self._battery_at = time
            found.append((_BATTERY, _LAYOUTS[_BATTERY].pack(time, (sensors.battery,))))
        return found

    def _speeds(self, sensors: JuniorSensors) -> tuple[float, ...]:
        """Speeds of the wheels since the reading before, in m/s; NaN where there is none, or the robot has been restarted."""
        before = self._before
        if before is None or sensors.time <= before.time:
            return (nan,) * len(sensors.travel)
        took = sensors.time - before.time
        return tuple((now - then) / took for now, then in zip(sensors.travel, before.travel, strict=True))
