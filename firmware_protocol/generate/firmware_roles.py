"""What the firmware is told of each role: its messages, streams and parameters, and what is true of any robot beside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    BYTE_LINKS_ONLY,
    JUNIOR_MESSAGES,
    ROBOT_MESSAGES,
    STANDARD_MESSAGES,
    SWARM_MESSAGES,
    JuniorSensors,
    SwarmObservation,
    SwarmRanges,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS, ROBOT_PARAMETERS, SWARM_PARAMETERS
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.wire.fields import Direction
from firmware_protocol.wire.mavlink_layout import offsets

if TYPE_CHECKING:
    from collections.abc import Iterable

    from firmware_protocol.parameters import Parameter
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.fields import Message

NUMBERED_HEAD: Final = {"session": 0, "sequence": 2}
"""Where a numbered message has its numbers, in bytes: the core reads them there, whatever the message is."""


@dataclass(frozen=True)
class FirmwareRole:
    """A role of the firmware.

    Attributes:
        name: Name of its folder and of what it brings, in C.
        product: AUTOPILOT_VERSION.product_id.
        messages: The messages that only it has.
        streams: What of these it sends by itself or on request, in the order of one control period, and the usual interval
            in ms; 0: on request only.
        parameters: All its parameters in the order of the wire, those of any robot among them.
        sensors: How many of its sensors may fail on request.
        asked: Its streams are asked for with more than their name, or of all robots at once: its `request` says what becomes
            of that.
        can_functions: The functions of its single frames on CAN, as `wire.can_layout` names them.
    """

    name: str
    product: int
    messages: tuple[type[Message], ...]
    streams: dict[type[Message], int]
    parameters: tuple[Parameter, ...]
    sensors: int
    can_functions: tuple[str, ...]
    asked: bool = False


def _product(role: Role) -> int:
    if role.product is None:
        raise ValueError(f"the {role.name} is no robot, and has no firmware of ours")
    return role.product


ROLES: Final = (
    FirmwareRole(
        name="junior",
        product=_product(JUNIOR),
        messages=tuple(JUNIOR_MESSAGES),
        streams={JuniorSensors: 20},
        parameters=JUNIOR_PARAMETERS,
        sensors=6,
        can_functions=("WHEELS", "SWITCHES", "EYES", "TRAVEL"),
    ),
    FirmwareRole(
        name="micro",
        product=2,
        messages=tuple(SWARM_MESSAGES),
        streams={SwarmObservation: 0, SwarmRanges: 0},
        parameters=SWARM_PARAMETERS,
        sensors=0,
        can_functions=("MOVE",),
        asked=True,
    ),
)
"""Every role. The first is what a board is that does not say."""

ANY_ROBOTS_MESSAGES: Final[tuple[type[Message], ...]] = (*STANDARD_MESSAGES, *ROBOT_MESSAGES)
"""What any robot says and understands."""
ANY_ROBOTS_PARAMETERS: Final = (*(parameter.name for parameter in ROBOT_PARAMETERS), "FAIL_ENABLE")
"""Parameters that the core itself looks at, of which each role has its own copy where it likes."""
OPTIONAL_PARAMETERS: Final = frozenset({"FAIL_ENABLE"})
"""Those of them that a role may lack: nothing of it fails on request then."""
NO_PARAMETER: Final = 255
ANY_ROBOTS_CAN_FUNCTIONS: Final = ("ESTOP", "ALIVE", "TRANSFER_DOWN", "TRANSFER_UP")


def understood(messages: Iterable[type[Message]]) -> list[type[Message]]:
    """What of these a robot takes over any link, in order of id.

    Args:
        messages: Message classes.

    Raises:
        ValueError: One is numbered, and does not begin with its numbers.
    """
    found = [message for message in messages if message.DIRECTION is not Direction.UP and message not in BYTE_LINKS_ONLY]
    for message in found:
        begins = offsets(message)
        if message.NUMBERED and any(begins[name] != at for name, at in NUMBERED_HEAD.items()):
            raise ValueError(f"{message.NAME} is numbered, and does not begin with session and sequence")
    return sorted(found, key=lambda message: message.ID)


def place(role: FirmwareRole, name: str) -> int:
    """Where a parameter stands among a role's.

    Args:
        role: The role.
        name: Name of the parameter.

    Returns:
        Its index; `NO_PARAMETER` where the role may lack it, and does.

    Raises:
        ValueError: The role has none of that name, and must.
    """
    names = [parameter.name for parameter in role.parameters]
    if name not in names and name in OPTIONAL_PARAMETERS:
        return NO_PARAMETER
    if name not in names:
        raise ValueError(f"{role.name} has no parameter {name}, which any robot has")
    return names.index(name)
