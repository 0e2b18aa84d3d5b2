"""The EEPROM of a new Junior that was given a system id."""

from __future__ import annotations

from functools import cache
from typing import Final

from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, ROBOT_COMPONENT, ParamSet
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.junior.device import VirtualDevice
from simdevice.sumo.match import Match

NEW_SYSTEM: Final = 1
"""System id of a new robot."""
_WRITING: Final = 80
"""Control periods in which a parameter is surely in the EEPROM."""


@cache
def image_of(system: int) -> bytes:
    """The EEPROM of a new robot that was given a system id, the way a person does it: SYS_ID set over the wire.

    Args:
        system: The id, 1..254.

    Returns:
        An image of the EEPROM.
    """
    device = VirtualDevice(Match().robot, uid=1)
    host = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
    device.step(host.encode(ParamSet(NEW_SYSTEM, ROBOT_COMPONENT, "SYS_ID", float(system))))
    for _ in range(_WRITING):
        device.step(b"")
    return device.nvm
