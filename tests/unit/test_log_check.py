"""Every rule is kept by good logs, of ours and of others, and each is found broken by a log made to break it."""

from __future__ import annotations

import random
import zlib
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import pytest
from damaged import damaged_bytes
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Statistics,
    SummaryOffset,
)
from mcap.records import Schema as SchemaRecord
from mcap.writer import CompressionType, Writer
from mcap_variants import ATTACHMENT, CHANNEL, MAGIC, METADATA, SCHEMA, SCHEMALESS, file_of, serialized, variants
from report_logs import coaching_log

from hil.mcaplog import LogReader
from hil.mcaplog.checking import check_log
from hil.mcaplog.checking.rules import OURS, RULES
from hil.mcaplog.making.copying import LogCopy
from hil.mcaplog.making.recovery import recover
from hil.mcaplog.making.slimming import slim
from hil.mcaplog.reading.reader import RawEntry
from hil.mcaplog.writing.packing import pack_groups

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from mcap.records import McapRecord

HEADER: Final = Header("", "other")
OUR_HEADER: Final = Header("", "junior-hil")
ENTRY: Final = Message(1, 2, b"\1", 1, 10)
PRIVATE: Final = b"\x80" + (3).to_bytes(8, "little") + b"abc"


def chunk(*records: McapRecord, **changes: object) -> Chunk:
    data = b"".join(map(serialized, records))
    times = [record.log_time for record in records if isinstance(record, Message)] or [0]
    return replace(Chunk("", data, max(times), min(times), zlib.crc32(data), len(data)), **changes)  # type: ignore[arg-type]


def changed(record: Statistics, name: str, value: int) -> Statistics:
    record = replace(record)
    setattr(record, name, value)
    return record


def log(*records: McapRecord | bytes, begin: bytes = MAGIC + serialized(HEADER), behind: bytes = b"") -> bytes:
    """A file of these records in its data."""
    data = b"".join(record if isinstance(record, bytes) else serialized(record) for record in records)
    return begin + data + serialized(DataEnd(0)) + (behind or serialized(Footer(0, 0, 0))) + MAGIC


def told(groups: dict[Opcode, Sequence[McapRecord]], *records: McapRecord, crc: int | None = None) -> bytes:
    """A file of these records and a summary; `crc` is what the footer says instead of the summary's checksum."""
    data = MAGIC + serialized(HEADER) + b"".join(map(serialized, records)) + serialized(DataEnd(0))
    end = pack_groups(len(data), groups)
    return data + (end if crc is None else end[:-4] + crc.to_bytes(4, "little")) + MAGIC


def broken(path: Path, data: bytes) -> set[str]:
    path.write_bytes(data)
    checked = check_log(path)
    for rule in checked.rules.values():
        assert rule.passed == (not rule.findings)
        assert all(0 <= found.offset <= len(data) and found.text for found in rule.findings)
    return {rule.name for rule in checked.rules.values() if not rule.passed}


