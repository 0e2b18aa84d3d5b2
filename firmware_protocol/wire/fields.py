"""How a dataclass says what it looks like on the wire, and the layout that follows from it.

A message is a frozen dataclass derived from `Message`; each field is annotated with a `Wire`. Everything else - the
MAVLink dialect, the DBC, the struct formats of the codecs, the protocol page - is derived from these annotations.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum, IntEnum, IntFlag
from functools import reduce
from operator import or_
from typing import Any, ClassVar, Final, Literal, get_args, get_type_hints

MAVLINK: Final = "mavlink"
"""A wire of bytes: MAVLink 2 frames."""
CAN: Final = "can"
"""A wire of CAN frames, each in its serial form of 16 bytes (`firmware_protocol.wire.can.frame`)."""

EnumType = type[IntEnum] | type[IntFlag]
WireType = Literal["u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "f32", "char"]

SIZES: Final[dict[str, int]] = {
    "u8": 1, "i8": 1, "char": 1, "u16": 2, "i16": 2, "u32": 4, "i32": 4, "f32": 4, "u64": 8, "i64": 8,
}  # fmt: skip


class Direction(Enum):
    """Which way a message goes."""

    UP = "robot to host"
    DOWN = "host to robot"
    BOTH = "both ways"


class Party(Enum):
    """Who, beside the host, says a message or understands it."""

    ROBOT = "any robot"
    JUNIOR = "a Junior"
    SWARM = "a micro-robot"
    REFEREE = "the referee of emulated bouts"
    TABLE = "the table of emulated micro-robots"

    @property
    def robot(self) -> bool:
        """It is a robot, and not what emulators put beside robots."""
        return self not in {Party.REFEREE, Party.TABLE}


@dataclass(frozen=True)
class Wire:
    """The wire side of one field.

    Attributes:
        type: Integer or float type on the wire; `char` is NUL-padded text.
        unit: Unit of the *Python* value (SI, or a count); empty for none.
        scale: Python value of one wire unit; the wire integer is the value divided by this, rounded to nearest.
        minimum: Least Python value accepted in either direction; None is the least the type can carry.
        maximum: Greatest, likewise. Of an enumerated field it is the enumeration's own, and is not given.
        count: Number of elements; 0 is a scalar, more is a tuple (or text, for `char`).
        enum: Enumeration or flags the value belongs to: nothing above its greatest member, or beside its flags, is accepted.
        newer: With `enum`: values that it does not have are accepted, too, since who says them may be newer than we are.
        extension: Added after the first version: MAVLink extension field, not sorted, not in the checksum seed.
        text: What it means, in a phrase.
        invalid: Wire value that says "not available"; the Python value is then None.
        secret: Never shown in an error's text.
        elements: Names of an array's elements where they are not only counted, as `("left", "right")`.
        nan: `f32` only: NaN is a value (MAVLink's "not given"). Elsewhere NaN, and everywhere infinity, is out of range.
    """

    type: WireType
    unit: str = ""
    scale: float = 1
    minimum: float | None = None
    maximum: float | None = None
    count: int = 0
    enum: EnumType | None = None
    extension: bool = False
    text: str = ""
    invalid: int | None = None
    nan: bool = False
    secret: bool = False
    newer: bool = False
    elements: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Take the range of an enumerated field from the enumeration.

        Raises:
            TypeError: It was given beside the enumeration, or there is none for `newer` to speak of; or there are not as many
                names as elements.
        """
        if self.elements and len(self.elements) != self.count:
            raise TypeError(f"{self.count} elements have not the names {', '.join(self.elements)}")
        if self.enum is None:
            if self.newer:
                raise TypeError("`newer` is said of an enumerated field")
            return
        if self.maximum is not None:
            raise TypeError(f"the range of a field of {self.enum.__name__} follows from it")
        if not self.newer:
            object.__setattr__(self, "maximum", greatest(self.enum))


def greatest(enum: EnumType) -> int:
    """The greatest value that an enumeration has: of flags, all of them together.

    Args:
        enum: The enumeration.
    """
    return reduce(or_, enum) if issubclass(enum, IntFlag) else max(enum)


class Message:
    """Base of all messages.

    Attributes:
        ID: MAVLink message id.
        NAME: Name in the dialect.
        DIRECTION: Which way it goes.
        NUMBERED: It carries `session` and `sequence`, is answered by ROBOT_ACK and is safe to repeat.
        PARTY: Who says it or understands it, beside the host.
    """

    ID: ClassVar[int] = -1
    NAME: ClassVar[str] = ""
    DIRECTION: ClassVar[Direction] = Direction.BOTH
    NUMBERED: ClassVar[bool] = False
    PARTY: ClassVar[Party] = Party.ROBOT

    def __init_subclass__(
        cls,
        *,
        id: int,  # noqa: A002
        direction: Direction,
        numbered: bool = False,
        party: Party = Party.ROBOT,
    ) -> None:
        """Set the class constants; the dialect's name follows from the class's own."""
        cls.ID = id
        cls.DIRECTION = direction
        cls.NUMBERED = numbered
        cls.PARTY = party
        cls.NAME = "".join("_" + c if c.isupper() else c for c in cls.__name__).lstrip("_").upper()


_FIELDS: Final[dict[type[Message], tuple[tuple[str, Wire], ...]]] = {}


def wire_fields(message: type[Message]) -> tuple[tuple[str, Wire], ...]:
    """The fields of a message as declared.

    Args:
        message: A message class.

    Returns:
        (name, wire) pairs in declared order.
    """
    if message not in _FIELDS:
        _FIELDS[message] = _read_annotations(message)
    return _FIELDS[message]


def _read_annotations(message: type[Message]) -> tuple[tuple[str, Wire], ...]:
    hints: dict[str, Any] = get_type_hints(message, include_extras=True)
    found: list[tuple[str, Wire]] = []
    for field in fields(message):  # type: ignore[arg-type]
        wire = next((extra for extra in get_args(hints[field.name]) if isinstance(extra, Wire)), None)
        if wire is None:
            raise TypeError(f"{message.__name__}.{field.name} has no Wire annotation")
        found.append((field.name, wire))
    return tuple(found)


def wire_order(message: type[Message]) -> tuple[tuple[str, Wire], ...]:
    """The fields in the order of the payload: MAVLink sorts by size, widest first, and appends extensions unsorted.

    Args:
        message: A message class.

    Returns:
        (name, wire) pairs in payload order.
    """
    declared = wire_fields(message)
    base = sorted((pair for pair in declared if not pair[1].extension), key=lambda pair: -SIZES[pair[1].type])
    return tuple(base) + tuple(pair for pair in declared if pair[1].extension)
