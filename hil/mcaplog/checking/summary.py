"""Rules for the summary of a log: what it says of the data, and where its parts are."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, Any, Final, TypeVar

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, ChunkIndex, Footer, MetadataIndex, Statistics, SummaryOffset
from mcap.records import Schema as SchemaRecord

from hil.mcaplog.checking.data import PRIVATE
from hil.mcaplog.making.slimming import SLIM
from hil.mcaplog.reading.unpacking import stream
from hil.mcaplog.writing.writer import UNINDEXED

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hil.mcaplog.checking.data import DataRules, Report

_IN_SUMMARY: Final = frozenset(
    {
        Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX,
    }
)  # fmt: skip
_Described = TypeVar("_Described", SchemaRecord, Channel)


class SummaryRules:
    """Looks at the records behind the end of the data, in order.

    Args:
        report: Takes what is against a rule.
        data: What the data holds.
    """

    def __init__(self, report: Report, data: DataRules) -> None:
        self._report = report
        self._data = data
        self._crc = self._begin = 0
        self._groups: dict[int, list[int]] = {}
        self._last = -1
        self._offsets: list[int] = []
        self._stated: dict[int, tuple[int, int]] = {}
        self._repeated: dict[int, set[int]] = {Opcode.SCHEMA: set(), Opcode.CHANNEL: set()}
        self._chunks: set[int] = set()
        self._attachments: set[int] = set()
        self._metadata: set[int] = set()
        self._statistics = False

    def begin(self, offset: int) -> None:
        """The data has ended, and this is where the summary begins in the file."""
        self._begin = offset

    def take(self, opcode: int, offset: int, head: bytes, content: bytes) -> None:
        """Take a record."""
        if opcode == Opcode.FOOTER:
            self._footer(offset, head, content)
            return
        self._crc = zlib.crc32(content, zlib.crc32(head, self._crc))
        if opcode == Opcode.SUMMARY_OFFSET:
            self._offsets.append(offset)
            found = SummaryOffset.read(stream(content))
            self._stated[found.group_opcode] = found.group_start, found.group_length
            return
        if opcode not in _IN_SUMMARY:
            if opcode < PRIVATE:
                self._report("order", offset, f"a record of kind {opcode:#04x} does not belong into the summary")
            return
        if self._offsets:
            self._report("order", offset, "the summary goes on behind the summary offsets")
        if opcode != self._last and opcode in self._groups:
            self._report("summary", offset, f"records of kind {opcode:#04x} do not stand together")
        self._last = opcode
        group = self._groups.setdefault(opcode, [offset, offset])
        group[1] = offset + len(head) + len(content)
        self._check(opcode, offset, content)

    def finish_ours(self) -> None:
        """Check that the summary of a log of ours has all that it may have."""
        data = self._data
        slim = not self._chunks and any(name in {SLIM, UNINDEXED} for _, _, name in data.metadata)
        missing = [
            what
            for what, there, wanted in (
                ("schemas", self._repeated[Opcode.SCHEMA], set(data.schemas)),
                ("channels", self._repeated[Opcode.CHANNEL], set(data.channels)),
                ("indexes of chunks", self._chunks, set() if slim else set(data.chunks)),
                ("indexes of attachments", self._attachments, {found[0] for found in data.attachments}),
                ("indexes of metadata", self._metadata, {found[0] for found in data.metadata}),
                ("statistics", {self._statistics}, {True}),
            )
            if wanted - there
        ]
        if missing:
            self._report("our index", self._begin, f"the summary does not have all: {', '.join(missing)}")

    def _check(self, opcode: int, offset: int, content: bytes) -> None:
        data = self._data
        if opcode == Opcode.SCHEMA:
            self._repeat(opcode, offset, SchemaRecord.read(stream(content)), data.schemas)
        elif opcode == Opcode.CHANNEL:
            self._repeat(opcode, offset, Channel.read(stream(content)), data.channels)
        elif opcode == Opcode.STATISTICS:
            self._check_statistics(offset, Statistics.read(stream(content)))
        elif opcode == Opcode.CHUNK_INDEX:
            self._check_chunk(offset, ChunkIndex.read(stream(content)))
        elif opcode == Opcode.ATTACHMENT_INDEX:
            index = AttachmentIndex.read(stream(content))
            described = (index.log_time, index.create_time, index.data_size, index.name, index.media_type)
            self._attachments.add(index.offset)
            if (index.offset, index.length, *described) not in data.attachments:
                self._report("attachment indexes", offset, f"there is no such attachment at byte {index.offset:,}")
        else:
            place = MetadataIndex.read(stream(content))
            self._metadata.add(place.offset)
            if (place.offset, place.length, place.name) not in data.metadata:
                self._report("metadata indexes", offset, f"there is no such metadata record at byte {place.offset:,}")

    def _repeat(self, opcode: int, offset: int, found: _Described, known: Mapping[int, _Described]) -> None:
        self._repeated[opcode].add(found.id)
        if known.get(found.id) != found:
            what = "schema" if opcode == Opcode.SCHEMA else "channel"
            self._report("repeated", offset, f"{what} {found.id} is not as it is in the data")

    def _check_chunk(self, offset: int, index: ChunkIndex) -> None:
        place = index.chunk_start_offset
        self._chunks.add(place)
        if place not in self._data.chunks:
            self._report("chunk indexes", offset, f"there is no chunk at byte {place:,}")
            return
        known = self._data.chunks[place]
        said = {
            "first log time": index.message_start_time,
            "last log time": index.message_end_time,
            "length": index.chunk_length,
            "message indexes": index.message_index_offsets,
            "length of the message indexes": index.message_index_length,
            "compression": index.compression,
            "compressed size": index.compressed_size,
            "size": index.uncompressed_size,
        }
        for (what, value), there in zip(said.items(), known or (), strict=False):
            if value != there:
                self._report(
                    "chunk indexes", offset, f"{what} of the chunk at byte {place:,}: {_short(value)}, not {_short(there)}"
                )

    def _check_statistics(self, offset: int, found: Statistics) -> None:
        data, self._statistics = self._data, True
        start, end = data.span or (0, 0)
        counts = {channel: count for channel, count in found.channel_message_counts.items() if count}
        for what, stated, there in (
            ("entries", found.message_count, sum(data.counts.values())),
            ("schemas", found.schema_count, len(data.schemas)),
            ("channels", found.channel_count, len(data.channels)),
            ("attachments", found.attachment_count, len(data.attachments)),
            ("metadata records", found.metadata_count, len(data.metadata)),
            ("chunks", found.chunk_count, len(data.chunks)),
            ("first log time", found.message_start_time, start),
            ("last log time", found.message_end_time, end),
            ("entries by channel", counts, data.counts),
        ):
            if stated != there:
                self._report("statistics", offset, f"{what}: {_short(stated)}, not {_short(there)}")

    def _footer(self, offset: int, head: bytes, content: bytes) -> None:
        footer = Footer.read(stream(content))
        begin = self._begin if self._groups else 0
        if footer.summary_start != begin:
            self._report(
                "summary", offset, f"the footer says that the summary begins at byte {footer.summary_start:,}, not {begin:,}"
            )
        offsets = self._offsets[0] if self._offsets else 0
        stated = footer.summary_offset_start
        if stated != offsets and not (stated == offset and not offsets):
            self._report("summary", offset, f"the footer says that the offsets begin at byte {stated:,}, not {offsets:,}")
        crc = zlib.crc32(content[:16], zlib.crc32(head, self._crc))
        if footer.summary_crc and footer.summary_crc != crc:
            self._report("summary checksum", offset, f"the summary has the checksum {crc:08x}, not {footer.summary_crc:08x}")
        for opcode, (start, length) in self._stated.items():
            group = self._groups.get(opcode)
            if group is None or (start, length) != (group[0], group[1] - group[0]):
                self._report("summary", offset, f"records of kind {opcode:#04x} are not where their summary offset says")


def _short(value: Any) -> str:  # noqa: ANN401 - whatever a record holds
    return f"{value:,}" if isinstance(value, int) else f"{value!r:.60}"
