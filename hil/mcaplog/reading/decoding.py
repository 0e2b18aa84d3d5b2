"""The channels of a log, and what decodes their entries."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from struct import Struct
from typing import Any, Final

from mcap.records import Channel
from mcap.records import Schema as SchemaRecord
from mcap_protobuf.decoder import DecoderFactory

from firmware_protocol.messages import MESSAGES
from hil.mcaplog.limits import LARGEST_CHANNEL, LARGEST_SCHEMAS, MOST_CHANNELS
from hil.mcaplog.reading.unpacking import DAMAGE, stream
from hil.mcaplog.records import RECORDS
from hil.mcaplog.schemas import (
    RENAMED,
    RENAMED_TOPICS,
    SENDER_FIELDS,
    SINCE_2_0,
    Schema,
    matches,
    message_schema,
    record_schema,
)
from hil.mcaplog.writing.encode import NO_FRAME, compile_rebuilder, read_sender

Decode = Callable[[bytes], tuple[Any, ...]]
"""An entry's data -> the value, and where it is a robot message the sender and the frame."""

_NUMBER: Final = Struct("<H")
_KNOWN: Final[dict[str, Schema]] = {
    schema.name: schema
    for schema in (*(message_schema(message) for message in MESSAGES.values()), *(record_schema(record) for record in RECORDS))
}


class UnreadableError(ValueError):
    """The entries of a channel can't be decoded; the text says why."""


def sender_only(data: bytes) -> tuple[Any, ...]:
    """Decode of a robot message nothing but who sent it."""
    return None, *(read_sender(data) or ())


def as_bytes(data: bytes) -> tuple[Any, ...]:
    """Decode nothing."""
    return (data,)


class Channels:
    """The schemas and channels of a log, as they are met.

    Args:
        note: Is told, in words, what was left out.
    """

    def __init__(self, note: Callable[[str], None]) -> None:
        self._note = note
        self._schemas: dict[int, SchemaRecord] = {}
        self._channels: dict[int, Channel] = {}
        self._made: dict[tuple[int, str], Decode | None] = {}
        self._size = 0

    def add_schema(self, content: bytes) -> None:
        """Take a schema record; one whose number is known already is not looked at again."""
        (number,) = _NUMBER.unpack_from(content)
        if number in self._schemas:
            return
        self._size += len(content)
        if self._size > LARGEST_SCHEMAS:
            self._size -= len(content)
            self._note(f"schema {number} was left out: there are more than {LARGEST_SCHEMAS:,} bytes of them")
            return
        self._schemas[number] = SchemaRecord.read(stream(content))

    def add_channel(self, content: bytes) -> None:
        """Take a channel record; likewise."""
        (number,) = _NUMBER.unpack_from(content)
        if number in self._channels:
            return
        if len(content) > LARGEST_CHANNEL or len(self._channels) >= MOST_CHANNELS:
            self._note(f"channel {number} was left out: there are too many, or it is too large")
            return
        self._channels[number] = Channel.read(stream(content))

    def topic(self, channel: int) -> str:
        """Topic of a channel, as it is called today; empty for one that is not known."""
        found = self._channels.get(channel)
        return "" if found is None else RENAMED_TOPICS.get(found.topic, found.topic)

    def schema(self, channel: int) -> SchemaRecord | None:
        """Schema of a channel; None where it has none, or it is not known."""
        found = self._channels.get(channel)
        return None if found is None else self._schemas.get(found.schema_id)

    def described(self, channel: int) -> tuple[Channel, SchemaRecord | None] | None:
        """A channel and its schema, None where it has none; None where one of the two is missing."""
        found, schema = self._channels.get(channel), self.schema(channel)
        return None if found is None or (found.schema_id and schema is None) else (found, schema)

    def add_all(self, schemas: Iterable[bytes], channels: Iterable[bytes]) -> None:
        """Take many records."""
        for content in schemas:
            self.add_schema(content)
        for content in channels:
            self.add_channel(content)

    @property
    def complete(self) -> bool:
        """There are channels, and all their schemas are known."""
        return bool(self._channels) and all(self.described(channel) for channel in self._channels)

    def __contains__(self, channel: int) -> bool:
        return channel in self._channels

    def decoder(self, channel: int) -> Decode:
        """What decodes the entries of a channel; it is made when it is first asked for.

        Raises:
            UnreadableError: The log does not say what they look like, or not in a way that can be read.
        """
        found = self._channels.get(channel)
        if found is None:
            raise UnreadableError("the log describes no such channel")
        if not found.schema_id:
            return as_bytes
        key = found.schema_id, found.message_encoding
        if key not in self._made:
            schema = self._schemas.get(found.schema_id)
            if schema is None:
                raise UnreadableError("its schema is missing")
            self._made[key] = None  # should it fail to be made, it is not tried again
            with suppress(*DAMAGE):
                self._made[key] = _decoder(schema, found.message_encoding)
        made = self._made[key]
        if made is None:
            raise UnreadableError("its schema is damaged")
        return made


def decoder_of(name: str, schema: bytes, schema_encoding: str, encoding: str) -> Callable[[bytes], Any]:
    """What decodes entries that are not in a log yet: data -> the value.

    Args:
        name: Full name of the schema.
        schema: The schema.
        schema_encoding: How the schema is written.
        encoding: How the entries are.
    """
    decode = _decoder(SchemaRecord(id=1, name=name, encoding=schema_encoding, data=schema), encoding)
    return lambda data: decode(data)[0]


def entry_decoder(schema: Schema) -> Decode:
    """What decodes entries of ours that are on their way into a log, as `Channels.decoder` does those of a log.

    Args:
        schema: What they look like.
    """
    return _decoder(SchemaRecord(id=1, name=schema.name, encoding="protobuf", data=schema.data), "protobuf")


def _decoder(record: SchemaRecord, encoding: str) -> Decode:
    parse = DecoderFactory().decoder_for(encoding, record)
    if parse is None:
        return as_bytes
    known = _KNOWN.get(RENAMED.get(record.name, record.name))
    if known is None:
        return lambda data: (parse(data),)
    from_peer = any(field.name in SENDER_FIELDS for field in known.fields)
    there = parse(b"").DESCRIPTOR.fields_by_name
    if not all(matches(field, there.get(field.name)) for field in known.fields):
        return lambda data: (parse(data),)  # another program's message: as its own descriptor has it
    absent = {field.name for field in known.fields if field.added} | SINCE_2_0
    rebuild = compile_rebuilder(known, [name for name in absent if name not in there])

    def decode(data: bytes) -> tuple[Any, ...]:
        parsed = parse(data)
        try:
            value = rebuild(parsed)
        except (AttributeError, TypeError, ValueError):
            return (parsed,)  # likewise, where only this one can't be ours
        if not from_peer:
            return (value,)
        frame = None if parsed.frame == NO_FRAME else parsed.frame
        return value, (parsed.sender_system, parsed.sender_component), frame

    return decode
