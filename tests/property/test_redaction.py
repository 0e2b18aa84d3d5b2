"""Of what passes a bridge, taps see every byte as it was, but for the payload of frames that carry a signing key."""

from __future__ import annotations

import random
import struct
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest
from fastcrc.crc16 import mcrf4xx
from hypothesis import given, settings
from hypothesis import strategies as st
from quiet_tap import QuietTap

from firmware_protocol.events import Received, Rejected
from firmware_protocol.generate.vectors import vectors
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import JuniorManeuverResult, Ping, RefereeState, SetupSigning, Statustext
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink import MavlinkCodec, SignedMavlinkCodec, split_frames
from firmware_protocol.wire.mavlink_layout import crc_extra
from firmware_protocol.wire.payload import PAYLOADS
from firmware_protocol.wire.signing import Signing, SigningKey, redacted, setup_signing
from hil.bridge.bridge import Bridge
from hil.signing.redaction import Redaction

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

KEY = SigningKey(bytes(range(1, 33)))
SECRET = KEY.secret
ORDINARY = [vector.frame for vector in vectors() if not isinstance(vector.message, SetupSigning)]


def setup(codec: MavlinkCodec | None = None) -> bytes:
    """A frame that carries the key."""
    return (codec or MavlinkCodec(system=255, component=190)).encode(setup_signing(1, KEY, 123_456_789_012))


def cut(data: bytes, seed: int) -> list[bytes]:
    """The bytes in random chunks."""
    rng = random.Random(seed)
    edges = sorted({0, len(data), *(rng.randrange(len(data) + 1) for _ in range(rng.randrange(12)))})
    return [data[a:b] for a, b in pairwise(edges)]


def kept(chunks: list[bytes], codec: MavlinkCodec | None = None, pause: float = 0.001) -> tuple[bytes, list[bytes]]:
    """What may be written down of chunks that come, and of what was rejected in them."""
    codec = codec or MavlinkCodec(system=255, component=190)
    redaction = Redaction(MAVLINK)
    passed: list[tuple[float, bytes]] = []
    rejected: list[bytes] = []
    for number, chunk in enumerate(chunks):
        events = codec.receive(chunk, number * pause)
        passed += redaction.received(number * pause, chunk, events)
        rejected += [event.raw for event in events if isinstance(event, Rejected)]
    events = codec.flush(100.0, ended=True)
    passed += redaction.ended(events)
    rejected += [event.raw for event in events if isinstance(event, Rejected)]
    assert [(stamp, len(data)) for stamp, data in passed] == [(at * pause, len(chunk)) for at, chunk in enumerate(chunks)]
    return b"".join(data for _, data in passed), rejected


@settings(deadline=None, max_examples=400, derandomize=True)
@given(st.lists(st.sampled_from(ORDINARY) | st.binary(max_size=60), max_size=8), st.integers(0, 2**32))
def test_every_other_byte_string_passes_unchanged(pieces: list[bytes], seed: int) -> None:
    stream = b"".join(pieces)
    assert kept(cut(stream, seed))[0] == stream


LOOKALIKES = st.lists(st.sampled_from([b"\xfd", b"\x00\x01\x00", b"\x20", b"\x00"]) | st.binary(max_size=3), max_size=30)


@settings(deadline=None, max_examples=400, derandomize=True)
@given(st.sampled_from([RefereeState, JuniorManeuverResult, Statustext]), LOOKALIKES, st.integers(0, 2**32))
def test_a_frame_of_which_a_part_looks_like_one_passes_unchanged(kind: type[Message], pieces: list[bytes], seed: int) -> None:
    """Three bytes of a pose, a result or a text may be the number of SETUP_SIGNING, behind what may be a start marker."""
    length = PAYLOADS[kind.ID].length
    payload = b"".join(pieces)[:length].ljust(length, b"\1")
    body = struct.pack("<BBBBBBHB", length, 0, 0, 0, 1, 25, kind.ID & 0xFFFF, kind.ID >> 16) + payload
    frame = b"\xfd" + body + struct.pack("<H", mcrf4xx(body + bytes([crc_extra(kind)])))
    assert kept(cut(frame * 2, seed))[0] == frame * 2


@settings(deadline=None, max_examples=400, derandomize=True)
@given(
    st.lists(st.sampled_from(ORDINARY), max_size=4), st.lists(st.sampled_from(ORDINARY), max_size=4),
    st.integers(0, 2**32), st.booleans(),
)  # fmt: skip
def test_a_key_is_left_out_whole_however_it_is_cut(before: list[bytes], after: list[bytes], seed: int, signed: bool) -> None:  # noqa: FBT001
    secret = setup(SignedMavlinkCodec(system=255, component=190, signing=Signing(KEY, lambda: 7)) if signed else None)
    head, tail = b"".join(before), b"".join(after)
    assert kept(cut(head + secret + tail, seed))[0] == head + redacted(secret) + tail


def test_a_key_in_two_chunks_is_left_out_wherever_it_is_cut() -> None:
    secret, ping = setup(), MavlinkCodec(system=1, component=1).encode(Ping(7, 1))
    for at in range(len(secret) + 1):
        data, _ = kept([ping + secret[:at], secret[at:] + ping])
        assert data == ping + redacted(secret) + ping, at


