"""A codec of arrays says of any bytes what the codec of objects says, in the same order."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import numpy as np
import pytest
from batch_words import all_in_words, told
from fastcrc.crc16 import mcrf4xx
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.events import Received
from firmware_protocol.generate.vectors import Vector, vectors
from firmware_protocol.messages import (
    MESSAGES,
    AutopilotVersion,
    Heartbeat,
    RobotAck,
    RobotStatus,
    Statustext,
    SwarmMove,
    SwarmObservation,
    SwarmRanges,
)
from firmware_protocol.wire import mavlink_batch
from firmware_protocol.wire.mavlink import MavlinkCodec, SignedMavlinkCodec
from firmware_protocol.wire.mavlink_batch import MavlinkBatchCodec
from firmware_protocol.wire.mavlink_layout import crc_extra
from firmware_protocol.wire.rows import row_bytes, rows_of_messages
from firmware_protocol.wire.signing import Signing, SigningKey

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from firmware_protocol.wire.fields import Message

VECTORS = vectors()
ALL = tuple(MESSAGES.values())
SOME = (SwarmObservation, SwarmRanges, RobotAck, RobotStatus)
SIGNED = SignedMavlinkCodec(system=7, component=1, signing=Signing(SigningKey(bytes(range(32))), lambda: 0))
FRAMES = [vector.frame for vector in VECTORS]
ODD = [
    *(SIGNED.encode(vector.message) for vector in VECTORS if type(vector.message) in SOME),
    *(frame[:-1] for frame in FRAMES[::7]),
    *(frame[:-2] + bytes((frame[-2] ^ 1, frame[-1])) for frame in FRAMES[::5]),
    *(bytes((0xFD, 255)), bytes(30), b"\xfd" * 20, b"\xfd\x09\x00\x00\x00\x01\x01\x00\x00\x00", b""),
]


@pytest.fixture(autouse=True, scope="module")
def _never_few() -> Iterator[None]:
    """Even one frame is done as arrays are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mavlink_batch, "FEW", 1)
        yield


def pair(kinds: Iterable[type[Message]]) -> tuple[MavlinkCodec, MavlinkBatchCodec]:
    return MavlinkCodec(system=255, component=190), MavlinkBatchCodec(system=255, component=190, kinds=kinds)


def same(kinds: Iterable[type[Message]], chunks: Iterable[tuple[bytes, float]]) -> int:
    """Compare; returns how many messages came as arrays."""
    objects, arrays = pair(kinds)
    count = 0
    for data, now in chunks:
        arrived = arrays.receive_batches(data, now)
        assert told(arrived) == all_in_words(objects.receive(data, now))
        count += sum(len(batch.rows) for batch in arrived.batches.values())
    assert (arrays.good, arrays.signed, arrays.rejected) == (objects.good, objects.signed, objects.rejected)
    assert all_in_words(arrays.flush(1e9)) == all_in_words(objects.flush(1e9))
    return count


@pytest.mark.parametrize("kinds", [ALL, SOME, ()], ids=["all", "some", "none"])
def test_golden_vectors_whole_and_in_halves(kinds: tuple[type[Message], ...]) -> None:
    data = b"".join(FRAMES)
    wanted = sum(type(vector.message) in kinds for vector in VECTORS)
    assert same(kinds, [(data, 0.0)]) == wanted
    for cut in range(0, len(data), 97):
        assert same(kinds, [(data[:cut], 0.0), (data[cut:], 0.001)]) == wanted


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.NAME)
def test_every_message_comes_as_rows_and_goes_out_as_the_same_bytes(kind: type[Message]) -> None:
    found: list[Vector] = [vector for vector in VECTORS if type(vector.message) is kind] * 20
    rows = rows_of_messages(kind, [vector.message for vector in found])
    objects, arrays = pair((kind,))
    frames = arrays.encode_batch(kind, rows)
    assert frames == b"".join(objects.encode(vector.message) for vector in found)
    assert arrays.encode_batch(kind, rows[:3]) == b"".join(objects.encode(vector.message) for vector in found[:3])
    batch = arrays.receive_batches(frames, 0.0).batches[kind]
    np.testing.assert_array_equal(row_bytes(batch.rows), row_bytes(rows))
    np.testing.assert_array_equal(batch.sequence, np.arange(len(rows)) % 256)


