"""Who may drive: the keeper, who armed the robot and must be heard; a host by its number, a ground station by its frames."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    ManualControl,
    Reason,
    RobotAlive,
    State,
    Timesync,
)
from firmware_protocol.peer.timing import HOST_HEARTBEAT, KEEP_ALIVE
from firmware_protocol.wire.fields import MAVLINK
from hil.conformance.orders import named
from hil.conformance.probe import QUIET
from hil.conformance.registry import Group, given, require
from hil.conformance.stopping import LONG, TICK, in_time

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.conformance.subject import Subject

GROUP: Final = Group("who may drive")
_SPAN: Final = 0.48
"""How long it is seen whether something keeps a robot, in s: nearly two times WATCHDOG."""
_WATCHDOG: Final = 0.25
_SHORT: Final = 0.2
"""A WATCHDOG in s that ends MANUAL_CONTROL before its own 0.25 s are over."""
_STICK: Final = 0.25
_MARK: Final = 44


def _saying(robot: Subject, say: Callable[[], None], seconds: float = _SPAN) -> None:
    """Say something every 40 ms, and nothing else."""
    with robot.silence():
        for _ in range(round(seconds / KEEP_ALIVE)):
            say()
            robot.spend(KEEP_ALIVE)


def expect_not_kept(robot: Subject, say: Callable[[], None], what: str) -> None:
    """See that something does not keep a robot that a host has armed.

    Args:
        robot: The robot.
        say: Says it, once.
        what: What is said, in words.
    """
    with robot.parameters(WATCHDOG=_WATCHDOG * 1e3):
        robot.arm()
        motion = robot.lasting(5.0)
        robot.expect(motion, Reason.NONE)
        _saying(robot, say)
        robot.expect_state(State.READY, f"after {_SPAN:g} s in which only {what} was heard")
        robot.expect_stopped(robot.ended(motion, 0.0), Reason.WATCHDOG)


def _expect_kept(robot: Subject, say: Callable[[], None], what: str) -> None:
    """See that something keeps a robot that a host has armed."""
    with robot.parameters(WATCHDOG=_WATCHDOG * 1e3):
        robot.arm()
        motion = robot.lasting(2 * _WATCHDOG)
        robot.expect(motion, Reason.NONE)
        _saying(robot, say, 2 * _WATCHDOG + QUIET)
        result = robot.ended(motion, 0.0)
        found = robot.outcome(result)
        require(
            result.outcome == robot.examples.completed, f"what takes {2 * _WATCHDOG:g} s, kept by {what}, ended with {found}"
        )


@GROUP.check("heartbeats-do-not-keep", rule="The keeper", motion=True, needs=("watchdog-stops",))
def heartbeats(robot: Subject) -> str:
    """What names no host does not keep what a host has armed, whoever sends it: HEARTBEAT, TIMESYNC."""
    said = HOST_HEARTBEAT, Timesync(0, 1)
    expect_not_kept(robot, lambda: robot.send(*said), "another program at the host's own address")
    if robot.wire != MAVLINK:
        return "from the host's side; a bus has no source"
    for who in robot.strangers:
        expect_not_kept(robot, lambda who=who: robot.send_as(who, *said), f"system {who[0]}, component {who[1]}")  # type: ignore[misc]
    return "from the host's own address, another component, another system"


@GROUP.check("alive-keeps", rule="The keeper", motion=True)
def alive(robot: Subject) -> str:
    """ROBOT_ALIVE of the host whose session is open keeps what it has armed, said to the robot or to all."""
    for system, component in ((robot.system, ROBOT_COMPONENT), (0, 0)):
        message = RobotAlive(robot.host, system, component)
        _expect_kept(robot, lambda message=message: robot.send(message), f"ROBOT_ALIVE to system {system}")  # type: ignore[misc]
    return "to the robot, to all"


@GROUP.check("alive-of-other-host-ignored", rule="The keeper", motion=True, needs=("watchdog-stops", "heartbeats-do-not-keep"))
def other_alive(robot: Subject) -> str:
    """ROBOT_ALIVE of another host does not keep it."""
    other = robot.host ^ 1 or 2
    said = RobotAlive(other, robot.system, ROBOT_COMPONENT), RobotAlive(other)
    expect_not_kept(robot, lambda: robot.send(*said), "ROBOT_ALIVE of another host")
    return "to the robot, to all"


@GROUP.check("numbered-messages-keep", rule="The keeper", motion=True, needs=("watchdog-stops",))
def numbered(robot: Subject) -> str:
    """Numbered messages of the session keep what its host has armed."""
    name = robot.question().NAME
    _expect_kept(robot, lambda: robot.send(robot.question()), name)
    return name


@GROUP.check(
    "other-session-does-not-keep",
    rule="The keeper",
    motion=True,
    needs=("watchdog-stops", "other-session-refused", "heartbeats-do-not-keep"),
)
def other_session(robot: Subject) -> str:
    """Numbered messages of another session do not keep it."""
    other = robot.session ^ 1

    def say() -> None:
        robot.send(robot.question(session=other))

    name = robot.question().NAME
    expect_not_kept(robot, say, f"{name} of another session")
    return name


@GROUP.check("other-host-cannot-arm", rule="The keeper")
def other_host(robot: Subject) -> str:
    """Arming with a number that is not that of the session's host is denied."""
    for number in (robot.host ^ 1 or 2, robot.host % 65_535 + 1, 0.5):
        result = robot.command(Command.ARM_DISARM, 1, param3=number)
        require(result == CommandResult.DENIED, f"arming with another host's number was answered by {_result(result)}")
        robot.expect_state(State.DISARMED, "after arming with another host's number")
    return "it stays disarmed"


