"""The CAN codec: single frames, transfers, and what becomes of parts that are missing, late or foreign."""

from __future__ import annotations

from dataclasses import replace

import pytest

from firmware_protocol.errors import EncodeError
from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.messages import (
    Command,
    CommandAck,
    CommandLong,
    Heartbeat,
    JuniorSensors,
    JuniorWheels,
    RefereeReset,
    RefereeState,
    RobotAck,
    RobotSession,
    RobotStatus,
    Statustext,
)
from firmware_protocol.wire.can import dbc
from firmware_protocol.wire.can.dbc import PART_TIMEOUT, CanCodec
from firmware_protocol.wire.can.frame import CanFrame
from firmware_protocol.wire.can.transfer import Partial
from firmware_protocol.wire.fields import Message

BEAT = Heartbeat(type=10, autopilot=0, base_mode=0, custom_mode=2, system_status=3)
SENSORS = JuniorSensors(time=12.345, travel=(0.5, -0.25), eye=(1, 2), floor=(3, 4), battery=7.4, flags=771)
TEXT = Statustext(severity=4, text="all fine")
STATUS = RobotStatus(0.0, 0, 0, 0, 0, 0, 1, 0, 0, 0)


def robot(node: int = 5) -> CanCodec:
    return CanCodec(system=node, component=1)


def host() -> CanCodec:
    return CanCodec(system=255, component=190)


def messages(events: list[Received | Rejected]) -> list[Message]:
    return [event.message for event in events if isinstance(event, Received)]


def reasons(events: list[Received | Rejected]) -> list[RejectReason]:
    return [event.reason for event in events if isinstance(event, Rejected)]


def test_wheels_are_one_frame_and_get_the_session_that_is_open() -> None:
    sender, receiver = host(), robot()
    wheels = JuniorWheels(4711, 12, (0.5, -0.35), 0.25, 5, 1)
    session = RobotSession(4711, 0, 7, 5, 1, 2, 0)
    (frame,) = sender.encode_frames(wheels)
    assert str(frame) == "105#0C00F401A2FEFA00"
    (received,) = messages(receiver.receive_frames([frame], 0.0))
    assert received == replace(wheels, session=0)
    receiver.receive_frames(sender.encode_frames(session), 0.0)
    assert messages(receiver.receive_frames([frame], 0.0)) == [wheels]


@pytest.mark.parametrize("node", [0, 5, 127])
def test_the_emergency_stop_is_one_frame_of_the_most_urgent_identifier(node: int) -> None:
    stop = CommandLong(node, 1, Command.FLIGHT_TERMINATION, confirmation=3, param1=1.0)
    (frame,) = host().encode_frames(stop)
    assert frame == CanFrame(node, b"\1")
    assert messages(robot().receive_frames([frame], 0.0)) == [replace(stop, confirmation=0)]
    assert reasons(robot().receive_frames([CanFrame(node, b"\0")], 0.0)) == [RejectReason.BAD_VALUE]
    assert len(host().encode_frames(replace(stop, param1=0.0))) > 1


def test_sensors_are_three_digests_used_together_or_not_at_all() -> None:
    frames = robot().encode_frames(SENSORS)
    assert [frame.identifier for frame in frames] == [0x185, 0x285, 0x385]
    codec = host()
    for frame in frames[:2]:
        assert codec.receive_frames([frame], 0.0) == []
    (event,) = codec.receive_frames(frames[2:], 0.001)
    assert isinstance(event, Received)
    assert (event.message, event.system, event.component, event.time) == (SENSORS, 5, 1, 0.001)
    for lost in range(3):
        codec = host()
        events = codec.receive_frames([*frames[:lost], *frames[lost + 1 :], *frames], 0.0)
        assert messages(events) == [SENSORS]
        assert set(reasons(events)) == {RejectReason.INCOMPLETE}
    codec = host()
    codec.receive_frames(frames[:2], 0.0)
    assert reasons(codec.flush(PART_TIMEOUT + 0.001)) == [RejectReason.INCOMPLETE]
    assert messages(codec.receive_frames(frames[2:], 1.0)) == []


