"""The index at the end of a whole log: what is where, without a look at the entries.

Chunk indexes are taken apart here, since the `mcap` package needs 15 us for one and a log of 1 GB has 75,000 of them.
"""

from __future__ import annotations

import zlib
from array import array
from dataclasses import dataclass, field
from struct import Struct, iter_unpack
from typing import TYPE_CHECKING, BinaryIO, Final, NamedTuple

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Footer, MetadataIndex, Statistics

from hil.mcaplog.limits import LARGEST_CHANNEL, LARGEST_SCHEMAS, MIB, MOST_CHANNELS
from hil.mcaplog.reading.unpacking import DAMAGE, RECORD_HEAD, stream
from hil.mcaplog.writing.writer import MAGIC

if TYPE_CHECKING:
    from collections.abc import Iterator

_FOOTER: Final = RECORD_HEAD.size + 20
_CHUNK_HEAD: Final = Struct("<QQQQI")
_CHUNK_TAIL: Final = Struct("<Q")
_LARGEST: Final[dict[int, int]] = {Opcode.SCHEMA: LARGEST_SCHEMAS, Opcode.CHANNEL: LARGEST_CHANNEL}
_SMALLEST_CHUNK: Final = RECORD_HEAD.size + 40
_MOST_FILES: Final = 10_000
"""Metadata records, and attachments, that an index may name."""


class IndexedChunk(NamedTuple):
    """A chunk as the index has it.

    Attributes:
        start: Log time of its first entry, in ns.
        end: Log time of its last entry, in ns.
        offset: Where it begins in the file, in bytes.
        length: Of its record, in bytes.
        places: Where the message index of each channel begins, as it stands in the record; empty where there are none.
        message_index_length: Of all of them, which follow the chunk, in bytes.
    """

    start: int
    end: int
    offset: int
    length: int
    places: bytes
    message_index_length: int

    @property
    def channels(self) -> list[int]:
        """The channels that have a message index."""
        return [channel for channel, _ in iter_unpack("<HQ", self.places)]


@dataclass
class LogIndex:
    """What the summary of a log says.

    Attributes:
        begin: Where the summary begins in the file, in bytes.
        end: Where it ends.
        statistics: Its counts; None where there are none.
        schemas: Contents of its schema records.
        channels: Contents of its channel records.
        metadata: Where metadata records are.
        attachments: Where attachments are.
        places: Offsets of all that it knows of, ascending: chunks, metadata, attachments, the summary itself.
        begins: Where each chunk begins in the file, in bytes.
        behinds: Where each chunk with its message indexes ends.
        ends: Log times of the last entry of each chunk, in ns.
        records: Where the index of each chunk is in the file, in bytes.
        footer: Where the footer is.
    """

    begin: int
    end: int
    statistics: Statistics | None = None
    schemas: list[bytes] = field(default_factory=list)
    channels: list[bytes] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    places: array[int] = field(default_factory=lambda: array("Q"))
    begins: array[int] = field(default_factory=lambda: array("Q"))
    behinds: array[int] = field(default_factory=lambda: array("Q"))
    ends: array[int] = field(default_factory=lambda: array("Q"))
    records: array[int] = field(default_factory=lambda: array("Q"))
    footer: int = 0

    @property
    def chunk_count(self) -> int:
        """Chunks that it knows of."""
        return len(self.records)

    def first(self, since: int) -> int:
        """Number of the first chunk that holds an entry of a log time, in ns, or later; how many there are if none does."""
        return next((number for number, end in enumerate(self.ends) if end >= since), len(self.ends))

    def chunks(self, file: BinaryIO, first: int = 0) -> Iterator[IndexedChunk]:
        """Its chunks, in the order of the file.

        Args:
            file: The log, opened for reading; nothing else may read it meanwhile.
            first: Number of the first that is wanted.
        """
        if first < len(self.records):
            for opcode, content in _records(file, self.records[first], self.end):
                if opcode == Opcode.CHUNK_INDEX:
                    yield _chunk(content)


