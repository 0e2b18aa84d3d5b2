"""The range of an enumerated field is the enumeration's own, so that a new member needs no second place."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Annotated

import pytest

from firmware_protocol.errors import EncodeError
from firmware_protocol.messages import MESSAGES, OpponentCode
from firmware_protocol.wire.fields import SIZES, Direction, EnumType, Message, Wire, wire_fields
from firmware_protocol.wire.mavlink_layout import raw_limits
from firmware_protocol.wire.payload import Payload

ENUMERATED = [
    pytest.param(wire, id=f"{message.NAME}.{name}")
    for message in MESSAGES.values()
    for name, wire in wire_fields(message)
    if wire.enum is not None
]


def members_of(enum: EnumType) -> list[int]:
    return [int(member) for member in enum]


@pytest.mark.parametrize("wire", ENUMERATED)
def test_an_enumerated_field_takes_every_member_and_nothing_greater(wire: Wire) -> None:
    assert wire.enum is not None
    low, high = raw_limits(wire)
    members = members_of(wire.enum)
    assert low <= min(members)
    if wire.newer:
        assert high == 2 ** (8 * SIZES[wire.type]) - 1
    elif issubclass(wire.enum, IntFlag):
        assert high == sum(members)
    else:
        assert high == max(members)


class Before(IntEnum):
    """An enumeration."""

    LIGHT = 0
    HEAVY = 1


class After(IntEnum):
    """The same, with one member more."""

    LIGHT = 0
    HEAVY = 1
    WEDGE = 2


class Side(IntFlag):
    """Flags."""

    LEFT = 1
    RIGHT = 2


@dataclass(frozen=True)
class Place(Message, id=65000, direction=Direction.DOWN):
    """A message with them."""

    opponent: Annotated[int, Wire("u8", enum=Before)]
    sides: Annotated[int, Wire("u8", enum=Side)] = 0


@dataclass(frozen=True)
class PlaceMore(Message, id=65001, direction=Direction.DOWN):
    """The same, once there is one member more."""

    opponent: Annotated[int, Wire("u8", enum=After)]
    sides: Annotated[int, Wire("u8", enum=Side)] = 0


def test_a_member_added_to_an_enumeration_is_accepted_on_the_wire() -> None:
    assert Payload(PlaceMore).pack(PlaceMore(After.WEDGE, Side.LEFT | Side.RIGHT)) == bytes((2, 3))
    for message in (Place(After.WEDGE), PlaceMore(After.WEDGE + 1), PlaceMore(0, 4)):
        with pytest.raises(EncodeError):
            Payload(type(message)).pack(message)


def test_a_range_is_not_given_beside_an_enumeration() -> None:
    with pytest.raises(TypeError, match="OpponentCode"):
        Wire("u8", enum=OpponentCode, maximum=6)
    with pytest.raises(TypeError, match="enumerated"):
        Wire("u8", newer=True)
