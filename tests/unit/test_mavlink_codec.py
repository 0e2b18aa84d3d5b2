"""The MAVLink codec, case by case."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from fastcrc.crc16 import mcrf4xx

from firmware_protocol.errors import EncodeError
from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.messages import (
    CommandLong,
    Heartbeat,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorSensors,
    JuniorWheels,
    ParamSet,
    ParamValue,
    Ping,
    Statustext,
)
from firmware_protocol.vocabulary import Action
from firmware_protocol.wire.fields import Direction, Message
from firmware_protocol.wire.mavlink import HOLD_BACK, MavlinkCodec, split_frames
from firmware_protocol.wire.mavlink_layout import crc_extra

WHEELS = JuniorWheels(4711, 12, (0.5, -0.35), 0.25, 1, 1)
MANEUVER = JuniorManeuver(4711, 13, 0.25, 5, 1, 1, 2, (Action.F, Action.L, 0, 0, 0, 0, 0, 0))
SENSORS = JuniorSensors(1.25, (0.1, -0.2), (600, 20), (1, 2), 7.4, 3)


def codec() -> MavlinkCodec:
    return MavlinkCodec(system=1, component=1)


def frame_of(message: Message) -> bytes:
    return codec().encode(message)


def sealed(frame: bytes, message: type[Message]) -> bytes:
    """The frame, its checksum made good again after its bytes were changed."""
    crc = mcrf4xx(frame[1:-2] + bytes((crc_extra(message),)))
    return frame[:-2] + crc.to_bytes(2, "little")


def messages_of(events: list[Received | Rejected]) -> list[Message]:
    return [event.message for event in events if isinstance(event, Received)]


def reasons_of(events: list[Received | Rejected]) -> list[RejectReason]:
    return [event.reason for event in events if isinstance(event, Rejected)]


def test_a_frame_as_the_standard_writes_it() -> None:
    frame = MavlinkCodec(system=255, component=190).encode(Heartbeat(6, 8, 0, 0, 4))
    assert frame.hex(" ", 1) == "fd 09 00 00 00 ff be 00 00 00 00 00 00 00 06 08 00 04 03 " + frame[-2:].hex(" ")
    assert frame == sealed(frame, Heartbeat)


def test_a_received_message_says_whence_and_when() -> None:
    frame = MavlinkCodec(system=42, component=25).encode(WHEELS)
    (event,) = codec().receive(frame, 12.5)
    assert event == Received(WHEELS, 42, 25, 0, 12.5, frame)


def test_the_sequence_counts_frames_and_wraps() -> None:
    sender, receiver = codec(), codec()
    events = [receiver.receive(sender.encode(WHEELS), 0.0)[0] for _ in range(258)]
    assert [event.sequence for event in events if isinstance(event, Received)] == [*range(256), 0, 1]


def test_zeros_at_the_end_are_trimmed_but_never_the_first_byte() -> None:
    assert frame_of(Ping(0, 0))[1] == 1
    assert frame_of(Ping(0x0102, 0))[1] == 2
    assert messages_of(codec().receive(frame_of(Ping(0, 0)), 0.0)) == [Ping(0, 0)]


def test_a_receiver_without_the_extensions_reads_the_rest() -> None:
    text = frame_of(Statustext(6, "low battery", 0, 0))
    assert text[1] == 1 + len("low battery")
    assert messages_of(codec().receive(text, 0.0)) == [Statustext(6, "low battery")]


@pytest.mark.parametrize(
    ("message", "change", "text"),
    [
        (WHEELS, {"speed": (1.2, 0.0)}, "JUNIOR_WHEELS.speed = (1.2, 0.0) can't be sent: it takes 2 numbers from -1 to 1"),
        (WHEELS, {"speed": (0.1,)}, "takes 2 numbers"),
        (WHEELS, {"speed": None}, "takes 2 numbers"),
        (WHEELS, {"duration": math.nan}, "JUNIOR_WHEELS.duration = nan can't be sent: it takes a number from 0 to 5 s"),
        (WHEELS, {"duration": math.inf}, "number from 0 to 5 s"),
        (WHEELS, {"duration": -0.001}, "number from 0 to 5 s"),
        (WHEELS, {"sequence": 65536}, "JUNIOR_WHEELS.sequence = 65536 can't be sent: it takes a whole number from 0 to 65535"),
        (WHEELS, {"sequence": 1.0}, "whole number"),
        (WHEELS, {"sequence": None}, "whole number"),
        (MANEUVER, {"count": 0}, "JUNIOR_MANEUVER.count = 0 can't be sent: it takes a whole number from 1 to 8"),
        (MANEUVER, {"actions": (17, 0, 0, 0, 0, 0, 0, 0)}, "8 whole numbers from 0 to 16"),
        (MANEUVER, {"actions": (1.0, 0, 0, 0, 0, 0, 0, 0)}, "8 whole numbers from 0 to 16"),
        (MANEUVER, {"period": 0.019}, "number from 0.02 to 5 s"),
        (Statustext(6, ""), {"text": "x" * 51}, "text of at most 50 bytes in UTF-8, without NUL"),
        (Statustext(6, ""), {"text": "\u00fc" * 26}, "text of at most 50 bytes"),
        (Statustext(6, ""), {"text": "a\0b"}, "without NUL"),
        (Statustext(6, ""), {"text": "\udc80"}, "UTF-8"),
        (
            ParamSet(1, 1, "SPD_FAST", 0.0),
            {"param_value": math.nan},
            "PARAM_SET.param_value = nan can't be sent: it takes a finite",
        ),
        (ParamSet(1, 1, "SPD_FAST", 0.0), {"param_value": 1e39}, "finite number"),
        (ParamSet(1, 1, "SPD_FAST", 0.0), {"param_id": b"SPD_FAST"}, "text of at most 16"),
        (CommandLong(1, 1, 400), {"param1": math.inf}, "a finite number or NaN"),
    ],
)
def test_what_the_wire_cannot_carry_is_refused_by_name(message: Message, change: dict[str, Any], text: str) -> None:
    sender = codec()
    with pytest.raises(EncodeError) as caught:
        sender.encode(dataclasses.replace(message, **change))  # type: ignore[type-var]
    assert text in str(caught.value)
    assert isinstance(caught.value, ValueError)
    assert sender.encode(message)[4] == 0, "a refused message uses up no sequence number"


def test_two_wrong_lengths_do_not_make_a_right_one() -> None:
    with pytest.raises(EncodeError, match=r"JUNIOR_SENSORS\.eye"):
        frame_of(dataclasses.replace(SENSORS, eye=(1, 2, 3), floor=(4,)))


def test_a_message_of_another_protocol_is_refused() -> None:
    @dataclasses.dataclass(frozen=True)
    class Foreign(Message, id=9000, direction=Direction.UP):
        """Not ours."""

    with pytest.raises(EncodeError, match="Foreign is not a message of this protocol"):
        frame_of(Foreign())


def test_values_are_rounded_to_the_nearest_unit() -> None:
    sent = dataclasses.replace(WHEELS, speed=(0.0004, -0.0006), duration=0.2996)
    (got,) = messages_of(codec().receive(frame_of(sent), 0.0))
    assert got == dataclasses.replace(WHEELS, speed=(0.0, -0.001), duration=0.3)


def test_numpy_numbers_are_numbers() -> None:
    sent = JuniorWheels(4711, np.uint16(12), tuple(np.array([0.5, -0.35])), np.float64(0.25), 1, 1)  # type: ignore[arg-type]
    assert frame_of(sent) == frame_of(WHEELS)


def test_not_available_is_none() -> None:
    result = JuniorManeuverResult(
        1,
        2,
        (50,) * 8,
        (0,) * 8,
        (0,) * 8,
        (0.0,) * 8,
        (0.0,) * 8,
        (None, 0.012) * 4,
        (0,) * 8,
        (0,) * 8,
        255,
        190,
        0,
        0,
        8,
        0,
        0,
    )
    assert messages_of(codec().receive(frame_of(result), 0.0)) == [result]


def test_command_parameters_may_be_nan() -> None:
    (got,) = messages_of(codec().receive(frame_of(CommandLong(1, 1, 400, 0, 1.0, math.nan)), 0.0))
    assert isinstance(got, CommandLong)
    assert math.isnan(got.param2)


@pytest.mark.parametrize(
    ("message", "at", "raw", "detail"),
    [
        (WHEELS, 4, (1200).to_bytes(2, "little"), "JUNIOR_WHEELS.speed can't be [1200, -350] on the wire"),
        (MANEUVER, 10, b"\x00", "JUNIOR_MANEUVER.count can't be 0 on the wire"),
        (ParamSet(1, 1, "A", 1.0), 0, b"\x00\x00\xc0\x7f", "PARAM_SET.param_value can't be nan on the wire"),
        (ParamValue("A", 1.0, 9, 1, 0), 0, b"\x00\x00\x80\x7f", "PARAM_VALUE.param_value can't be inf on the wire"),
        (SENSORS, 7, b"\xff", "JUNIOR_SENSORS.time"),
    ],
)
def test_a_good_frame_with_a_bad_value_is_rejected(message: Message, at: int, raw: bytes, detail: str) -> None:
    frame = frame_of(message)
    frame = sealed(frame[: 10 + at] + raw + frame[10 + at + len(raw) :], type(message))
    receiver = codec()
    events = receiver.receive(frame + frame_of(WHEELS), 0.0)
    assert reasons_of(events) == [RejectReason.BAD_VALUE]
    assert isinstance(events[0], Rejected)
    assert detail in events[0].detail
    assert events[0].raw == frame
    assert events[0].system == frame[5]  # the checksum was good: it is certain who sent it
    assert messages_of(events) == [WHEELS]


def test_text_that_is_not_utf8_is_shown_with_replacements() -> None:
    frame = bytearray(frame_of(Statustext(6, "abc")))
    frame[11] = 0xFF
    assert messages_of(codec().receive(sealed(bytes(frame), Statustext), 0.0)) == [Statustext(6, "\ufffdbc")]


def test_noise_is_told_apart_and_kept() -> None:
    events = codec().receive(b"Junior 1.0 booting\r\n" + frame_of(WHEELS), 0.0)
    assert events[0] == Rejected(RejectReason.NOISE, b"Junior 1.0 booting\r\n", 0.0)
    assert messages_of(events) == [WHEELS]


def test_noise_without_end_is_reported_in_pieces() -> None:
    receiver = codec()
    pieces = [event for _ in range(100) for event in receiver.receive(b"\x55" * 100, 0.0)]
    assert 3 * 10 <= len(pieces) <= 100
    assert all(len(event.raw) <= 355 for event in pieces)


def test_mavlink_1_is_noise() -> None:
    events = codec().receive(b"\xfe\x09\x00\x01\x01\x00" + bytes(9) + b"\x12\x34" + frame_of(WHEELS), 0.0)
    assert reasons_of(events) == [RejectReason.NOISE]
    assert messages_of(events) == [WHEELS]


@pytest.mark.parametrize(
    ("position", "value", "reason"),
    [
        (1, 0, RejectReason.BAD_HEADER),
        (1, 13, RejectReason.BAD_HEADER),
        (1, 255, RejectReason.BAD_HEADER),
        (2, 0x02, RejectReason.BAD_HEADER),
        (2, 0x80, RejectReason.BAD_HEADER),
        (9, 0x01, RejectReason.UNKNOWN_MESSAGE),
        (4, 0x99, RejectReason.BAD_CHECKSUM),
        (12, 0x99, RejectReason.BAD_CHECKSUM),
        (-1, 0x99, RejectReason.BAD_CHECKSUM),
    ],
)
def test_a_damaged_frame_is_one_rejection_and_its_neighbours_arrive(position: int, value: int, reason: RejectReason) -> None:
    damaged = bytearray(frame_of(WHEELS))
    assert damaged[position] != value
    damaged[position] = value
    receiver = codec()
    events = receiver.receive(frame_of(SENSORS) + bytes(damaged) + frame_of(MANEUVER), 0.0)
    assert messages_of(events) == [SENSORS, MANEUVER]
    rejected = [event for event in events if isinstance(event, Rejected)]
    assert rejected[0].reason is reason
    assert b"".join(event.raw for event in rejected) == bytes(damaged)
    assert receiver.rejected[reason] == 1


def test_a_foreign_frame_with_good_framing_is_one_unknown_message_even_in_single_bytes() -> None:
    foreign = b"\xfd\x20\x00\x00\x05\x01\x01\x1e\x00\x00" + bytes([0xFD, 0, 7, 0xFD] * 8) + b"\x12\x34"
    whole = codec().receive(foreign + frame_of(WHEELS), 0.0)
    assert whole[0] == Rejected(RejectReason.UNKNOWN_MESSAGE, foreign, 0.0, "message id 30")
    assert messages_of(whole) == [WHEELS]
    receiver = codec()
    stream = foreign + frame_of(WHEELS)
    assert [event for i in range(len(stream)) for event in receiver.receive(stream[i : i + 1], 0.0)] == whole


def test_a_longer_length_swallows_nothing() -> None:
    """The length claims the frames behind as well: they are found when the claim has proved false."""
    damaged = bytearray(
        frame_of(JuniorManeuverResult(*(1, 2), *((1,) * 8,) * 3, *((0.1,) * 8,) * 3, *((1,) * 8,) * 2, 255, 190, 0, 0, 8, 3, 3))
    )
    damaged = damaged[:40]
    frames = [frame_of(SENSORS), frame_of(WHEELS), frame_of(MANEUVER), frame_of(SENSORS), frame_of(WHEELS)]
    receiver = codec()
    events = receiver.receive(bytes(damaged), 0.0)
    for frame in frames:
        events += receiver.receive(frame, 0.001)
    assert messages_of(events) == [SENSORS, WHEELS, MANEUVER, SENSORS, WHEELS]
    assert reasons_of(events) == [RejectReason.BAD_CHECKSUM]


def test_a_frame_that_waits_is_given_up_after_silence_and_what_it_held_back_is_delivered() -> None:
    broken = frame_of(SENSORS)[:15]
    receiver = codec()
    assert receiver.receive(broken, 1.0) == []
    assert receiver.receive(frame_of(Ping(1, 0)), 1.005) == []
    assert receiver.flush(1.024) == []
    events = receiver.flush(1.026)
    assert reasons_of(events) == [RejectReason.INCOMPLETE]
    assert events[0] == Rejected(RejectReason.INCOMPLETE, broken, 1.005, "JUNIOR_SENSORS")
    assert messages_of(events) == [Ping(1, 0)]
    assert receiver.flush(9.0) == []


def test_the_next_chunk_after_silence_gives_up_the_old_one() -> None:
    receiver = codec()
    receiver.receive(frame_of(SENSORS)[:15], 1.0)
    events = receiver.receive(frame_of(WHEELS), 1.5)
    assert reasons_of(events) == [RejectReason.INCOMPLETE]
    assert messages_of(events) == [WHEELS]


def test_slow_bytes_are_one_frame_while_no_gap_is_long() -> None:
    receiver = codec()
    frame = frame_of(SENSORS)
    events = [event for i in range(len(frame)) for event in receiver.receive(frame[i : i + 1], 0.019 * i)]
    assert messages_of(events) == [SENSORS]


def test_a_marker_alone_is_given_up_too() -> None:
    receiver = codec()
    assert receiver.receive(b"\xfd", 0.0) == []
    assert reasons_of(receiver.flush(0.5)) == [RejectReason.INCOMPLETE]


def test_counters_agree_with_the_events() -> None:
    bad = bytearray(frame_of(WHEELS))
    bad[-1] ^= 1
    receiver = codec()
    events = receiver.receive(b"noise" + frame_of(WHEELS) + bytes(bad) + frame_of(SENSORS) + b"\xfd\x05", 0.0)
    events += receiver.flush(1.0)
    assert receiver.good == len(messages_of(events)) == 2
    assert {reason: n for reason, n in receiver.rejected.items() if n} == Counter(reasons_of(events))


def test_how_long_a_damaged_header_can_hold_back() -> None:
    assert HOLD_BACK == 10 + 123 + 2 + 13


def test_split_frames() -> None:
    frames = [frame_of(WHEELS), frame_of(SENSORS), frame_of(Ping(0, 0))]
    assert split_frames(b"".join(frames)) == frames
    assert split_frames(b"".join(frames) + b"rest") == [*frames, b"rest"]
    assert split_frames(frames[0] + frames[1][:-1]) == [frames[0], frames[1][:-1]]
    assert split_frames(b"no frame" + frames[0]) == [b"no frame" + frames[0]]
    assert split_frames(b"") == []
    signed = b"\xfd" + frames[0][1:2] + b"\x01" + frames[0][3:] + bytes(13)
    assert split_frames(signed + frames[1]) == [signed, frames[1]]