def _result(result: int | None) -> str:
    return "nothing" if result is None else named(CommandResult, result)


@GROUP.check("ground-station-obeyed", rule="The keeper", needs=("stopped-state-said-at-once",))
def obeyed(robot: Subject) -> str:
    """Who arms without a number, a ground station, is obeyed though a host has opened a session, and has gone."""
    robot.arm()
    robot.expect(robot.single(5.0), Reason.NONE)
    with robot.silence():
        robot.spend(0.3)
        for number in (0.0, math.nan):
            robot.order(Command.ARM_DISARM, 1, param3=number)
            robot.expect_state(State.READY, f"after it was armed with param3 {number:g}")
            robot.send(ManualControl(robot.system, x=0, r=0))
            robot.expect_state(State.DRIVING, f"after MANUAL_CONTROL of who armed it with param3 {number:g}")
            robot.order(Command.ARM_DISARM, 0)
            robot.expect_state(State.DISARMED, "after disarming")
    return "param3 0 and NaN: armed, driven, disarmed"


@GROUP.check("ground-station-closes-session", rule="The keeper", needs=("ground-station-obeyed",))
def closes(robot: Subject) -> str:
    """Who arms without a number closes the session, until one is opened: its messages are refused, its host cannot arm."""
    robot.arm()
    robot.order(Command.ARM_DISARM, 1)
    when = "when a ground station has armed the robot"
    refused = robot.single(), robot.brief(), robot.question()
    for message in refused:
        robot.expect(message, Reason.WRONG_SESSION, when)
    robot.expect_state(State.READY, "after messages of a closed session")
    result = robot.command(Command.ARM_DISARM, 1, param3=robot.host)
    require(result == CommandResult.DENIED, f"arming by the host of a closed session was answered by {_result(result)}")
    robot.open_session()
    robot.expect_state(State.DISARMED, "after a session was opened again")
    robot.arm()
    robot.expect(robot.single(0.1), Reason.NONE, "of the session that was opened then")
    return ", ".join(dict.fromkeys([*(message.NAME for message in refused), "arming"]))


@GROUP.check("new-keeper-stops-motion", rule="The keeper", motion=True, needs=("ground-station-obeyed",))
def new_keeper(robot: Subject) -> str:
    """A change of the keeper stops what was set in motion; a keeper that arms again changes nothing."""
    for make, state in robot.examples.under_way:
        robot.open_session()
        robot.arm()
        robot.expect(make(robot), Reason.NONE)
        robot.arm()
        robot.expect_state(state, "after its host has armed it again")
        robot.order(Command.ARM_DISARM, 1)
        robot.expect_state(State.READY, f"when a ground station has armed it in state {state.name}")
    if robot.wire != MAVLINK:
        return "from a host to a ground station; a bus has no source"
    robot.send(ManualControl(robot.system, x=0, r=0))
    start = len(robot.heard)
    robot.send_as(robot.strangers[1], CommandLong(robot.system, ROBOT_COMPONENT, Command.ARM_DISARM, param1=1.0))
    ack = given(robot.wait(CommandAck, start=start), "arming by a second ground station was not answered")
    require(ack.result == CommandResult.ACCEPTED, f"arming by a second ground station was answered by {_result(ack.result)}")
    robot.expect_state(State.READY, "when a second ground station has armed what the first one drove")
    return "from a host to a ground station, to a second one"


@GROUP.check("manual-control-dead-man", rule="MANUAL_CONTROL", needs=("ground-station-obeyed",))
def dead_man(robot: Subject) -> str:
    """MANUAL_CONTROL holds for 250 ms."""
    with robot.parameters(WATCHDOG=2000.0):
        robot.order(Command.ARM_DISARM, 1)
        with robot.watching():
            robot.send(ManualControl(robot.system, x=0, r=0), Timesync(0, 44))
            reading = given(robot.wait(Timesync, lambda m: m.ts1 == 44 and m.tc1 != 0, start=0), "TIMESYNC was not answered")
            begun = reading.tc1 * 1e-9
            driven = given(robot.entered(State.DRIVING, after=begun - TICK, timeout=0.5), "it did not drive")
            ended = given(robot.entered(State.READY, after=driven, timeout=LONG), f"it still drove after {LONG:g} s")
    return in_time("it ended", ended - begun, 0.25)


