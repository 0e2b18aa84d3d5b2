"""The compiled packers and unpackers against the general path, which is the truth: equal on good values and on bad ones."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.errors import EncodeError
from firmware_protocol.generate.vectors import vectors
from firmware_protocol.messages import MESSAGES
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import RECORD_LENGTH
from firmware_protocol.wire.fields import wire_fields
from firmware_protocol.wire.mavlink import MavlinkCodec, SignedMavlinkCodec
from firmware_protocol.wire.payload import PAYLOADS, BadValueError, Payload
from firmware_protocol.wire.signing import Signing, SigningKey

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.events import Received, Rejected, RejectReason
    from firmware_protocol.wire.codec import Codec
    from firmware_protocol.wire.fields import Message, Wire

KEY = SigningKey(bytes(range(1, 33)))
ODD: tuple[Any, ...] = (
    None, float("nan"), float("inf"), float("-inf"), -0.0, 1e-300, 1e39, 3.4e38, 1e300, -1, 0, 1, 0.5, 127, 128, 255, 256,
    -32769, 65535, 65536, 2**31, 2**32, 2**53, 2**53 + 1, 2**64, 10**400, True, "", "text", "nul\0", "\N{OHM SIGN}" * 40,
    b"bytes", (), (1,), [0.5, 0.5], (None, 1), "ab", object,
)  # fmt: skip
"""What may stand in a field that should not, or just may."""


def said(work: Callable[[Any], Any], given_: object) -> tuple[object, str]:
    """What comes of it: kind and text, of results and of errors alike, so that 1, 1.0 and True differ, and NaN is itself."""
    try:
        result = work(given_)
    except (BadValueError, EncodeError) as error:
        return type(error), str(error)
    return type(result), repr(result)


def near(wire: Wire, rng: random.Random) -> object:
    """A value at random: one that the field takes, or nearly, or one that it does not."""
    if rng.random() < 0.15:
        return rng.choice(ODD)
    if wire.type == "char":
        return "".join(rng.choice("aZ09_\u00e9\0") for _ in range(rng.randrange(wire.count + 2)))
    low, high = (-1.0 if wire.minimum is None else wire.minimum), (70_000.0 if wire.maximum is None else wire.maximum)
    edges = (low, high, low - wire.scale, high + wire.scale, low - wire.scale / 2, high + wire.scale / 2)

    def one() -> object:
        value = rng.choice(edges) if rng.random() < 0.3 else rng.uniform(low, high)
        if rng.random() < 0.05:
            return rng.choice(ODD)
        if wire.scale == 1 and wire.type != "f32" and rng.random() < 0.97:
            return round(value)
        return value

    return tuple(one() for _ in range(wire.count)) if wire.count else one()


@pytest.mark.parametrize("kind", MESSAGES.values(), ids=lambda kind: str(kind.NAME))
def test_packing_equals_the_general_path(kind: type[Message]) -> None:
    payload, rng = PAYLOADS[kind.ID], random.Random(kind.ID)
    sent = 0
    for _ in range(400):
        message = kind(**{name: near(wire, rng) for name, wire in wire_fields(kind)})
        expected = said(payload.pack_any, message)
        assert said(payload.pack, message) == expected
        sent += expected[0] is bytes
    for vector in vectors():
        if type(vector.message) is kind:
            assert payload.pack(vector.message) == payload.pack_any(vector.message)
            sent += 1
    assert sent


@pytest.mark.parametrize("kind", MESSAGES.values(), ids=lambda kind: str(kind.NAME))
def test_unpacking_equals_the_general_path(kind: type[Message]) -> None:
    payload, rng = PAYLOADS[kind.ID], random.Random(kind.ID)
    good = [payload.pack_any(vector.message) for vector in vectors() if type(vector.message) is kind]
    for _ in range(400):
        data = bytearray(rng.choice(good))
        for _ in range(rng.randrange(4)):
            data[rng.randrange(len(data))] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
        whole = bytes(data) if rng.random() < 0.8 else rng.randbytes(payload.length)
        cut = whole[: rng.randrange(1, payload.length + 1)] if rng.random() < 0.3 else whole
        assert said(payload.unpack, cut) == said(payload.unpack_any, cut)


@pytest.mark.parametrize("kind", MESSAGES.values(), ids=lambda kind: str(kind.NAME))
def test_a_message_unpacked_is_as_one_that_was_made(kind: type[Message]) -> None:
    for vector in vectors():
        if type(vector.message) is kind:
            payload = PAYLOADS[kind.ID]
            compiled, general = payload.unpack(payload.pack(vector.message)), payload.unpack_any(payload.pack(vector.message))
            assert list(vars(compiled)) == list(vars(general))
            assert (repr(compiled), type(compiled)) == (repr(general), kind)
            with pytest.raises(AttributeError):
                compiled.new = 1  # type: ignore[attr-defined]


def mavlink() -> Codec:
    return MavlinkCodec(system=1, component=1)


def signed() -> Codec:
    return SignedMavlinkCodec(system=1, component=1, signing=Signing(KEY, lambda: 0))


def can() -> Codec:
    return CanCodec(system=1, component=1)


def streams(codec: Callable[[], Codec], piece: int) -> st.SearchStrategy[bytes]:
    """Frames one after the other, whole and damaged, and noise between them, in pieces of so many bytes."""
    frames: list[bytes] = []
    sender = codec()
    for vector in vectors():
        try:
            frames.append(sender.encode(vector.message))
        except EncodeError:
            continue
    damaged = st.tuples(st.sampled_from(frames), st.integers(0, 2**16), st.integers(0, 255)).map(
        lambda what: bytes(byte ^ (what[2] if at == what[1] % len(what[0]) else 0) for at, byte in enumerate(what[0]))
    )
    noise = st.integers(0, 3).flatmap(lambda pieces: st.binary(min_size=pieces * piece, max_size=pieces * piece))
    return st.lists(st.sampled_from(frames) | damaged | noise, max_size=8).map(b"".join)


def heard(codec: Codec, data: bytes) -> tuple[list[Received | Rejected], int, dict[RejectReason, int]]:
    """What a codec makes of it."""
    return [*codec.receive(data, 0.0), *codec.flush(1.0, ended=True)], codec.good, codec.rejected


@pytest.mark.parametrize(
    ("codec", "piece"), [(mavlink, 1), (signed, 1), (can, RECORD_LENGTH)], ids=["mavlink", "signed", "can"]
)
def test_a_codec_hears_the_same_by_the_general_path(
    codec: Callable[[], Codec], piece: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    @settings(deadline=None, max_examples=150, derandomize=True)
    @given(streams(codec, piece))
    def hear(data: bytes) -> None:
        compiled = heard(codec(), data)
        with monkeypatch.context() as patch:
            for payload in PAYLOADS.values():
                patch.setattr(payload, "unpack", payload.unpack_any)
            general = heard(codec(), data)
        assert repr(compiled) == repr(general)

    hear()


def test_functions_are_compiled_when_they_are_first_called() -> None:
    (vector,) = (vector for vector in vectors() if vector.message == vectors()[0].message)
    payload = Payload(type(vector.message))
    before = payload.pack, payload.unpack
    assert payload.unpack(payload.pack(vector.message)) == vector.message
    after = payload.pack, payload.unpack
    assert not set(before) & set(after)
    payload.unpack(payload.pack(vector.message))
    assert (payload.pack, payload.unpack) == after