def out_of_range(kind: type[Message], number: int) -> bytes:
    """A frame whose payload is anything, with a good checksum."""
    made = MavlinkCodec(system=3, component=1)
    payload = random.Random(number).randbytes(made.encode(next(v.message for v in VECTORS if type(v.message) is kind))[1])
    return forged(kind, payload)


def forged(kind: type[Message], payload: bytes) -> bytes:
    frame = bytes((0xFD, len(payload), 0, 0, 9, 3, 1)) + kind.ID.to_bytes(3, "little") + payload
    return frame + mcrf4xx(frame[1:] + bytes((crc_extra(kind),))).to_bytes(2, "little")


PIECES = st.one_of(
    st.sampled_from(FRAMES),
    st.sampled_from(FRAMES),
    st.sampled_from(ODD),
    st.binary(max_size=20),
    st.builds(out_of_range, st.sampled_from((*SOME, SwarmMove, Heartbeat)), st.integers(0, 1000)),
    st.builds(lambda inner: forged(Statustext, b"\x03" + inner[:53].ljust(53, b"!")), st.sampled_from(FRAMES)),
)


CHUNKS = (
    st.lists(PIECES, max_size=60),
    st.lists(st.tuples(st.integers(0, 3000), st.sampled_from([0.0, 0.001, 0.03])), max_size=4),
    st.sampled_from([ALL, SOME]),
)


def compare(pieces: list[bytes], cuts: list[tuple[int, float]], kinds: tuple[type[Message], ...]) -> None:
    data = b"".join(pieces)
    chunks, at, now = [], 0, 0.0
    for size, wait in cuts:
        chunks.append((data[at : at + size], now))
        at, now = at + size, now + wait
    same(kinds, [*chunks, (data[at:], now)])


@given(*CHUNKS)
def test_hostile_bytes(pieces: list[bytes], cuts: list[tuple[int, float]], kinds: tuple[type[Message], ...]) -> None:
    compare(pieces, cuts, kinds)


@pytest.mark.nightly
@settings(max_examples=5000)
@given(*CHUNKS)
def test_very_many_hostile_bytes(pieces: list[bytes], cuts: list[tuple[int, float]], kinds: tuple[type[Message], ...]) -> None:
    compare(pieces, cuts, kinds)


def test_what_was_held_back_keeps_the_stamp_of_its_chunk() -> None:
    waiting = b"\xfd\x4e" + FRAMES[0][2:7] + AutopilotVersion.ID.to_bytes(3, "little")
    assert same((Heartbeat,), [(waiting + FRAMES[1], 0.0), (FRAMES[2], 0.03)]) == 2


@settings(max_examples=40)
@given(st.lists(st.tuples(st.integers(0, 20_000), st.integers(0, 255)), max_size=30), st.integers(0, 2**32))
def test_bytes_that_were_changed_anywhere(changes: list[tuple[int, int]], seed: int) -> None:
    order = random.Random(seed).sample(FRAMES, len(FRAMES))
    data = bytearray(b"".join(order))
    for at, value in changes:
        data[at % len(data)] = value
    same(SOME, [(bytes(data), 0.0)])


def test_a_frame_within_a_frame_is_not_taken_twice() -> None:
    inner = MavlinkCodec(system=4, component=1).encode(RobotAck(47200, 1, 2, 255, 190, 0, 0))
    outer = forged(Statustext, b"\x03" + inner.ljust(53, b"!"))
    assert same((Statustext, RobotAck), [(outer * 20, 0.0)]) == 20
    broken = outer[:-1] + bytes((outer[-1] ^ 1,))
    assert same((Statustext, RobotAck), [((broken + outer) * 20, 0.0)]) == 2 * 20


def test_few_frames_come_as_rows_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mavlink_batch, "FEW", 10_000)
    data = b"".join(FRAMES)
    assert same(ALL, [(data, 0.0)]) == same(SOME, [(data, 0.0)]) + sum(type(v.message) not in SOME for v in VECTORS)


def test_a_reset_begins_anew() -> None:
    _, arrays = pair(SOME)
    arrays.receive_batches(b"".join(FRAMES)[:-5], 0.0)
    arrays.reset()
    assert not arrays.flush(1.0)
    kind, rows = RobotAck, rows_of_messages(RobotAck, [RobotAck(47200, 1, 2, 255, 190, 0, 0)])
    assert arrays.encode_batch(kind, rows)[4] == 0
    assert isinstance(MavlinkCodec(system=1, component=1).receive(arrays.encode_batch(kind, rows), 0.0)[0], Received)
