"""Writes a log from the records of another, indexed or small: entries byte for byte, with their times and numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, BinaryIO

import zstandard
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, DataEnd, Header, Metadata, MetadataIndex
from mcap.records import Schema as SchemaRecord

from hil.mcaplog.reading.unpacking import RECORD_HEAD, stream
from hil.mcaplog.writing.packing import MESSAGE_RECORD_HEAD, index_attachment, pack_chunk, pack_summary, serialize
from hil.mcaplog.writing.writer import MAGIC, SIZES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mcap.records import AttachmentIndex, ChunkIndex

    from hil.mcaplog.reading.reader import RawEntry


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
        size = MESSAGE_RECORD_HEAD.size + len(entry.data)
        length = size - RECORD_HEAD.size
        self._buffer += MESSAGE_RECORD_HEAD.pack(
            Opcode.MESSAGE, length, entry.channel, entry.sequence, entry.log_time, entry.publish_time
        )
        self._buffer += entry.data
        self._counts[entry.channel] = self._counts.get(entry.channel, 0) + 1
        self._sizes[channel.topic] = self._sizes.get(channel.topic, 0) + size
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
        self._attachments.append(index_attachment(found, self._offset, len(record)))
        self._put(record)

    def finish(self) -> None:
        """Write the rest: the last chunk, the sizes by topic, the index."""
        self._finish_chunk()
        self.values(SIZES, {topic: str(size) for topic, size in sorted(self._sizes.items())})
        self._put(serialize(DataEnd(0)))
        self._put(
            pack_summary(
                self._offset,
                schemas=list(self._schemas.values()),
                channels=list(self._channels.values()),
                counts=self._counts,
                chunks=self._chunks,
                attachments=self._attachments,
                metadata=self._metadata,
                indexed=self._indexed,
            )
        )
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
        raw = bytes(self._buffer)
        records, found = pack_chunk(raw, self._index, self._offset, self._compressor, indexed=self._indexed)
        self._put(records)
        self._chunks.append(found)
        self._buffer.clear()
        self._index.clear()

    def _put_metadata(self, name: str, record: bytes) -> None:
        self._metadata.append(MetadataIndex(offset=self._offset, length=len(record), name=name))
        self._put(record)

    def _put(self, data: bytes) -> None:
        self._file.write(data)
        self._offset += len(data)
