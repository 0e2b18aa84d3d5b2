"""Rules for the data of a log: what describes entries, entries, chunks, message indexes, attachments, metadata."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Header, MessageIndex
from mcap.records import Schema as SchemaRecord

from hil.mcaplog.attachments import read_attachment
from hil.mcaplog.reading.decoding import Channels, UnreadableError
from hil.mcaplog.reading.reader import MESSAGE_HEAD
from hil.mcaplog.reading.unpacking import DAMAGE, RECORD_HEAD, read_chunk, split, stream, unpack
from hil.mcaplog.reading.walking import read_metadata
from hil.mcaplog.writing.writer import CONFIG, RUN, SIZES

if TYPE_CHECKING:
    from hil.mcaplog.limits import ReadLimits

Report = Callable[[str, int, str], None]
"""Takes a rule, the byte of the file, and what is against the rule."""
_IN_DATA: Final = frozenset(
    {
        Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA,
        Opcode.DATA_END,
    }
)  # fmt: skip
PRIVATE: Final = 0x80
"""Opcodes from here on are anybody's."""
STEP: Final = "/bridge/step"


@dataclass
class OpenChunk:
    """A chunk whose message indexes follow.

    Attributes:
        offset: Where it begins in the file.
        length: Of its record.
        chunk: The record.
        start: Log time of its first entry, in ns; 0 where it has none.
        end: Of the last.
        places: Log time and place of each entry, by channel.
        indexes: Where the message index of each channel begins in the file.
        behind: Where the last of them ends.
    """

    offset: int
    length: int
    chunk: Chunk
    start: int = 0
    end: int = 0
    places: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    indexes: dict[int, int] = field(default_factory=dict)
    behind: int = 0


