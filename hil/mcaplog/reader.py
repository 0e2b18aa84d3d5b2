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
from hil.mcaplog.encode import NO_FRAME, compile_rebuilder, read_sender
from hil.mcaplog.errors import LogError
from hil.mcaplog.records import RECORDS
from hil.mcaplog.schemas import RENAMED, RENAMED_TOPICS, SENDER_FIELDS, SINCE_2_0, Schema, message_schema, record_schema
from hil.mcaplog.writer import MAGIC

if TYPE_CHECKING:
    from pathlib import Path

_RECORD_HEAD: Final = struct.Struct("<BQ")
_MESSAGE_HEAD: Final = struct.Struct("<HIQQ")
_LARGEST_CHUNK: Final = 1 << 28
_DAMAGE: Final = (
    McapError, struct.error, ValueError, TypeError, KeyError, OverflowError, MemoryError, zstandard.ZstdError, DecodeError,
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


class LogReader:
    """A log file to be read from the start, as often as wanted.

    Attributes:
        path: The file.
        size: Its size in bytes.
        metadata: The metadata records met in the last pass, by name; of several with one name the last.
        truncated: The last pass did not come to a proper end of the file.
        damage: What the last pass found wrong, in words.
        bytes_read: Bytes up to the end of the last whole record of the last pass.
        messages_read: Entries met in the last pass, wanted or not.

    Args:
        path: The file.

    Raises:
        LogError: It cannot be opened or is not a log.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.metadata: dict[str, dict[str, str]] = {}
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
        schemas: dict[int, SchemaRecord] = {}
        channels: dict[int, tuple[str, _Decode]] = {}
        wanted = topics is None or bool(topics)
        for record in self.records(expand=wanted):
            try:
                if record.opcode == Opcode.MESSAGE:
                    self.messages_read += 1
                    channel, _, stamp, _ = _MESSAGE_HEAD.unpack_from(record.content)
                    if channel not in channels:
                        continue
                    topic, decode = channels[channel]
                    yield LogEntry(topic, stamp / 1e9, *decode(record.content[_MESSAGE_HEAD.size :]))
                elif record.opcode == Opcode.SCHEMA:
                    schema = SchemaRecord.read(_stream(record.content))
                    schemas[schema.id] = schema
                elif record.opcode == Opcode.CHANNEL:
                    found = Channel.read(_stream(record.content))
                    topic = RENAMED_TOPICS.get(found.topic, found.topic)
                    asked = topic not in leave_out and (topics is None or topic in topics)
                    if asked and found.schema_id in schemas and found.id not in channels:
                        decoder = _unread if topic in unread else _decoder(schemas[found.schema_id])
                        channels[found.id] = (topic, decoder)
            except _DAMAGE as error:
                self._note(f"a record could not be decoded ({error})")

    def records(self, *, expand: bool = True) -> Iterator[RawRecord]:
        """Every record, those inside chunks too, each whole.

        Args:
            expand: Open the chunks; else they are skipped over.

        Yields:
            The records; those inside a chunk follow it.
        """
        self.metadata, self.damage, self.truncated = {}, [], True
        self.bytes_read = self.messages_read = 0
        with self.path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                self._note("the file ends within its first bytes")
                return
            self.bytes_read = len(MAGIC)
            for record in self._whole_records(file, expand=expand):
                yield record
                if record.opcode == Opcode.METADATA:
                    self._take_metadata(record)
                elif record.opcode == Opcode.CHUNK and expand:
                    yield from self._open_chunk(record)
                elif record.opcode == Opcode.FOOTER:
                    self.truncated = file.read(len(MAGIC)) != MAGIC
                    self.bytes_read += 0 if self.truncated else len(MAGIC)
                    return

    def health(self) -> str:
        """What the last pass found, in a sentence."""
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
            if opcode == Opcode.CHUNK and not expand:
                file.seek(length, 1)
                content = b""
            else:
                content = file.read(length)
            self.bytes_read = file.tell()
            yield RawRecord(opcode, content, offset)

    def _open_chunk(self, record: RawRecord) -> Iterator[RawRecord]:
        try:
            data = _unpack_chunk(Chunk.read(_stream(record.content)))
        except _DAMAGE as error:
            self._note(f"the chunk at byte {record.offset:,} is damaged and was left out ({error})")
            return
        at = 0
        while at + _RECORD_HEAD.size <= len(data):
            opcode, length = _RECORD_HEAD.unpack_from(data, at)
            at += _RECORD_HEAD.size
            if at + length > len(data):
                self._note(f"the chunk at byte {record.offset:,} ends within a record")
                return
            yield RawRecord(opcode, data[at : at + length], -1)
            at += length

    def _take_metadata(self, record: RawRecord) -> None:
        try:
            metadata = Metadata.read(_stream(record.content))
        except _DAMAGE as error:
            self._note(f"the metadata at byte {record.offset:,} is damaged ({error})")
            return
        self.metadata[metadata.name] = {key: value for key, value in metadata.metadata.items() if key != "padding"}

    def _note(self, text: str) -> None:
        if len(self.damage) < 100:
            self.damage.append(text)


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))


def _unpack_chunk(chunk: Chunk) -> bytes:
    if chunk.compression not in ("", "zstd"):
        raise ValueError(f"compressed by {chunk.compression!r}")
    if chunk.uncompressed_size > _LARGEST_CHUNK:
        raise ValueError(f"claims to hold {chunk.uncompressed_size:,} bytes")
    data = chunk.data
    if chunk.compression:
        if not 0 <= zstandard.frame_content_size(data) <= _LARGEST_CHUNK:
            raise ValueError("does not say how much it holds")
        data = zstandard.ZstdDecompressor().decompress(data)
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("bad checksum")
    return data


def _unread(data: bytes) -> tuple[Any, ...]:
    return None, *(read_sender(data) or ())


def _decoder(record: SchemaRecord) -> _Decode:
    parse = DecoderFactory().decoder_for("protobuf", record)
    if parse is None:
        return lambda data: (data,)
    known = _KNOWN.get(RENAMED.get(record.name, record.name))
    if known is None:
        return lambda data: (parse(data),)
    from_peer = any(field.name in SENDER_FIELDS for field in known.fields)
    there = parse(b"").DESCRIPTOR.fields_by_name
    rebuild = compile_rebuilder(known, [name for name in SINCE_2_0 if name not in there])

    def decode(data: bytes) -> tuple[Any, ...]:
        parsed = parse(data)
        try:
            value = rebuild(parsed)
        except (AttributeError, TypeError, ValueError):
            return (parsed,)  # another version's message: as its own descriptor has it
        if not from_peer:
            return (value,)
        frame = None if parsed.frame == NO_FRAME else parsed.frame
        return value, (parsed.sender_system, parsed.sender_component), frame

    return decode
