"""What the robot says by itself, how often, and that it is true."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    CommandResult,
    Heartbeat,
    JuniorSensors,
    ParamValue,
    RobotStatus,
    SensorFlag,
    SysStatus,
)
from hil.conformance.orders import named
from hil.conformance.probe import QUIET, TRIES
from hil.conformance.registry import Group, NotRunError, given, require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.conformance.subject import Subject

GROUP: Final = Group("streams and sensors")
_ADC: Final = 1023


def _intervals(messages: Sequence[JuniorSensors | RobotStatus]) -> list[float]:
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


@GROUP.check("status-once-a-second", rule="ROBOT_STATUS")
def status_rate(robot: Subject) -> str:
    """ROBOT_STATUS and SYS_STATUS come once a second."""
    robot.spend(3.3)
    gaps = _intervals(robot.got(RobotStatus))
    require(
        len(gaps) >= 2 and all(0.95 <= gap <= 1.05 for gap in gaps), f"ROBOT_STATUS after {[round(gap, 3) for gap in gaps]} s"
    )
    count = len(robot.got(SysStatus))
    require(count in {3, 4}, f"{count} times SYS_STATUS in 3.3 s")
    return "both once a second"


@GROUP.check("interval-obeyed", rule="COMMAND_LONG", needs=("sensors-50-hz",))
def interval(robot: Subject) -> str:
    """SET_MESSAGE_INTERVAL sets the interval of a stream, stops it, and gives its default back."""

    def count(microseconds: float, seconds: float) -> int:
        robot.order(Command.SET_MESSAGE_INTERVAL, JuniorSensors.ID, microseconds)
        robot.spend(0.1)
        robot.forget()
        robot.spend(seconds)
        return len(robot.got(JuniorSensors))

    for microseconds, seconds, least, most in ((100_000, 1.0, 9, 11), (-1, 0.3, 0, 0), (0, 0.5, 23, 27)):
        found = count(microseconds, seconds)
        require(least <= found <= most, f"{found} times JUNIOR_SENSORS in {seconds:g} s at an interval of {microseconds} us")
    result = robot.command(Command.SET_MESSAGE_INTERVAL, ParamValue.ID, 100_000)
    require(result == CommandResult.UNSUPPORTED, "an interval for PARAM_VALUE is not UNSUPPORTED")
    return "100 ms, never, default"


@GROUP.check("streams-set-again", rule="Being found", needs=("interval-obeyed",))
def set_again(robot: Subject) -> str:
    """A stream that another program has switched off is switched on again by SET_MESSAGE_INTERVAL."""
    robot.need_sources()

    def count(kind: type[JuniorSensors | RobotStatus], seconds: float) -> int:
        robot.spend(QUIET)
        robot.forget()
        robot.spend(seconds)
        return len(robot.got(kind))

    for kind, seconds in ((JuniorSensors, 0.5), (RobotStatus, 1.5)):
        off = CommandLong(robot.system, ROBOT_COMPONENT, Command.SET_MESSAGE_INTERVAL, 0, kind.ID, -1.0)
        try:
            for _ in range(TRIES):
                robot.send_as(robot.strangers[1], off)
                if (found := count(kind, seconds)) == 0:
                    break
            require(found == 0, f"{kind.NAME} still came when another program had switched it off")
            robot.order(Command.SET_MESSAGE_INTERVAL, kind.ID, 0)
            require(count(kind, seconds) > 0, f"{kind.NAME} did not come when it was switched on again")
        finally:
            robot.command(Command.SET_MESSAGE_INTERVAL, kind.ID, 0)
    return "JUNIOR_SENSORS, ROBOT_STATUS"


@GROUP.check("heartbeat-stays", rule="Being found")
def heartbeat_stays(robot: Subject) -> str:
    """HEARTBEAT is not switched off, nor made rarer than every 5 s: a robot must remain findable."""

    def ask(interval: float) -> int | None:
        return robot.command(Command.SET_MESSAGE_INTERVAL, Heartbeat.ID, interval * 1e6 if interval > 0 else interval)

    def word(result: int | None) -> str:
        return "nothing" if result is None else named(CommandResult, result)

    try:
        for wanted in (-1.0, 5.1, 60.0):
            result = ask(wanted)
            require(result == CommandResult.DENIED, f"an interval of {wanted:g} s was answered by {word(result)}")
        robot.forget()
        robot.spend(1.3)
        require(robot.got(Heartbeat), "HEARTBEAT did not come within 1.3 s")
        result = ask(5.0)
        require(result == CommandResult.ACCEPTED, f"an interval of 5 s was answered by {word(result)}")
    finally:
        ask(0.0)
    return "never, 5.1 s and 60 s denied, 5 s taken"


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