START: Final = len(MAGIC) + len(serialized(HEADER))
STATISTICS: Final = Statistics(0, 1, {1: 1}, 0, 1, 2, 2, 0, 1)
BREAKERS: Final[dict[str, list[bytes]]] = {
    "magic": [log()[:-1] + b"x", log() + b"more"],
    "records": [log()[:-40], log(bytes(20)), log(serialized(CHANNEL)[:1] + (2).to_bytes(8, "little") + b"ab")],
    "order": [
        log(begin=MAGIC),
        log(HEADER),
        log()[: -len(MAGIC) - 29],
        log(Statistics(0, 0, {}, 0, 0, 0, 0, 0, 0)),
        MAGIC + serialized(HEADER) + serialized(Footer(0, 0, 0)) + MAGIC,
        log(behind=serialized(METADATA) + serialized(Footer(0, 0, 0))),
    ],
    "schemas": [log(replace(SCHEMA, id=0)), log(SCHEMA, replace(SCHEMA, name="Other"))],
    "channels": [log(CHANNEL), log(SCHEMALESS, replace(SCHEMALESS, topic="other"))],
    "messages": [log(ENTRY), log(chunk(ENTRY, SCHEMALESS))],
    "chunks": [
        log(chunk(SCHEMALESS, ENTRY, uncompressed_crc=5)),
        log(chunk(SCHEMALESS, ENTRY, uncompressed_size=5)),
        log(chunk(SCHEMALESS, ENTRY, message_start_time=1)),
        log(chunk(SCHEMALESS, ENTRY, message_end_time=9)),
        log(chunk(SCHEMALESS, ENTRY, METADATA)),
        log(chunk(SCHEMALESS, compression="zstd")),
    ],
    "message indexes": [
        log(MessageIndex(1, [])),
        log(chunk(SCHEMALESS, ENTRY), MessageIndex(1, [(2, 0)])),
        log(chunk(SCHEMALESS, ENTRY), MessageIndex(1, [])),
        log(chunk(SCHEMALESS, replace(SCHEMALESS, id=2), ENTRY, replace(ENTRY, channel_id=2)), MessageIndex(2, [(2, 93)])),
        log(chunk(SCHEMALESS, ENTRY), METADATA, MessageIndex(1, [(2, 47)])),
    ],
    "attachments": [log(serialized(ATTACHMENT)[:-1] + b"x")],
    "data checksum": [log()[: -len(MAGIC) - 29 - 4] + b"abcd" + serialized(Footer(0, 0, 0)) + MAGIC],
    "summary checksum": [told({Opcode.SCHEMA: [SCHEMA]}, SCHEMA, crc=7)],
    "summary": [
        log(behind=serialized(Footer(5, 0, 0))),
        log(SCHEMA, behind=serialized(SCHEMA) + serialized(Footer(0, 0, 0))),
        told({Opcode.SCHEMA: [SCHEMA], Opcode.CHANNEL: [CHANNEL, SCHEMA, CHANNEL]}, SCHEMA, CHANNEL),
        log(SCHEMA, behind=serialized(SummaryOffset(Opcode.SCHEMA, 0, 0)) + serialized(Footer(0, 5, 0))),
    ],
    "repeated": [told({Opcode.SCHEMA: [replace(SCHEMA, name="Other")]}, SCHEMA), told({Opcode.CHANNEL: [CHANNEL]}, SCHEMA)],
    "chunk indexes": [
        told({Opcode.CHUNK_INDEX: [ChunkIndex(1, START, "", 1, 2, 0, {}, 2, 1)]}, chunk(SCHEMALESS, ENTRY)),
        told({Opcode.CHUNK_INDEX: [ChunkIndex(1, 7, "", 1, 2, 0, {}, 2, 1)]}, chunk(SCHEMALESS, ENTRY)),
    ],
    "attachment indexes": [told({Opcode.ATTACHMENT_INDEX: [AttachmentIndex(START, 5, 2, 1, 3, "myFile", "")]}, ATTACHMENT)],
    "metadata indexes": [told({Opcode.METADATA_INDEX: [MetadataIndex(START, 5, "other")]}, METADATA)],
    "statistics": [
        told({Opcode.STATISTICS: [changed(STATISTICS, name, 7)]}, SCHEMA, CHANNEL, ENTRY)
        for name in (
            "attachment_count", "channel_count", "chunk_count", "message_count", "message_start_time", "message_end_time",
            "metadata_count", "schema_count",
        )
    ]
    + [told({Opcode.STATISTICS: [replace(STATISTICS, channel_message_counts={1: 5})]}, SCHEMA, CHANNEL, ENTRY)],
    "entries": [
        log(SchemaRecord(1, b"no descriptor", "protobuf", "x.Y"), replace(CHANNEL, message_encoding="protobuf"), ENTRY),
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "log.mcap"
    coaching_log(path, budget=30)
    return path


def test_good_logs_keep_every_rule(good: Path, tmp_path: Path) -> None:
    checked = check_log(good)
    assert checked.passed
    assert checked.ours
    assert set(checked.rules) == {*RULES, *OURS}
    for make in (slim, recover):
        out = tmp_path / f"{make.__name__}.mcap"
        make(good, out)
        assert check_log(out).passed
    path = tmp_path / "log.mcap"
    for variant in variants():
        assert not broken(path, file_of(variant)), variant


@pytest.mark.parametrize("compression", CompressionType)
def test_so_do_those_of_the_stock_writer(tmp_path: Path, compression: CompressionType) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=300, compression=compression, enable_data_crcs=True)
        writer.start()
        channel = writer.register_channel("/x", "json", writer.register_schema("X", "jsonschema", b"{}"))
        for number in range(50):
            writer.add_message(channel, number, b"{}" * number, number)
        writer.add_attachment(1, 2, "file", "text/plain", b"content")
        writer.add_metadata("name", {"a": "b"})
        writer.finish()  # type: ignore[no-untyped-call]
    checked = check_log(path)
    assert checked.passed
    assert not checked.ours


@pytest.mark.parametrize(("rule", "number"), [(rule, number) for rule in RULES for number in range(len(BREAKERS[rule]))])
def test_every_rule_can_be_broken(tmp_path: Path, rule: str, number: int) -> None:
    found = broken(tmp_path / "log.mcap", BREAKERS[rule][number])
    assert rule in found
    assert len(found) <= 3


def test_private_records_may_be_anywhere(tmp_path: Path) -> None:
    data = log(PRIVATE, SCHEMALESS, ENTRY, PRIVATE, behind=PRIVATE + serialized(Footer(0, 0, 0)))
    assert not broken(tmp_path / "log.mcap", data)


def ours(path: Path, *, entries: Sequence[Message], topic: str = "/x", first: str = "run") -> bytes:
    """A log that says it is ours."""
    with path.open("wb") as file:
        copy = LogCopy(file, header=OUR_HEADER)
        copy.values(first, {})
        copy.values("config", {})
        channel = Channel(1, topic, "json", {}, 0)
        for one in entries:
            copy.entry(raw(one), channel, None)
        copy.finish()
    return path.read_bytes()


def raw(message: Message) -> RawEntry:
    return RawEntry("", message.channel_id, message.sequence, message.log_time, message.publish_time, message.data)


def test_our_own_rules_can_be_broken(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    fine = [Message(1, time, b"", time, number) for number, time in ((1, 5), (2, 5), (3, 9))]
    assert not broken(path, ours(path, entries=fine, topic="/bridge/step"))
    back = [*fine, Message(1, 8, b"", 8, 4)]
    assert broken(path, ours(path, entries=back, topic="/bridge/step")) == {"our clock"}
    assert not broken(path, ours(path, entries=back))
    assert broken(path, ours(path, entries=[*fine, Message(1, 9, b"", 9, 3)])) == {"our numbers"}
    assert broken(path, ours(path, entries=fine, first="config")) == {"our metadata"}
    data = bytearray(ours(path, entries=fine))
    place = data.index(b"93", data.index(b"sizes"))
    data[place : place + 2] = b"94"
    assert broken(path, bytes(data)) == {"our sizes"}
    bare = MAGIC + serialized(OUR_HEADER)
    assert broken(path, log(Metadata("run", {}), Metadata("config", {}), begin=bare)) == {"our index"}


@pytest.mark.parametrize("seed", range(3))
def test_damage_anywhere_is_found_and_never_raises(good: Path, tmp_path: Path, seed: int) -> None:
    data, path = good.read_bytes(), tmp_path / "log.mcap"
    dice = random.Random(seed)
    begin = next(record for record in LogReader(good).records() if record.opcode == Opcode.CHUNK).offset
    found = 0
    for _ in range(12):
        damaged = bytearray(data)
        damaged[dice.randrange(begin, len(data))] ^= 1 << dice.randrange(8)
        found += bool(broken(path, bytes(damaged)))
    assert found >= 11  # what nothing depends on may be anything: publish times of entries outside chunks, say
    for _ in range(8):
        changed = damaged_bytes(data, dice)
        if changed.startswith(MAGIC):
            broken(path, changed)


def test_a_finding_says_where(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(log(SCHEMALESS, *[replace(ENTRY, channel_id=9)] * 50))
    rule = check_log(path).rules["messages"]
    assert rule.count == 50
    assert len(rule.findings) == 20
    assert rule.findings[0].offset == START + len(serialized(SCHEMALESS))
    assert "an entry comes before its channel, 9" in rule.findings[0].text
