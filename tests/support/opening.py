"""How a host begins with a robot, for tests that say everything themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import PROTOCOL_MAJOR, PROTOCOL_MINOR, ROBOT_COMPONENT, Command, CommandLong, RobotSession

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message


def opening(session: int, host: int, system: int = 1) -> list[Message]:
    """Open a session, and arm.

    Args:
        session: Its number.
        host: Number of the host.
        system: System id of the robot.
    """
    robot = (system, ROBOT_COMPONENT)
    return [
        RobotSession(session, 0, host, *robot, PROTOCOL_MAJOR, PROTOCOL_MINOR),
        CommandLong(*robot, Command.ARM_DISARM, param1=1.0, param3=float(host)),
    ]
