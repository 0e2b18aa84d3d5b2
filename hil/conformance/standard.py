"""What every MAVLink vehicle does: heartbeat, version, commands and their answers, clocks."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from firmware_protocol.faults.failures import FailureType, FailureUnit
from firmware_protocol.messages import (
    ARMED_FLAG,
    GENERIC_AUTOPILOT,
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    ROBOT_COMPONENT,
    ROVER,
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Ping,
    RobotAck,
    RobotStatus,
    State,
    SysStatus,
    Timesync,
)
from firmware_protocol.wire.can.layout import LAST_NODE
from firmware_protocol.wire.fields import CAN
from hil.conformance.orders import named
from hil.conformance.probe import QUIET
from hil.conformance.registry import Group, given, require

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message
    from hil.conformance.subject import Subject

GROUP: Final = Group("identity and commands")
_STANDBY, _ACTIVE, _EMERGENCY = 3, 4, 6
_MAVLINK_2, _PARAM_FLOAT = 8192, 2
_NO_COMMAND: Final = 31_010
"""MAV_CMD_USER_1: nothing of ours."""


@GROUP.check("heartbeat-once-a-second", rule="HEARTBEAT")
def heartbeat_rate(robot: Subject) -> str:
    """HEARTBEAT comes once a second."""
    robot.spend(4.3)
    stamps = [event.time for event in robot.heard if isinstance(event.message, Heartbeat)]
    gaps = [after - before for before, after in pairwise(stamps)]
    require(len(gaps) >= 2 and all(0.8 <= gap <= 1.2 for gap in gaps), f"intervals of {[round(gap, 2) for gap in gaps]} s")
    return f"{sum(gaps) / len(gaps):.3f} s"


@GROUP.check("heartbeat-tells-state", rule="HEARTBEAT")
def heartbeat_state(robot: Subject) -> str:
    """HEARTBEAT says what the robot is, whether it is armed, and in which state."""

    def look(state: State, *, armed: bool, status: int) -> None:
        beat = given(robot.requested(Heartbeat), "no HEARTBEAT on request")
        who = (beat.type, beat.autopilot, beat.mavlink_version)
        require(who == (ROVER, GENERIC_AUTOPILOT, 3), f"type, autopilot and MAVLink version are {who}, not (10, 0, 3)")
        found = (beat.custom_mode, bool(beat.base_mode & ARMED_FLAG), beat.system_status)
        require(found == (state, armed, status), f"{state.name}: (custom_mode, armed, system_status) is {found}")

    look(State.DISARMED, armed=False, status=_STANDBY)
    robot.arm()
    look(State.READY, armed=True, status=_ACTIVE)
    robot.order(Command.FLIGHT_TERMINATION, 1)
    look(State.STOPPED, armed=False, status=_EMERGENCY)
    return "disarmed, ready, stopped"


@GROUP.check("version-on-request", rule="AUTOPILOT_VERSION")
def version(robot: Subject) -> str:
    """AUTOPILOT_VERSION comes on request and names a protocol that we speak."""
    answer = given(robot.requested(AutopilotVersion), "it was requested and did not come")
    major, minor = answer.middleware_sw_version >> 24, answer.middleware_sw_version >> 16 & 0xFF
    require(major == PROTOCOL_MAJOR, f"protocol {major}.{minor}, not {PROTOCOL_MAJOR}.{PROTOCOL_MINOR}")
    wanted = _MAVLINK_2 | _PARAM_FLOAT
    require(answer.capabilities & wanted == wanted, f"capabilities {answer.capabilities:#x} lack MAVLink 2 or float parameters")
    return f"protocol {major}.{minor}, firmware {answer.flight_sw_version:#010x}, uid {answer.uid:#x}"


@GROUP.check("unknown-command-unsupported", rule="COMMAND_ACK")
def unknown_command(robot: Subject) -> str:
    """A command that the robot does not know is answered by UNSUPPORTED."""
    result = robot.command(_NO_COMMAND)
    require(result == CommandResult.UNSUPPORTED, f"answered by {_result(result)}")
    return f"command {_NO_COMMAND}"


@GROUP.check("command-values-denied", rule="What is not understood")
def command_values(robot: Subject) -> str:
    """A command with a value that it does not know is denied."""
    for command, value, other in (
        (Command.ARM_DISARM, 0.5, 0.0),
        (Command.ARM_DISARM, math.nan, 0.0),
        (Command.FLIGHT_TERMINATION, 0.0, 0.0),
        (Command.PREFLIGHT_REBOOT, 7.0, 0.0),
        (Command.SET_MESSAGE_INTERVAL, RobotStatus.ID, -2.0),
        (Command.SET_MESSAGE_INTERVAL, RobotStatus.ID, math.nan),
    ):
        result = robot.command(command, value, other)
        require(result == CommandResult.DENIED, f"{command.name} {value:g} {other:g} was answered by {_result(result)}")
    robot.expect_state(State.DISARMED, "after denied commands")
    return "6 values"


@GROUP.check("failures-need-consent", rule="COMMAND_LONG")
def failures(robot: Subject) -> str:
    """Nothing can be made to fail while FAIL_ENABLE is 0."""
    with robot.parameters(FAIL_ENABLE=0.0):
        results = {unit: robot.command(Command.INJECT_FAILURE, unit, FailureType.OFF) for unit in FailureUnit}
        for unit in FailureUnit:  # a robot that let them fail is to be well again
            robot.command(Command.INJECT_FAILURE, unit, FailureType.OK)
    for unit, result in results.items():
        refused = result in {CommandResult.DENIED, CommandResult.UNSUPPORTED}
        require(refused, f"the failure of {unit.name} was answered by {_result(result)}")
    return f"{len(FailureUnit)} units"


@GROUP.check("message-on-request", rule="COMMAND_LONG")
def on_request(robot: Subject) -> str:
    """Each of the robot's streams comes on request; any other message is UNSUPPORTED."""
    kinds: tuple[type[Message], ...] = (Heartbeat, SysStatus, *robot.examples.requested, RobotStatus, AutopilotVersion)
    for kind in kinds:
        require(robot.requested(kind) is not None, f"{kind.NAME} was requested and did not come")
    result = robot.command(Command.REQUEST_MESSAGE, ParamValue.ID)
    require(result == CommandResult.UNSUPPORTED, f"PARAM_VALUE was answered by {_result(result)}")
    return f"{len(kinds)} messages"


