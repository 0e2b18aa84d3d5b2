"""What the robot says by itself, and how often."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    Command,
    CommandLong,
    CommandResult,
    Heartbeat,
    ParamValue,
    RobotStatus,
    SysStatus,
)
from hil.conformance.orders import named
from hil.conformance.probe import QUIET, TRIES
from hil.conformance.registry import Group, require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.fields import Message
    from hil.conformance.subject import Subject

GROUP: Final = Group("streams")


def _intervals(messages: Sequence[RobotStatus]) -> list[float]:
    """Times between messages by the robot's own clock, in s."""
    return [after.time - before.time for before, after in pairwise(messages)]


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


@GROUP.check("interval-obeyed", rule="COMMAND_LONG", needs=("sensors-50-hz", "status-once-a-second"))
def interval(robot: Subject) -> str:
    """SET_MESSAGE_INTERVAL sets the interval of a stream, stops it, and gives its default back."""
    kind = robot.examples.stream

    def count(microseconds: float, seconds: float) -> int:
        robot.order(Command.SET_MESSAGE_INTERVAL, kind.ID, microseconds)
        robot.spend(0.1)
        robot.forget()
        robot.spend(seconds)
        return len(robot.got(kind))

    for microseconds, seconds, least, most in ((100_000, 1.0, 9, 11), (-1, 0.3, 0, 0), (0, *robot.examples.usual)):
        found = count(microseconds, seconds)
        require(least <= found <= most, f"{found} times {kind.NAME} in {seconds:g} s at an interval of {microseconds} us")
    result = robot.command(Command.SET_MESSAGE_INTERVAL, ParamValue.ID, 100_000)
    require(result == CommandResult.UNSUPPORTED, "an interval for PARAM_VALUE is not UNSUPPORTED")
    return "100 ms, never, default"


@GROUP.check("streams-set-again", rule="Being found", needs=("interval-obeyed",))
def set_again(robot: Subject) -> str:
    """A stream that another program has switched off is switched on again by SET_MESSAGE_INTERVAL."""
    robot.need_sources()

    def count(kind: type[Message], seconds: float) -> int:
        robot.spend(QUIET)
        robot.forget()
        robot.spend(seconds)
        return len(robot.got(kind))

    kinds: tuple[type[Message], ...] = (*robot.examples.chatter, RobotStatus)
    for kind in kinds:
        seconds = 1.5 if kind is RobotStatus else 0.5
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
    return ", ".join(kind.NAME for kind in kinds)


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
