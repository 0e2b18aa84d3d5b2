"""Failures that a robot rehearses when it is told to: MAVLink's MAV_CMD_INJECT_FAILURE (420).

The command's first parameter is the unit, the second how it fails, the third which one of its kind (0 is all). The numbers
are MAVLink's; which of Junior's parts bear which number is decided here, and in the firmware's `failure.c`. A robot obeys
only while its parameter FAIL_ENABLE is 1, and forgets all failures when that is set to 0, and when it restarts.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final


class FailureUnit(IntEnum):
    """What may fail (FAILURE_UNIT): the units that Junior has."""

    SENSOR_DISTANCE_SENSOR = 7
    SYSTEM_BATTERY = 100
    SYSTEM_MOTOR = 101
    SYSTEM_MAVLINK_SIGNAL = 105


class FailureType(IntEnum):
    """How it fails (FAILURE_TYPE); OK ends a failure."""

    OK = 0
    OFF = 1
    STUCK = 2
    GARBAGE = 3
    WRONG = 4
    SLOW = 5
    DELAYED = 6
    INTERMITTENT = 7


_SENSOR: Final = frozenset({FailureType.OK, FailureType.OFF, FailureType.STUCK, FailureType.GARBAGE})
FAILURES: Final[dict[FailureUnit, frozenset[FailureType]]] = {
    FailureUnit.SENSOR_DISTANCE_SENSOR: _SENSOR,
    FailureUnit.SYSTEM_BATTERY: _SENSOR,
    FailureUnit.SYSTEM_MOTOR: frozenset({FailureType.OK, FailureType.OFF, FailureType.SLOW}),
    FailureUnit.SYSTEM_MAVLINK_SIGNAL: frozenset({FailureType.OK, FailureType.OFF}),
}
"""The types that Junior's firmware knows of each unit."""
INSTANCES: Final[dict[FailureUnit, tuple[str, ...]]] = {
    FailureUnit.SENSOR_DISTANCE_SENSOR: ("eye_left", "eye_right", "floor_left", "floor_right", "arm_left", "arm_right"),
    FailureUnit.SYSTEM_BATTERY: ("battery",),
    FailureUnit.SYSTEM_MOTOR: ("wheel_left", "wheel_right"),
    FailureUnit.SYSTEM_MAVLINK_SIGNAL: ("host",),
}
"""The instances of each unit, from 1."""


def failing_part(name: str) -> tuple[FailureUnit, int]:
    """Unit and instance of a part of the robot.

    Args:
        name: As `eye_left`, `wheel_right`, `battery`, `host`.

    Raises:
        ValueError: There is none of this name.
    """
    for unit, names in INSTANCES.items():
        if name in names:
            return unit, names.index(name) + 1
    known = ", ".join(part for names in INSTANCES.values() for part in names)
    raise ValueError(f"there is no part {name!r} that can fail: known are {known}")


def failure_in_words(unit: float, how: float, instance: float) -> str:
    """What a command asks for.

    Args:
        unit: Its first parameter.
        how: Its second.
        instance: Its third.

    Returns:
        For instance `wheel_left off`, or `wheel_left` where it is to be well again; numbers where Junior has no such part.
    """
    names = next((INSTANCES[known] for known in FailureUnit if known == unit), ())
    part = "every " + f"unit {unit:g}" if instance == 0 else f"unit {unit:g} number {instance:g}"
    if names and instance == 0:
        part = " and ".join(names)
    elif instance in range(1, len(names) + 1):
        part = names[int(instance) - 1]
    if how == FailureType.OK:
        return part
    return f"{part} {next((known.name.lower() for known in FailureType if known == how), f'{how:g}')}"