def test_a_robots_time_goes_on_beyond_the_32_bits_of_its_digest() -> None:
    codec, sender = host(), robot()
    turn = 2**32 / 1000
    times = []
    for time in (turn - 0.005, turn, turn + 3.0):
        (message,) = messages(codec.receive_frames(sender.encode_frames(replace(SENSORS, time=time)), 0.0))
        assert isinstance(message, JuniorSensors)
        times.append(message.time)
    assert times == pytest.approx([turn - 0.005, turn, turn + 3.0])
    late = host()  # it came later: only ROBOT_STATUS tells
    for when, shown in ((turn + 1, 1.0), (turn + 2, turn + 2)):
        sender_time = replace(SENSORS, time=when)
        (message,) = messages(late.receive_frames(sender.encode_frames(sender_time), 0.0))
        assert isinstance(message, JuniorSensors)
        assert message.time == pytest.approx(shown)
        late.receive_frames(sender.encode_frames(replace(STATUS, time=turn + 1.5)), 0.0)


@pytest.mark.parametrize(("status", "sensed"), [(2**32 / 1000, 2**32 / 1000 - 0.005), (2**53 / 1e6, 2**53 / 1e6 - 60.0)])
def test_a_robots_time_may_lie_before_that_of_its_last_status(status: float, sensed: float) -> None:
    codec, sender = host(), robot()
    codec.receive_frames(sender.encode_frames(replace(STATUS, time=status)), 0.0)
    (message,) = messages(codec.receive_frames(sender.encode_frames(replace(SENSORS, time=sensed)), 0.0))
    assert isinstance(message, JuniorSensors)
    assert message.time == pytest.approx(sensed, abs=0.002)


def test_everything_else_is_a_transfer_in_parts_of_seven_bytes() -> None:
    sender = robot()
    frames = sender.encode_frames(BEAT)
    assert [str(frame) for frame in frames[:1]] == ["685#0000000902000000"]
    assert [frame.data[0] for frame in sender.encode_frames(TEXT)] == [0x20 | part for part in range(9)]
    (event,) = host().receive_frames(frames, 0.0)
    assert isinstance(event, Received)
    assert event.message == BEAT
    assert event.raw == b"".join(frame.pack() for frame in frames)
    numbers = [sender.encode_frames(BEAT)[0].data[0] >> 5 for _ in range(9)]
    assert numbers == [2, 3, 4, 5, 6, 7, 0, 1, 2]


@pytest.mark.parametrize("lost", range(9))
def test_a_missing_part_discards_the_whole_and_nothing_else(lost: int) -> None:
    sender, codec = robot(), host()
    first, second = sender.encode_frames(TEXT), sender.encode_frames(BEAT)
    events = codec.receive_frames([*first[:lost], *first[lost + 1 :], *second], 0.0)
    assert messages(events) == [BEAT]
    assert set(reasons(events)) == {RejectReason.INCOMPLETE}


def test_what_is_not_completed_in_time_is_given_up() -> None:
    codec = host()
    frames = robot().encode_frames(TEXT)
    for step, frame in enumerate(frames[:-1]):  # each part in time
        assert codec.receive_frames([frame], step * PART_TIMEOUT * 0.9) == []
    at = len(frames) * PART_TIMEOUT
    assert codec.flush(at - 2 * PART_TIMEOUT) == []
    events = codec.receive_frames(frames[-1:], at + PART_TIMEOUT)
    assert reasons(events) == [RejectReason.INCOMPLETE, RejectReason.INCOMPLETE]


def test_a_part_that_comes_twice_changes_nothing() -> None:
    frames = robot().encode_frames(TEXT)
    events = host().receive_frames([frame for frame in frames for _ in range(2)], 0.0)
    assert messages(events) == [TEXT]
    assert len(reasons(events)) == len(frames)


