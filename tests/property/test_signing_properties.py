"""Signed frames of every kind: any damage is refused, any repetition is refused, all else is believed."""

from __future__ import annotations

import random

from firmware_bench import FirmwareBench
from hypothesis import given, settings
from hypothesis import strategies as st
from signed_pair import END, KEY, NOW, signed_at, signed_codec

from firmware_protocol.events import Received
from firmware_protocol.generate.vectors import vectors
from firmware_protocol.messages import Ping
from firmware_protocol.wire.mavlink import split_frames
from firmware_protocol.wire.signing import OLDEST, TIME_LIMIT, Signing
from simdevice._host import lib

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


TIMES = st.one_of(
    st.integers(0, END),
    st.integers(TIME_LIMIT - 3, TIME_LIMIT + 3),
    st.integers(END - 3, END),
    st.integers(NOW - OLDEST - 3, NOW + OLDEST),
)


@settings(deadline=None, max_examples=300, derandomize=True)
@given(st.lists(st.tuples(TIMES, st.integers(1, 3)), max_size=12), st.lists(st.integers(-(10**6), 10**15), max_size=4))
def test_whatever_is_heard_our_time_goes_forward_and_not_beyond_2100(heard: list[tuple[int, int]], steps: list[int]) -> None:
    clock = [NOW]
    host = Signing(KEY, lambda: clock[0])
    stamps = []
    for index, (time, system) in enumerate(heard):
        before = host.now()
        believed_it = host.check(signed_at(time, Ping(1, 1), system=system)) is None
        assert not believed_it or time < TIME_LIMIT
        assert host.now() == (max(before, time) if believed_it else before)
        clock[0] += steps[index] if index < len(steps) else 0
        stamps.append(int.from_bytes(host.sign(b"")[1:7], "little"))
    assert stamps == sorted(stamps)
    assert all(stamp <= TIME_LIMIT for stamp in stamps)
    below = [stamp for stamp in stamps if stamp < TIME_LIMIT]
    assert len(set(below)) == len(below)


@settings(deadline=None, max_examples=200, derandomize=True)
@given(TIMES.filter(bool))
def test_what_is_a_time_for_a_host_is_one_for_a_robot(time: int) -> None:
    bench = FirmwareBench()
    lib.host_give_key(bench.robot, KEY.secret)
    bench.power_on()
    frame = signed_at(time, Ping(1, 1))
    answered = any(isinstance(answer, Ping) for answer in bench.tick(raw=frame))
    assert answered == (Signing(KEY, lambda: 0).check(frame) is None)
