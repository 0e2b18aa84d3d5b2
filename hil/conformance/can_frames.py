"""CAN frames as no codec of ours would make them: values out of range, parts that are missing, damaged or foreign."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Final

from fastcrc.crc16 import mcrf4xx

from firmware_protocol.wire.can import layout
from firmware_protocol.wire.can.frame import CanFrame
from firmware_protocol.wire.fields import SIZES, wire_fields
from firmware_protocol.wire.mavlink_layout import STRUCT_CODES, crc_extra, offsets
from firmware_protocol.wire.payload import PAYLOADS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.fields import Message

UNKNOWN_ID: Final = 49_999
"""No message of this protocol, nor of MAVLink's own sets."""
STOP: Final = b"\1"
"""Data of JUNIOR_ESTOP."""


def identifier(function: int, node: int) -> int:
    """The identifier of a function and a node."""
    return function << layout.FUNCTION_SHIFT | node


def _number(frames: Sequence[CanFrame]) -> int:
    """The number of a transfer."""
    return frames[0].data[0] >> layout.PART_BITS


def body(frames: Sequence[CanFrame]) -> bytes:
    """What all parts of a transfer hold: message id, length, payload, CRC."""
    return b"".join(frame.data[1:] for frame in frames)


def cut(frames: Sequence[CanFrame], data: bytes) -> list[CanFrame]:
    """The same transfer with other contents, whatever these are.

    Args:
        frames: A good transfer: identifier and number are taken from it.
        data: What the parts are to hold, checksum and all.
    """
    head, size = _number(frames) << layout.PART_BITS, layout.PART_DATA
    return [
        CanFrame(frames[0].identifier, bytes((head | part,)) + data[part * size : part * size + size])
        for part in range(-(-len(data) // size))
    ]


def sealed(frames: Sequence[CanFrame], message_id: int, payload: bytes, extra: int) -> list[CanFrame]:
    """The same transfer with another message in it, and a good checksum.

    Args:
        frames: A good transfer: identifier and number are taken from it.
        message_id: Id of the message.
        payload: Its payload, of any length that a transfer can have.
        extra: Seed of the message.
    """
    data = struct.pack("<HB", message_id, len(payload)) + payload
    return cut(frames, data + struct.pack("<H", mcrf4xx(data + bytes((extra,)))))


def payload(frames: Sequence[CanFrame]) -> bytes:
    """The payload of a transfer."""
    return body(frames)[layout.TRANSFER_HEAD : -layout.TRANSFER_TAIL]


def forged(frames: Sequence[CanFrame], message: Message, name: str, value: float, index: int = 0) -> list[CanFrame]:
    """The same message with another value in one field, with a good checksum.

    Args:
        frames: The message's frames: one, of JUNIOR_WHEELS, or a transfer.
        message: What they carry.
        name: The field.
        value: Its new value as it stands on the wire: an integer in wire units, or a float for `f32`.
        index: Which element, where the field has several.
    """
    kind = type(message)
    wire = dict(wire_fields(kind))[name]
    full = bytearray(PAYLOADS[kind.ID].pack(message))
    struct.pack_into(f"<{STRUCT_CODES[wire.type]}", full, offsets(kind)[name] + index * SIZES[wire.type], value)
    if frames[0].identifier >> layout.FUNCTION_SHIFT == layout.WHEELS_FUNCTION:
        start = offsets(kind)["sequence"]
        return [CanFrame(frames[0].identifier, bytes(full[start : start + frames[0].length]))]
    start, count = layout.target_cut(kind)
    return sealed(frames, kind.ID, bytes(full[:start] + full[start + count :]), crc_extra(kind))


def without(frames: Sequence[CanFrame], part: int) -> list[CanFrame]:
    """The same transfer with one part missing."""
    return [frame for at, frame in enumerate(frames) if at != part]


def resized(frame: CanFrame, length: int) -> CanFrame:
    """The same frame with fewer data bytes, or with zeros added.

    Args:
        frame: A frame.
        length: How many bytes it is to have, 0 to 8.
    """
    return CanFrame(frame.identifier, frame.data[:length].ljust(length, b"\0"), frame.extended)


def readdressed(frame: CanFrame, function: int, node: int) -> CanFrame:
    """The same data under another identifier."""
    return CanFrame(identifier(function, node), frame.data)