@GROUP.check("stick-range", rule="What is not understood", needs=("ground-station-obeyed",))
def stick(robot: Subject) -> str:
    """MANUAL_CONTROL with a stick beyond its range is ignored."""
    robot.order(Command.ARM_DISARM, 1)
    for field in ("x", "r"):
        for value in (1001, -1001, -32_768):
            robot.raw(robot.forged(ManualControl(robot.system), field, value))
            robot.spend(QUIET / 4)
            robot.expect_state(State.READY, f"after MANUAL_CONTROL with {field} {value}")
    return "x, r"


def _driven(robot: Subject, say: Callable[[], None]) -> float:
    """Let a ground station drive by hand, once; see how long the robot goes on, in s of its own time.

    Args:
        robot: The robot.
        say: Called every 40 ms meanwhile.
    """
    robot.forget()
    with robot.parameters(WATCHDOG=_SHORT * 1e3), robot.watching(), robot.silence():
        robot.order(Command.ARM_DISARM, 1)
        robot.send(ManualControl(robot.system, x=0, r=0), Timesync(0, _MARK))
        _saying(robot, say, _STICK + QUIET)
        reading = robot.wait(Timesync, lambda m: m.ts1 == _MARK and m.tc1 != 0, start=0)
        begun = given(reading, "TIMESYNC was not answered").tc1 * 1e-9
        driven = given(robot.entered(State.DRIVING, after=begun - TICK, timeout=QUIET), "it did not drive")
        return given(robot.entered(State.READY, after=driven, timeout=LONG), f"it still drove after {LONG:g} s") - begun


@GROUP.check(
    "ground-station-keeps", rule="The keeper", needs=("watchdog-stops", "manual-control-dead-man", "ground-station-obeyed")
)
def keeps(robot: Subject) -> str:
    """Any frame of the ground station that armed the robot keeps it; on CAN, any from the host's side."""
    silent = in_time("left alone it stopped", _driven(robot, lambda: None), _SHORT)
    kept = in_time("kept by HEARTBEAT it ended", _driven(robot, lambda: robot.send(HOST_HEARTBEAT)), _STICK)
    return f"kept, driving ended {kept}; left alone, {silent}"


@GROUP.check(
    "ground-station-not-kept-by-others",
    rule="The keeper",
    needs=("watchdog-stops", "ground-station-obeyed", "ground-station-keeps"),
)
def not_kept(robot: Subject) -> str:
    """Frames of others do not keep what a ground station has armed: another component of its system, the host before it."""
    robot.need_sources()
    said = HOST_HEARTBEAT, RobotAlive(robot.host)
    words = ""
    for who in robot.strangers:
        after = _driven(robot, lambda who=who: robot.send_as(who, *said))  # type: ignore[misc]
        words = in_time(f"with system {who[0]}, component {who[1]} heard, it stopped", after, _SHORT)
    return f"driving ended {words}"


@GROUP.check(
    "manual-control-from-who-armed",
    rule="MANUAL_CONTROL",
    needs=("stopped-state-said-at-once", "ground-station-obeyed"),
)
def manual(robot: Subject) -> str:
    """MANUAL_CONTROL is taken from the system and component that armed the robot without a number."""
    robot.need_sources()
    robot.order(Command.ARM_DISARM, 1)
    for who in robot.strangers:
        robot.send_as(who, ManualControl(robot.system, x=0, r=0))
        robot.expect_state(State.READY, f"after MANUAL_CONTROL from system {who[0]}, component {who[1]}")
    robot.send(ManualControl(robot.system, x=0, r=0))
    robot.expect_state(State.DRIVING, "after MANUAL_CONTROL from who armed it")
    return "another component and another system are ignored"


@GROUP.check("manual-control-not-for-host", rule="MANUAL_CONTROL")
def hosted(robot: Subject) -> str:
    """MANUAL_CONTROL does not drive what a host has armed, though it comes from the host's own address."""
    robot.arm()
    robot.send(ManualControl(robot.system, x=0, r=0))
    robot.expect_state(State.READY, "after MANUAL_CONTROL to what a host has armed")
    robot.expect(robot.single(), Reason.NONE, "of its host, after that")
    return "it stands, and its host still drives"


@GROUP.check("anybody-stops", rule="The keeper", needs=("emergency-stop-latched",))
def anybody(robot: Subject) -> str:
    """Disarming and the emergency stop are obeyed whoever asks for them."""
    robot.need_sources()
    orders = (
        (Command.ARM_DISARM, 0.0, State.DISARMED),
        (Command.FLIGHT_TERMINATION, 1.0, State.STOPPED),
        (Command.ARM_DISARM, 0.0, State.DISARMED),
    )
    for who in robot.strangers:
        for command, value, state in orders:
            if state is not State.DISARMED or robot.state() != State.STOPPED:
                robot.arm()
                robot.expect(robot.single(5.0), Reason.NONE)
            start = len(robot.heard)
            robot.send_as(who, CommandLong(robot.system, ROBOT_COMPONENT, command, param1=value))
            robot.wait(CommandAck, start=start)
            robot.expect_state(state, f"after command {command} from system {who[0]}, component {who[1]}")
    return "another component, another system"
