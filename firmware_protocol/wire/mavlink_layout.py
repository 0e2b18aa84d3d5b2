"""How MAVLink 2 lays a message out: lengths, offsets, struct formats and the checksum seed, all from its fields.

Source: the MAVLink guide, "Packet Serialization" (https://mavlink.io/en/guide/serialization.html).
"""

from __future__ import annotations

from typing import Final

from fastcrc.crc16 import mcrf4xx

from firmware_protocol.wire.fields import SIZES, Message, Wire, wire_order

MARKER: Final = 0xFD
"""First byte of a MAVLink 2 frame."""
HEADER_LENGTH: Final = 10
"""Marker, length, incompatibility flags, compatibility flags, sequence, system, component, and three bytes of message id."""
CHECKSUM_LENGTH: Final = 2
SIGNATURE_LENGTH: Final = 13
FLAG_SIGNED: Final = 0x01
"""The only incompatibility flag there is: a signature follows the checksum."""
MAX_PAYLOAD: Final = 255

C_TYPES: Final[dict[str, str]] = {
    "u8": "uint8_t", "i8": "int8_t", "u16": "uint16_t", "i16": "int16_t", "u32": "uint32_t", "i32": "int32_t",
    "u64": "uint64_t", "i64": "int64_t", "f32": "float", "char": "char",
}  # fmt: skip
"""Names of the wire types in the dialect and in C."""

STRUCT_CODES: Final[dict[str, str]] = {
    "u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "u64": "Q", "i64": "q", "f32": "f", "char": "s",
}  # fmt: skip
"""Codes of the wire types in Python's `struct`."""

INTEGER_LIMITS: Final[dict[str, tuple[int, int]]] = {
    "u8": (0, 2**8 - 1), "i8": (-(2**7), 2**7 - 1), "u16": (0, 2**16 - 1), "i16": (-(2**15), 2**15 - 1),
    "u32": (0, 2**32 - 1), "i32": (-(2**31), 2**31 - 1), "u64": (0, 2**64 - 1), "i64": (-(2**63), 2**63 - 1),
}  # fmt: skip
"""Least and greatest wire value of each integer type."""


def wire_size(wire: Wire) -> int:
    """Bytes a field occupies in the payload."""
    return SIZES[wire.type] * max(1, wire.count)


def raw_limits(wire: Wire) -> tuple[int, int]:
    """Least and greatest wire integer a field accepts, `invalid` aside.

    A scaled 64-bit field carries at most 2**53 units, which is what a float holds exactly (285 years in us).

    Args:
        wire: An integer field.

    Returns:
        (least, greatest), in wire units.
    """
    low, high = INTEGER_LIMITS[wire.type]
    if wire.scale != 1:
        low, high = max(low, -(2**53)), min(high, 2**53)
    if wire.minimum is not None:
        low = max(low, round(wire.minimum / wire.scale))
    if wire.maximum is not None:
        high = min(high, round(wire.maximum / wire.scale))
    return low, high


def offsets(message: type[Message]) -> dict[str, int]:
    """Where each field begins in the payload.

    Args:
        message: A message class.

    Returns:
        Byte offset by field name, in payload order.
    """
    found: dict[str, int] = {}
    at = 0
    for name, wire in wire_order(message):
        found[name] = at
        at += wire_size(wire)
    return found


def payload_length(message: type[Message], *, extensions: bool = True) -> int:
    """Length of the untrimmed payload.

    Args:
        message: A message class.
        extensions: Count the extension fields.

    Returns:
        Bytes.
    """
    return sum(wire_size(wire) for _, wire in wire_order(message) if extensions or not wire.extension)


def crc_extra(message: type[Message]) -> int:
    """The seed that makes the checksum of a frame depend on its message's definition (MAVLink's CRC_EXTRA).

    Args:
        message: A message class.

    Returns:
        One byte; extension fields have no part in it.
    """
    text = bytearray(f"{message.NAME} ".encode())
    for name, wire in wire_order(message):
        if wire.extension:
            continue
        text += f"{C_TYPES[wire.type]} {name} ".encode()
        if wire.count:
            text.append(wire.count)
    crc = mcrf4xx(bytes(text))
    return crc & 0xFF ^ crc >> 8


def target_offsets(message: type[Message]) -> tuple[int | None, int | None]:
    """Where the payload says whom it is for.

    Args:
        message: A message class.

    Returns:
        Offsets of the system and of the component addressed; None where there is none. MANUAL_CONTROL calls the first `target`.
    """
    found = offsets(message)
    system = found.get("target_system", found.get("target"))
    return system, found.get("target_component")
