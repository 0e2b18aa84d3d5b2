"""The hand-made encoders against google.protobuf, for every message at the limits of every field."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pytest
from google.protobuf import descriptor_pb2
from mcap.records import Schema as SchemaRecord
from mcap_protobuf.decoder import DecoderFactory

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.messages import MESSAGES, JuniorManeuverResult, RobotStatus
from firmware_protocol.wire.fields import Message, Wire, wire_fields
from hil.bridge.operator import OperatorInput
from hil.bridge.taps import NOTHING, Circumstances
from hil.mcaplog.records import (
    RECORDS,
    BridgeOpening,
    BridgeStep,
    CreditRecord,
    DecisionRecord,
    EventRecord,
    SessionDrawn,
    TrialRecord,
    UnsentBytes,
    WireBytes,
)
from hil.mcaplog.schemas import Schema, message_schema, record_schema, topic_of
from hil.mcaplog.writing.encode import (
    compile_encoder,
    compile_rebuilder,
    read_sender,
    sender_suffix,
    step_encoder,
    varint,
    wire_encoder,
)
from pal_advisor.maneuvers import Motive, Origin, Telling

if TYPE_CHECKING:
    from enum import StrEnum

LIMITS = {
    "u8": (0, 255), "i8": (-128, 127), "u16": (0, 65535), "i16": (-32768, 32767), "u32": (0, 2**32 - 1),
    "i32": (-(2**31), 2**31 - 1), "u64": (0, 2**64 - 1), "i64": (-(2**63), 2**63 - 1), "f32": (-1e6, 1e6),
}  # fmt: skip


def parse(schema: Schema, data: bytes) -> Any:  # noqa: ANN401 - a class made at run time
    """What stock MCAP tools make of an entry, by the descriptor that the log embeds."""
    decode = DecoderFactory().decoder_for(
        "protobuf", SchemaRecord(id=1, data=schema.data, encoding="protobuf", name=schema.name)
    )
    assert decode is not None
    return decode(data)


def sample(kind: type[Message], side: int) -> Message:
    """A message with every field at its least (0) or greatest (1) value."""
    return kind(**{name: _value(wire, side) for name, wire in wire_fields(kind)})


def _value(wire: Wire, side: int) -> object:
    if wire.type == "char":
        return ("", "x" * wire.count)[side]
    limit = (wire.minimum, wire.maximum)[side]
    one: Any = limit if limit is not None else LIMITS[wire.type][side] * wire.scale
    if wire.invalid is not None and side == 0:
        one = None
    return (one,) * wire.count if wire.count else one


@pytest.mark.parametrize("kind", MESSAGES.values(), ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("side", [0, 1])
def test_every_message_survives(kind: type[Message], side: int) -> None:
    schema = message_schema(kind)
    message = sample(kind, side)
    data = compile_encoder(schema)(message) + sender_suffix(1, 25, 7)
    assert read_sender(data) == ((1, 25), 7)
    parsed = parse(schema, data)
    assert compile_rebuilder(schema)(parsed) == message
    assert (parsed.sender_system, parsed.sender_component, parsed.frame) == (1, 25, 7)


def test_what_is_not_available_is_nan_in_the_log_and_none_in_python() -> None:
    schema = message_schema(JuniorManeuverResult)
    message = sample(JuniorManeuverResult, 0)
    parsed = parse(schema, compile_encoder(schema)(message))
    assert all(math.isnan(value) for value in parsed.travel)
    rebuilt = compile_rebuilder(schema)(parsed)
    assert isinstance(rebuilt, JuniorManeuverResult)
    assert rebuilt.travel == (None,) * 8


def test_enumerations_have_their_names_in_the_log() -> None:
    schema = message_schema(RobotStatus)
    parsed = parse(schema, compile_encoder(schema)(sample(RobotStatus, 1)))
    assert parsed.DESCRIPTOR.fields_by_name["state"].enum_type.values_by_number[parsed.state].name == "STOPPED"


def test_units_are_in_the_descriptor() -> None:
    files = descriptor_pb2.FileDescriptorSet.FromString(message_schema(RobotStatus).data)
    comments = [location.leading_comments.strip() for location in files.file[0].source_code_info.location]
    assert "s; Time since boot" in comments


def test_topics_follow_from_the_names() -> None:
    topics = {topic_of(kind) for kind in MESSAGES.values()}
    assert len(topics) == len(MESSAGES)
    assert {"/junior/sensors", "/junior/maneuver_result", "/referee/state", "/mavlink/heartbeat"} <= topics


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: record.__name__)
def test_every_record_has_a_schema_that_stock_tools_take(record: type) -> None:
    assert parse(record_schema(record), b"") is not None


@pytest.mark.parametrize(
    "record",
    [
        BridgeStep(1.5, (1.0, 1.25), (3, 70000), ("key w", "")),
        BridgeStep(0.0, (), ()),
        BridgeOpening("a:", "a:1", "can", lockstep=False, clock=-1.5, signing_time=2**48 - 1),
        SessionDrawn("a:", 65535),
        UnsentBytes("a:", bytes(300), timeout=True, error="nobody reads"),
        WireBytes("rx", "serial:///dev/ttyÜ", bytes(300)),
        EventRecord("link", "", "{}"),
        DecisionRecord(7, 2, exam=False, generation=3, tried=1, previous="any", current="left", actions="F B", motive="untried",
                       origin="crossover", parents=("F F", "B B"), digest="0123456789abcdef"),
        DecisionRecord(7, 2, exam=False, generation=3, tried=1, previous="any", current="left", actions="F B", motive="untried",
                       origin="crossover", parents=(), digest="0123456789abcdef", expected=-1.5, error=0.25, mirrored=True),
        CreditRecord(7, "performed", (6, 7), (0.5, -0.0), (6,), (1.5,), "0123456789abcdef"),
        CreditRecord(0, "bout interrupted", (), (), (), (), "0123456789abcdef"),
        TrialRecord(1, "any", "left", 2, exam=True, actions="F B", period=0.25, fitness=-3.5, performed=2, won=False, lost=True,
                    progress=None, duration=0.5, ended="completed"),
    ],
)  # fmt: skip
def test_records_survive(record: object) -> None:
    schema = record_schema(type(record))
    assert compile_rebuilder(schema)(parse(schema, compile_encoder(schema)(record))) == record


@pytest.mark.parametrize("data", [b"", b"x" * 17, b"x" * 18, b"x" * 100])
def test_what_is_no_robot_message_has_no_sender(data: bytes) -> None:
    assert read_sender(data) is None


def test_the_sender_of_a_sent_message_has_no_frame() -> None:
    assert read_sender(b"abc" + sender_suffix(255, 190)) == ((255, 190), None)


@pytest.mark.parametrize(
    ("record", "field", "words"),
    [(DecisionRecord, "motive", Motive), (DecisionRecord, "origin", Origin), (CreditRecord, "telling", Telling)],
)
def test_a_log_names_every_word_that_the_learner_uses(record: type, field: str, words: type[StrEnum]) -> None:
    (text,) = (found.text for found in record_schema(record).fields if found.name == field)
    assert text.removeprefix("why: ").removeprefix("how it arose: ").split(", ") == list(words)


def test_a_field_that_a_log_cannot_hold_is_a_programming_error() -> None:
    @dataclass
    class Odd:
        what: complex

    with pytest.raises(TypeError, match="cannot hold"):
        record_schema(Odd)


@pytest.mark.parametrize("size", [0, 1, 127, 128, 1023, 1024, 20000])
def test_the_fast_encoder_of_wire_bytes_agrees_with_the_general_one(size: int) -> None:
    data = bytes(size)
    general = compile_encoder(record_schema(WireBytes))
    assert wire_encoder("tx", "memory:")(data) == general(WireBytes("tx", "memory:", data))


@pytest.mark.parametrize("chunks", [[], [(1.25, b"abc")], [(1.25, b"")], [(1.25, b"abc"), (1.5, b"")]])
@pytest.mark.parametrize("network", ["memory:", "", "serial:///dev/ttyÜ?" + "x" * 200])
def test_the_fast_encoder_of_steps_agrees_with_the_general_one(chunks: list[tuple[float, bytes]], network: str) -> None:
    schema = record_schema(BridgeStep)
    step = BridgeStep(2.0, tuple(stamp for stamp, _ in chunks), tuple(len(data) for _, data in chunks), network=network)
    general = parse(schema, compile_encoder(schema)(step))
    encode = step_encoder(network)
    fast, met = (parse(schema, encode(2.0, chunks, circumstances)) for circumstances in (NOTHING, Circumstances()))
    assert str(fast) == str(met) == str(general)
    assert compile_rebuilder(schema)(fast) == step


@pytest.mark.parametrize("chunks", [[], [(1.25, b"abc")]])
def test_every_circumstance_of_a_step_survives(chunks: list[tuple[float, bytes]]) -> None:
    met = Circumstances(
        inputs=(OperatorInput("key w", "robot 1 on a"), OperatorInput("interrupt")),
        lost=LinkClosedError("a:1", "pulled"),
        ended=LinkClosedError("a:2", "a:2 is gone"),
        back="a:3",
        news=("one", "", "drei Ü"),
        dropped=2**40,
    )
    schema = record_schema(BridgeStep)
    data = step_encoder("a:")(2.0, chunks, met)
    assert compile_rebuilder(schema)(parse(schema, data)) == BridgeStep(
        clock=2.0,
        chunk_times=tuple(stamp for stamp, _ in chunks),
        chunk_sizes=tuple(len(data) for _, data in chunks),
        inputs=("key w", "interrupt"),
        input_robots=("robot 1 on a", ""),
        network="a:",
        lost="pulled",
        lost_link="a:1",
        ended="a:2 is gone",
        ended_link="a:2",
        back="a:3",
        news=("one", "", "drei Ü"),
        dropped=2**40,
    )


@pytest.mark.parametrize(
    "change",
    [
        {"inputs": (OperatorInput("key w"),)},
        {"lost": LinkClosedError("a:", "")},
        {"ended": LinkClosedError("a:", "")},
        {"back": "a:"},
        {"news": ("",)},
        {"dropped": 1},
    ],
    ids=lambda change: next(iter(change)),
)
def test_each_circumstance_alone_is_in_the_log(change: dict[str, Any]) -> None:
    encode = step_encoder("a:")
    schema = record_schema(BridgeStep)
    assert str(parse(schema, encode(2.0, [], Circumstances(**change)))) != str(parse(schema, encode(2.0, [], NOTHING)))


@pytest.mark.parametrize(("value", "data"), [(0, b"\0"), (127, b"\x7f"), (128, b"\x80\x01"), (300, b"\xac\x02")])
def test_varints(value: int, data: bytes) -> None:
    assert varint(value) == data
