"""Small MCAP files in every form that the format allows: each kind of record with and without what may be left out.

The forms are those of MCAP's own conformance suite: ten features, by what they make sense with, times six contents; 416
files. They are made here from the `mcap` package's records, by none of this project's code.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Final

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
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

MAGIC: Final = b"\x89MCAP0\r\n"
SCHEMA: Final = Schema(id=1, data=b"\4\5\6", encoding="c", name="Example")
CHANNEL: Final = Channel(id=1, topic="example", message_encoding="a", metadata={"foo": "bar"}, schema_id=1)
SCHEMALESS: Final = Channel(id=1, topic="example", message_encoding="a", metadata={"foo": "bar"}, schema_id=0)
ATTACHMENT: Final = Attachment(create_time=1, log_time=2, name="myFile", media_type="application/octet-stream", data=b"\1\2\3")
METADATA: Final = Metadata(name="myMetadata", metadata={"foo": "bar"})
CONTENTS: Final[dict[str, list[McapRecord]]] = {
    "NoData": [],
    "OneMessage": [SCHEMA, CHANNEL, Message(1, 2, b"\1\2\3", 1, 10)],
    "OneAttachment": [ATTACHMENT],
    "OneMetadata": [METADATA],
    "OneSchemalessMessage": [SCHEMALESS, Message(1, 2, b"\1\2\3", 1, 10)],
    "TenMessages": [SCHEMA, CHANNEL, *(Message(1, 100 + number, bytes([number]) * 3, number, number) for number in range(10))],
}


@dataclass(frozen=True)
class Variant:
    """A file of the suite.

    Attributes:
        content: Name of its content.
        features: What it has of what may be left out: ch (chunks), mx (message indexes), st (statistics), rsh and rch (schemas
            and channels in the summary too), ax, mdx, chx (indexes of attachments, metadata, chunks), sum (summary offsets),
            pad (records have something behind what is known of them).
    """

    content: str
    features: frozenset[str]

    def __str__(self) -> str:
        return "-".join((self.content, *sorted(self.features)))


def variants() -> Iterator[Variant]:
    """All of them: 416."""
    for content, records in CONTENTS.items():
        kinds = {type(record) for record in records}
        sensible = ["st", "pad"]
        sensible += ["rsh"] if Schema in kinds else []
        sensible += ["rch", "ch", "mx", "chx"] if Channel in kinds else []
        sensible += ["ax"] if Attachment in kinds else []
        sensible += ["mdx"] if Metadata in kinds else []
        for chosen in product((False, True), repeat=len(sensible)):
            features = {name for name, there in zip(sensible, chosen, strict=True) if there}
            if features & {"mx", "chx"} and "ch" not in features:
                continue
            yield Variant(content, frozenset(features))
            if features & {"st", "rsh", "rch", "ax", "mdx", "chx"}:
                yield Variant(content, frozenset(features | {"sum"}))


@dataclass
class _File:
    features: frozenset[str]
    data: bytearray = field(default_factory=lambda: bytearray(MAGIC))
    chunks: list[ChunkIndex] = field(default_factory=list)

    def put(self, record: McapRecord, *, extended: bool = True) -> tuple[int, int]:
        """Append a record; where it is, and how long."""
        at, raw = len(self.data), serialized(record)
        if extended and "pad" in self.features:
            raw = raw[:1] + (len(raw) - 9 + 3).to_bytes(8, "little") + raw[9:] + b"\1\2\3"
        self.data += raw
        return at, len(raw)

    def put_chunk(self, records: Sequence[McapRecord]) -> None:
        raw, index = bytearray(), MessageIndex(1, [])
        for record in records:
            if isinstance(record, Message):
                index.records.append((record.log_time, len(raw)))
            raw += serialized(record)
        times = [time for time, _ in index.records]
        chunk = Chunk("", bytes(raw), max(times), min(times), zlib.crc32(raw), len(raw))
        at, length = self.put(chunk, extended=False)
        offsets, size = {}, 0
        if "mx" in self.features:
            offsets[1], size = self.put(index)
        self.chunks.append(ChunkIndex(length, at, "", len(raw), max(times), size, offsets, min(times), len(raw)))


def file_of(variant: Variant) -> bytes:
    """The content of a file."""
    records, features = CONTENTS[variant.content], variant.features
    file = _File(features)
    file.put(Header(profile="", library=""))
    summary: dict[Opcode, list[McapRecord]] = {}
    in_chunks = [record for record in records if isinstance(record, Schema | Channel | Message)]
    if "ch" in features:
        file.put_chunk(in_chunks)
    for record in records:
        if "ch" in features and record in in_chunks:
            continue
        at, length = file.put(record, extended=not isinstance(record, Message))
        if isinstance(record, Attachment) and "ax" in features:
            index = AttachmentIndex(
                at, length, record.log_time, record.create_time, len(record.data), record.name, record.media_type
            )
            summary[Opcode.ATTACHMENT_INDEX] = [index]
        elif isinstance(record, Metadata) and "mdx" in features:
            summary[Opcode.METADATA_INDEX] = [MetadataIndex(at, length, record.name)]
    file.put(DataEnd(0))
    if "rsh" in features:
        summary[Opcode.SCHEMA] = [record for record in records if isinstance(record, Schema)]
    if "rch" in features:
        summary[Opcode.CHANNEL] = [record for record in records if isinstance(record, Channel)]
    if "st" in features:
        summary[Opcode.STATISTICS] = [_statistics(records, len(file.chunks))]
    if "chx" in features:
        summary[Opcode.CHUNK_INDEX] = list(file.chunks)
    _finish(file, summary)
    return bytes(file.data)


def _statistics(records: list[McapRecord], chunks: int) -> Statistics:
    messages = [record for record in records if isinstance(record, Message)]
    times = [message.log_time for message in messages] or [0]

    def count(kind: type[McapRecord]) -> int:
        return sum(isinstance(record, kind) for record in records)

    return Statistics(
        attachment_count=count(Attachment),
        channel_count=count(Channel),
        channel_message_counts={1: len(messages)} if messages else {},
        chunk_count=chunks,
        message_count=len(messages),
        message_end_time=max(times),
        message_start_time=min(times),
        metadata_count=count(Metadata),
        schema_count=count(Schema),
    )


def _finish(file: _File, summary: dict[Opcode, list[McapRecord]]) -> None:
    begin, groups = len(file.data), []
    for opcode, records in summary.items():
        start = len(file.data)
        for record in records:
            file.put(record)
        groups.append(SummaryOffset(opcode, start, len(file.data) - start))
    offsets = len(file.data)
    if "sum" in file.features:
        for group in groups:
            file.put(group)
    footer = Footer(begin if summary else 0, offsets if "sum" in file.features else 0, 0)
    if summary:
        footer.summary_crc = zlib.crc32(serialized(footer)[:-4], zlib.crc32(file.data[begin:]))
    file.put(footer, extended=False)
    file.data += MAGIC


def serialized(record: McapRecord) -> bytes:
    """A record as it stands in a file."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
