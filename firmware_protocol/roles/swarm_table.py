"""What one can ask of the table of emulated micro-robots. Each returns a ticket at once; the answer comes with time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import TABLE_NODE, TABLE_SYSTEM, BoxShape, TableKind, TablePlace, TableReset, TableState
from firmware_protocol.peer.exchanges.commands import NumberedExchange
from firmware_protocol.peer.role import Role
from firmware_protocol.wire.fields import CAN

if TYPE_CHECKING:
    from firmware_protocol.messages import RobotAck
    from firmware_protocol.peer.companion import Companion
    from firmware_protocol.peer.exchanges.exchange import Ticket

TABLE: Final = Role(name="table", product=None, readings=TableState, streams={TableState: 0.2}, slowest=5.0)
"""The table: no robot, and so in no table of roles."""


def table_system(wire: str) -> int:
    """System id of a table.

    Args:
        wire: `mavlink` or `can`: there its nodes end at 127.
    """
    return TABLE_NODE if wire == CAN else TABLE_SYSTEM


def reset_table(
    table: Companion,
    seed: int,
    size: tuple[float, float],
    *,
    wall: bool = False,
    kind: TableKind = TableKind.PLAIN,
    box: BoxShape = BoxShape.NONE,
    room: int = 0,
) -> Ticket[RobotAck]:
    """Set the table up anew.

    Args:
        table: The table, on its first network.
        seed: Noise follows from it, 0..2^32 - 1.
        size: Along x, along y, in m.
        wall: A wall runs round it.
        kind: What stands on it.
        box: Shape of the box.
        room: Number of the room whose walls stand on it; 0: none.
    """
    message = TableReset(seed, 0, 0, size, table.system, table.component, int(wall), kind, box, room)
    return table.ask(NumberedExchange("setting up the table", message, table.numbering), TABLE)


def place(table: Companion, system: int, position: tuple[float, float], heading: float = 0.0) -> Ticket[RobotAck]:
    """Pick something up and put it there, its wheels standing.

    Args:
        table: The table, on the network of the robot.
        system: System id of the robot; `THE_BOX` and `THE_GOAL` of `firmware_protocol.messages.table` on the first network.
        position: Of its centre, x and y, in m.
        heading: In rad.
    """
    message = TablePlace(0, 0, position, heading, table.system, table.component, system)
    return table.ask(NumberedExchange("placing", message, table.numbering), TABLE)
