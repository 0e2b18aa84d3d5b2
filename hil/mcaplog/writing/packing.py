"""How records stand in a log that is written: what its two writers, of new entries and of another log's, share."""

from __future__ import annotations

import zlib
from struct import Struct, pack
from typing import TYPE_CHECKING, Final

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Chunk, ChunkIndex, Footer, Statistics, SummaryOffset

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mcap.records import Attachment, Channel, McapRecord, MetadataIndex, Schema
    from zstandard import ZstdCompressor

    from hil.mcaplog.writing.row_encoding import EntryRows

MESSAGE_RECORD_HEAD: Final = Struct("<BQHIQQ")
"""Opcode and length of a message record, its channel, its number in it, log time and publish time."""
_HEADS: Final = np.dtype(
    [("opcode", "u1"), ("size", "<u8"), ("channel", "<u2"), ("number", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")]
)
"""The same as columns."""
_LEAD: Final = 9
"""Bytes of a record that its length does not count."""
INDEX_HEAD: Final = Struct("<BQHI")
"""Opcode and length of a message index record, its channel, and the bytes of what follows: stamps and places by turns."""


def serialize(record: McapRecord) -> bytes:
    """A record as it stands in a file."""
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


def pack_messages(parts: Sequence[EntryRows], numbers: Sequence[int], begin: int) -> tuple[bytes, list[list[int]]]:
    """Message records of many entries, in the order of their places.

    Args:
        parts: The entries, each of another channel.
        numbers: Of each channel, the number of its last message.
        begin: Where the first record will be among those of its chunk.

    Returns:
        The records; and of each channel, the stamp and the place of its messages by turns.
    """
    stamps = [np.rint(part.times * 1e9).astype(np.int64) for part in parts]
    sizes = np.repeat([MESSAGE_RECORD_HEAD.size + part.data.shape[1] for part in parts], [len(times) for times in stamps])
    order = np.argsort(np.concatenate([part.places for part in parts]))
    places = np.empty_like(sizes)
    places[order] = begin + np.cumsum(sizes[order]) - sizes[order]
    records: list[bytes] = []
    index = []
    for part, number, times in zip(parts, numbers, stamps, strict=True):
        first, size = len(records), MESSAGE_RECORD_HEAD.size + part.data.shape[1]
        heads = np.zeros(len(times), _HEADS)
        heads["opcode"], heads["size"], heads["channel"] = int(Opcode.MESSAGE), size - _LEAD, part.channel
        heads["number"] = np.arange(number + 1, number + 1 + len(times))
        heads["log_time"] = heads["publish_time"] = times
        data = np.concatenate((heads.view(np.uint8).reshape(len(times), -1), part.data), axis=1).tobytes()
        records += [data[at : at + size] for at in range(0, len(data), size)]
        index.append(np.stack((times, places[first : len(records)]), axis=1).ravel().tolist())
    return b"".join([records[number] for number in order.tolist()]), index


def pack_chunk(
    raw: bytes, index: Mapping[int, Sequence[int]], offset: int, compressor: ZstdCompressor, *, indexed: bool = True
) -> tuple[bytes, ChunkIndex]:
    """A chunk record, with the message index records behind it.

    Args:
        raw: The records in it.
        index: Of each channel in it, the stamp and the place of its messages by turns; not empty.
        offset: Where it will begin in the file, in bytes.
        compressor: Compresses it.
        indexed: Message index records follow it.

    Returns:
        The records, and what the summary says of the chunk.
    """
    first = min(min(places[::2]) for places in index.values())
    last = max(max(places[::2]) for places in index.values())
    chunk = Chunk("zstd", compressor.compress(raw), last, first, zlib.crc32(raw), len(raw))
    body = serialize(chunk)
    pieces, length = [body], len(body)
    offsets: dict[int, int] = {}
    for channel, places in index.items() if indexed else ():
        offsets[channel] = offset + length
        size = 8 * len(places)
        piece = INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + size, channel, size) + pack(f"<{len(places)}Q", *places)
        pieces.append(piece)
        length += len(piece)
    found = ChunkIndex(
        chunk_length=len(body),
        chunk_start_offset=offset,
        compression=chunk.compression,
        compressed_size=len(chunk.data),
        message_end_time=last,
        message_index_length=length - len(body),
        message_index_offsets=offsets,
        message_start_time=first,
        uncompressed_size=len(raw),
    )
    return b"".join(pieces), found


def index_attachment(attachment: Attachment, offset: int, length: int) -> AttachmentIndex:
    """What the summary says of an attachment.

    Args:
        attachment: The attachment.
        offset: Where its record begins in the file, in bytes.
        length: Bytes of the record.
    """
    return AttachmentIndex(
        offset=offset,
        length=length,
        log_time=attachment.log_time,
        create_time=attachment.create_time,
        data_size=len(attachment.data),
        name=attachment.name,
        media_type=attachment.media_type,
    )


def pack_groups(begin: int, groups: Mapping[Opcode, Sequence[McapRecord]]) -> bytes:
    """Records as the summary of a log, with where each kind of them is, and the footer.

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


def pack_summary(
    begin: int,
    *,
    schemas: Sequence[Schema],
    channels: Sequence[Channel],
    counts: Mapping[int, int],
    chunks: Sequence[ChunkIndex],
    attachments: Sequence[AttachmentIndex],
    metadata: Sequence[MetadataIndex],
    indexed: bool = True,
) -> bytes:
    """The summary of a log, from its first record to the footer.

    Args:
        begin: Where it will begin in the file, in bytes.
        schemas: Its schemas.
        channels: Its channels.
        counts: Messages of each channel.
        chunks: What there is to say of its chunks.
        attachments: Likewise.
        metadata: Likewise.
        indexed: It says where the chunks are.
    """
    whole = Statistics(
        attachment_count=len(attachments),
        channel_count=len(channels),
        channel_message_counts={channel: count for channel, count in sorted(counts.items()) if count},
        chunk_count=len(chunks),
        message_count=sum(counts.values()),
        message_end_time=max((chunk.message_end_time for chunk in chunks), default=0),
        message_start_time=min((chunk.message_start_time for chunk in chunks), default=0),
        metadata_count=len(metadata),
        schema_count=len(schemas),
    )
    groups: dict[Opcode, Sequence[McapRecord]] = {
        Opcode.SCHEMA: schemas,
        Opcode.CHANNEL: channels,
        Opcode.STATISTICS: [whole],
        Opcode.CHUNK_INDEX: chunks if indexed else [],
        Opcode.ATTACHMENT_INDEX: attachments,
        Opcode.METADATA_INDEX: metadata,
    }
    return pack_groups(begin, groups)
