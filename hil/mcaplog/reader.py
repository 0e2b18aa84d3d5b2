"""Reads logs, whole or damaged: everything up to the damage, and how much that was, never a traceback.

MCAP's indexed readers need the footer that a crashed writer never wrote; this one walks the records from the start.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any, BinaryIO, Final

import zstandard
from google.protobuf.message import DecodeError
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Metadata
from mcap.records import Schema as SchemaRecord
from mcap_protobuf.decoder import DecoderFactory

from firmware_protocol.messages import MESSAGES
from hil.mcaplog.attachments import LogAttachment, read_attachment
from hil.mcaplog.encode import NO_FRAME, compile_rebuilder, read_sender
from hil.mcaplog.errors import LogError
from hil.mcaplog.limits import (
    LARGEST_ATTACHMENTS,
    LARGEST_CHANNEL,
    LARGEST_METADATA,
    LARGEST_SCHEMAS,
    MOST_CHANNELS,
    ReadLimits,
    remedy,
)
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
from hil.mcaplog.writer import MAGIC

if TYPE_CHECKING:
    from pathlib import Path

_RECORD_HEAD: Final = struct.Struct("<BQ")
_MESSAGE_HEAD: Final = struct.Struct("<HIQQ")
_NUMBER: Final = struct.Struct("<H")
_DAMAGE: Final = (
    McapError, struct.error, AttributeError, ValueError, TypeError, LookupError, OverflowError, MemoryError, RecursionError,
    zstandard.ZstdError, DecodeError,
)  # fmt: skip
_KNOWN: Final[dict[str, Schema]] = {
    schema.name: schema
    for schema in (*(message_schema(message) for message in MESSAGES.values()), *(record_schema(record) for record in RECORDS))
}


@dataclass(frozen=True, slots=True)
class LogEntry:
    """One entry of a log.

    Attributes:
        topic: Its topic.
        time: Log time in s.
        value: A message of `firmware_protocol.messages`, a record of `records`, or, for anything else,
            the protobuf message as the log's own descriptor parses it; the bytes where it is not
            protobuf. None where it was not asked for.
        sender: MAVLink system and component of the sender of a robot message.
        frame: Sequence number of the frame that a received robot message came in, 0..255.
    """

    topic: str
    time: float
    value: Any
    sender: tuple[int, int] | None = None
    frame: int | None = None


@dataclass(frozen=True, slots=True)
class RawRecord:
    """A record as it stands in the file: its MCAP opcode, content and offset (-1 inside a chunk)."""

    opcode: int
    content: bytes
    offset: int


_Decode = Callable[[bytes], tuple[Any, ...]]
"""Protobuf -> the value, and where it is a robot message the sender and the frame."""


class _TooMuchError(Exception):
    """The file holds more than a file of its size may; the text says of what."""


class LogReader:
    """A log file to be read from the start, as often as wanted.

    Attributes:
        path: The file.
        size: Its size in bytes.
        metadata: The metadata records met in the last pass, by name; of several with one name the last.
        attachments: The attachments met in the last pass, by name, likewise.
        truncated: The last pass did not come to a proper end of the file.
        damage: What the last pass found wrong, in words.
        bytes_read: Bytes up to the end of the last whole record of the last pass.
        messages_read: Entries met in the last pass, wanted or not.
        stopped: Why the last pass did not go on to the end though the file does; empty where it did.

    Args:
        path: The file.
        limits: What it may unpack to.

    Raises:
        LogError: It cannot be opened or is not a log.
    """

    def __init__(self, path: Path, limits: ReadLimits = ReadLimits()) -> None:  # noqa: B008 - frozen
        self.path = path
        self.stopped = ""
        self._limits = limits
        self._unpacked = self._records = 0
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, LogAttachment] = {}
        self._attached = 0
        self.truncated = False
        self.damage: list[str] = []
        self.bytes_read = 0
        self.messages_read = 0
        try:
            self.size = path.stat().st_size
            with path.open("rb") as file:
                start = file.read(len(MAGIC))
        except OSError as error:
            raise LogError(f"cannot read the log {path}: {error.strerror}") from error
        except ValueError as error:  # a zero byte in its name
            raise LogError(f"cannot read the log {str(path)!r}: no file has this name") from error
        if not MAGIC.startswith(start):
            raise LogError(f"{path} is not a log: it does not begin as an MCAP file does")

    def entries(
        self, topics: Collection[str] | None = None, *, leave_out: Collection[str] = (), unread: Collection[str] = ()
    ) -> Iterator[LogEntry]:
        """Everything readable, in the order of the file.

        Args:
            topics: Only these topics; None is all. An empty collection reads the metadata only, fast.
            leave_out: Not these topics.
            unread: Of these topics of robot messages only who sent them: their value is None. It is much faster.

        Yields:
            The entries.
        """
        decoders = _Decoders(self._note)
        channels: dict[int, tuple[str, _Decode]] = {}
        wanted = topics is None or bool(topics)
        for record in self.records(expand=wanted):
            try:
                if record.opcode == Opcode.MESSAGE:
                    self.messages_read += 1
                    channel, _, stamp, _ = _MESSAGE_HEAD.unpack_from(record.content)
                    if channel not in channels:
                        topic = decoders.topic(channel)
                        asked = topic not in leave_out and (topics is None or topic in topics)
                        channels[channel] = topic, _read_nothing  # should the decoder fail to be made, it is not tried again
                        if asked:
                            channels[channel] = topic, _unread if topic in unread else decoders.make(channel)
                    topic, decode = channels[channel]
                    if len(record.content) > self._limits.entry:
                        self._note(f"an entry of {topic[:40]} has {len(record.content):,} bytes and was left out: {remedy()}")
                    elif decode is not _read_nothing:
                        yield LogEntry(topic, stamp / 1e9, *decode(record.content[_MESSAGE_HEAD.size :]))
                elif record.opcode == Opcode.SCHEMA:
                    decoders.schema(record.content)
                elif record.opcode == Opcode.CHANNEL:
                    decoders.channel(record.content)
            except _DAMAGE as error:
                self._note(f"a record could not be decoded ({error})")

    def records(self, *, expand: bool = True) -> Iterator[RawRecord]:
        """Every record, those inside chunks too, each whole.

        Args:
            expand: Open the chunks; else they are skipped over.

        Yields:
            The records; those inside a chunk follow it.
        """
        self.metadata, self.attachments, self.damage, self.truncated = {}, {}, [], True
        self.bytes_read = self.messages_read = self._unpacked = self._records = self._attached = 0
        self.stopped = ""
        with self.path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                self._note("the file ends within its first bytes")
                return
            self.bytes_read = len(MAGIC)
            for record in self._whole_records(file, expand=expand):
                yield record
                if record.opcode == Opcode.METADATA:
                    self._take_metadata(record)
                elif record.opcode == Opcode.ATTACHMENT and record.content:
                    self._take_attachment(record)
                elif record.opcode == Opcode.CHUNK and expand:
                    try:
                        yield from self._open_chunk(record)
                    except _TooMuchError as error:
                        self.stopped = f"it holds more {error} than a file of its size may; {remedy()}"
                        return
                elif record.opcode == Opcode.FOOTER:
                    self.truncated = file.read(len(MAGIC)) != MAGIC
                    self.bytes_read += 0 if self.truncated else len(MAGIC)
                    return

    def health(self) -> str:
        """What the last pass found, in a sentence."""
        if self.stopped:
            noted = "".join(f"; {text}" for text in self.damage[:3])
            return f"read in part: {self.stopped}; {self.bytes_read:,} of {self.size:,} bytes were read{noted}"
        if not self.truncated and not self.damage:
            return f"whole, {self.size:,} bytes"
        share = f"{self.bytes_read:,} of {self.size:,} bytes could be read"
        words = "cut off: the run was not ended properly" if self.truncated else "damaged"
        return f"{words}; {share}" + (f"; {'; '.join(self.damage[:3])}" if self.damage else "")

    def _whole_records(self, file: BinaryIO, *, expand: bool) -> Iterator[RawRecord]:
        while True:
            offset = file.tell()
            head = file.read(_RECORD_HEAD.size)
            if len(head) < _RECORD_HEAD.size:
                return
            opcode, length = _RECORD_HEAD.unpack(head)
            if opcode == 0 or offset + _RECORD_HEAD.size + length > self.size:
                return
            if length > self._limits.chunk:
                self._note(f"the record at byte {offset:,} has {length:,} bytes and was left out: {remedy(length)}")
                file.seek(length, 1)
                opcode, content = Opcode.ATTACHMENT, b""
            elif opcode == Opcode.CHUNK and not expand:
                file.seek(length, 1)
                content = b""
            else:
                content = file.read(length)
            self.bytes_read = file.tell()
            yield RawRecord(opcode, content, offset)

    def _open_chunk(self, record: RawRecord) -> Iterator[RawRecord]:
        try:
            chunk = Chunk.read(_stream(record.content))
            size = _unpacked_size(chunk)
            if size > self._limits.chunk:
                text = f"the chunk at byte {record.offset:,} unpacks to {size:,} bytes and was left out"
                self._note(f"{text}: {remedy(size)}" if size < 1 << 40 else text)
                return
            self._unpacked += size
            if self._unpacked > self._limits.unpacked(self.size):
                raise _TooMuchError("bytes")
            data = _unpack_chunk(chunk)
        except _DAMAGE as error:
            self._note(f"the chunk at byte {record.offset:,} is damaged and was left out ({error})")
            return
        at, most = 0, self._limits.records(self.size)
        while at + _RECORD_HEAD.size <= len(data):
            opcode, length = _RECORD_HEAD.unpack_from(data, at)
            at += _RECORD_HEAD.size
            if not opcode:
                self._note(f"the chunk at byte {record.offset:,} holds what is no record")
                return
            self._records += 1
            if self._records > most:
                raise _TooMuchError("records")
            if at + length > len(data):
                self._note(f"the chunk at byte {record.offset:,} ends within a record")
                return
            yield RawRecord(opcode, data[at : at + length], -1)
            at += length

    def _take_metadata(self, record: RawRecord) -> None:
        if len(record.content) > LARGEST_METADATA:
            self._note(f"the metadata at byte {record.offset:,} has {len(record.content):,} bytes and was left out")
            return
        try:
            metadata = Metadata.read(_stream(record.content))
        except _DAMAGE as error:
            self._note(f"the metadata at byte {record.offset:,} is damaged ({error})")
            return
        self.metadata[metadata.name] = {key: value for key, value in metadata.metadata.items() if key != "padding"}

    def _take_attachment(self, record: RawRecord) -> None:
        self._attached += len(record.content)
        if self._attached > LARGEST_ATTACHMENTS:
            self._attached -= len(record.content)
            self._note(
                f"the attachment at byte {record.offset:,} was left out: there are more than {LARGEST_ATTACHMENTS:,} bytes"
            )
            return
        try:
            attachment = read_attachment(record.content)
        except _DAMAGE as error:
            self._note(f"the attachment at byte {record.offset:,} is damaged ({error})")
            return
        self.attachments[attachment.name] = attachment

    def _note(self, text: str) -> None:
        if len(self.damage) < 100:
            self.damage.append(text)


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))


def _unpacked_size(chunk: Chunk) -> int:
    """What a chunk will unpack to, in bytes, as it says itself: the unpacking fails where it says too little."""
    if not chunk.compression:
        return len(chunk.data)
    if chunk.compression != "zstd":
        raise ValueError(f"compressed by {chunk.compression[:20]!r}")
    size = int(zstandard.frame_content_size(chunk.data))
    if size < 0:
        raise ValueError("does not say how much it holds")
    return size


def _unpack_chunk(chunk: Chunk) -> bytes:
    data = chunk.data
    if chunk.compression:
        data = zstandard.ZstdDecompressor().decompress(data)
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("bad checksum")
    return data


def _read_nothing(_: bytes) -> tuple[Any, ...]:
    return (None,)


def _unread(data: bytes) -> tuple[Any, ...]:
    return None, *(read_sender(data) or ())


class _Decoders:
    """The channels of a log, and what decodes their entries; each is made when its first entry comes.

    Args:
        note: Takes note of damage.
    """

    def __init__(self, note: Callable[[str], None]) -> None:
        self._note = note
        self._schemas: dict[int, SchemaRecord] = {}
        self._channels: dict[int, tuple[str, int]] = {}
        self._made: dict[int, _Decode] = {}
        self._size = 0

    def schema(self, content: bytes) -> None:
        """Take a schema; one that is known already is not looked at again."""
        (number,) = _NUMBER.unpack_from(content)
        if number in self._schemas:
            return
        self._size += len(content)
        if self._size > LARGEST_SCHEMAS:
            self._size -= len(content)
            self._note(f"schema {number} was left out: there are more than {LARGEST_SCHEMAS:,} bytes of them")
            return
        self._schemas[number] = SchemaRecord.read(_stream(content))

    def channel(self, content: bytes) -> None:
        """Take a channel; likewise."""
        (number,) = _NUMBER.unpack_from(content)
        if number in self._channels:
            return
        if len(content) > LARGEST_CHANNEL or len(self._channels) >= MOST_CHANNELS:
            self._note(f"channel {number} was left out: there are too many, or it is too large")
            return
        found = Channel.read(_stream(content))
        self._channels[number] = RENAMED_TOPICS.get(found.topic, found.topic), found.schema_id

    def topic(self, channel: int) -> str:
        """Topic of a channel; empty for one that is not known."""
        return self._channels.get(channel, ("", 0))[0]

    def make(self, channel: int) -> _Decode:
        """What decodes the entries of a channel; those without a schema are not read."""
        schema = self._channels.get(channel, ("", 0))[1]
        if schema not in self._schemas:
            return _read_nothing
        if schema not in self._made:
            self._made[schema] = _read_nothing  # as above
            self._made[schema] = _decoder(self._schemas[schema])
        return self._made[schema]


def _decoder(record: SchemaRecord) -> _Decode:
    parse = DecoderFactory().decoder_for("protobuf", record)
    if parse is None:
        return lambda data: (data,)
    known = _KNOWN.get(RENAMED.get(record.name, record.name))
    if known is None:
        return lambda data: (parse(data),)
    from_peer = any(field.name in SENDER_FIELDS for field in known.fields)
    there = parse(b"").DESCRIPTOR.fields_by_name
    if not all(matches(field, there.get(field.name)) for field in known.fields):
        return lambda data: (parse(data),)  # another program's message: as its own descriptor has it
    rebuild = compile_rebuilder(known, [name for name in SINCE_2_0 if name not in there])

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