@GROUP.check("ping-answered", rule="PING")
def ping(robot: Subject) -> str:
    """PING is answered with its own time and number; an answer to somebody is not."""
    answer = given(robot.ask(Ping(time_usec=2**53 + 1, seq=77), Ping), "it was not answered")
    require((answer.time_usec, answer.seq) == (2**53 + 1, 77), f"the answer was {answer}")
    robot.forget()
    robot.send(Ping(time_usec=1, seq=78, target_system=robot.system, target_component=ROBOT_COMPONENT))
    robot.spend(QUIET)
    require(not robot.got(Ping), "an answer was answered")
    return "same time, same number"


@GROUP.check("timesync-answered", rule="TIMESYNC")
def timesync(robot: Subject) -> str:
    """TIMESYNC is answered with the robot's time since boot."""
    before = robot.status()
    reading = robot.clock_reading()
    after = robot.status()
    require(before.time <= reading <= after.time, f"{reading:.3f} s is not between {before.time:.3f} and {after.time:.3f} s")
    robot.forget()
    robot.send(Timesync(tc1=1, ts1=1))
    robot.spend(QUIET)
    require(not robot.got(Timesync), "an answer was answered")
    return "the clock of ROBOT_STATUS.time"


@GROUP.check("other-target-ignored", rule="Addresses")
def other_target(robot: Subject) -> str:
    """What is addressed to another system or component is ignored."""
    on_can = robot.wire == CAN  # where a frame names a node, and no component
    other = robot.system % (LAST_NODE if on_can else 254) + 1
    for system, component in ((other, ROBOT_COMPONENT), (robot.system, 99))[: 1 if on_can else 2]:
        robot.forget()
        robot.send(
            CommandLong(system, component, Command.ARM_DISARM, param1=1.0),
            CommandLong(system, component, Command.FLIGHT_TERMINATION, param1=1.0),
            ParamRequestRead(system, component, "SYS_ID"),
            ParamSet(system, component, "WATCHDOG", 123.0),
            robot.single(target_system=system, target_component=component),
        )
        robot.spend(QUIET)
        require(not robot.got(CommandAck), f"a command to system {system}, component {component} was answered")
        require(not robot.got(ParamValue), f"a parameter asked of system {system}, component {component} was answered")
        require(not robot.got(RobotAck), f"motion of system {system}, component {component} was answered")
    robot.expect_state(State.DISARMED, "after somebody else was armed and stopped")
    return "another system" if on_can else "another system, another component"


@GROUP.check("all-means-stop-only", rule="Addresses", needs=("other-target-ignored",))
def broadcast(robot: Subject) -> str:
    """System 0 means all, and is honoured for stopping alone."""

    def say(command: Command, value: float) -> None:
        robot.send(CommandLong(0, 0, command, param1=value))
        robot.spend(QUIET)

    say(Command.ARM_DISARM, 1.0)
    robot.expect_state(State.DISARMED, "after all were told to arm")
    robot.forget()
    robot.send(ParamRequestRead(0, 0, "SYS_ID"))
    robot.spend(QUIET)
    require(not robot.got(ParamValue), "a parameter asked of all was answered")
    robot.arm()
    robot.forget()
    robot.send(robot.single(target_system=0, target_component=0))
    robot.spend(QUIET)
    require(not robot.got(RobotAck), "all were told to drive, and one answered")
    say(Command.ARM_DISARM, 0.0)
    robot.expect_state(State.DISARMED, "after all were told to disarm")
    say(Command.FLIGHT_TERMINATION, 1.0)
    robot.expect_state(State.STOPPED, "after an emergency stop to all")
    return "disarm and emergency stop"


def _result(result: int | None) -> str:
    return "nothing" if result is None else named(CommandResult, result)