def read_index(file: BinaryIO, size: int) -> LogIndex | None:
    """Read the summary of a log.

    Args:
        file: The log.
        size: Its size in bytes.

    Returns:
        The index; None where there is none, its checksum is wrong or missing, or it contradicts the file's size or itself.
    """
    begin = size - _FOOTER - len(MAGIC)
    if begin < len(MAGIC):
        return None
    file.seek(begin)
    tail = file.read(_FOOTER + len(MAGIC))
    if tail[:1] != bytes([Opcode.FOOTER]) or tail[_FOOTER:] != MAGIC:
        return None
    footer = Footer.read(stream(tail[RECORD_HEAD.size :]))
    end = footer.summary_offset_start or begin
    if not len(MAGIC) <= footer.summary_start <= end <= begin or not footer.summary_start:
        return None
    if not footer.summary_crc or _checksum(file, footer.summary_start, size - len(MAGIC) - 4) != footer.summary_crc:
        return None
    index = LogIndex(footer.summary_start, end, footer=begin)
    try:
        _fill(index, file)
    except DAMAGE:
        return None
    return index


def _fill(index: LogIndex, file: BinaryIO) -> None:
    """Read all but what the chunk indexes say of their channels.

    Raises:
        ValueError: It contradicts itself.
    """
    behind, at = 0, index.begin
    for opcode, content in _records(file, index.begin, index.end):
        if len(content) > _LARGEST.get(opcode, 64 * MIB):
            raise ValueError("too large")
        if opcode == Opcode.CHUNK_INDEX:
            chunk = _chunk(content)
            if chunk.offset < behind or chunk.length < _SMALLEST_CHUNK:
                raise ValueError("chunks out of order")
            behind = chunk.offset + chunk.length + chunk.message_index_length
            index.begins.append(chunk.offset)
            index.behinds.append(behind)
            index.ends.append(chunk.end)
            index.records.append(at)
        else:
            _take(index, opcode, content)
        at += RECORD_HEAD.size + len(content)
    places = array("Q", index.begins)
    places.extend(record.offset for record in index.metadata)
    places.extend(record.offset for record in index.attachments)
    _check(index, behind, places)
    places.append(index.begin)
    index.places = array("Q", sorted(places))


def _take(index: LogIndex, opcode: int, content: bytes) -> None:
    if opcode == Opcode.SCHEMA:
        index.schemas.append(content)
    elif opcode == Opcode.CHANNEL:
        index.channels.append(content)
    elif opcode == Opcode.STATISTICS:
        index.statistics = Statistics.read(stream(content))
    elif opcode == Opcode.METADATA_INDEX:
        index.metadata.append(MetadataIndex.read(stream(content)))
    elif opcode == Opcode.ATTACHMENT_INDEX:
        index.attachments.append(AttachmentIndex.read(stream(content)))


def _check(index: LogIndex, behind: int, places: array[int]) -> None:
    statistics = index.statistics
    if statistics is not None and index.chunk_count not in {0, statistics.chunk_count}:
        raise ValueError("chunks are missing")
    if len(index.channels) > MOST_CHANNELS or sum(map(len, index.schemas)) > LARGEST_SCHEMAS:
        raise ValueError("too many channels, or too large schemas")
    if max(len(index.metadata), len(index.attachments)) > _MOST_FILES:
        raise ValueError("too many metadata records or attachments")
    if behind > index.begin or any(place >= index.begin for place in places):
        raise ValueError("it names places behind the data")


def _records(file: BinaryIO, begin: int, end: int) -> Iterator[tuple[int, bytes]]:
    """The records between two places, many read at once."""
    file.seek(begin)
    data, at, left = b"", 0, end - begin
    while True:
        whole = len(data) - at >= RECORD_HEAD.size
        opcode, length = RECORD_HEAD.unpack_from(data, at) if whole else (0, 0)
        behind = at + RECORD_HEAD.size + length
        if whole and behind <= len(data):
            yield opcode, data[behind - length : behind]
            at = behind
            continue
        if not left and at == len(data):
            return
        missing = behind - len(data)
        if missing > left or length > 64 * MIB:
            raise ValueError("it ends within a record")
        more = file.read(min(left, max(missing, MIB)))
        data, at, left = data[at:] + more, 0, left - len(more)
        if not more:
            raise ValueError("it ends within a record")


def _chunk(content: bytes) -> IndexedChunk:
    start, end, offset, length, size = _CHUNK_HEAD.unpack_from(content)
    at = _CHUNK_HEAD.size + size
    if size % 10:
        raise ValueError("no chunk index")
    return IndexedChunk(start, end, offset, length, content[_CHUNK_HEAD.size : at], _CHUNK_TAIL.unpack_from(content, at)[0])


def _checksum(file: BinaryIO, begin: int, end: int) -> int:
    file.seek(begin)
    crc, left = 0, end - begin
    while left > 0:
        piece = file.read(min(left, MIB))
        if not piece:
            return -1
        crc, left = zlib.crc32(piece, crc), left - len(piece)
    return crc
