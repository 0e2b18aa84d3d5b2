"""Whether a robot that has said who it is can be spoken to. No I/O, no clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import VersionError, WrongRobotError
from firmware_protocol.messages import PROTOCOL_MAJOR
from firmware_protocol.versions import other_version

if TYPE_CHECKING:
    from firmware_protocol.errors import HilError
    from firmware_protocol.messages import AutopilotVersion
    from firmware_protocol.peer.role import Role


def unfit(version: AutopilotVersion, system: int, uid: int, role: Role) -> HilError | None:
    """Why a robot can't be spoken to.

    Args:
        version: What it says about itself.
        system: Its system id.
        uid: Unique id of the robot that was spoken with as this system before; 0 where there was none, or it named none.
        role: What it is taken for.

    Returns:
        WrongRobotError where it is another than before, VersionError where it speaks another protocol; None where all is well.
    """
    if uid and version.uid and version.uid != uid:
        return WrongRobotError(
            f"another robot answers as system {system}: its unique id is {version.uid:016x}, "
            f"that of the one that was lost {uid:016x}"
        )
    major, minor = version.middleware_sw_version >> 24, version.middleware_sw_version >> 16 & 0xFF
    if major == PROTOCOL_MAJOR:
        return None
    if major == 0:
        return VersionError(f"system {system} speaks MAVLink but is no {role.name}: it names no version of our protocol")
    return VersionError(f"robot {system} {other_version(f'{major}.{minor}')}")
