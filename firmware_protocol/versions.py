"""Versions of the protocol: which one both ends speak, and what is said where there is none."""

from __future__ import annotations

from firmware_protocol.messages import PROTOCOL_MAJOR, PROTOCOL_MINOR


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
