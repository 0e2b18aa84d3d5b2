"""The index of a log: it saves looking, and changes nothing of what is found, even where it is wrong."""

from __future__ import annotations

import random
import zlib
from typing import TYPE_CHECKING, Final

import pytest
from mcap.opcode import Opcode
from mcap.writer import Writer
from report_logs import coaching_log

from hil.mcaplog import LogReader
from hil.mcaplog.reading.overview import overview
from hil.mcaplog.writing.writer import SIZES

if TYPE_CHECKING:
    from pathlib import Path

    from hil.mcaplog import LogEntry

RARE: Final = "/pal/trial"
OFTEN: Final = "/junior/sensors"


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "log.mcap"
    coaching_log(path, budget=30)
    return path


def plainly(path: Path) -> list[LogEntry]:
    """Every entry, without a look at the index."""
    return list(LogReader(path).entries())


def pressed(entries: list[LogEntry]) -> list[str]:
    return [str(entry) for entry in entries]


@pytest.mark.parametrize("topics", [[RARE], [OFTEN], [RARE, "/events"], ["/nowhere"]])
def test_topics_are_found_by_it(good: Path, topics: list[str]) -> None:
    reader = LogReader(good)
    assert pressed(list(reader.entries(topics))) == pressed([entry for entry in plainly(good) if entry.topic in topics])
    assert reader.whole
    assert reader.messages_read < len(plainly(good))
    assert {"run", "config", "robot"} <= set(reader.metadata)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99, 1.5])
def test_a_late_part_is_found_by_it(good: Path, share: float) -> None:
    everything = plainly(good)
    start = everything[0].time + share * (everything[-1].time - everything[0].time)
    reader = LogReader(good)
    late = [entry for entry in everything if entry.time >= start]
    assert pressed(list(reader.entries(start=start))) == pressed(late)
    assert reader.whole
    assert "robot" in reader.metadata
    found = list(LogReader(good).entries([OFTEN], start=start))
    assert pressed(found) == pressed([entry for entry in late if entry.topic == OFTEN])


def test_where_it_is_not_whole_the_log_is_walked(good: Path, tmp_path: Path) -> None:
    data, path = good.read_bytes(), tmp_path / "log.mcap"
    whole = pressed(list(LogReader(good).entries([RARE])))
    index = LogReader(good).index
    assert index is not None
    dice = random.Random(1)
    for _ in range(40):
        damaged = bytearray(data)
        damaged[dice.randrange(index.begin, len(data) - 12)] ^= 1 << dice.randrange(8)
        path.write_bytes(damaged)
        reader = LogReader(path)
        assert reader.index is None
        assert pressed(list(reader.entries([RARE]))) == whole
    for cut in (index.begin - 5, index.begin, index.begin + 40, len(data) - 1):
        path.write_bytes(data[:cut])
        assert pressed(list(LogReader(path).entries([RARE]))) == whole


def test_it_is_not_trusted_where_it_has_no_checksum(good: Path, tmp_path: Path) -> None:
    data, path = bytearray(good.read_bytes()), tmp_path / "log.mcap"
    data[-12:-8] = bytes(4)
    path.write_bytes(data)
    reader = LogReader(path)
    assert reader.index is None
    assert pressed(list(reader.entries([RARE]))) == pressed([entry for entry in plainly(good) if entry.topic == RARE])


@pytest.mark.parametrize("seed", range(3))
def test_one_that_lies_costs_no_traceback(good: Path, tmp_path: Path, seed: int) -> None:
    data, path = bytearray(good.read_bytes()), tmp_path / "log.mcap"
    index = LogReader(good).index
    assert index is not None
    dice = random.Random(seed)
    for _ in range(6):
        lying = bytearray(data)
        for _ in range(dice.choice([1, 5])):
            lying[dice.randrange(index.begin, index.footer)] ^= 1 << dice.randrange(8)
        lying[-12:-8] = zlib.crc32(lying[index.begin : -12]).to_bytes(4, "little")
        path.write_bytes(lying)
        list(LogReader(path).entries([RARE]))
        list(LogReader(path).entries(start=5.0))
        overview(path)


