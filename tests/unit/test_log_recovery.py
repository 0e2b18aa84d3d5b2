"""Damaged logs made whole, and whole ones made small: entries byte for byte, and what stock tools read."""

from __future__ import annotations

import json
import random
import struct
import zlib
from typing import TYPE_CHECKING

import lz4.frame
import pytest
import zstandard
from damaged import damaged_bytes, packed, records_of
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Chunk, Header
from mcap.writer import Writer
from mcap_variants import MAGIC, SCHEMALESS, file_of, serialized, variants
from report_logs import coaching_log

from hil.files.outputs import OutputExistsError
from hil.mcaplog import LogError, LogReader, UnreadableLogError
from hil.mcaplog.checking.rules import check_log
from hil.mcaplog.compare import compare_logs
from hil.mcaplog.making.recovery import recover
from hil.mcaplog.making.slimming import KEPT, QUICK, SLIM, matches, pack, slim
from hil.mcaplog.reading.overview import overview
from hil.mcaplog.writing.writer import CUT, SIZES

if TYPE_CHECKING:
    from pathlib import Path

    from hil.mcaplog.reading.reader import RawEntry


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "log.mcap"
    coaching_log(path, budget=40)
    return path


def raw(path: Path) -> list[RawEntry]:
    return list(LogReader(path).raw_entries())


def stock(path: Path) -> list[tuple[str, int, int, int, bytes]]:
    """What the stock reader gives, by the index, in the order of the file."""
    with path.open("rb") as file:
        found = make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)
        return [(channel.topic, one.sequence, one.log_time, one.publish_time, one.data) for _, channel, one in found]


def plain(entries: list[RawEntry]) -> list[tuple[str, int, int, int, bytes]]:
    return [(one.topic, one.sequence, one.log_time, one.publish_time, one.data) for one in entries]


def test_a_log_that_was_cut_off_becomes_whole(good: Path, tmp_path: Path) -> None:
    data, path, out = good.read_bytes(), tmp_path / "cut.mcap", tmp_path / "whole.mcap"
    everything = raw(good)
    counts = []
    for length in range(5000, len(data), 9733):
        path.write_bytes(data[:length])
        made = recover(path, out, overwrite=True)
        found = plain(raw(out))
        assert found == plain(everything)[: len(found)]
        assert stock(out) == found
        assert len(found) >= len(raw(path))
        assert made.entries == len(found)
        assert not made.whole
        assert overview(out).indexed
        counts.append(len(found))
    assert counts == sorted(counts)


def test_what_is_left_of_a_chunk_that_was_cut_off_is_had(tmp_path: Path) -> None:
    entries = [(Opcode.MESSAGE, struct.pack("<HIQQ", 1, number, 0, 0)) for number in range(9000)]
    data = serialized(SCHEMALESS) + packed(entries)
    dice = random.Random(1)
    for name, compress in (("zstd", zstandard.ZstdCompressor().compress), ("lz4", lz4.frame.compress), ("", bytes)):
        path, out = tmp_path / f"cut{name}.mcap", tmp_path / f"out{name}.mcap"
        chunk = serialized(Chunk(name, compress(data), 0, 0, zlib.crc32(data), len(data)))
        whole = MAGIC + serialized(Header("", "other")) + chunk
        path.write_bytes(whole[: -dice.randrange(10, 40)])
        assert not raw(path)
        recover(path, out)
        found = raw(out)
        assert [entry.sequence for entry in found] == list(range(len(found)))
        assert len(found) > 1000