def test_parts_of_different_robots_and_of_the_referee_may_mix() -> None:
    referee = CanCodec(system=5, component=25)
    state = RefereeState(1.0, 1, 0.5, (0.1, 0.2), 0.3, (0.0, 0.1), 0.2, 0.3, 1, 0, 1)
    streams = [robot(5).encode_frames(TEXT), robot(6).encode_frames(TEXT), referee.encode_frames(state)]
    mixed = [stream[i] for i in range(9) for stream in streams if i < len(stream)]
    events = [event for event in host().receive_frames(mixed, 0.0) if isinstance(event, Received)]
    assert {(event.system, event.component, event.message) for event in events} == {
        (5, 1, TEXT),
        (6, 1, TEXT),
        (5, 25, state),
    }


def test_lost_transfers_show_in_the_sequence_of_the_messages() -> None:
    sender, codec = robot(), host()
    seen = []
    for number in range(40):
        frames = sender.encode_frames(SENSORS if number % 2 else RobotAck(47101, 1, number, 255, 190, 0, 0))
        if number % 10 not in {4, 6}:  # two transfers of every five
            seen += [event.sequence for event in codec.receive_frames(frames, 0.0) if isinstance(event, Received)]
    assert seen[-1] == 39
    assert len(seen) == 32


@pytest.mark.parametrize("lost", range(7))
def test_up_to_six_lost_transfers_in_a_row_are_counted_wherever_the_numbers_stand(lost: int) -> None:
    sender, codec = robot(), host()
    for round_ in range(1, 9):  # the numbers wrap at another place each time
        for _ in range(lost):
            sender.encode_frames(BEAT)
        (event,) = codec.receive_frames(sender.encode_frames(BEAT), 0.0)
        assert isinstance(event, Received)
        assert event.sequence == (round_ - 1) * (lost + 1)


def test_a_repeated_transfer_is_told_apart_by_its_sequence() -> None:
    codec = host()
    frames = robot().encode_frames(BEAT)
    sequences = [event.sequence for event in codec.receive_frames([*frames, *frames], 0.0) if isinstance(event, Received)]
    assert sequences == [0, 0]


def test_the_host_is_whom_answers_are_for() -> None:
    ack = CommandAck(400, 0, target_system=7, target_component=8)
    (message,) = messages(CanCodec(system=254, component=190).receive_frames(robot().encode_frames(ack), 0.0))
    assert message == replace(ack, target_system=254, target_component=190)


@pytest.mark.parametrize(
    ("codec", "message", "words"),
    [
        (host(), CommandLong(128, 1, 400), "system 128 has no place"),
        (host(), CommandLong(5, 30, 400), "component 30 has no place"),
        (host(), SENSORS, "can't be sent over CAN by the host"),
        (robot(), CommandLong(5, 1, 400), "can't be sent over CAN by a robot"),
        (host(), JuniorWheels(1, 2, (2.0, 0.0), 0.1, 5, 1), "speed"),
        (host(), Message(), "not a message"),
    ],
)
def test_what_the_bus_cannot_carry_is_an_error_of_ours(codec: CanCodec, message: Message, words: str) -> None:
    with pytest.raises(EncodeError, match=words):
        codec.encode(message)


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (CanFrame(0x685, extended=True), RejectReason.UNKNOWN_MESSAGE),
        (CanFrame(0x785), RejectReason.UNKNOWN_MESSAGE),
        (CanFrame(0x405), RejectReason.UNKNOWN_MESSAGE),
        (CanFrame(0x680, bytes(8)), RejectReason.BAD_HEADER),
        (CanFrame(0x685), RejectReason.BAD_HEADER),
        (CanFrame(0x685, bytes(3)), RejectReason.BAD_HEADER),
        (CanFrame(0x685, b"\0\0\0\xff" + bytes(4)), RejectReason.BAD_HEADER),
        (CanFrame(0x685, b"\0\0\0\x09" + bytes(3)), RejectReason.BAD_HEADER),
        (CanFrame(0x685, b"\1\0\0\x09" + bytes(4)), RejectReason.INCOMPLETE),
        (CanFrame(0x185, bytes(7)), RejectReason.BAD_HEADER),
        (CanFrame(0x105, b"\0\0\xff\x7f" + bytes(4)), RejectReason.BAD_VALUE),
    ],
)
def test_foreign_and_malformed_frames_are_rejected(frame: CanFrame, reason: RejectReason) -> None:
    codec = host()
    (event,) = codec.receive_frames([frame], 1.0)
    assert isinstance(event, Rejected)
    assert (event.reason, event.raw, event.time) == (reason, frame.pack(), 1.0)
    assert codec.rejected[reason] == 1