def test_message_indexes_that_are_wrong_are_not_used(good: Path, tmp_path: Path) -> None:
    data, path = bytearray(good.read_bytes()), tmp_path / "log.mcap"
    first = next(record for record in LogReader(good).records() if record.opcode == Opcode.MESSAGE_INDEX)
    data[first.offset + 9 + 6 + 8] ^= 1
    path.write_bytes(data)
    topic = LogReader(good)
    list(topic.raw_entries(["/nowhere"]))
    name = topic.channels.topic(int.from_bytes(first.content[:2], "little"))
    reader = LogReader(path)
    assert pressed(list(reader.entries([name]))) == pressed([entry for entry in plainly(good) if entry.topic == name])
    assert "are wrong, and were not used" in reader.health()


def test_message_indexes_may_be_empty(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=100)
        writer.start()
        one, two = (writer.register_channel(topic, "json", 0) for topic in ("/one", "/two"))
        for number in range(20):
            writer.add_message(one, number, b"x" * 30, number)
        writer.add_message(two, 20, b"{}", 20)
        for index in writer._Writer__chunk_indices:  # type: ignore[attr-defined]
            index.message_index_offsets.setdefault(two, index.chunk_start_offset + index.chunk_length)
        writer.finish()  # type: ignore[no-untyped-call]
    reader = LogReader(path)
    assert [entry.time for entry in reader.entries(["/two"])] == [20e-9]
    assert reader.whole


def test_entries_outside_chunks_and_files_between_them_are_not_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=200)
        writer.start()
        one, two = (writer.register_channel(topic, "json", 0) for topic in ("/one", "/two"))
        for number in range(100):
            writer.add_message(two if number % 10 else one, number * 1_000_000, b"x" * 30, number)
            if number == 50:
                writer.add_attachment(1, 2, "file", "text/plain", b"content")
                writer.add_metadata("middle", {"a": "b"})
        writer.finish()  # type: ignore[no-untyped-call]
    reader = LogReader(path)
    assert [entry.time for entry in reader.entries(["/one"])] == [number / 1000 for number in range(0, 100, 10)]
    assert (list(reader.attachments), list(reader.metadata)) == (["file"], ["middle"])
    assert len(list(reader.entries(start=0.0905))) == 9
    assert (list(reader.attachments), list(reader.metadata)) == (["file"], ["middle"])


def test_it_tells_where_to_go_on_behind_damage(good: Path, tmp_path: Path) -> None:
    data, path = bytearray(good.read_bytes()), tmp_path / "log.mcap"
    chunks = [record for record in LogReader(good).records() if record.opcode == Opcode.CHUNK]
    lost = chunks[len(chunks) // 2]
    data[lost.offset : lost.offset + 9] = bytes(9)
    path.write_bytes(data)
    reader = LogReader(path)
    entries = pressed(list(reader.entries()))
    whole = pressed(plainly(good))
    assert entries[-1] == whole[-1]
    assert len(whole) * (1 - 2 / len(chunks)) < len(entries) < len(whole)
    assert "which the index names" in reader.health()
    assert not reader.truncated


def test_the_overview_is_the_same_with_it_and_without(good: Path, tmp_path: Path) -> None:
    data, path = good.read_bytes(), tmp_path / "log.mcap"
    path.write_bytes(data[:-20])
    by_index, by_entries = overview(good), overview(path)
    assert (by_index.indexed, by_entries.indexed) == (True, False)
    assert (by_index.whole, by_entries.whole) == (True, False)
    assert "cut off" in by_entries.health
    assert [(one.topic, one.schema, one.entries) for one in by_index.topics] == [
        (one.topic, one.schema, one.entries) for one in by_entries.topics
    ]
    for attribute in ("start", "end", "entries", "series", "metadata", "attachments"):
        assert getattr(by_index, attribute) == getattr(by_entries, attribute)
    assert by_index.series[0][1] == "coaching"


def test_sizes_come_from_the_log_or_from_reading_it_all(good: Path) -> None:
    exact = overview(good, sizes=True)
    assert all(topic.size for topic in exact.topics)
    unpacked = [record for record in LogReader(good).records() if record.offset < 0 and record.opcode == Opcode.MESSAGE]
    assert sum(topic.size or 0 for topic in exact.topics) == sum(len(record.content) + 9 for record in unpacked)
    told = exact.metadata.get(SIZES)
    if told is not None:
        assert {topic.topic: str(topic.size) for topic in exact.topics} == told
