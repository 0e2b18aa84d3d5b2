"""Writes a whole, indexed log from the records of another: entries byte for byte, with their times and numbers."""

from __future__ import annotations

import zlib
from struct import Struct, pack
from typing import TYPE_CHECKING, BinaryIO, Final

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Statistics,
    SummaryOffset,
)
from mcap.records import Schema as SchemaRecord

from hil.mcaplog.overview import MESSAGE_SIZE
from hil.mcaplog.unpacking import RECORD_HEAD, stream
from hil.mcaplog.writer import MAGIC, SIZES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hil.mcaplog.reader import RawEntry

_MESSAGE: Final = Struct("<BQHIQQ")
_INDEX_HEAD: Final = Struct("<BQHI")


class LogCopy:
    """A log that is being written from another's records.

    Args:
        file: What to write to.
        header: Of the log that is copied; None where it has none that can be read.
        level: How well chunks are compressed: zstd's level.
        chunk_size: What a chunk holds, in bytes, before it is compressed.
        indexed: Chunks and the entries in them are indexed, which takes 16 bytes an entry that do not compress; without that,
            readers go through all of it where one topic is asked for. The two go together: some readers raise on chunks
            that are indexed and whose entries are not.
    """

    def __init__(
        self,
        file: BinaryIO,
        *,
        header: Header | None = None,
        level: int = 3,
        chunk_size: int = 1 << 20,
        indexed: bool = True,
    ) -> None:
        self._file = file
        self._indexed = indexed
        self._chunk_size = chunk_size
        self._compressor = zstandard.ZstdCompressor(level=level)
        self._offset = 0
        self._schemas: dict[int, SchemaRecord] = {}
        self._channels: dict[int, Channel] = {}
        self._buffer = bytearray()
        self._index: dict[int, list[int]] = {}
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._counts: dict[int, int] = {}
        self._sizes: dict[str, int] = {}
        self._put(MAGIC + serialize(header or Header(profile="", library="")))

    @property
    def entries(self) -> int:
        """Entries taken so far."""
        return sum(self._counts.values())

    def entry(self, entry: RawEntry, channel: Channel, schema: SchemaRecord | None) -> None:
        """Append an entry.

        Args:
            entry: The entry.
            channel: Its channel, as the other log has it.
            schema: Its schema; None where the channel has none.
        """
        if entry.channel not in self._channels:
            self._describe(channel, schema)
        self._index.setdefault(entry.channel, []).extend((entry.log_time, len(self._buffer)))
        length = MESSAGE_SIZE - RECORD_HEAD.size + len(entry.data)
        self._buffer += _MESSAGE.pack(Opcode.MESSAGE, length, entry.channel, entry.sequence, entry.log_time, entry.publish_time)
        self._buffer += entry.data
        self._counts[entry.channel] = self._counts.get(entry.channel, 0) + 1
        self._sizes[channel.topic] = self._sizes.get(channel.topic, 0) + MESSAGE_SIZE + len(entry.data)
        if len(self._buffer) >= self._chunk_size:
            self._finish_chunk()

    def metadata(self, content: bytes) -> None:
        """Append a metadata record as it stands; not the sizes by topic, which are counted anew."""
        name = Metadata.read(stream(content)).name
        if name != SIZES:
            self._put_metadata(name, RECORD_HEAD.pack(Opcode.METADATA, len(content)) + content)

    def values(self, name: str, values: Mapping[str, str]) -> None:
        """Append a metadata record."""
        self._put_metadata(name, serialize(Metadata(name=name, metadata=dict(values))))

    def attachment(self, content: bytes) -> None:
        """Append an attachment as it stands."""
        found = Attachment.read(stream(content))
        record = RECORD_HEAD.pack(Opcode.ATTACHMENT, len(content)) + content
        self._attachments.append(
            AttachmentIndex(
                offset=self._offset,
                length=len(record),
                log_time=found.log_time,
                create_time=found.create_time,
                data_size=len(found.data),
                name=found.name,
                media_type=found.media_type,
            )
        )
        self._put(record)

    def finish(self) -> None:
        """Write the rest: the last chunk, the sizes by topic, the index."""
        self._finish_chunk()
        self.values(SIZES, {topic: str(size) for topic, size in sorted(self._sizes.items())})
        self._put(serialize(DataEnd(0)))
        self._put(self._summary())
        self._put(MAGIC)

    def _describe(self, channel: Channel, schema: SchemaRecord | None) -> None:
        if schema is not None and schema.id not in self._schemas:
            self._schemas[schema.id] = schema
            self._buffer += serialize(schema)
        self._channels[channel.id] = channel
        self._buffer += serialize(channel)

    def _finish_chunk(self) -> None:
        if not self._index:
            return
        times = [time for places in self._index.values() for time in places[::2]]
        raw, start = bytes(self._buffer), self._offset
        chunk = Chunk(
            compression="zstd",
            data=self._compressor.compress(raw),
            message_end_time=max(times),
            message_start_time=min(times),
            uncompressed_crc=zlib.crc32(raw),
            uncompressed_size=len(raw),
        )
        body = serialize(chunk)
        self._put(body)
        offsets: dict[int, int] = {}
        for channel, places in self._index.items() if self._indexed else ():
            offsets[channel] = self._offset
            size = 8 * len(places)
            self._put(_INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + size, channel, size) + pack(f"<{len(places)}Q", *places))
        self._chunks.append(
            ChunkIndex(
                chunk_length=len(body),
                chunk_start_offset=start,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=chunk.message_end_time,
                message_index_length=self._offset - start - len(body),
                message_index_offsets=offsets,
                message_start_time=chunk.message_start_time,
                uncompressed_size=len(raw),
            )
        )
        self._buffer.clear()
        self._index.clear()

    def _summary(self) -> bytes:
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(sorted(self._counts.items())),
            chunk_count=len(self._chunks),
            message_count=self.entries,
            message_end_time=max((chunk.message_end_time for chunk in self._chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in self._chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )
        return summary(
            self._offset,
            {
                Opcode.SCHEMA: list(self._schemas.values()),
                Opcode.CHANNEL: list(self._channels.values()),
                Opcode.STATISTICS: [statistics],
                Opcode.CHUNK_INDEX: self._chunks if self._indexed else [],
                Opcode.ATTACHMENT_INDEX: self._attachments,
                Opcode.METADATA_INDEX: self._metadata,
            },
        )

    def _put_metadata(self, name: str, record: bytes) -> None:
        self._metadata.append(MetadataIndex(offset=self._offset, length=len(record), name=name))
        self._put(record)

    def _put(self, data: bytes) -> None:
        self._file.write(data)
        self._offset += len(data)


def summary(begin: int, groups: Mapping[Opcode, Sequence[McapRecord]]) -> bytes:
    """The summary of a log, from its first record to the footer.

    Args:
        begin: Where it will begin in the file, in bytes.
        groups: Its records by kind.
    """
    body, offsets = bytearray(), bytearray()
    for opcode, records in groups.items():
        group = b"".join(map(serialize, records))
        if group:
            offsets += serialize(SummaryOffset(group_opcode=opcode, group_start=begin + len(body), group_length=len(group)))
        body += group
    footer = Footer(summary_start=begin, summary_offset_start=begin + len(body), summary_crc=0)
    footer.summary_crc = zlib.crc32(serialize(footer)[:-4], zlib.crc32(body + offsets))
    return bytes(body + offsets) + serialize(footer)


def serialize(record: McapRecord) -> bytes:
    """A record as it stands in a file."""
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
