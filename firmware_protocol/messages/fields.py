"""Who is who on the wire, and the fields that many messages have."""

from __future__ import annotations

from typing import Annotated, Final

from firmware_protocol.vocabulary import RobotClass
from firmware_protocol.wire.fields import Wire

ROBOT_COMPONENT: Final = 1
"""MAV_COMP_ID_AUTOPILOT1: the robot itself."""
REFEREE_COMPONENT: Final = 25
"""MAV_COMP_ID_USER1: the emulator's referee."""
TABLE_COMPONENT: Final = 25
"""Likewise: the table of emulated micro-robots."""
TABLE_SYSTEM: Final = 254
"""System id of that table, on every network of byte links: its robots have 1 to 253."""
TABLE_NODE: Final = 127
"""What it is on a CAN bus: node and system id; its robots have 1 to 126."""
HOST_COMPONENT: Final = 190
"""MAV_COMP_ID_MISSIONPLANNER: the host."""
HOST_SYSTEM: Final = 255
"""System id of the host."""
SHARE_COMPONENT: Final = 240
"""MAV_COMP_ID_UDP_BRIDGE, of the host's system: the link is shared, and who is on it this way looks on only."""
SIDES: Final = ("left", "right")
AXES: Final = ("x", "y")
CLASSES: Final = tuple(each.name.lower() for each in RobotClass)
Target = Annotated[int, Wire("u8", text="System addressed; 0 is all, honoured only for stop, e-stop and ROBOT_ALIVE")]
TargetComponent = Annotated[int, Wire("u8", text="Component addressed; 0 is all")]
Asker = Annotated[int, Wire("u8", text="System that asked; 0: not filled in, which is a fault")]
AskerComponent = Annotated[int, Wire("u8", text="Component that asked; likewise")]
Session = Annotated[int, Wire("u16", text="Session of the host, random, opened by ROBOT_SESSION")]
Sequence = Annotated[int, Wire("u16", text="Number of the command within the session")]
