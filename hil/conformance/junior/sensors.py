"""A Junior's sensors: how often they are told, and that what is told is true."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import JuniorSensors, SensorFlag
from firmware_protocol.roles.junior import JUNIOR
from hil.conformance.probe import QUIET
from hil.conformance.registry import Group, NotRunError, given, require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.conformance.subject import Subject

GROUP: Final = Group("sensors", role=JUNIOR.name)
_ADC: Final = 1023


def _intervals(messages: Sequence[JuniorSensors]) -> list[float]:
    """Times between messages by the robot's own clock, in s."""
    return [after.time - before.time for before, after in pairwise(messages)]


def _sensors(robot: Subject) -> JuniorSensors:
    """What is sensed now."""
    robot.spend(0.03)  # two control periods after whatever was set
    return given(robot.requested(JuniorSensors), "JUNIOR_SENSORS was requested and did not come")


def _flag(sensors: JuniorSensors, flag: int) -> bool:
    return bool(sensors.flags & flag)


@GROUP.check("sensors-50-hz", rule="JUNIOR_SENSORS")
def sensors_rate(robot: Subject) -> str:
    """JUNIOR_SENSORS comes 50 times a second."""
    robot.spend(1.0)
    gaps = _intervals(robot.got(JuniorSensors))
    require(len(gaps) >= 40, f"{len(gaps) + 1} in a second")
    mean = sum(gaps) / len(gaps)
    require(0.019 <= mean <= 0.021 and min(gaps) > 0, f"every {mean * 1e3:.1f} ms")
    return f"every {mean * 1e3:.1f} ms"


@GROUP.check("sensors-in-range", rule="JUNIOR_SENSORS")
def in_range(robot: Subject) -> str:
    """Readings are ADC counts, travel and time are since boot, and the battery is measured."""
    robot.spend(0.2)
    readings = robot.got(JuniorSensors)
    require(readings, "no JUNIOR_SENSORS came")
    counts = [count for reading in readings for count in (*reading.eye, *reading.floor)]
    require(max(counts) <= _ADC, f"a reading of {max(counts)} counts")
    require(min(_intervals(readings), default=1.0) > 0, "the time since boot does not go on")
    require(readings[-1].battery > 0, "the battery has no voltage")
    return f"battery {readings[-1].battery:.2f} V"


@GROUP.check("eyes-follow-threshold", rule="EYE_L_ON")
def eyes(robot: Subject) -> str:
    """An eye sees at or above its threshold, and ceases below it by the hysteresis."""
    for name, flag, side in (("EYE_L_ON", SensorFlag.EYE_LEFT, 0), ("EYE_R_ON", SensorFlag.EYE_RIGHT, 1)):
        with robot.parameters(**{name: 0.0}):
            require(_flag(_sensors(robot), flag), f"with {name} at 0 the eye does not see")
        with robot.parameters(**{"EYE_HYST": 0.0, name: float(_ADC)}):
            sensors = _sensors(robot)
            if sensors.eye[side] == _ADC:
                raise NotRunError("an eye is dazzled: it reads 1023")
            require(not _flag(sensors, flag), f"with {name} at {_ADC} the eye sees at {sensors.eye[side]} counts")
    return "both eyes"


@GROUP.check("floor-follows-threshold", rule="FLOOR_INVERT")
def floor(robot: Subject) -> str:
    """A floor sensor is off the ring at or above its threshold, inverted below it."""
    for name, flag in (("FLOOR_L_OFF", SensorFlag.OFF_RING_LEFT), ("FLOOR_R_OFF", SensorFlag.OFF_RING_RIGHT)):
        for inverted in (0.0, 1.0):
            with robot.parameters(**{name: 0.0, "FLOOR_INVERT": inverted}):
                seen = _flag(_sensors(robot), flag)
                require(seen != bool(inverted), f"with {name} at 0 and FLOOR_INVERT at {inverted:g} it is {seen}")
    return "both sensors"


@GROUP.check("standing-does-not-travel", rule="JUNIOR_SENSORS")
def standing(robot: Subject) -> str:
    """A robot that stands does not travel."""
    robot.spend(2 * QUIET)
    travels = [reading.travel for reading in robot.got(JuniorSensors)]
    require(travels, "no JUNIOR_SENSORS came")
    moved = max(abs(now - before) for now, before in zip(travels[-1], travels[0], strict=True))
    require(moved <= 0.002, f"{moved * 1e3:.0f} mm while nothing was commanded")
    return f"{moved * 1e3:.0f} mm"
