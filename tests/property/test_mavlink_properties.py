"""The MAVLink codec on messages and bytes of every kind."""

from __future__ import annotations

import random
import struct
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.events import Received, Rejected
from firmware_protocol.generate.vectors import vectors
from firmware_protocol.messages import MESSAGES
from firmware_protocol.wire.fields import Message, Wire, wire_fields
from firmware_protocol.wire.mavlink import HOLD_BACK, MavlinkCodec
from firmware_protocol.wire.mavlink_layout import raw_limits

FRAMES = [vector.frame for vector in vectors()]


def elements(wire: Wire) -> st.SearchStrategy[Any]:
    """Values of one element that survive the wire unchanged."""
    if wire.type == "f32":
        return st.floats(width=32, allow_nan=False, allow_infinity=False)
    low, high = raw_limits(wire)
    whole = st.integers(low, high)
    divisor = round(1 / wire.scale)
    values: st.SearchStrategy[Any] = whole if divisor == 1 else whole.map(lambda raw: raw / divisor)
    return values if wire.invalid is None else st.none() | values


def values_of(wire: Wire) -> st.SearchStrategy[Any]:
    if wire.type == "char":
        return st.text(st.characters(exclude_characters="\0", codec="utf-8"), max_size=wire.count).filter(
            lambda text: len(text.encode()) <= wire.count
        )
    if wire.count:
        return st.tuples(*[elements(wire)] * wire.count)
    return elements(wire)


def messages() -> st.SearchStrategy[Message]:
    return st.sampled_from(list(MESSAGES.values())).flatmap(
        lambda message: st.builds(message, **{name: values_of(wire) for name, wire in wire_fields(message)})
    )


def cut(data: bytes, seed: int) -> list[bytes]:
    """The bytes in random chunks."""
    rng = random.Random(seed)
    edges = sorted({0, len(data), *(rng.randrange(len(data) + 1) for _ in range(rng.randrange(12)))})
    return [data[a:b] for a, b in pairwise(edges)]


def run(chunks: list[bytes], *, pause: float = 0.0) -> list[Received | Rejected]:
    codec = MavlinkCodec(system=1, component=1)
    events: list[Received | Rejected] = []
    now = 0.0
    for chunk in chunks:
        events += codec.receive(chunk, now)
        now += pause
    return events + codec.flush(now + 1.0)


def frames_in(events: list[Received | Rejected]) -> list[bytes]:
    return [event.raw for event in events if isinstance(event, Received)]


@settings(deadline=None, max_examples=150, derandomize=True)
@given(messages())
def test_what_is_encoded_is_decoded(message: Message) -> None:
    (event,) = run([MavlinkCodec(system=3, component=4).encode(message)])
    assert isinstance(event, Received)
    assert event.message == message


@settings(deadline=None, max_examples=400, derandomize=True)
@given(st.lists(st.sampled_from(FRAMES) | st.binary(max_size=40), max_size=8), st.integers(0, 2**32))
def test_no_byte_is_lost_invented_or_reordered_and_chunks_do_not_matter(pieces: list[bytes], seed: int) -> None:
    stream = b"".join(pieces)
    whole = run([stream])
    assert b"".join(event.raw for event in whole) == stream
    assert run(cut(stream, seed)) == whole


def damage(frame: bytes, rng: random.Random) -> bytes:
    """Change, drop or insert bytes; at least one thing happens."""
    data = bytearray(frame)
    for _ in range(rng.randrange(1, 4)):
        at = rng.randrange(len(data)) if data else 0
        kind = rng.randrange(4)
        if kind == 0 and data:
            data[at] ^= 1 << rng.randrange(8)
        elif kind == 1 and data:
            data[at] = rng.choice((0x00, 0xFD, 0xFF, rng.randrange(256)))
        elif kind == 2:
            del data[at : at + rng.randrange(1, 30)]
        else:
            data[at:at] = rng.randbytes(rng.randrange(1, 30))
    return bytes(data)


@pytest.mark.parametrize("seed", range(8))
def test_damage_in_one_frame_costs_that_frame_and_no_other(seed: int) -> None:
    """The bound on resynchronisation, over 3000 damaged streams."""
    rng = random.Random(seed)
    for _ in range(375):
        frames = rng.choices(FRAMES, k=6)
        victim = rng.randrange(6)
        damaged = damage(frames[victim], rng)
        stream = b"".join((*frames[:victim], damaged, *frames[victim + 1 :]))
        got = frames_in(run(cut(stream, rng.randrange(2**32))))
        others = frames[:victim] + frames[victim + 1 :]
        if len(got) == 6:  # bytes put in front or behind, or changed into themselves, leave the frame whole
            assert got == frames
            assert frames[victim] in damaged
        else:
            assert got == others


@pytest.mark.parametrize("seed", range(4))
def test_good_frames_come_at_the_latest_when_the_hold_back_has_passed(seed: int) -> None:
    rng = random.Random(1000 + seed)
    for _ in range(200):
        damaged = damage(rng.choice(FRAMES), rng)
        good = rng.choices(FRAMES, k=12)
        codec = MavlinkCodec(system=1, component=1)
        events = codec.receive(damaged, 0.0)
        fed = 0
        for number, frame in enumerate(good, start=1):
            events += codec.receive(frame, 0.0)
            fed += len(frame)
            if fed >= HOLD_BACK:
                assert frames_in(events)[-number:] == good[:number]
        assert frames_in(events + codec.flush(1.0))[-12:] == good


@settings(deadline=None, max_examples=200, derandomize=True)
@given(st.lists(st.binary(max_size=60) | st.sampled_from(FRAMES).map(lambda f: f[:20]), max_size=6), st.sampled_from(FRAMES))
def test_after_garbage_and_silence_the_next_good_frame_is_decoded(garbage: list[bytes], frame: bytes) -> None:
    codec = MavlinkCodec(system=1, component=1)
    for chunk in garbage:
        codec.receive(chunk, 0.0)
    events = codec.receive(frame, 0.021)
    assert frames_in(events)[-1:] == [frame]


def test_a_million_random_bytes_never_raise_and_rarely_pass() -> None:
    data = random.Random(7).randbytes(1_000_000)
    events = run([data[i : i + 997] for i in range(0, len(data), 997)])
    assert b"".join(event.raw for event in events) == data
    assert len(frames_in(events)) == 0


def test_a_million_mutated_bytes_never_raise_and_every_whole_frame_arrives() -> None:
    rng = random.Random(8)
    parts: list[bytes] = []
    whole: list[bytes] = []
    size = 0
    while size < 1_000_000:
        frame = rng.choice(FRAMES)
        if rng.random() < 0.3:
            frame = damage(frame, rng)
        else:
            whole.append(frame)
        parts.append(frame)
        size += len(frame)
    stream = b"".join(parts)
    events = run([stream[i : i + 300] for i in range(0, len(stream), 300)])
    assert b"".join(event.raw for event in events) == stream
    got = iter(frames_in(events))
    assert all(any(frame == other for other in got) for frame in whole), "every undamaged frame is delivered, in order"


def test_plausible_headers_everywhere_cost_no_more_than_time() -> None:
    """The worst case: every few bytes a header that could be, claiming the longest payload."""
    header = struct.pack("<BBBBBBBHB", 0xFD, 121, 0, 0, 0, 1, 1, 47103, 0)
    stream = header * 20_000
    events = run([stream[i : i + 256] for i in range(0, len(stream), 256)])
    assert b"".join(event.raw for event in events) == stream
    assert frames_in(events) == []
