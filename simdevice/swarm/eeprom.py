"""The EEPROMs of new micro-robots, written the way a person does it: parameters are set over the wire."""

from __future__ import annotations

from functools import cache
from typing import Final

from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM, ROBOT_COMPONENT, ParamSet
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.boards import NVM_SIZE, board_host

NEW_SYSTEM: Final = 1
"""System id of a new robot."""
_PERIOD: Final = 5000
"""Control period, in us."""
_WRITING: Final = 80
"""Control periods in which parameters are surely in the EEPROM."""


@cache
def image_of(system: int, group: int) -> bytes:
    """The EEPROM of a new robot that was given a system id and a class.

    Args:
        system: The id, 1..254.
        group: The class: 0 RANGER, 1 WILD.

    Returns:
        An image of the EEPROM.
    """
    host = board_host()
    robot = host.ffi.new("host_robot *")
    nvm = host.ffi.buffer(robot.io.nvm)
    nvm[:] = b"\xff" * NVM_SIZE
    robot.io.role, robot.io.has_encoders = MICRO_ROBOT.product, 1
    host.lib.host_power_on(robot, 0)
    codec = MavlinkCodec(system=HOST_SYSTEM, component=HOST_COMPONENT)
    wanted = [("CLASS", float(group)), ("SYS_ID", float(system))]
    rx = b"".join([codec.encode(ParamSet(NEW_SYSTEM, ROBOT_COMPONENT, name, value)) for name, value in wanted])
    for period in range(_WRITING):
        host.lib.host_tick(robot, period * _PERIOD, rx, len(rx))
        rx = b""
    return bytes(nvm[:])