def test_a_damaged_chunk_costs_only_what_is_behind_the_damage(good: Path, tmp_path: Path) -> None:
    data, path, out = bytearray(good.read_bytes()), tmp_path / "log.mcap", tmp_path / "out.mcap"
    chunks = [record for record in LogReader(good).records() if record.opcode == Opcode.CHUNK]
    first = chunks[0]
    data[first.offset + 9 + len(first.content) // 2] ^= 0xFF  # with the channels that all others need
    path.write_bytes(data)
    made = recover(path, out)
    assert made.entries > 0.8 * len(raw(good))
    assert set(plain(raw(out))) <= set(plain(raw(good)))
    assert stock(out) == plain(raw(out))


def test_metadata_attachments_and_every_form_are_kept(tmp_path: Path) -> None:
    path, out = tmp_path / "log.mcap", tmp_path / "out.mcap"
    for variant in list(variants())[::7]:
        path.write_bytes(file_of(variant))
        one = LogReader(path)
        before = list(one.entries())
        if variant.content == "NoData":
            with pytest.raises(UnreadableLogError, match="nothing could be had"):
                recover(path, out, overwrite=True)
            continue
        recover(path, out, overwrite=True)
        two = LogReader(out)
        assert list(two.entries()) == before
        assert two.attachments == one.attachments
        assert {name: values for name, values in two.metadata.items() if name != SIZES} == one.metadata
        with out.open("rb") as file:
            schemas = [schema for schema, _, _ in make_reader(file).iter_messages()]
        with path.open("rb") as file:
            assert [schema for schema, _, _ in NonSeekingReader(file).iter_messages()] == schemas


@pytest.mark.parametrize("seed", range(4))
def test_whatever_is_done_to_a_log_something_or_an_error_comes_out(good: Path, tmp_path: Path, seed: int) -> None:
    data, path, out = good.read_bytes(), tmp_path / "log.mcap", tmp_path / "out.mcap"
    dice = random.Random(seed)
    for _ in range(6):
        path.write_bytes(damaged_bytes(data, dice))
        try:
            read = raw(path)
            made = recover(path, out, overwrite=True)
        except LogError:
            assert not out.exists()
            continue
        assert made.entries + sum(reader_unread(path)) >= len(read) * 0.99
        assert len(stock(out)) == made.entries
        out.unlink()


@pytest.mark.parametrize("seed", range(3))
def test_what_is_before_the_damage_is_never_lost(good: Path, tmp_path: Path, seed: int) -> None:
    data, path, out = good.read_bytes(), tmp_path / "log.mcap", tmp_path / "out.mcap"
    ends, counts = list[int](), list[int]()  # where chunks end in the file, and how many entries there are up to there
    for record in LogReader(good).records():
        if record.opcode == Opcode.CHUNK:
            ends.append(record.offset + 9 + len(record.content))
            counts.append(counts[-1] if counts else 0)
        elif record.opcode == Opcode.MESSAGE:
            counts[-1] += 1
    everything = raw(good)
    dice = random.Random(seed)
    for _ in range(8):
        at = dice.randrange(ends[0], len(data))
        damaged = bytearray(data)
        damaged[at] ^= 1 << dice.randrange(8)
        safe = everything[: max(count for end, count in zip(ends, counts, strict=True) if end <= at)]
        path.write_bytes(damaged if dice.random() < 0.7 else damaged[:at])
        recover(path, out, overwrite=True)
        assert plain(raw(path))[: len(safe)] == plain(safe)
        assert plain(raw(out))[: len(safe)] == plain(safe)
        of_one = [entry for entry in safe if entry.topic == "/pal/trial"]
        assert plain(list(LogReader(path).raw_entries(["/pal/trial"])))[: len(of_one)] == plain(of_one)


def reader_unread(path: Path) -> list[int]:
    reader = LogReader(path)
    list(reader.entries())
    return list(reader.not_read.values())


def test_where_nothing_could_be_had_there_is_no_file(good: Path, tmp_path: Path) -> None:
    path, out = tmp_path / "log.mcap", tmp_path / "out.mcap"
    path.write_bytes(good.read_bytes()[:30])
    with pytest.raises(UnreadableLogError, match="nothing could be had of the log"):
        recover(path, out)
    assert not out.exists()
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_exists_is_not_replaced_unasked_and_the_log_itself_never(good: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    out.write_bytes(b"mine")
    with pytest.raises(OutputExistsError):
        recover(good, out)
    assert out.read_bytes() == b"mine"
    assert recover(good, out, overwrite=True).whole
    before = good.read_bytes()
    with pytest.raises(LogError, match="is the log itself"):
        recover(good, good, overwrite=True)
    assert good.read_bytes() == before


def test_a_slim_log_has_what_running_it_again_needs(good: Path, tmp_path: Path) -> None:
    out = tmp_path / "slim.mcap"
    made = slim(good, out)
    wanted = [entry for entry in raw(good) if matches(entry.topic, KEPT)]
    assert plain(raw(out)) == plain(wanted)
    assert stock(out) == plain(wanted)
    assert 0 < made.size < good.stat().st_size / 2
    topics = {entry.topic for entry in wanted}
    assert {"/bridge/step", "/wire/rx", "/wire/tx", "/events", "/pal/trial"} <= topics
    assert "/junior/sensors" not in topics
    one, two = LogReader(good), LogReader(out)
    list(one.entries([]))
    list(two.entries([]))
    assert json.loads(two.metadata[SLIM]["kept"])
    assert {name: two.metadata[name] for name in one.metadata if name != SIZES} == {
        name: values for name, values in one.metadata.items() if name != SIZES
    }
    assert [entry.topic for entry in LogReader(out).entries(["/pal/trial"])] == ["/pal/trial"] * 40


def test_a_log_is_small_without_its_index_and_gets_one_again(good: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.mcap"
    pack(good, out, level=QUICK)
    assert raw(out) == raw(good)
    assert out.stat().st_size < 0.7 * good.stat().st_size
    assert check_log(out).passed
    one, other = tmp_path / "one.mcap", tmp_path / "other.mcap"
    slim(good, one)
    slim(out, other)
    assert one.read_bytes() == other.read_bytes()
    assert compare_logs(good, out).same
    recover(good, one, overwrite=True)
    recover(out, other, overwrite=True)
    assert one.read_bytes() == other.read_bytes()
    assert check_log(other).passed


def test_a_slim_log_keeps_attachments(tmp_path: Path) -> None:
    path, out = tmp_path / "log.mcap", tmp_path / "slim.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_attachment(1, 2, "advice.toml", "application/toml", b"version = 1")
        writer.add_message(writer.register_channel("/events", "json", 0), 5, b"{}", 6, 7)
        writer.add_message(writer.register_channel("/tf", "json", 0), 5, b"{}", 6, 7)
        writer.finish()  # type: ignore[no-untyped-call]
    slim(path, out)
    reader = LogReader(out)
    assert [(entry.topic, entry.sequence, entry.log_time, entry.publish_time) for entry in reader.raw_entries()] == [
        ("/events", 7, 5, 6)
    ]
    assert reader.attachments["advice.toml"].data == b"version = 1"


def test_limits_hold_for_them_too(tmp_path: Path, good: Path) -> None:
    path, out = tmp_path / "bomb.mcap", tmp_path / "out.mcap"
    data = packed([*records_of(good), (0x80, bytes(17 << 20))])
    chunk = serialized(Chunk("zstd", zstandard.ZstdCompressor().compress(data), 0, 0, 0, len(data)))
    path.write_bytes(MAGIC + chunk)
    with pytest.raises(UnreadableLogError, match="--max-chunk 18"):
        recover(path, out)
    assert not out.exists()


def test_what_is_made_of_a_damaged_log_says_that_it_ends_early(good: Path, tmp_path: Path) -> None:
    cut, out, again = tmp_path / "cut.mcap", tmp_path / "whole.mcap", tmp_path / "again.mcap"
    cut.write_bytes(good.read_bytes()[:-9000])
    for make in (recover, slim):
        make(cut, out, overwrite=True)
        reader = LogReader(out)
        list(reader.raw_entries())
        assert reader.whole
        assert reader.ends_early
        assert "cut off" in reader.metadata[CUT]["why"]
        recover(out, again, overwrite=True)
        reader = LogReader(again)
        list(reader.raw_entries())
        assert reader.ends_early
    recover(good, out, overwrite=True)
    reader = LogReader(out)
    list(reader.raw_entries())
    assert not reader.ends_early


def test_a_slim_log_that_was_cut_off_keeps_what_came_before(tmp_path: Path) -> None:
    long, small, cut = tmp_path / "long.mcap", tmp_path / "small.mcap", tmp_path / "cut.mcap"
    coaching_log(long, budget=150)
    entries = slim(long, small).entries
    cut.write_bytes(small.read_bytes()[: small.stat().st_size // 2])
    assert len(raw(cut)) > entries // 4


def test_what_is_slim_or_holds_no_entry_is_not_made_slim(good: Path, tmp_path: Path) -> None:
    small, out = tmp_path / "small.mcap", tmp_path / "out.mcap"
    slim(good, small)
    with pytest.raises(LogError, match="is slim already"):
        slim(small, out)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(good.read_bytes()[:9000])
    assert not raw(cut)
    with pytest.raises(UnreadableLogError, match=r"no entry could be had of the log .*cut off"):
        slim(cut, out)
    assert not out.exists()
