"""A CAN frame that cannot exist cannot be made."""

from __future__ import annotations

import pytest

from firmware_protocol.wire.can.frame import CanFrame, pack_frames, split_records


@pytest.mark.parametrize(
    ("identifier", "data", "extended"),
    [(-1, b"", False), (0x800, b"", False), (1 << 29, b"", True), (-1, b"", True), (0, bytes(9), False)],
)
def test_an_impossible_frame_is_refused(identifier: int, data: bytes, extended: bool) -> None:  # noqa: FBT001
    with pytest.raises(ValueError, match="CAN"):
        CanFrame(identifier, data, extended)


@pytest.mark.parametrize(
    "frame", [CanFrame(0), CanFrame(0x7FF, bytes(range(8))), CanFrame(0x1FFFFFFF, b"\xff", extended=True), CanFrame(5, b"\0")]
)
def test_the_serial_form_is_linuxes(frame: CanFrame) -> None:
    record = frame.pack()
    assert len(record) == 16
    assert int.from_bytes(record[:4], "little") == frame.identifier | (frame.extended << 31)
    assert (record[4], record[5:8], record[8 : 8 + frame.length]) == (frame.length, bytes(3), frame.data)
    assert CanFrame.unpack(record) == frame
    assert hash(CanFrame.unpack(record)) == hash(frame)


@pytest.mark.parametrize(
    "record",
    [
        b"",
        bytes(15),
        bytes(17),
        b"\x00\x08\x00\x00" + bytes(12),
        b"\0\0\0\x40" + bytes(12),
        bytes(4) + b"\x09" + bytes(11),
        bytes(5) + b"\1" + bytes(10),
        bytes(4) + b"\x01" + bytes(4) + b"\1" + bytes(6),
    ],
)
def test_what_is_no_serial_form_is_refused(record: bytes) -> None:
    with pytest.raises(ValueError, match="CAN"):
        CanFrame.unpack(record)


def test_frames_are_written_as_candump_does_and_cut_apart_again() -> None:
    frames = [CanFrame(0x186, b"\1\2\xaa"), CanFrame(0x186, b"", extended=True)]
    assert [str(frame) for frame in frames] == ["186#0102AA", "00000186#"]
    records = split_records(pack_frames(frames) + b"rest")
    assert [CanFrame.unpack(record) for record in records[:2]] == frames
    assert records[2:] == [b"rest"]