def test_a_key_in_a_frame_that_is_damaged_or_broken_off_is_left_out() -> None:
    secret, ping = setup(), MavlinkCodec(system=1, component=1).encode(Ping(7, 1))
    for at in range(10, len(secret)):
        for damaged in (
            secret[:at] + bytes((secret[at] ^ 0x41,)) + secret[at + 1 :],
            secret[:at] + secret[at + 1 :],
            secret[:at],
        ):
            data, rejected = kept([ping + damaged[:25], damaged[25:] + ping])
            assert data == ping + redacted(damaged) + ping
            assert not any(piece in b"".join(rejected) for piece in (SECRET[:3], SECRET[-3:]))


def test_a_damaged_one_that_holds_what_looks_like_another_frame_is_left_out_to_its_end() -> None:
    inner = b"\xfd\x09\x00\x00\x01\x01\x01\x00\x00\x00"
    secret = setup()
    odd = secret[:16] + inner + secret[26:]
    data, rejected = kept([odd])
    assert data == redacted(odd)
    assert SECRET[-6:] not in b"".join(rejected)


@pytest.mark.parametrize("reason", ["not signed", "another key", "replayed"])
def test_one_that_is_not_believed_is_left_out_too(reason: str) -> None:
    other = SigningKey(bytes(range(2, 34)))
    secret = (
        setup()
        if reason == "not signed"
        else setup(SignedMavlinkCodec(system=255, component=190, signing=Signing(KEY, lambda: 7)))
    )
    host = SignedMavlinkCodec(system=255, component=190, signing=Signing(other if reason == "another key" else KEY, lambda: 7))
    stream = [secret, secret] if reason == "replayed" else [secret]
    data, rejected = kept(stream, host)
    assert data == redacted(secret) * len(stream)
    assert rejected == [redacted(secret)]


def test_an_ordinary_chunk_is_not_held() -> None:
    codec, redaction = MavlinkCodec(system=255, component=190), Redaction(MAVLINK)
    for number, chunk in enumerate(cut(b"".join(ORDINARY), 3)):
        events = codec.receive(chunk, 0.001 * number)
        assert redaction.received(0.001 * number, chunk, events) == [(0.001 * number, chunk)]


def test_on_can_nothing_is_touched() -> None:
    codec, redaction = open_codec(CAN, system=255, component=190), Redaction(CAN)
    data = setup()[:48]
    assert redaction.received(1.0, data, codec.receive(data, 1.0)) == [(1.0, data)]
    assert redaction.judged([]) == redaction.ended([]) == []


# --- the bridge ------------------------------------------------------------------------------------------------------


@dataclass
class Far:
    """Who is at the other end: says what it is told to, a chunk a millisecond."""

    script: list[bytes]
    time: float = 0.0
    heard: bytes = b""

    def now(self) -> float:
        return self.time

    def step(self, inbound: bytes) -> bytes:
        self.heard += inbound
        self.time += 0.001
        return self.script.pop(0) if self.script else b""


@dataclass
class Log(QuietTap):
    """A tap."""

    rx: list[tuple[float, bytes]] = field(default_factory=list)
    tx: list[bytes] = field(default_factory=list)
    found: list[Received | Rejected] = field(default_factory=list)

    def wire_rx(self, time: float, data: bytes) -> None:
        self.rx.append((time, data))

    def wire_tx(self, time: float, data: bytes) -> None:
        del time
        self.tx.append(data)

    def received(self, event: Received | Rejected) -> None:
        self.found.append(event)


def heard(script: list[bytes], *, close_after: int | None = None) -> Log:
    """What a tap sees of what comes."""
    far, log = Far(list(script)), Log()
    with Bridge(MemoryLink(far), far, taps=[log]) as bridge:
        for _ in range(close_after or len(script) + 40):
            bridge.step(0.001)
    return log


def test_a_bridge_tells_its_taps_of_no_key_that_comes() -> None:
    secret, ping = setup(), MavlinkCodec(system=1, component=1).encode(Ping(7, 1))
    log = heard([ping + secret[:20], secret[20:] + ping, ping])
    assert [data for _, data in log.rx] == [ping + redacted(secret)[:20], redacted(secret)[20:] + ping, ping]
    assert [time for time, _ in log.rx] == pytest.approx([0.001, 0.002, 0.003])
    assert [type(event.message) for event in log.found if isinstance(event, Received)] == [Ping, SetupSigning, Ping, Ping]


@pytest.mark.parametrize("close_after", [None, 3])
def test_one_that_is_broken_off_is_told_of_when_it_is_given_up_or_the_bridge_closed(close_after: int | None) -> None:
    secret = setup()
    log = heard([secret[:30]], close_after=close_after)
    assert [data for _, data in log.rx] == [redacted(secret[:30])]


def test_a_bridge_tells_its_taps_of_no_key_that_goes() -> None:
    far, log = Far([]), Log()
    with Bridge(MemoryLink(far), far, taps=[log]) as bridge:
        bridge.send(Ping(7, 1))
        bridge.send(setup_signing(1, KEY, 5))
        bridge.step(0.0)
        bridge.step(0.01)
    assert SECRET in far.heard
    went = [redacted(frame) if frame[7:10] == b"\0\1\0" else frame for frame in split_frames(far.heard)]
    assert b"".join(log.tx) == b"".join(went)
    assert SECRET[:3] not in b"".join(log.tx)
