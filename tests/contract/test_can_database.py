"""The CAN database: cantools loads it strictly, and its layouts are those of our payloads."""

from __future__ import annotations

import pytest
from cantools.database import load_file
from cantools.database.can import Database

from firmware_protocol.generate.outputs import ROOT
from firmware_protocol.generate.vectors import Vector, vectors
from firmware_protocol.messages import BYTE_LINKS_ONLY, MESSAGES
from firmware_protocol.wire.can.layout import (
    FUNCTION_MASK,
    FUNCTION_SHIFT,
    NEVER_FUNCTION,
    TARGET_FIELDS,
    long_identifier,
    single_frames,
)
from firmware_protocol.wire.fields import wire_order
from firmware_protocol.wire.mavlink_layout import offsets, wire_size
from firmware_protocol.wire.payload import PAYLOADS

ON_CAN = [vector for vector in vectors() if type(vector.message) not in BYTE_LINKS_ONLY]
PATH = ROOT / "firmware_protocol/dialect/junior.dbc"


@pytest.fixture(scope="module")
def database() -> Database:
    return load(0x1FFFFFFF)


def load(mask: int) -> Database:
    found = load_file(str(PATH), strict=True, frame_id_mask=mask)
    assert isinstance(found, Database)
    return found


def test_every_message_and_every_single_frame_is_there(database: Database) -> None:
    assert {message.name for message in database.messages if message.is_extended_frame} == {
        m.NAME for m in MESSAGES.values() if m not in BYTE_LINKS_ONLY
    }
    singles = [message for message in database.messages if not message.is_extended_frame]
    assert sorted(message.name for message in singles) == sorted(frame.name for frame in single_frames())
    for message in singles:
        assert message.length <= 8
        assert message.frame_id & 0x7F == 0
        down = message.frame_id >> FUNCTION_SHIFT & 1 == 0
        assert message.senders == ["HOST" if down else "ROBOT"]


def test_masking_the_node_finds_the_single_frames_and_no_long_message() -> None:
    masked = load(FUNCTION_MASK)
    for frame in single_frames():
        assert masked.get_message_by_frame_id(frame.identifier | 0x2A).name == frame.name
    for message in MESSAGES.values():
        assert long_identifier(message) & FUNCTION_MASK == NEVER_FUNCTION << FUNCTION_SHIFT


def test_single_frames_decode_to_si_units(database: Database) -> None:
    wheels = database.get_message_by_name("JUNIOR_WHEELS_FRAME")
    data = bytes.fromhex("0c00 f401 a2fe fa00")
    assert wheels.decode(data) == pytest.approx({"sequence": 12, "speed_left": 0.5, "speed_right": -0.35, "duration": 0.25})
    assert database.get_message_by_name("JUNIOR_ESTOP").encode({"stop": 1}) == b"\x01"


@pytest.mark.parametrize(
    "vector", [v for v in vectors() if type(v.message) not in BYTE_LINKS_ONLY], ids=lambda vector: vector.name
)
def test_long_messages_are_the_payload_without_the_targets(vector: Vector, database: Database) -> None:
    kind = type(vector.message)
    full = PAYLOADS[kind.ID].pack(vector.message)
    at = offsets(kind)
    kept = [(name, wire) for name, wire in wire_order(kind) if name not in TARGET_FIELDS]
    payload = b"".join(full[at[name] : at[name] + wire_size(wire)] for name, wire in kept)
    message = database.get_message_by_name(kind.NAME)
    assert message.length == len(payload)
    shown = message.decode_simple(payload, decode_choices=False)
    assert message.encode(shown, strict=False) == payload
    position = {signal.name: signal for signal in message.signals}
    for name, wire in kept:
        if not wire.count and wire.type != "f32" and len(name) <= 32:
            value = getattr(vector.message, name)
            assert shown[name] == pytest.approx(
                wire.invalid * wire.scale if value is None and wire.invalid else value, rel=1e-12
            )
            assert position[name].unit == (wire.unit or None)
