"""Signed frames of every kind: any damage is refused, any repetition is refused, all else is believed."""

from __future__ import annotations

import random

from hypothesis import given, settings
from hypothesis import strategies as st
from signed_pair import KEY, NOW, signed_codec

from firmware_protocol.events import Received
from firmware_protocol.generate.vectors import vectors
from firmware_protocol.mavlink import split_frames
from firmware_protocol.signing import Signing

MESSAGES = [vector.message for vector in vectors()]


def believed(host: object, data: bytes) -> list[Received]:
    """The frames that an end believes."""
    events = host.receive(data, 0.0) + host.flush(1.0)  # type: ignore[attr-defined]
    return [event for event in events if isinstance(event, Received)]


def test_any_bit_turned_over_is_refused() -> None:
    rng = random.Random(7)
    for message in MESSAGES:
        frame = signed_codec().encode(message)
        for bit in rng.sample(range(8 * len(frame)), min(60, 8 * len(frame))):
            broken = bytearray(frame)
            broken[bit // 8] ^= 1 << bit % 8
            assert not believed(signed_codec(), bytes(broken)), (message, bit)


def test_any_bit_turned_over_does_not_pass_the_signature_alone() -> None:
    for message in MESSAGES[:12]:
        frame = signed_codec().encode(message)
        for bit in range(8, 8 * len(frame)):  # of the marker nothing depends
            broken = bytearray(frame)
            broken[bit // 8] ^= 1 << bit % 8
            assert Signing(KEY, lambda: NOW).check(bytes(broken)) is not None, (message, bit)


@settings(deadline=None, max_examples=100, derandomize=True)
@given(st.lists(st.sampled_from(MESSAGES), min_size=1, max_size=12), st.randoms(use_true_random=False))
def test_any_replay_is_refused(messages: list[object], rng: random.Random) -> None:
    sender, host = signed_codec(system=1, component=1), signed_codec()
    frames = [sender.encode(message) for message in messages]  # type: ignore[arg-type]
    assert [event.message for event in believed(host, b"".join(frames))] == messages
    again = rng.choices(frames, k=8)
    assert not believed(host, b"".join(again))


@settings(deadline=None, max_examples=100, derandomize=True)
@given(st.lists(st.sampled_from(MESSAGES), min_size=1, max_size=10), st.permutations(range(10)))
def test_out_of_order_each_is_believed_at_most_once(messages: list[object], order: list[int]) -> None:
    sender, host = signed_codec(system=1, component=1), signed_codec()
    frames = [sender.encode(message) for message in messages]  # type: ignore[arg-type]
    stream = [frames[index] for index in order if index < len(frames)] * 2
    taken = [event.raw for event in believed(host, b"".join(stream))]
    assert len(set(taken)) == len(taken)
    assert [frames.index(raw) for raw in taken] == sorted(frames.index(raw) for raw in taken)


@settings(deadline=None, max_examples=200, derandomize=True)
@given(st.binary(max_size=300))
def test_nothing_unsigned_is_ever_believed(noise: bytes) -> None:
    host, sender = signed_codec(), signed_codec(system=1, component=1)
    good = sender.encode(MESSAGES[0])
    assert [event.raw for event in believed(host, noise)] == []
    assert [event.raw for event in believed(host, good)] == [good]
    assert split_frames(good) == [good]
