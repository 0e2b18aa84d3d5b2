"""Small files that would cost much: logs that unpack to far more than they are."""

from __future__ import annotations

import struct
import time
import tracemalloc
from typing import TYPE_CHECKING, Final

import pytest
from damaged import log_of, packed, records_of
from mcap.opcode import Opcode
from report_logs import coaching_log

from hil.cli.app import run
from hil.mcaplog import LogReader, UnreadableLogError
from hil.mcaplog.limits import LARGEST_CHUNK, MIB, MOST_CHANNELS, ReadLimits, lifted
from hil.report.gather import gather

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

MOST_MEMORY: Final = 100_000_000
MOST_TIME: Final = 20.0
"""In CPU time in s, with memory traced: a backstop."""
PRIVATE: Final = 0x80
"""An opcode that nobody has defined."""


def message(channel: int, data: bytes = b"") -> tuple[int, bytes]:
    return Opcode.MESSAGE, struct.pack("<HIQQ", channel, 0, 0, 0) + data


def channel(number: int, padding: int = 0) -> tuple[int, bytes]:
    text = struct.pack("<I", 1) + b"x"
    return Opcode.CHANNEL, struct.pack("<HH", number, 1) + text + struct.pack("<II", 0, padding) + bytes(padding)


def schema(number: int, size: int) -> tuple[int, bytes]:
    head = struct.pack("<HI", number, 1) + b"x" + struct.pack("<I", 8) + b"protobuf"
    return Opcode.SCHEMA, head + struct.pack("<I", size) + bytes(size)


BOMBS: Final[dict[str, Callable[[], bytes]]] = {
    "a chunk of 256 MiB": lambda: log_of([bytes(256 * MIB)]),
    "many chunks": lambda: log_of([packed([(PRIVATE, bytes(15 * MIB))])] * 20),
    "a run of zeros": lambda: log_of([bytes(LARGEST_CHUNK)]),
    "empty records": lambda: log_of([packed([(PRIVATE, b"")]) * 1_500_000]),
    "empty messages": lambda: log_of([packed([channel(1), message(1)] + [message(1)] * 400_000)] * 3),
    "channels": lambda: log_of([packed([channel(number) for number in range(60_000)])]),
    "one channel again and again": lambda: log_of([packed([channel(1, 4000)] * 4000)]),
    "fat channels": lambda: log_of([packed([channel(number, 4000) for number in range(4000)])]),
    "fat schemas": lambda: log_of([packed([schema(number + 1, 100_000) for number in range(150)])]),
    "metadata": lambda: log_of([], outside=[(Opcode.METADATA, struct.pack("<II", 0, 1_500_000) + bytes(1_500_000))]),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_costs_little_and_is_told(tmp_path: Path, name: str) -> None:
    path = tmp_path / "bomb.mcap"
    path.write_bytes(BOMBS[name]())
    tracemalloc.start()
    try:
        begun = time.process_time()
        try:
            whole = gather(path).whole
        except UnreadableLogError:
            whole = False
        assert time.process_time() - begun < MOST_TIME
        assert tracemalloc.get_traced_memory()[1] < MOST_MEMORY
    finally:
        tracemalloc.stop()
    assert whole == (name == "one channel again and again")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("a chunk of 256 MiB", "unpacks to 268,435,456 bytes and was left out: if the log is in order: --max-chunk 256"),
        ("many chunks", "it holds more bytes than a file of its size may; if the log is in order: --max-chunk 16"),
        ("a run of zeros", "holds what is no record"),
        ("empty records", "it holds more records than a file of its size may"),
        ("channels", f"channel {MOST_CHANNELS} was left out"),
        ("fat schemas", "schema 21 was left out: there are more than 2,097,152 bytes of them"),
    ],
)
def test_the_limit_is_named_and_what_lifts_it(tmp_path: Path, name: str, said: str) -> None:
    path = tmp_path / "bomb.mcap"
    path.write_bytes(BOMBS[name]())
    reader = LogReader(path)
    assert not list(reader.entries())
    assert said in reader.health()


def test_a_run_of_zeros_is_not_a_record(tmp_path: Path) -> None:
    path = tmp_path / "zeros.mcap"
    path.write_bytes(log_of([packed([(PRIVATE, b"abc")]) + bytes(9000), packed([(PRIVATE, b"d")])]))
    contents = [record.content for record in LogReader(path).records() if record.opcode == PRIVATE]
    assert contents == [b"abc", b"d"]


def test_what_is_too_large_in_the_file_itself_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "attached.mcap"
    path.write_bytes(log_of([packed([(PRIVATE, b"d")])], outside=[(Opcode.ATTACHMENT, bytes(LARGEST_CHUNK + 1))]))
    reader = LogReader(path)
    assert [record.content for record in reader.records() if record.opcode == PRIVATE] == [b"d"]
    assert "was left out: if the log is in order: --max-chunk 17" in reader.health()


def test_an_entry_that_is_too_large_to_be_decoded_is_left_out(tmp_path: Path) -> None:
    coaching_log(tmp_path / "good.mcap", budget=10)
    records = records_of(tmp_path / "good.mcap")
    event = next(content for opcode, content in records if opcode == Opcode.MESSAGE and b"coaching" in content)
    path = tmp_path / "large.mcap"
    path.write_bytes(log_of([packed([*records, (Opcode.MESSAGE, event + bytes(5 * MIB))])]))
    reader = LogReader(path)
    whole = len(list(LogReader(tmp_path / "good.mcap").entries()))
    assert len(list(reader.entries())) == whole
    assert "1 entry of /events could not be read (one has 5,242," in reader.health()
    list(LogReader(path, lifted(16)).entries())


def test_a_limit_can_be_lifted(tmp_path: Path) -> None:
    path = tmp_path / "large.mcap"
    path.write_bytes(log_of([packed([(PRIVATE, bytes(20 * MIB))])] * 3))
    assert len(list(LogReader(path).records())) < 10
    reader = LogReader(path, lifted(24))
    assert sum(len(record.content) for record in reader.records() if record.opcode == PRIVATE) == 60 * MIB
    assert reader.health().startswith("whole")
    assert lifted(None) == ReadLimits()


def test_the_verb_lifts_it_and_says_what_it_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    coaching_log(tmp_path / "good.mcap", budget=10)
    records = records_of(tmp_path / "good.mcap")
    path = tmp_path / "large.mcap"
    path.write_bytes(log_of([packed([*records, (PRIVATE, bytes(17 * MIB))])]))
    assert run(["report", str(path)]) == 4
    captured = capsys.readouterr()
    assert "nothing could be read of the log" in captured.err
    assert "--max-chunk 18" in captured.err
    assert not (tmp_path / "large-report").exists()
    assert run(["report", str(path), "--max-chunk", "18"]) == 0
    assert "--max-chunk" not in capsys.readouterr().err
    assert "Junior performed 10 maneuvers" in (tmp_path / "large-report" / "report.html").read_text("utf-8")


def test_logs_of_our_own_are_far_from_every_limit(tmp_path: Path) -> None:
    path = tmp_path / "good.mcap"
    coaching_log(path, budget=100)
    size = path.stat().st_size
    unpacked = [record for record in LogReader(path).records() if record.offset < 0]
    limits = ReadLimits()
    assert sum(len(record.content) for record in unpacked) * 4 < limits.unpacked(size)
    assert len(unpacked) * 4 < limits.records(size)
    assert sum(len(record.content) for record in unpacked if record.opcode == Opcode.SCHEMA) * 4 < 2 * MIB
