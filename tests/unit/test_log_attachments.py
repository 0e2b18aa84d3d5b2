"""Attachments: what a log carries of files is read, from a log cut off too, and never costs much."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import pytest
from damaged import log_of, packed
from mcap.opcode import Opcode
from mcap.writer import Writer

from hil.mcaplog import LogAttachment, LogReader
from hil.mcaplog.limits import LARGEST_ATTACHMENTS, MIB

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_attachment(1, 2_500_000_000, "advice.toml", "application/toml", b"version = 1\n")
        writer.add_attachment(1, 3_000_000_000, "empty", "", b"x")
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_attachments_are_read_by_name(log: Path) -> None:
    reader = LogReader(log)
    assert not list(reader.entries([]))
    assert reader.attachments["advice.toml"] == LogAttachment("advice.toml", "application/toml", 2.5, b"version = 1\n")
    assert list(reader.attachments) == ["advice.toml", "empty"]
    assert reader.health().startswith("whole")


def test_they_are_read_from_a_log_that_was_cut_off(log: Path) -> None:
    data = log.read_bytes()
    first = next(record for record in LogReader(log).records() if record.opcode == Opcode.ATTACHMENT)
    log.write_bytes(data[: first.offset + 9 + len(first.content) + 5])
    reader = LogReader(log)
    assert not list(reader.entries())
    assert list(reader.attachments) == ["advice.toml"]
    assert reader.truncated


def test_a_damaged_one_is_told_and_left_out(log: Path) -> None:
    data = bytearray(log.read_bytes())
    first = next(record for record in LogReader(log).records() if record.opcode == Opcode.ATTACHMENT)
    data[first.offset + 9 + len(first.content) - 6] ^= 1
    log.write_bytes(data)
    reader = LogReader(log)
    assert not list(reader.entries())
    assert list(reader.attachments) == ["empty"]
    assert "attachment at byte" in reader.health()


def test_all_of_them_together_have_a_limit(tmp_path: Path) -> None:
    size = 15 * MIB
    many = [
        (Opcode.ATTACHMENT, struct.pack("<QQI", 0, 0, 1) + bytes([97 + number]) + struct.pack("<IQ", 0, size) + bytes(size + 4))
        for number in range(6)
    ]
    path = tmp_path / "fat.mcap"
    path.write_bytes(log_of([packed([])], outside=many))
    reader = LogReader(path)
    assert not list(reader.entries([]))
    assert sum(len(attachment.data) for attachment in reader.attachments.values()) <= LARGEST_ATTACHMENTS
    assert list(reader.attachments) == ["a", "b", "c", "d"]
    assert "more than 67,108,864 bytes" in reader.health()
