"""A log with long chunks: whole at any moment for the stock reader, and none the worse in the end."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING

import pytest
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Message, Metadata
from mcap.stream_reader import StreamReader

from hil.files.outputs import Output
from hil.mcaplog.log_file import LogFile
from hil.mcaplog.records import EventRecord
from hil.mcaplog.schemas import record_schema
from hil.mcaplog.writing.writer import LONG_CHUNK_SIZE, LogWriter

if TYPE_CHECKING:
    from pathlib import Path


def seen(path: Path) -> tuple[list[float], list[str]]:
    """Times of the messages that the stock reader finds in a log that goes on, and names of its metadata."""
    times, names = list[float](), list[str]()
    with path.open("rb") as file, suppress(McapError, EOFError):  # where it ends
        for record in StreamReader(file, validate_crcs=True).records:
            if isinstance(record, Message):
                times.append(record.log_time / 1e9)
            elif isinstance(record, Metadata):
                names.append(record.name)
    return times, names


def test_what_is_in_no_chunk_yet_can_be_read_and_the_chunk_takes_its_place(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    writer = LogWriter(path, run={}, flush_every=0.25, long_chunks=True)
    channel = writer.channel("/events", record_schema(EventRecord))
    count, largest = 0, 0
    while not writer._chunks:
        writer.write(channel, count / 8, b"twice the same" * 100)
        if count % 64 == 2:
            times, _ = seen(path)
            assert times[-1] >= count / 8 - 0.25
            assert times == [number / 8 for number in range(len(times))]
        largest = max(largest, path.stat().st_size)
        count += 1
    assert largest > 0.9 * LONG_CHUNK_SIZE
    assert path.stat().st_size < largest / 2
    assert seen(path)[0] == [number / 8 for number in range(count - 1)]
    writer.close()
    with path.open("rb") as file:
        summary = make_reader(file, validate_crcs=True).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == count


def test_metadata_and_attachments_go_before_what_is_in_no_chunk_yet(tmp_path: Path) -> None:
    logs = [tmp_path / name for name in ("flushed.mcap", "not.mcap")]
    for path, flush_every in zip(logs, (0.25, 1e6), strict=True):
        writer = LogWriter(path, run={}, flush_every=flush_every, long_chunks=True)
        channel = writer.channel("/events", record_schema(EventRecord))
        for number in range(50):
            writer.write(channel, number / 8, b"data")
            if number == 20:
                writer.metadata("robot", {"id": "1"})
                writer.attachment("a", b"b" * 1000, media_type="", time=2.0)
                assert seen(path) == ([index / 8 for index in range(21)], ["run", "robot"])
        writer.close()
    assert logs[0].read_bytes() == logs[1].read_bytes()


@pytest.mark.parametrize("left", [-5, 0, 1, 8, 9, 100])
def test_a_kill_before_the_rest_of_the_tail_is_cut_off_leaves_whole_records(tmp_path: Path, left: int) -> None:
    path = tmp_path / "log.mcap"
    output = Output(path)
    file = LogFile(output)
    file.put(b"A" * 10)
    file.extend_tail(bytearray(b"t" * 20))
    file.extend_tail(bytearray(b"t" * (200 + left)))
    assert path.read_bytes() == b"A" * 10 + b"t" * (200 + left)
    before = bytearray()
    plain = output.file.truncate

    class Watched:
        """Looks at the file when its rest is about to be cut off."""

        def __getattr__(self, name: str) -> object:
            return getattr(inner, name)

        def truncate(self) -> int:
            inner.flush()
            before.extend(path.read_bytes())
            return plain()

    inner = output.file
    output.file = Watched()  # type: ignore[assignment]
    file.put(b"B" * 200)
    output.file = inner
    file.flush()
    assert path.read_bytes() == b"A" * 10 + b"B" * 200
    assert file.offset == 210
    if left >= 9:
        assert before[:210] == b"A" * 10 + b"B" * 200
        assert before[210] >= 0x80
        assert int.from_bytes(before[211:219], "little") == len(before) - 219
    inner.close()


def test_what_is_no_regular_file_gets_chunks_alone(tmp_path: Path) -> None:
    if not hasattr(os, "mkfifo"):
        pytest.skip("no pipes with names")
    path = tmp_path / "fifo"
    os.mkfifo(path)
    held = os.open(path, os.O_RDWR)
    output = Output(path)
    file = LogFile(output)
    file.put(b"A")
    file.extend_tail(bytearray(b"tail"))
    file.put(b"B")
    file.flush()
    assert os.read(held, 100) == b"AB"
    output.file.close()
    os.close(held)


def test_the_disk_is_made_to_have_a_log_every_second(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", synced.append)
    writer = LogWriter(tmp_path / "log.mcap", run={}, flush_every=0.25, sync_every=1.0)
    channel = writer.channel("/events", record_schema(EventRecord))
    for number in range(1000):
        writer.write(channel, number * 0.01, b"data")
    assert len(synced) == 10
    writer.close()
    assert len(synced) == 11
