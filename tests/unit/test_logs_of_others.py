"""Logs that other programs wrote: every entry is given, or named as not read, whatever form the file has."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, Final

import lz4.frame
import pytest
import zstandard
from damaged import packed, records_of
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader
from mcap.records import Chunk, DataEnd, Footer, Header
from mcap.writer import CompressionType, Writer
from mcap_variants import MAGIC, file_of, serialized, variants
from report_logs import coaching_log

from hil.cli.app import run
from hil.mcaplog import LogReader, UnreadableLogError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def streamed(data: bytes) -> bytes:
    """Compressed by one that does not know beforehand how much there is."""
    compressor = zstandard.ZstdCompressor(write_content_size=False).compressobj()
    return compressor.compress(data) + compressor.flush()


COMPRESSIONS: Final[dict[str, tuple[str, Callable[[bytes], bytes]]]] = {
    "zstd": ("zstd", zstandard.ZstdCompressor().compress),
    "zstd without size": ("zstd", streamed),
    "lz4": ("lz4", lz4.frame.compress),
    "lz4 without size": ("lz4", lambda data: lz4.frame.compress(data, store_size=False)),
    "none": ("", bytes),
}


def stock_count(path: Path) -> int:
    """What the stock reader counts; its indexed one raises where there are chunk indexes and no channels in the summary."""
    with path.open("rb") as file:
        return sum(1 for _ in NonSeekingReader(file).iter_messages(log_time_order=False))


def chunked(path: Path, chunks: list[bytes], compression: str) -> None:
    """A file of chunks without an index."""
    name, compress = COMPRESSIONS[compression]
    written = [serialized(Chunk(name, compress(data), 0, 0, zlib.crc32(data), len(data))) for data in chunks]
    ends = serialized(DataEnd(0)) + serialized(Footer(0, 0, 0))
    path.write_bytes(MAGIC + serialized(Header("", "other")) + b"".join(written) + ends + MAGIC)


def test_every_form_of_a_file_gives_what_the_stock_reader_counts(tmp_path: Path) -> None:
    path, told = tmp_path / "log.mcap", 0
    for variant in variants():
        path.write_bytes(file_of(variant))
        reader = LogReader(path)
        entries = list(reader.entries())
        assert len(entries) == stock_count(path), variant
        assert reader.whole, (variant, reader.health())
        assert len(list(reader.entries(["example"]))) == len(entries), variant
        late = [entry for entry in entries if entry.time >= 105e-9]
        assert list(reader.entries(start=105e-9)) == late, variant
        assert ("myFile" in reader.attachments, "myMetadata" in reader.metadata) == (
            variant.content == "OneAttachment",
            variant.content == "OneMetadata",
        )
        told += 1
    assert told == 416


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_chunks_are_opened_whatever_they_are_compressed_with(tmp_path: Path, compression: str) -> None:
    good, path = tmp_path / "good.mcap", tmp_path / "other.mcap"
    coaching_log(good, budget=10)
    records = records_of(good)
    half = len(records) // 2
    chunked(path, [packed(records[:half]), packed(records[half:])], compression)
    reader = LogReader(path)
    assert [str(entry) for entry in reader.entries()] == [str(entry) for entry in LogReader(good).entries()]
    assert reader.whole


@pytest.mark.parametrize("compression", list(COMPRESSIONS)[1:])
def test_a_chunk_that_says_less_than_it_holds_is_told(tmp_path: Path, compression: str) -> None:
    name, compress = COMPRESSIONS[compression]
    data = packed([(0x80, bytes(5000))])
    path = tmp_path / "log.mcap"
    for claimed in (10, 4000, 6000):
        chunk = serialized(Chunk(name, compress(data), 0, 0, 0, claimed))
        path.write_bytes(MAGIC + chunk + serialized(Footer(0, 0, 0)) + MAGIC)
        reader = LogReader(path)
        found = [record for record in reader.records() if record.opcode == 0x80]
        assert bool(found) == (not name)  # what is not compressed is there, whatever is said of it
        assert bool(reader.damage) == bool(name)


@pytest.mark.parametrize("compression", ["zstd without size", "lz4"])
def test_a_bomb_that_does_not_say_so_costs_nothing(tmp_path: Path, compression: str) -> None:
    name, compress = COMPRESSIONS[compression]
    path = tmp_path / "bomb.mcap"
    chunk = serialized(Chunk(name, compress(bytes(1 << 28)), 0, 0, 0, 1000))
    path.write_bytes(MAGIC + chunk + serialized(Footer(0, 0, 0)) + MAGIC)
    reader = LogReader(path)
    assert not list(reader.entries())
    assert "unpacks to more than it says" in reader.health()


def test_what_can_t_be_opened_at_all_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "log.mcap"
    chunk = serialized(Chunk("snappy", b"abc", 0, 0, 0, 3))
    path.write_bytes(MAGIC + chunk + serialized(Footer(0, 0, 0)) + MAGIC)
    reader = LogReader(path)
    assert not list(reader.entries())
    with pytest.raises(UnreadableLogError, match=r"nothing could be read of the log .*snappy"):
        reader.require_something()
    assert run(["report", str(path)]) == 4
    assert "compressed by 'snappy'" in capsys.readouterr().err


def test_entries_that_can_t_be_given_are_counted_by_topic_and_why(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        good = writer.register_channel("/plain", "json", 0)
        bad = writer.register_channel("/torn", "protobuf", writer.register_schema("x.Y", "protobuf", b"no descriptor"))
        for number in range(5):
            writer.add_message(good, number, b"{}", number)
            writer.add_message(bad, number, b"{}", number)
        writer.finish()  # type: ignore[no-untyped-call]
    reader = LogReader(path)
    entries = list(reader.entries())
    assert [entry.value for entry in entries] == [b"{}"] * 5
    assert sum(reader.not_read.values()) == 5
    assert not reader.whole
    assert "5 entries of /torn could not be read (" in reader.health()
    assert len(entries) + sum(reader.not_read.values()) == stock_count(path)


def test_entries_of_a_channel_that_is_nowhere_described_are_counted(tmp_path: Path) -> None:
    good, path = tmp_path / "good.mcap", tmp_path / "other.mcap"
    coaching_log(good, budget=10)
    messages = [record for record in records_of(good) if record[0] == Opcode.MESSAGE]
    chunked(path, [packed(messages)], "none")
    reader = LogReader(path)
    assert not list(reader.entries())
    assert sum(reader.not_read.values()) == len(messages)
    assert "of no known topic could not be read (the log describes no such channel)" in reader.health()
    with pytest.raises(UnreadableLogError):
        reader.require_something()
