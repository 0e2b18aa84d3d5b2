"""The emulated serial CAN adapter: commands in any pieces, frames both ways, and text that is none."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.wire.can.frame import CanFrame, split_records
from simdevice.serving.slcan import ERROR, OK, SlcanAdapter

FRAMES = [CanFrame(0x7FF), CanFrame(0x005, b"\1"), CanFrame(0x1ABCDEF0, bytes(range(8)), extended=True)]
TEXT = b"t7FF0\rt005101\rT1ABCDEF080001020304050607\r"


def opened() -> SlcanAdapter:
    adapter = SlcanAdapter()
    assert adapter.take(b"S6\rO\r") == (b"", OK + OK)
    return adapter


@given(st.lists(st.integers(0, len(TEXT)), max_size=6))
def test_frames_pass_both_ways_in_any_pieces(cuts: list[int]) -> None:
    adapter, frames, answers = opened(), b"", b""
    edges = [0, *sorted(cuts), len(TEXT)]
    for start, end in pairwise(edges):
        some, told = adapter.take(TEXT[start:end])
        frames, answers = frames + some, answers + told
    assert [CanFrame.unpack(record) for record in split_records(frames)] == FRAMES
    assert answers == b"z\rz\rZ\r"
    assert adapter.give(frames) == TEXT


def test_nothing_passes_while_the_channel_is_closed() -> None:
    adapter = opened()
    assert adapter.take(b"C\r") == (b"", OK)
    assert not adapter.is_open
    assert adapter.take(b"t005101\r") == (b"", ERROR)
    assert adapter.give(FRAMES[0].pack()) == b""


@pytest.mark.parametrize(
    "line",
    [b"t", b"t005", b"t0052AA", b"t005201", b"t8001AA", b"t+051AA", b"t 51 1AA", b"t0_51AA", b"t00510G", b"t0059" + b"00" * 9],
)
def test_what_is_no_frame_is_refused(line: bytes) -> None:
    assert opened().take(line + b"\r") == (b"", ERROR)


@given(st.lists(st.binary(max_size=80), max_size=8))
def test_no_text_raises(pieces: list[bytes]) -> None:
    adapter = opened()
    for piece in pieces:
        frames, _ = adapter.take(piece)
        for record in split_records(frames):
            CanFrame.unpack(record)
