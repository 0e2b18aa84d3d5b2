"""Sensors and wheels as ROS 2 joint states, which viewers plot by name without being told how (log time, name, value).

sensor_msgs/msg/JointState in CDR, little-endian, as the OMG's DDS-RTPS lays it out: a header of four bytes, numbers aligned
to their size counted from behind that header, text with its length and a closing NUL.
"""

from __future__ import annotations

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
NAMES: Final = ("eye_left", "eye_right", "floor_left", "floor_right", "wheel_left", "wheel_right")
"""Eyes and floor sensors in ADC counts, wheels in m travelled."""


def _text(text: str) -> bytes:
    raw = text.encode() + b"\0"
    padding = b"\0" * (-len(raw) % 4)
    return Struct("<I").pack(len(raw)) + raw + padding


_COUNT: Final = Struct("<I").pack(len(NAMES))
_BEFORE: Final = b"\0\1\0\0"
_NAMED: Final = _text("") + _COUNT + b"".join(map(_text, NAMES)) + _COUNT
_MIDDLE: Final = _NAMED + b"\0" * (-(8 + len(_NAMED)) % 8)
_LAYOUT: Final = Struct(f"<4siI{len(_MIDDLE)}s{len(NAMES)}dII")


def encode_joints(time: float, sensors: JuniorSensors) -> bytes:
    """A joint state with the sensors' readings as positions.

    Args:
        time: Log time in s.
        sensors: What the robot sensed.
    """
    seconds, nanoseconds = divmod(round(time * 1e9), 1_000_000_000)
    return _LAYOUT.pack(_BEFORE, seconds, nanoseconds, _MIDDLE, *sensors.eye, *sensors.floor, *sensors.travel, 0, 0)