class DataRules:
    """Looks at the records of the data, in order.

    Args:
        report: Takes what is against a rule.
        limits: What chunks may unpack to.
        size: Of the file, in bytes.

    Attributes:
        library: What the header names as the log's writer.
        ended: The end of the data was met.
        schemas: Schemas, by number.
        channels: Channels, by number.
        counts: Entries, by channel.
        span: Log times of the first and the last entry, in ns; None where there is none.
        chunks: What the index of each chunk should say, by where the chunk begins; None of one that could not be opened.
        attachments: What the index of each attachment should say.
        metadata: What the index of each metadata record should say: where, how long, its name.
    """

    def __init__(self, report: Report, limits: ReadLimits, size: int) -> None:
        self._report = report
        self._limits = limits
        self._size = size
        self._crc = 0
        self._unpacked = 0
        self._known = Channels(lambda text: report("records", 0, text))
        self._open: OpenChunk | None = None
        self._last: dict[int, int] = {}
        self._clocks: dict[str, int] = {}
        self._sizes: dict[str, int] = {}
        self._told: tuple[int, dict[str, str]] | None = None
        self.library = ""
        self.ended = False
        self.schemas: dict[int, SchemaRecord] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: dict[int, int] = {}
        self.span: tuple[int, int] | None = None
        self.chunks: dict[int, tuple[object, ...] | None] = {}
        self.attachments: list[tuple[object, ...]] = []
        self.metadata: list[tuple[int, int, str]] = []

    def begin(self, magic: bytes) -> None:
        """The file begins."""
        self._crc = zlib.crc32(magic)

    def pass_over(self, data: bytes) -> None:
        """Bytes that count for nothing but the checksum."""
        self._crc = zlib.crc32(data, self._crc)

    def header(self, content: bytes) -> None:
        """Take the header."""
        self.library = str(Header.read(stream(content)).library)

    def take(self, opcode: int, offset: int, head: bytes, content: bytes) -> bool:
        """Take a record; true where the data ends with it."""
        if opcode != Opcode.MESSAGE_INDEX:
            self._close_chunk()
        if opcode in {Opcode.DATA_END, Opcode.FOOTER}:
            self.ended = True
            self._check_end(opcode, offset, content)
            return True
        self._crc = zlib.crc32(content, zlib.crc32(head, self._crc))
        if opcode not in _IN_DATA:
            if opcode < PRIVATE:
                self._report("order", offset, f"a record of kind {opcode:#04x} does not belong into the data")
        elif opcode == Opcode.CHUNK:
            self._chunk(offset, len(head) + len(content), content)
        elif opcode == Opcode.MESSAGE_INDEX:
            self._message_index(offset, content)
        elif opcode == Opcode.ATTACHMENT:
            self._attachment(offset, len(head) + len(content), content)
        elif opcode == Opcode.METADATA:
            name, values = read_metadata(content)
            self.metadata.append((offset, len(head) + len(content), name))
            if name == SIZES:
                self._told = offset, values
        else:
            self._entry_or_description(opcode, offset, content, 0, len(content))
        return False

    def finish_ours(self) -> None:
        """Check what only the whole data can tell, of a log of ours."""
        names = [name for _, _, name in self.metadata]
        if names[:1] != [RUN] or names.count(CONFIG) != 1:
            self._report("our metadata", 0, f"the metadata records are {', '.join(names[:5]) or 'none'}")
        if self._told is not None:
            offset, told = self._told
            for topic, size in self._sizes.items():
                if told.get(topic) != str(size):
                    self._report("our sizes", offset, f"{topic} has {size:,} bytes, not {told.get(topic, 'none')}")

    def _check_end(self, opcode: int, offset: int, content: bytes) -> None:
        if opcode == Opcode.FOOTER:
            self._report("order", offset, "the footer comes without an end of the data")
            return
        stated = DataEnd.read(stream(content)).data_section_crc
        if stated and stated != self._crc:
            self._report("data checksum", offset, f"the data has the checksum {self._crc:08x}, not {stated:08x}")

    def _entry_or_description(self, opcode: int, offset: int, data: bytes, begin: int, end: int) -> None:
        if opcode == Opcode.MESSAGE:
            self._entry(offset, data, begin, end)
        elif opcode == Opcode.SCHEMA:
            self._schema(offset, data[begin:end])
        else:
            self._channel(offset, data[begin:end])

    def _schema(self, offset: int, content: bytes) -> None:
        schema = SchemaRecord.read(stream(content))
        if not schema.id:
            self._report("schemas", offset, "a schema has the number 0")
        if self.schemas.setdefault(schema.id, schema) != schema:
            self._report("schemas", offset, f"schema {schema.id} is there twice, and not the same")
        self._known.add_schema(content)

    def _channel(self, offset: int, content: bytes) -> None:
        channel = Channel.read(stream(content))
        if channel.schema_id and channel.schema_id not in self.schemas:
            self._report("channels", offset, f"channel {channel.id} comes before its schema, {channel.schema_id}")
        if self.channels.setdefault(channel.id, channel) != channel:
            self._report("channels", offset, f"channel {channel.id} is there twice, and not the same")
        self._known.add_channel(content)

    def _entry(self, offset: int, data: bytes, begin: int, end: int) -> None:
        if end - begin < MESSAGE_HEAD.size:
            self._report("records", offset, "an entry is too short to be one")
            return
        channel, number, stamp, _ = MESSAGE_HEAD.unpack_from(data, begin)
        self.counts[channel] = self.counts.get(channel, 0) + 1
        self.span = (min(stamp, self.span[0]), max(stamp, self.span[1])) if self.span else (stamp, stamp)
        if channel not in self.channels:
            self._report("messages", offset, f"an entry comes before its channel, {channel}")
            return
        topic = self._known.topic(channel)
        self._sizes[topic] = self._sizes.get(topic, 0) + RECORD_HEAD.size + end - begin
        self._check_numbers(offset, topic, channel, number)
        try:
            value = self._known.decoder(channel)(data[begin + MESSAGE_HEAD.size : end])[0]
        except UnreadableError as error:
            self._report("entries", offset, f"an entry of {topic} at {stamp / 1e9:.6f} s can't be decoded: {error}")
        except DAMAGE as error:
            self._report("entries", offset, f"an entry of {topic} at {stamp / 1e9:.6f} s is not what its schema says ({error})")
        else:
            if topic == STEP:
                self._check_clock(offset, str(getattr(value, "network", "")), stamp)

    def _check_clock(self, offset: int, network: str, stamp: int) -> None:
        last = self._clocks.get(network, 0)
        if stamp < last:
            self._report("our clock", offset, f"a step at {stamp / 1e9:.6f} s comes after one at {last / 1e9:.6f} s")
        self._clocks[network] = stamp

    def _check_numbers(self, offset: int, topic: str, channel: int, number: int) -> None:
        last = self._last.get(channel, 0)
        if last and number <= last:
            self._report("our numbers", offset, f"entry {number} of {topic} comes after entry {last}")
        self._last[channel] = number

    def _chunk(self, offset: int, length: int, content: bytes) -> None:
        self.chunks[offset] = None
        try:
            chunk, size = read_chunk(content)
            self._unpacked += size
            if size > self._limits.chunk or self._unpacked > self._limits.unpacked(self._size):
                self._report("chunks", offset, f"a chunk unpacks to {size:,} bytes, and was not looked at")
                return
            if size != chunk.uncompressed_size:
                self._report("chunks", offset, f"a chunk unpacks to {size:,} bytes, not {chunk.uncompressed_size:,}")
            data = unpack(chunk, size)
        except DAMAGE as error:
            self._report("chunks", offset, f"a chunk can't be unpacked ({error})")
            return
        found = self._open = OpenChunk(offset, length, chunk, behind=offset + length)
        for opcode, begin, end in split(data, lambda text: self._report("chunks", offset, f"a chunk {text}")):
            if opcode == Opcode.MESSAGE and end - begin >= MESSAGE_HEAD.size:
                channel, _, stamp, _ = MESSAGE_HEAD.unpack_from(data, begin)
                found.places.setdefault(channel, []).append((stamp, begin - RECORD_HEAD.size))
            if opcode in {Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL}:
                try:
                    self._entry_or_description(opcode, offset, data, begin, end)
                except DAMAGE as error:
                    self._report("records", offset, f"a record in a chunk can't be read ({error})")
            elif opcode < PRIVATE:
                self._report("chunks", offset, f"a record of kind {opcode:#04x} does not belong into a chunk")
        stamps = [stamp for places in found.places.values() for stamp, _ in places]
        found.start, found.end = min(stamps, default=0), max(stamps, default=0)
        if (found.start, found.end) != (chunk.message_start_time, chunk.message_end_time):
            stated = f"{chunk.message_start_time:,} to {chunk.message_end_time:,}"
            self._report("chunks", offset, f"a chunk has entries from {found.start:,} to {found.end:,} ns, not from {stated}")

    def _message_index(self, offset: int, content: bytes) -> None:
        index, chunk = MessageIndex.read(stream(content)), self._open
        if chunk is None:
            if not self.chunks or list(self.chunks.values())[-1] is not None:
                self._report("message indexes", offset, "a message index does not follow a chunk")
            return
        chunk.indexes[index.channel_id] = offset
        chunk.behind = offset + RECORD_HEAD.size + len(content)
        if sorted(index.records) != sorted(chunk.places.get(index.channel_id, [])):
            self._report(
                "message indexes", offset, f"the message index of channel {index.channel_id} is not what the chunk holds"
            )

    def _close_chunk(self) -> None:
        chunk, self._open = self._open, None
        if chunk is None:
            return
        missing = sorted(set(chunk.places) - set(chunk.indexes))
        if missing and chunk.indexes:
            self._report(
                "message indexes", chunk.offset, f"channel {missing[0]} has no message index, others of its chunk have"
            )
        self.chunks[chunk.offset] = (
            chunk.chunk.message_start_time,
            chunk.chunk.message_end_time,
            chunk.length,
            chunk.indexes,
            chunk.behind - chunk.offset - chunk.length,
            chunk.chunk.compression,
            len(chunk.chunk.data),
            chunk.chunk.uncompressed_size,
        )

    def _attachment(self, offset: int, length: int, content: bytes) -> None:
        try:
            read_attachment(content)
        except ValueError as error:
            self._report("attachments", offset, f"an attachment is damaged: {error}")
        found = Attachment.read(stream(content))
        described = (found.log_time, found.create_time, len(found.data), found.name, found.media_type)
        self.attachments.append((offset, length, *described))
