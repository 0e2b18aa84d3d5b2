"""What is where on the CAN bus: functions, identifiers, single frames, and the head and tail of a transfer.

An 11-bit identifier is `function << 7 | node`. The node is the robot's system id, 1 to 127, and 0 for all; a function is
twice the urgency class (0 is the most urgent) plus the direction (0 to the robot, 1 from it). One host is on the bus: two
nodes may not send the same identifier. The emulators' referee, or table, is a node of its own and has functions of its own.
A function means the same whatever the role of the node: a role that needs single frames has functions of its own, and the
other roles leave them alone.

A transfer is a message cut into frames with one identifier. Byte 0 of each is `transfer << 5 | part`; the other seven bytes
of all parts, one after the other, are message number (u16), length (u8), payload and CRC-16/MCRF4XX (u16) of all that and
the message's CRC_EXTRA. The payload is MAVLink's untrimmed one without the target fields.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from firmware_protocol.messages import JuniorSensors, JuniorWheels, RobotAlive, SwarmMove
from firmware_protocol.wire.fields import SIZES, Message, Wire, wire_order

FUNCTION_SHIFT: Final = 7
FUNCTION_MASK: Final = 0x780
"""Bits of an 11-bit identifier that hold the function; the rest is the node."""
NODE_MASK: Final = 0x7F
LAST_NODE: Final = 127
"""Greatest node id; a system id beyond it has no place on the bus."""

ESTOP_FUNCTION: Final = 0
WHEELS_FUNCTION: Final = 2
SWITCHES_FUNCTION: Final = 3
MOVE_FUNCTION: Final = 4
EYES_FUNCTION: Final = 5
ALIVE_FUNCTION: Final = 6
TRAVEL_FUNCTION: Final = 7
REFEREE_DOWN_FUNCTION: Final = 10
REFEREE_UP_FUNCTION: Final = 11
TRANSFER_DOWN_FUNCTION: Final = 12
TRANSFER_UP_FUNCTION: Final = 13
NEVER_FUNCTION: Final = 15

TRANSFERS: Final = 8
"""Transfers are numbered modulo this, for each identifier."""
PART_BITS: Final = 5
PART_MASK: Final = 31
PART_DATA: Final = 7
"""Bytes of a transfer in one frame."""
TRANSFER_HEAD: Final = 3
"""Message number and length."""
TRANSFER_TAIL: Final = 2
"""CRC."""
MAX_TRANSFER: Final = (PART_MASK + 1) * PART_DATA - TRANSFER_HEAD - TRANSFER_TAIL
"""Longest payload that a transfer can carry, in bytes."""

TARGET_FIELDS: Final = frozenset({"target_system", "target_component", "target"})
"""Fields that CAN does not carry: the identifier says for whom a frame is."""


@dataclass(frozen=True)
class SingleFrame:
    """A frame that travels alone.

    Attributes:
        identifier: Its identifier, for node 0.
        name: Its name in the database.
        text: What it is.
        sender: `HOST` or `ROBOT`.
        fields: What is in it, in order.
    """

    identifier: int
    name: str
    text: str
    sender: str
    fields: tuple[tuple[str, Wire], ...]

    @property
    def length(self) -> int:
        """Data bytes."""
        return sum(SIZES[wire.type] * max(1, wire.count) for _, wire in self.fields)


def long_identifier(message: type[Message]) -> int:
    """The never-sent 29-bit identifier under which a message is in the DBC at full length."""
    return message.ID << 11 | NEVER_FUNCTION << FUNCTION_SHIFT


def _pick(message: type[Message], *names: str) -> tuple[tuple[str, Wire], ...]:
    by_name = dict(wire_order(message))
    return tuple((name, by_name[name]) for name in names)


def single_frames() -> tuple[SingleFrame, ...]:
    """The frames that travel alone, node 0."""
    stop = Wire("u8", minimum=1, maximum=1, text="1; any other value is ignored")
    time = Wire("u32", "s", 1e-3, text="Time since boot, wraps after 49 days")
    flags, battery, travel = _pick(JuniorSensors, "flags", "battery", "travel")
    table: tuple[tuple[int, str, str, str, tuple[tuple[str, Wire], ...]], ...] = (
        (ESTOP_FUNCTION, "JUNIOR_ESTOP", "Emergency stop, latched; node 0 stops all.", "HOST", (("stop", stop),)),
        (
            WHEELS_FUNCTION,
            "JUNIOR_WHEELS_FRAME",
            "JUNIOR_WHEELS without the session.",
            "HOST",
            _pick(JuniorWheels, "sequence", "speed", "duration"),
        ),
        (
            MOVE_FUNCTION,
            "SWARM_MOVE_FRAME",
            "SWARM_MOVE without session, face, speed, effort and sectors.",
            "HOST",
            _pick(SwarmMove, "sequence", "heading", "distance", "sector", "options"),
        ),
        (
            ALIVE_FUNCTION,
            "ROBOT_ALIVE_FRAME",
            "ROBOT_ALIVE: the host is there; node 0 tells all.",
            "HOST",
            _pick(RobotAlive, "host"),
        ),
        (
            SWITCHES_FUNCTION,
            "JUNIOR_SENSORS_SWITCHES",
            "Digest of JUNIOR_SENSORS: decisions, battery.",
            "ROBOT",
            (("time", time), flags, battery),
        ),
        (
            EYES_FUNCTION,
            "JUNIOR_SENSORS_EYES",
            "Digest of JUNIOR_SENSORS: eyes and floor, raw.",
            "ROBOT",
            _pick(JuniorSensors, "eye", "floor"),
        ),
        (TRAVEL_FUNCTION, "JUNIOR_SENSORS_TRAVEL", "Digest of JUNIOR_SENSORS: wheel travel.", "ROBOT", (travel,)),
    )
    return tuple(
        SingleFrame(function << FUNCTION_SHIFT, name, text, sender, fields) for function, name, text, sender, fields in table
    )


def target_cut(message: type[Message]) -> tuple[int, int]:
    """Which bytes of MAVLink's payload CAN leaves out.

    Args:
        message: A message class.

    Returns:
        Offset and number of the bytes that say for whom it is; 0 bytes where none does.

    Raises:
        TypeError: They do not stand together.
    """
    at, start, cut = 0, 0, 0
    for name, wire in wire_order(message):
        if name in TARGET_FIELDS:
            if cut and at != start + cut:
                raise TypeError(f"the target fields of {message.NAME} must stand together")
            start = start if cut else at
            cut += 1
        at += SIZES[wire.type] * max(1, wire.count)
    return start, cut
