"""Frames as no codec of ours would make them: broken, foreign, or with values out of range."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Final

from fastcrc.crc16 import mcrf4xx

from firmware_protocol.wire.fields import SIZES, wire_fields
from firmware_protocol.wire.mavlink_layout import (
    CHECKSUM_LENGTH,
    FLAG_SIGNED,
    HEADER_LENGTH,
    STRUCT_CODES,
    crc_extra,
    offsets,
    payload_length,
)

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

UNKNOWN_ID: Final = 49_999
"""No message of this protocol, nor of MAVLink's own sets."""
_AT_LENGTH, _AT_FLAGS, _AT_ID = 1, 2, 7
_MARKER_1: Final = 0xFE
"""First byte of a MAVLink 1 frame."""


def _body(frame: bytes) -> bytes:
    """The payload as it stands in a frame, signed or not."""
    return frame[HEADER_LENGTH : HEADER_LENGTH + frame[_AT_LENGTH]]


def _seal(head: bytes, body: bytes, extra: int) -> bytes:
    """A frame of header and payload: the length is set, the checksum computed. What signs it is the probe's business."""
    frame = head[:_AT_LENGTH] + bytes((len(body),)) + head[_AT_FLAGS:HEADER_LENGTH] + body
    return frame + struct.pack("<H", mcrf4xx(frame[1:] + bytes((extra,))))


def untrimmed(frame: bytes, kind: type[Message]) -> bytes:
    """The same frame with the zeros at the end of its payload.

    Args:
        frame: A good frame.
        kind: What it carries.
    """
    body = _body(frame).ljust(payload_length(kind), b"\0")
    return _seal(frame[:HEADER_LENGTH], body, crc_extra(kind))


def unsigned(frame: bytes, kind: type[Message]) -> bytes:
    """The same frame without its signature, with a good checksum.

    Args:
        frame: A good frame.
        kind: What it carries.
    """
    head = frame[:_AT_FLAGS] + bytes((frame[_AT_FLAGS] & ~FLAG_SIGNED,)) + frame[_AT_FLAGS + 1 : HEADER_LENGTH]
    return _seal(head, _body(frame), crc_extra(kind))


def forged(frame: bytes, kind: type[Message], name: str, value: float, index: int = 0) -> bytes:
    """The same frame with another value in one field, with a good checksum.

    Args:
        frame: A good frame.
        kind: What it carries.
        name: The field.
        value: Its new value as it stands on the wire: an integer in wire units, or a float for `f32`.
        index: Which element, where the field has several.
    """
    wire = dict(wire_fields(kind))[name]
    body = bytearray(_body(frame).ljust(payload_length(kind), b"\0"))
    struct.pack_into(f"<{STRUCT_CODES[wire.type]}", body, offsets(kind)[name] + index * SIZES[wire.type], value)
    return _seal(frame[:HEADER_LENGTH], bytes(body), crc_extra(kind))


def checksum_at(frame: bytes) -> int:
    """Where the last byte of a frame's checksum is."""
    return HEADER_LENGTH + frame[_AT_LENGTH] + CHECKSUM_LENGTH - 1


def damaged(frame: bytes, position: int, mask: int = 0x55) -> bytes:
    """The same frame with some bits of one byte turned over.

    Args:
        frame: A frame.
        position: Which byte; negative counts from the end.
        mask: Which bits.
    """
    broken = bytearray(frame)
    broken[position] ^= mask
    return bytes(broken)


def foreign(frame: bytes) -> bytes:
    """A whole frame of a message that nobody knows, with the numbers and the payload of this one."""
    head = frame[:_AT_ID] + UNKNOWN_ID.to_bytes(3, "little")
    return _seal(head, _body(frame), 0)


def header(frame: bytes, *, length: int) -> bytes:
    """The header of this frame alone, with a length that its message may not have."""
    return frame[:_AT_LENGTH] + bytes((length,)) + frame[_AT_FLAGS:HEADER_LENGTH]


def version_1(frame: bytes, kind: type[Message]) -> bytes:
    """The same message in a MAVLink 1 frame.

    Args:
        frame: A good frame of a message whose id is below 256.
        kind: What it carries.
    """
    body = _body(frame).ljust(payload_length(kind, extensions=False), b"\0")
    head = bytes((len(body), frame[4], frame[5], frame[6], kind.ID)) + body
    return bytes((_MARKER_1,)) + head + struct.pack("<H", mcrf4xx(head + bytes((crc_extra(kind),))))
