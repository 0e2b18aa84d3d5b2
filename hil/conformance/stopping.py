"""Arming, stopping, and everything that stops by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    ManualControl,
    Reason,
    RobotStatus,
    State,
    Timesync,
)
from hil.conformance.orders import SLACK, named
from hil.conformance.registry import Group, given, require

if TYPE_CHECKING:
    from hil.conformance.subject import Subject
    from hil.conformance.talk import Result

GROUP: Final = Group("stopping")
_EARLY: Final = 0.006
"""How much too early a deadline may be seen to act, in s: a control period, and rounding."""
TICK: Final = 0.005
"""A control period, in s."""
LONG: Final = 2.0
"""Longer than anything that is to end earlier, in s."""


def _limits(seconds: float) -> tuple[float, float]:
    return seconds - _EARLY, seconds + SLACK


def in_time(what: str, found: float, wanted: float) -> str:
    """See that something took as long as it must.

    Args:
        what: What it was, in words.
        found: How long it took, in s of the robot's own time.
        wanted: How long it must take, in s.

    Returns:
        How long it took, in words.
    """
    low, high = _limits(wanted)
    require(low <= found <= high, f"{what} after {found * 1e3:.0f} ms, not after {wanted * 1e3:.0f} ms")
    return f"after {found * 1e3:.0f} ms"


@GROUP.check("disarmed-refuses-motion", rule="Stopping")
def disarmed(robot: Subject) -> str:
    """A disarmed robot refuses everything that would turn its wheels."""
    refused = robot.single(), robot.brief()
    for message in refused:
        robot.expect(message, Reason.DISARMED, "while disarmed")
    robot.send(ManualControl(robot.system, x=0, r=0))
    robot.expect_state(State.DISARMED, "after MANUAL_CONTROL while disarmed")
    return ", ".join(dict.fromkeys([*(message.NAME for message in refused), "MANUAL_CONTROL"]))


@GROUP.check("arms-and-disarms", rule="In a minute")
def arms(robot: Subject) -> str:
    """Command 400 arms and disarms."""
    for _ in range(2):
        robot.arm()
        robot.expect_state(State.READY, "after command 400 with 1")
    for _ in range(2):
        robot.order(Command.ARM_DISARM, 0)
        robot.expect_state(State.DISARMED, "after command 400 with 0")
    return "ready and disarmed, each twice"


@GROUP.check("emergency-stop-latched", rule="Stopping")
def latched(robot: Subject) -> str:
    """An emergency stop is latched: only disarming clears it, then arming is possible."""
    robot.arm()
    for _ in range(2):
        robot.order(Command.FLIGHT_TERMINATION, 1)
        robot.expect_state(State.STOPPED, "after an emergency stop")
    result = robot.command(Command.ARM_DISARM, 1, param3=robot.host)
    refused = CommandResult.TEMPORARILY_REJECTED
    require(result == refused, f"arming was answered by {'nothing' if result is None else named(CommandResult, result)}")
    for message in (robot.single(), robot.brief()):
        robot.expect(message, Reason.EMERGENCY_STOP, "after an emergency stop")
    robot.expect_state(State.STOPPED, "after arming was refused")
    robot.order(Command.ARM_DISARM, 0)
    robot.arm()
    robot.expect_state(State.READY, "after disarming and arming")
    return "until disarmed"


@GROUP.check("emergency-stop-at-once", rule="Stopping", motion=True)
def at_once(robot: Subject) -> str:
    """An emergency stop acts in the control period in which it arrives."""
    robot.arm()
    with robot.watching():
        motion = robot.lasting(5.0)
        robot.expect(motion, Reason.NONE)
        robot.send(CommandLong(robot.system, 1, Command.FLIGHT_TERMINATION, param1=1.0), Timesync(0, 55))
        answer = given(robot.wait(Timesync, lambda m: m.ts1 == 55 and m.tc1 != 0, start=0), "TIMESYNC was not answered")
        seen = given(robot.entered(State.STOPPED, after=answer.tc1 * 1e-9 - TICK, timeout=LONG), "it never stopped")
        late = max(0.0, seen - answer.tc1 * 1e-9)
        require(late <= SLACK, f"it stopped {late * 1e3:.0f} ms after the order")
        result = robot.ended(motion, 1.0)
    robot.expect_stopped(result, Reason.EMERGENCY_STOP)
    return f"within {max(late, TICK) * 1e3:.0f} ms"


@GROUP.check("disarming-ends-maneuver", rule="A maneuver", motion=True)
def disarming(robot: Subject) -> str:
    """Disarming stops a maneuver, or a move, and its result says so."""
    robot.arm()
    motion = robot.lasting(5.0)
    robot.expect(motion, Reason.NONE)
    robot.order(Command.ARM_DISARM, 0)
    robot.expect_stopped(robot.ended(motion, 0.5), Reason.DISARMED)
    robot.expect_state(State.DISARMED, "after disarming")
    return "STOPPED, DISARMED"


def _silent(robot: Subject) -> tuple[float, Result]:
    """Have something performed, fall silent, and see when the robot ends it, in s of its own time."""
    robot.arm()
    with robot.watching():
        motion = robot.lasting(5.0)
        robot.expect(motion, Reason.NONE)
        with robot.silence():
            last = robot.last_word()
            seen = robot.entered(State.READY, after=last, timeout=LONG)
        end = given(seen, f"it went on for {LONG:g} s with no word from its host")
        return end - last, robot.ended(motion, 0.5)


@GROUP.check("stopped-state-said-at-once", rule="COMMAND_LONG", needs=("emergency-stop-latched",))
def said_at_once(robot: Subject) -> str:
    """Asked for together with the order, HEARTBEAT says that the robot is disarmed, or stopped."""
    for command, value, state in ((Command.ARM_DISARM, 0.0, State.DISARMED), (Command.FLIGHT_TERMINATION, 1.0, State.STOPPED)):
        robot.arm()
        robot.expect(robot.single(5.0), Reason.NONE)
        order = CommandLong(robot.system, ROBOT_COMPONENT, command, param1=value)
        request = CommandLong(robot.system, ROBOT_COMPONENT, Command.REQUEST_MESSAGE, param1=Heartbeat.ID)
        start = len(robot.heard)
        robot.send(order, request)
        ack = robot.wait(CommandAck, lambda m, command=command: m.command == command, start=start)  # type: ignore[misc]
        require(ack is not None, f"command {command} was not answered")
        acked = next(at for at, event in enumerate(robot.heard[start:], start) if event.message is ack)
        said = given(robot.wait(Heartbeat, start=acked), "HEARTBEAT was requested with it and did not come").custom_mode
        require(said == state, f"asked together with command {command}, HEARTBEAT says {named(State, said)}, not {state.name}")
    return "disarmed, stopped"


@GROUP.check("watchdog-stops", rule="WATCHDOG", motion=True)
def watchdog(robot: Subject) -> str:
    """A robot that moves and hears nothing from its keeper for WATCHDOG ms stops."""
    with robot.parameters(WATCHDOG=250.0):
        after, result = _silent(robot)
    robot.expect_stopped(result, Reason.WATCHDOG)
    return in_time("it stopped", after, 0.25)


@GROUP.check("watchdog-follows-parameter", rule="WATCHDOG", motion=True, needs=("watchdog-stops",))
def watchdog_parameter(robot: Subject) -> str:
    """The watchdog's time is the parameter WATCHDOG."""
    with robot.parameters(WATCHDOG=500.0):
        after, _ = _silent(robot)
    return in_time("with WATCHDOG at 500 it stopped", after, 0.5)


@GROUP.check("watchdog-lets-heard-host-be", rule="In a minute", motion=True)
def heard(robot: Subject) -> str:
    """A robot that hears ROBOT_ALIVE of its host every 40 ms goes on."""
    robot.arm()
    motion = robot.lasting(1.0)
    robot.expect(motion, Reason.NONE)
    result = robot.ended(motion, 1.0)
    require(result.outcome == robot.examples.completed, f"what takes 1 s ended with {robot.outcome(result)}")
    return "1 s"


@GROUP.check("reboot-comes-up-disarmed", rule="ROBOT_STATUS")
def reboot(robot: Subject) -> str:
    """After a reboot the robot is disarmed, its clock begins anew, and the boot is counted."""
    robot.arm()
    before = robot.status()
    after: RobotStatus = robot.reboot()
    robot.expect_state(State.DISARMED, "after a reboot")
    count = after.boot_count - before.boot_count
    require(count == 1, f"ROBOT_STATUS.boot_count rose by {count}")
    require(after.maneuvers == 0, f"ROBOT_STATUS.maneuvers is {after.maneuvers}")
    return f"boot {after.boot_count}"
