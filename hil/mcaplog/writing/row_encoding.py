"""Many robot messages of one kind as log entries at once: the columns of an array, between tags that never change.

What comes out is what `hil.mcaplog.writing.encode` makes of each message.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.wire.rows import column
from hil.mcaplog.schemas import SENDER_FIELDS, FieldType, SchemaField, message_schema
from hil.mcaplog.writing.encode import NO_FRAME, field_tag

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows

_TYPES: Final[dict[FieldType, str]] = {
    "double": "<f8", "fixed32": "<u4", "sfixed32": "<i4", "fixed64": "<u8", "sfixed64": "<i8", "bool": "u1", "enum": "<u2",
}  # fmt: skip


@dataclass(frozen=True)
class EntryRows:
    """Entries of one channel, all of the same length.

    Attributes:
        channel: Their channel.
        times: Log time of each, in s, shape (entries,).
        places: Where each belongs among all that are written with them, ascending, shape (entries,).
        data: The entries, shape (entries, bytes).
    """

    channel: int
    times: NDArray[np.float64]
    places: NDArray[np.intp]
    data: NDArray[np.uint8]

    def between(self, first: int, last: int) -> EntryRows:
        """Those whose place is at least `first`, and less than `last`."""
        begin, end = np.searchsorted(self.places, (first, last))
        return EntryRows(self.channel, self.times[begin:end], self.places[begin:end], self.data[begin:end])


def encodable(message: type[Message]) -> bool:
    """Whether all entries of a message have the same length: it holds no text.

    Args:
        message: Class of the messages.
    """
    return all(field.kind in _TYPES for field in message_schema(message).fields)


def encode_rows(
    message: type[Message], rows: Rows, system: ArrayLike, component: ArrayLike, frame: ArrayLike = NO_FRAME
) -> NDArray[np.uint8]:
    """Encode messages, with who sent them.

    Args:
        message: Class of the messages, one that is `encodable`.
        rows: The messages.
        system: MAVLink system id of each sender, or of all.
        component: Likewise component id.
        frame: Frame sequence number of each, 0..255.

    Returns:
        The entries, shape (messages, bytes).
    """
    empty = _empty(message)
    entries = np.repeat(empty, len(rows))
    for name, value in zip(SENDER_FIELDS, (system, component, frame), strict=True):
        entries[name] = value
    for field in message_schema(message).fields:
        if field.name in SENDER_FIELDS:
            continue
        values = column(message, rows, field.name)
        entries[field.name] = (values & 0x7F | 0x80) + (values.astype(np.uint16) >> 7 << 8) if field.kind == "enum" else values
    return entries.view(np.uint8).reshape(len(rows), empty.dtype.itemsize)


def _empty(message: type[Message]) -> NDArray[np.void]:
    """One entry that holds tags, and nothing else yet."""
    if message not in _EMPTY:
        _EMPTY[message] = _make_empty(message)
    return _EMPTY[message]


_EMPTY: Final[dict[type[Message], NDArray[np.void]]] = {}


def _make_empty(message: type[Message]) -> NDArray[np.void]:
    layout: list[Any] = []
    tags: dict[str, bytes] = {}
    for field in message_schema(message).fields:
        kind = _TYPES[field.kind]
        tag = field_tag(field)
        tags[_tag_name(field)] = tag
        layout += [
            (_tag_name(field), "u1", (len(tag),)),
            (field.name, kind, (field.count,)) if field.count else (field.name, kind),
        ]
    entry = np.zeros(1, np.dtype(layout))
    for name, tag in tags.items():
        entry[name] = np.frombuffer(tag, np.uint8)
    return entry


def _tag_name(field: SchemaField) -> str:
    return f"tag of {field.name}"
