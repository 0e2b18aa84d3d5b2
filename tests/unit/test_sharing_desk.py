"""What guests of a shared link are told: answers from what is known, the emergency stop passed on, and nothing else."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from guest import ROBOT, ROVER, STOP

from firmware_protocol.messages import (
    GROUND_STATION,
    HOST_COMPONENT,
    HOST_SYSTEM,
    PARAM_TYPE_REAL32,
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    AckResult,
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    JuniorWheels,
    ManualControl,
    MissionCount,
    MissionRequestList,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Reason,
    RobotAck,
    RobotAlive,
    RobotSession,
    Timesync,
)
from hil.bridge.operator import GUEST_STOP, PARAMETERS
from hil.sharing.desk import READ_AGAIN, STOP_WAIT, Asker, FrontDesk, Reply

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

VERSION = AutopilotVersion(7, 1, 2, uid=99)
QGC = Asker(1, 255, 190)
OTHER = Asker(2, 250, 1)


def value(index: int, *, count: int = 2, name: str = "") -> ParamValue:
    """A parameter as a robot says it."""
    return ParamValue(name or f"P{index}", 0.5 + index, PARAM_TYPE_REAL32, count, index)


class Desk(FrontDesk):
    """A desk that remembers what it has asked for."""

    def __init__(self, *known: Message, system: int = 1) -> None:
        self.asked: list[tuple[str, str]] = []
        super().__init__(lambda what, robot: self.asked.append((what, robot)))
        for message in (ROVER, *known):
            self.heard(message, system, ROBOT_COMPONENT)

    def says(self, message: Message, asker: Asker = QGC, now: float = 0.0) -> list[Message]:
        """What is said to somebody who says this."""
        replies = self.answer(asker, message, now)
        assert all(reply.guest == asker.guest for reply in replies)
        return [reply.message for reply in replies]


def test_who_it_is_and_what_it_said_last_is_known() -> None:
    desk = Desk(VERSION)
    accepted = CommandAck(512, CommandResult.ACCEPTED, target_system=255, target_component=190)
    assert desk.says(CommandLong(*ROBOT, Command.REQUEST_MESSAGE, 0, 148.0)) == [accepted, VERSION]
    assert desk.says(CommandLong(*ROBOT, Command.REQUEST_MESSAGE, 0, 0.0)) == [accepted, ROVER]


@pytest.mark.parametrize("number", [math.nan, -1.0, 1e30, math.inf, 77.0, 111.0, 22.0, 47109.0])
def test_what_was_not_heard_is_denied(number: float) -> None:
    desk = Desk(CommandAck(400, 0), Timesync(1, 1), value(0))
    (ack,) = desk.says(CommandLong(*ROBOT, Command.REQUEST_MESSAGE, 0, number))
    assert isinstance(ack, CommandAck)
    assert ack.result == CommandResult.DENIED


@pytest.mark.parametrize(
    ("command", "param1"),
    [
        (Command.ARM_DISARM, 1.0),
        (Command.ARM_DISARM, 0.0),
        (Command.SET_MESSAGE_INTERVAL, 47100.0),
        (Command.PREFLIGHT_REBOOT, 1.0),
        (Command.INJECT_FAILURE, 1.0),
        (Command.FLIGHT_TERMINATION, 0.0),
        (Command.FLIGHT_TERMINATION, math.nan),
        (519, 1.0),
    ],
)
def test_every_other_command_is_denied(command: int, param1: float) -> None:
    desk = Desk()
    assert desk.says(CommandLong(*ROBOT, command, 0, param1), OTHER) == [
        CommandAck(command, CommandResult.DENIED, target_system=250, target_component=1)
    ]
    assert desk.asked == []


def test_parameters_that_are_known_are_listed_to_who_asks() -> None:
    desk = Desk(value(1), value(0))
    assert desk.says(ParamRequestList(*ROBOT)) == [value(0), value(1)]
    assert desk.says(ParamRequestRead(*ROBOT, "P1")) == [value(1)]
    assert desk.says(ParamRequestRead(*ROBOT, param_index=0)) == [value(0)]
    assert desk.says(ParamRequestRead(*ROBOT, param_index=2)) == []
    (none,) = desk.says(ParamRequestRead(*ROBOT, "P9"))
    assert isinstance(none, ParamValue)
    assert (none.param_id, none.param_index, math.isnan(none.param_value)) == ("P9", 0xFFFF, True)
    assert desk.asked == []


def test_parameters_that_are_not_known_are_read_by_who_drives_now_and_then() -> None:
    desk = Desk(value(0))
    assert desk.says(ParamRequestList(*ROBOT)) == [value(0)]
    assert desk.asked == [(PARAMETERS, "1")]
    assert desk.says(ParamRequestRead(*ROBOT, "P1"), now=READ_AGAIN / 2) == []
    assert desk.says(ParamSet(*ROBOT, "P1", 3.0), now=READ_AGAIN / 2) == []
    assert desk.asked == [(PARAMETERS, "1")]
    assert desk.says(ParamRequestList(*ROBOT), now=READ_AGAIN) == [value(0)]
    assert desk.asked == [(PARAMETERS, "1")] * 2


def test_a_value_that_nobody_has_is_no_parameter() -> None:
    nobody = ParamValue("P9", math.nan, PARAM_TYPE_REAL32, 2, 0xFFFF)
    assert not next(iter(Desk(nobody).known)).parameters


def test_setting_a_parameter_is_answered_by_the_value_in_force() -> None:
    desk = Desk(value(0), value(1))
    assert desk.says(ParamSet(*ROBOT, "P0", 3.0)) == [value(0)]
    assert desk.says(ParamSet(*ROBOT, "P7", 3.0)) == []
    changed = ParamValue("P0", 9.0, PARAM_TYPE_REAL32, 2, 0)
    desk.heard(changed, 1, ROBOT_COMPONENT)
    assert desk.says(ParamSet(*ROBOT, "P0", 3.0)) == [changed]


def test_there_is_no_mission() -> None:
    assert Desk().says(MissionRequestList(*ROBOT, 1)) == [MissionCount(255, 190, 0, 1)]


def test_nobody_takes_a_robot_or_moves_it() -> None:
    desk = Desk()
    opening = RobotSession(5, 0, 9, *ROBOT, 2, 1)
    assert desk.says(opening) == [
        RobotAck(RobotSession.ID, 5, 0, 255, 190, AckResult.REFUSED, Reason.WRONG_SESSION),
    ]
    (refused,) = desk.says(
        JuniorWheels(session=5, sequence=1, target_system=1, target_component=1, speed=(0.1, 0.1), duration=0.1)
    )
    assert isinstance(refused, RobotAck)
    assert refused.result == AckResult.REFUSED
    assert desk.says(ManualControl(1, 500)) == []
    assert desk.says(RobotAlive(5)) == []
    assert desk.says(ROVER) == []
    assert desk.asked == []


def test_others_than_robots_answer_nothing() -> None:
    desk = Desk()
    desk.heard(ROVER, HOST_SYSTEM, ROBOT_COMPONENT)
    desk.heard(Heartbeat(GROUND_STATION, 8, 0, 0, 4), 9, ROBOT_COMPONENT)
    desk.heard(ROVER, 8, REFEREE_COMPONENT)
    desk.heard(VERSION, 7, ROBOT_COMPONENT)
    assert [robot.system for robot in desk.known] == [1]
    assert desk.says(CommandLong(2, 1, Command.ARM_DISARM)) == []
    assert desk.says(CommandLong(1, REFEREE_COMPONENT, Command.ARM_DISARM)) == []
    assert len(desk.says(CommandLong(0, 0, Command.ARM_DISARM))) == 1


def test_the_stop_is_passed_on_at_once_and_answered_as_the_robot_answers() -> None:
    desk = Desk()
    assert desk.says(STOP) == []
    assert desk.asked == [(GUEST_STOP, "")]
    assert desk.says(STOP, now=0.1) == []
    assert desk.asked == [(GUEST_STOP, "")], "one that repeats itself has been heard"
    assert desk.says(STOP, OTHER, now=0.1) == []
    assert desk.asked == [(GUEST_STOP, "")] * 2
    ack = CommandAck(185, CommandResult.ACCEPTED, target_system=HOST_SYSTEM, target_component=HOST_COMPONENT)
    assert desk.heard(CommandAck(185, CommandResult.IN_PROGRESS), *ROBOT) == []
    assert desk.heard(CommandAck(400, 0), *ROBOT) == []
    assert desk.heard(ack, 1, REFEREE_COMPONENT) == []
    assert desk.heard(ack, 2, ROBOT_COMPONENT) == []
    assert desk.heard(ack, *ROBOT) == [
        Reply(1, 1, CommandAck(185, 0, target_system=255, target_component=190)),
        Reply(2, 1, CommandAck(185, 0, target_system=250, target_component=1)),
    ]
    assert desk.heard(ack, *ROBOT) == []
    assert desk.overdue(99.0) == []


def test_a_stop_that_no_robot_answers_has_failed() -> None:
    desk = Desk()
    desk.heard(ROVER, 2, ROBOT_COMPONENT)
    assert desk.says(CommandLong(0, 0, Command.FLIGHT_TERMINATION, 0, 1.0)) == []
    assert desk.overdue(STOP_WAIT - 0.01) == []
    assert desk.overdue(STOP_WAIT) == [Reply(1, 1, CommandAck(185, 4, target_system=255, target_component=190))]
    assert desk.overdue(STOP_WAIT) == []


def test_nobody_who_has_left_is_answered() -> None:
    desk = Desk()
    desk.says(STOP)
    desk.left(QGC.guest)
    assert desk.heard(CommandAck(185, 0), *ROBOT) == []
    assert desk.overdue(99.0) == []


def test_a_stop_for_nobody_is_none() -> None:
    desk = Desk()
    assert desk.says(CommandLong(9, 1, Command.FLIGHT_TERMINATION, 0, 1.0)) == []
    assert desk.asked == []