def test_a_transfer_nobody_can_read_is_refused_in_one_piece() -> None:
    frames = robot().encode_frames(TEXT)
    unknown = [CanFrame(0x685, frames[0].data[:1] + b"\xff\xff" + frames[0].data[3:]), *frames[1:]]
    damaged = [*frames[:3], CanFrame(0x685, frames[3].data[:-1] + b"?"), *frames[4:]]
    down = [CanFrame(0x605, frame.data) for frame in frames]
    longer = [CanFrame(0x685, b"\0\0\0\x0a" + bytes(4)), CanFrame(0x685, b"\1" + bytes(7)), CanFrame(0x685, b"\2\0")]
    for stream, reason in (
        (unknown, RejectReason.UNKNOWN_MESSAGE),
        (damaged, RejectReason.BAD_CHECKSUM),
        (down, RejectReason.BAD_HEADER),
        (longer, RejectReason.BAD_HEADER),
    ):
        events = host().receive_frames(stream, 0.0)
        assert reasons(events) == [reason]
        assert isinstance(events[0], Rejected)
        assert events[0].raw == b"".join(frame.pack() for frame in stream)


def test_what_is_for_the_referee_has_a_function_of_its_own() -> None:
    reset = RefereeReset(seed=3, session=1, sequence=2, target_system=5, target_component=25, opponent=0)
    frames = host().encode_frames(reset)
    assert {frame.identifier for frame in frames} == {0x505}
    assert messages(CanCodec(system=5, component=25).receive_frames(frames, 0.0)) == [reset]


class Watched(Partial):
    """An incomplete transfer; notes how often it is looked at whether one is too old."""

    looks = 0

    @property
    def heard(self) -> float:
        """When the last part came, in s."""
        Watched.looks += 1
        return self._heard

    @heard.setter
    def heard(self, time: float) -> None:
        self._heard = time


def test_what_is_incomplete_on_a_busy_bus_is_not_all_looked_at_with_every_chunk(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(dbc, "Partial", Watched)
    codec = host()
    for k in range(127):
        codec.receive_frames(robot(k + 1).encode_frames(TEXT)[:1], k * 0.001)
    assert codec.rejected[RejectReason.INCOMPLETE] == 76  # heard at 0.075 s, and now it is 0.126 s
    assert 0 < Watched.looks <= 2 * 127
    codec.flush(1.0)
    assert codec.rejected[RejectReason.INCOMPLETE] == 127


def test_what_goes_on_is_not_given_up_for_being_the_first() -> None:
    codec = host()
    first, second = robot(1).encode_frames(TEXT), robot(2).encode_frames(TEXT)
    codec.receive_frames(first[:1], 0.00)
    codec.receive_frames(second[:1], 0.01)
    codec.receive_frames(first[1:2], 0.04)
    (event,) = codec.receive_frames([], 0.07)
    assert event.system == 2
    assert codec.receive_frames(first[2:3], 0.08) == []
    eyes, travel = robot(3).encode_frames(SENSORS)[1:]
    switches = robot(3).encode_frames(SENSORS)[0]
    codec.receive_frames([switches, robot(4).encode_frames(SENSORS)[0]], 0.20)
    codec.receive_frames([eyes], 0.24)
    assert [event.system for event in codec.receive_frames([], 0.27)] == [4]
    assert messages(codec.receive_frames([travel], 0.28)) == [SENSORS]
