"""The roles there are, and what a robot says that has one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import RobotStatus
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.roles.swarm import MICRO_ROBOT

if TYPE_CHECKING:
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.fields import Message

ROLES: Final[tuple[Role, ...]] = (JUNIOR, MICRO_ROBOT)
"""Every role. The first is what a robot is taken for before it has said what it is."""
SIGNS: Final[frozenset[type[Message]]] = frozenset({RobotStatus, *(role.readings for role in ROLES)})
"""Messages by which a robot that has a role is known, before its first heartbeat."""
