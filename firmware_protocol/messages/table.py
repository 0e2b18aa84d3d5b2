"""The messages of the table that emulated micro-robots stand on: set it up, place who is on it, look at it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Final

from firmware_protocol.messages.fields import AXES, Sequence, Session, Target, TargetComponent
from firmware_protocol.messages.swarm import GREATEST_ANGLE, Heading, Position
from firmware_protocol.wire.fields import Direction, Message, Party, Wire

THE_BOX: Final = 0
"""In TABLE_PLACE.system, the box."""
THE_GOAL: Final = 255
"""Likewise, the goal."""


class TableKind(IntEnum):
    """What stands on a table, beside robots."""

    PLAIN = 0
    BOX = 1
    OBSTACLES = 2


class BoxShape(IntEnum):
    """Shape of the box."""

    NONE = 0
    CYLINDER = 1
    CUBE = 2


@dataclass(frozen=True)
class TableReset(Message, id=47310, direction=Direction.DOWN, numbered=True, party=Party.TABLE):
    """Set the table up anew: its size, its wall, what stands on it, and its noise from the beginning.

    Taken on the first network only; on others it is refused (BAD_VALUE).
    """

    seed: Annotated[int, Wire("u32", text="Noise follows from it")]
    session: Session
    sequence: Sequence
    size: Annotated[tuple[float, ...], Wire("u16", "m", 1e-3, count=2, elements=AXES, text="Size: along x, along y")]
    target_system: Target
    target_component: TargetComponent
    wall: Annotated[int, Wire("u8", maximum=1, text="1: a wall runs round it")]
    kind: Annotated[int, Wire("u8", enum=TableKind, text="What stands on it")]
    box: Annotated[int, Wire("u8", enum=BoxShape, text="Shape of the box")]
    map: Annotated[int, Wire("u8", text="Number of the room: 1 to 3 are known to every table, its own follow; 0: none")]


@dataclass(frozen=True)
class TablePlace(Message, id=47311, direction=Direction.DOWN, numbered=True, party=Party.TABLE):
    """Pick something up and put it there, its wheels standing. A robot need be neither armed nor in a session.

    Box and goal are taken on the first network only.
    """

    session: Session
    sequence: Sequence
    position: Position
    heading: Heading
    target_system: Target
    target_component: TargetComponent
    system: Annotated[int, Wire("u8", text="System id of a robot of this network; 0: the box; 255: the goal")]


@dataclass(frozen=True)
class TableState(Message, id=47312, direction=Direction.UP, party=Party.TABLE):
    """What is to be seen of the table, 5 Hz and on change, on every network."""

    time: Annotated[float, Wire("u64", "s", 1e-6, text="Time of the emulation")]
    box: Annotated[tuple[float, ...], Wire("i16", "m", 1e-3, count=2, elements=AXES, text="Position of the box: x, y")]
    box_heading: Annotated[float, Wire("i16", "rad", 1e-4, -GREATEST_ANGLE, GREATEST_ANGLE, text="Heading of the box")]
    goal: Annotated[tuple[float, ...], Wire("i16", "m", 1e-3, count=2, elements=AXES, text="Position of the goal: x, y")]
    contacts: Annotated[int, Wire("u16", text="Who touches the box, of the first 16 robots: bit i for the one in row i")]
    resets: Annotated[int, Wire("u16", text="How often the table has been set up anew, by TABLE_RESET")]


TABLE_MESSAGES: Final[tuple[type[Message], ...]] = (TableReset, TablePlace, TableState)
