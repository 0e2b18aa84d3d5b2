"""Versions of this program, and of what it computes with."""

from __future__ import annotations

import platform
from importlib import metadata
from typing import Final

from firmware_protocol.messages import PROTOCOL_MAJOR, PROTOCOL_MINOR

PACKAGES: Final = ("junior-hil", "numpy", "pymunk", "protobuf")
"""Packages on which it depends what a run decides."""


def versions() -> dict[str, str]:
    """Of the packages, of the protocol, which is the firmware's too, and of Python."""
    found = {name: metadata.version(name) for name in PACKAGES}
    return {**found, "protocol": f"{PROTOCOL_MAJOR}.{PROTOCOL_MINOR}", "python": platform.python_version()}
