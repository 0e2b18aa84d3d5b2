"""Versions of the protocol: which one both ends speak, and what is said where there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import VersionError, WrongRobotError
from firmware_protocol.messages import PROTOCOL_MAJOR, PROTOCOL_MINOR

if TYPE_CHECKING:
    from firmware_protocol.errors import HilError
    from firmware_protocol.messages import AutopilotVersion


def spoken_minor(theirs: int) -> int:
    """The newest minor version that both ends speak, of the major version that both have.

    Args:
        theirs: The robot's `middleware_sw_version`, in AUTOPILOT_VERSION.
    """
    return min(PROTOCOL_MINOR, theirs >> 16 & 0xFF)


def other_version(version: str) -> str:
    """Which versions there are, and what to do.

    Args:
        version: The robot's, as `1.0`; its major version is not ours.

    Returns:
        As `speaks protocol 1.0, this software 2.0: flash it again`.
    """
    newer = int(version.partition(".")[0]) > PROTOCOL_MAJOR
    cure = "update this software" if newer else "flash it again"
    return f"speaks protocol {version}, this software {PROTOCOL_MAJOR}.{PROTOCOL_MINOR}: {cure}"


def unfit(version: AutopilotVersion, system: int, uid: int, kind: str) -> HilError | None:
    """Why a robot can't be spoken to.

    Args:
        version: What it says about itself.
        system: Its system id.
        uid: Unique id of the robot that was spoken with as this system before; 0 where there was none, or it named none.
        kind: What it is taken for, as `Junior`.

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
        return VersionError(f"system {system} speaks MAVLink but is no {kind}: it names no version of our protocol")
    return VersionError(f"robot {system} {other_version(f'{major}.{minor}')}")
