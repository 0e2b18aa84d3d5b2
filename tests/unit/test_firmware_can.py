"""The firmware's CAN front end: frames to messages and back, what is counted, what is lost, what is not."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import pytest
from can_bench import CanBench
from fastcrc.crc16 import mcrf4xx
from firmware_bench import FirmwareBench

from firmware_protocol.messages import (
    Heartbeat,
    JuniorSensors,
    JuniorWheels,
    ParamSet,
    ParamValue,
    Ping,
    Reason,
    RobotAlive,
    RobotSession,
    State,
)
from firmware_protocol.vocabulary import Action
from firmware_protocol.wire.can import layout
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import RECORD_LENGTH, CanFrame
from firmware_protocol.wire.mavlink_layout import crc_extra
from simdevice._host import lib

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message


@pytest.fixture
def bench() -> CanBench:
    return CanBench()


def ping(number: int, transfer: int = 0) -> list[CanFrame]:
    """A ping as a transfer with this number."""
    host = CanCodec(system=255, component=190)
    for _ in range(transfer):
        host.encode(Ping(1, 1))
    return host.encode_frames(Ping(time_usec=number, seq=number))


def answered(bench: CanBench) -> list[int]:
    """Numbers of the pings that were answered."""
    return [answer.seq for answer in bench.got(Ping)]


def transfer(kind: type[Message], payload: bytes, *, number: int = 0, node: int = 0) -> list[CanFrame]:
    """A transfer with a good checksum, whatever is in it.

    Args:
        kind: The message.
        payload: What it carries.
        number: Of the transfer.
        node: For whom.
    """
    data = struct.pack("<HB", kind.ID, len(payload)) + payload
    data += struct.pack("<H", mcrf4xx(data + bytes((crc_extra(kind),))))
    identifier = layout.TRANSFER_DOWN_FUNCTION << layout.FUNCTION_SHIFT | node
    return [CanFrame(identifier, bytes((number << 5 | i // 7,)) + data[i : i + 7]) for i in range(0, len(data), 7)]


# --- transfers ------------------------------------------------------------------------------------------------------


def test_transfers_are_counted_and_none_is_lost(bench: CanBench) -> None:
    for number in range(20):
        bench.frames(*ping(number, number % 8))
    assert answered(bench) == list(range(20))
    assert bench.counters() == (20, 0, 0, 0)


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [([0, 1, 4], 2), ([6, 7, 0, 3], 2), ([5], 0), ([0, 0, 0], 0), ([1, 7], 5), ([0, 7], 6), ([7, 1], 1), ([3, 3, 4, 5], 0)],
)
def test_what_is_missing_is_lost_and_what_comes_again_is_not(bench: CanBench, numbers: list[int], lost: int) -> None:
    for i, number in enumerate(numbers):
        bench.frames(*ping(i, number))
    assert answered(bench) == list(range(len(numbers)))
    assert bench.counters() == (len(numbers), 0, 0, lost)


def test_an_unknown_transfer_of_the_next_number_is_not_lost(bench: CanBench) -> None:
    bench.frames(*ping(0, 0))
    bench.frames(*transfer(ParamValue, b"\0" * 25, number=1))
    bench.frames(*ping(2, 2))
    assert answered(bench) == [0, 2]
    assert bench.counters() == (2, 0, 1, 0)


def test_an_unknown_transfer_of_another_number_says_nothing_about_what_was_lost(bench: CanBench) -> None:
    bench.frames(*ping(0, 0))
    bench.frames(*transfer(ParamValue, b"\0" * 25, number=5))
    bench.frames(*ping(1, 1))
    assert bench.counters() == (2, 0, 1, 0)


def test_an_unknown_transfer_that_comes_first_tells_no_number(bench: CanBench) -> None:
    bench.frames(*transfer(ParamValue, b"\0" * 25, number=0))
    bench.frames(*ping(0, 4))
    assert bench.counters() == (1, 0, 1, 0)


@pytest.mark.parametrize("missing", range(len(ping(0))))
def test_a_missing_part_discards_the_whole_and_nothing_else(bench: CanBench, missing: int) -> None:
    frames = ping(0, 0)
    del frames[missing]
    bench.frames(*frames)
    bench.frames(*ping(1, 1))
    assert answered(bench) == [1]
    assert bench.counters()[:3] == (1, 0, 0)


@pytest.mark.parametrize("twice", range(len(ping(0))))
def test_a_part_that_comes_twice_does_no_harm(bench: CanBench, twice: int) -> None:
    frames = ping(0, 0)
    frames.insert(twice, frames[twice])
    bench.frames(*frames)
    assert answered(bench) == [0]


def test_a_part_with_the_same_head_and_other_data_is_none_of_it(bench: CanBench) -> None:
    frames = ping(0, 0)
    other = CanFrame(frames[1].identifier, frames[1].data[:-1] + b"\xff")
    bench.frames(frames[0], frames[1], other, *frames[2:])
    assert answered(bench) == []
    shorter = CanFrame(frames[1].identifier, frames[1].data[:-1])
    bench.frames(frames[0], frames[1], shorter, *frames[2:])
    assert answered(bench) == []
    bench.frames(*ping(1, 1))
    assert answered(bench) == [1]


@pytest.mark.parametrize(("ms", "taken"), [(45, True), (50, True), (55, False)])
def test_a_transfer_is_given_up_after_50_ms_of_silence(bench: CanBench, ms: int, taken: bool) -> None:  # noqa: FBT001
    frames = ping(3)
    bench.frames(frames[0])
    bench.run(ms - 5, alive=False)
    bench.frames(*frames[1:])
    assert answered(bench) == ([3] if taken else [])
    bench.frames(*ping(4, 1))
    assert answered(bench)[-1:] == [4]


@pytest.mark.parametrize("length", [7, 3, 1])
def test_a_part_of_another_length_ends_the_transfer(bench: CanBench, length: int) -> None:
    frames = ping(0)
    frames[1] = CanFrame(frames[1].identifier, frames[1].data[:length])
    bench.frames(*frames)
    assert answered(bench) == []
    bench.frames(*ping(5, 1))
    assert answered(bench) == [5]
    assert bench.counters()[:3] == (1, 0, 1)


def test_a_last_part_that_is_too_long_ends_the_transfer(bench: CanBench) -> None:
    frames = ping(0)
    last = frames[-1]
    assert last.length < 8
    frames[-1] = CanFrame(last.identifier, last.data + b"\0")
    bench.frames(*frames)
    assert answered(bench) == []


@pytest.mark.parametrize("position", range(1, 8))
def test_a_damaged_transfer_is_discarded_and_counted(bench: CanBench, position: int) -> None:
    frames = ping(0)
    data = bytearray(frames[1].data)
    data[position] ^= 0x10
    frames[1] = CanFrame(frames[1].identifier, bytes(data))
    bench.frames(*frames)
    assert answered(bench) == []
    assert bench.counters() == (0, 1, 0, 0)


@pytest.mark.parametrize("byte", [-1, -2])
def test_each_byte_of_the_checksum_counts(bench: CanBench, byte: int) -> None:
    frames = ping(0)
    whole = bytearray(b"".join(frame.data[1:] for frame in frames))
    whole[byte] ^= 1
    pieces = [bytes((i // 7,)) + bytes(whole[i : i + 7]) for i in range(0, len(whole), 7)]
    bench.frames(*(CanFrame(frames[0].identifier, piece) for piece in pieces))
    assert answered(bench) == []


def test_a_first_part_too_short_for_its_head_is_unknown(bench: CanBench) -> None:
    identifier = ping(0)[0].identifier
    for length in range(4):
        bench.frames(CanFrame(identifier, b"\0" * length))
    assert bench.counters()[:3] == (0, 0, 4)


def test_a_message_that_there_is_not_is_unknown(bench: CanBench) -> None:
    identifier = ping(0)[0].identifier
    bench.frames(CanFrame(identifier, b"\0" + struct.pack("<HB", 9999, 0)))
    assert bench.counters() == (0, 0, 1, 0)


def test_a_frame_without_a_head_does_not_disturb_a_transfer(bench: CanBench) -> None:
    frames = ping(6)
    bench.frames(frames[0], CanFrame(frames[0].identifier, b""), *frames[1:])
    assert answered(bench) == [6]


@pytest.mark.parametrize("change", [-1, 1])
def test_a_transfer_of_a_wrong_length_is_unknown(bench: CanBench, change: int) -> None:
    good = b"\0" * 12
    bench.frames(*transfer(Ping, good))
    assert answered(bench) == [0]
    bench.clear()
    longer = good + b"\0" if change > 0 else good[:-1]
    bench.frames(*transfer(Ping, longer, number=1))
    assert answered(bench) == ([0] if change < 0 else [])


# --- for whom -------------------------------------------------------------------------------------------------------


def test_what_is_for_another_node_is_not_heard(bench: CanBench) -> None:
    bench.frames(CanFrame(layout.ESTOP_FUNCTION << 7 | 2, b"\1"))
    bench.frames(*transfer(Ping, b"\0" * 12, node=2))
    assert bench.state() is State.DISARMED
    assert answered(bench) == []
    assert bench.counters() == (0, 0, 0, 0)


@pytest.mark.parametrize("function", [1, 3, 4, 5, 7, 8, 9, 10, 11, 13, 14, 15])
def test_functions_of_others_are_not_heard(bench: CanBench, function: int) -> None:
    for node in (0, 1):
        bench.frames(CanFrame(function << 7 | node, b"\1"))
        bench.frames(*(CanFrame(function << 7 | node, frame.data) for frame in ping(0)))
    assert bench.counters() == (0, 0, 0, 0)


@pytest.mark.parametrize("node", [1, 2, 42])
def test_what_is_for_all_and_what_is_for_this_robot_do_not_mix(bench: CanBench, node: int) -> None:
    bench.tick(ParamSet(1, 1, "SYS_ID", float(node)))
    bench.run(400, alive=False)
    bench.power_on()
    mine, everybodys = (
        transfer(ParamSet, struct.pack("<f16sB", 200.0, b"EYE_L_ON", 9), node=node),
        transfer(Ping, b"\5" * 12, node=0),
    )
    for pair in zip(mine, everybodys, strict=False):
        bench.frames(*pair)
    bench.frames(*mine[len(everybodys) :], *everybodys[len(mine) :])
    assert len(bench.got(Ping)) == 1
    assert bench.latest(ParamValue).param_value == 200.0


def test_a_system_beyond_the_bus_is_its_last_node() -> None:
    line = FirmwareBench()
    line.tick(ParamSet(1, 1, "SYS_ID", 200.0))
    line.run(400, alive=False)
    bench = CanBench(line.nvm)
    (frame, *_) = (frame for _ in range(30) for frame in bench.frames())
    assert frame.identifier & layout.NODE_MASK == layout.LAST_NODE
    bench.frames(CanFrame(layout.ESTOP_FUNCTION << 7 | layout.LAST_NODE, b"\1"))
    assert bench.state() is State.STOPPED


@pytest.mark.parametrize(("system", "taken"), [(126, True), (127, True), (128, False)])
def test_no_system_id_that_has_no_place_on_the_bus_is_taken(bench: CanBench, system: int, taken: bool) -> None:  # noqa: FBT001
    bench.tick(ParamSet(1, 1, "SYS_ID", float(system)))
    assert bench.latest(ParamValue).param_value == (system if taken else 1)
    if taken:
        bench.run(400, alive=False)
        bench.power_on()
        (frame, *_) = (frame for _ in range(30) for frame in bench.frames())
        assert frame.identifier & layout.NODE_MASK == system


def test_other_parameters_may_be_greater_than_a_node(bench: CanBench) -> None:
    bench.tick(ParamSet(1, 1, "EYE_L_ON", 200.0))
    assert bench.latest(ParamValue).param_value == 200.0


# --- single frames --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("node", [0, 1])
def test_a_stop_is_one_frame(bench: CanBench, node: int) -> None:
    bench.armed().perform((Action.FF,), 5.0)
    bench.frames(CanFrame(layout.ESTOP_FUNCTION << 7 | node, b"\1"))
    assert bench.state() is State.STOPPED
    assert bench.wheels == (0, 0)


@pytest.mark.parametrize("data", [b"", b"\0", b"\2", b"\1\1"])
def test_another_stop_is_unknown(bench: CanBench, data: bytes) -> None:
    bench.frames(CanFrame(layout.ESTOP_FUNCTION << 7 | 1, data))
    assert bench.state() is State.DISARMED
    assert bench.counters() == (0, 0, 1, 0)


def test_the_wheels_are_one_frame(bench: CanBench) -> None:
    bench.armed()
    (frame,) = bench.host.encode_frames(bench.wheels_message(0.5, -0.25, 1.0))  # type: ignore[attr-defined]
    bench.frames(frame)
    assert bench.wheels == (500, -250)
    assert bench.state() is State.DRIVING


@pytest.mark.parametrize("length", [0, 7])
def test_the_wheels_of_another_length_are_unknown(bench: CanBench, length: int) -> None:
    bench.armed()
    bench.frames(CanFrame(layout.WHEELS_FUNCTION << 7 | 1, bytes(length)))
    assert bench.wheels == (0, 0)
    assert bench.counters()[2] == 1


def test_wheels_for_all_are_not_obeyed(bench: CanBench) -> None:
    bench.armed()
    bench.frames(CanFrame(layout.WHEELS_FUNCTION << 7, struct.pack("<HhhH", 1, 500, 500, 1000)))
    assert bench.wheels == (0, 0)


@pytest.mark.parametrize("length", [0, 1, 3])
def test_an_alive_of_another_length_is_unknown_and_keeps_nothing(bench: CanBench, length: int) -> None:
    bench.armed().perform((Action.FF,), 5.0)
    for _ in range(50):
        bench.frames(CanFrame(layout.ALIVE_FUNCTION << 7, bench.host.encode(RobotAlive(1234))[8 : 8 + length]))
    assert bench.wheels == (0, 0)
    assert bench.counters()[2] == 50


def test_its_sensors_are_three_frames_of_one_moment(bench: CanBench) -> None:
    bench.io.eye = [1, 2]
    bench.io.floor = [3, 1023]
    bench.io.travel_um = [5000, -7000]
    bench.run(1000, alive=False)
    sensors = bench.latest(JuniorSensors)
    assert (sensors.eye, sensors.floor, sensors.battery) == ((1, 2), (3, 1023), 7.4)
    assert sensors.travel == pytest.approx((0.005, -0.007))
    sent = [frame.identifier for _ in range(4) for frame in bench.frames()]
    digests = [f << 7 | 1 for f in (layout.SWITCHES_FUNCTION, layout.EYES_FUNCTION, layout.TRAVEL_FUNCTION)]
    assert sent == digests


# --- out ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("frames", "sensors", "heartbeats"), [(0, False, False), (1, False, False), (2, False, True), (3, True, True)]
)
def test_what_finds_no_room_is_sent_whole_later_or_not_at_all(
    bench: CanBench,
    frames: int,
    sensors: bool,  # noqa: FBT001
    heartbeats: bool,  # noqa: FBT001
) -> None:
    room = frames * RECORD_LENGTH + RECORD_LENGTH // 2
    lib.host_slow_down(bench.robot, 0, room, room)
    bench.run(5000, alive=False)  # the bench takes no rejection
    assert bool(bench.got(JuniorSensors)) is sensors
    assert bool(bench.got(Heartbeat)) is heartbeats
    bench.clear()
    lib.host_slow_down(bench.robot, 0, 0, 0)
    bench.run(1000, alive=False)
    assert bench.got(JuniorSensors)
    assert bench.got(Heartbeat)


def test_its_transfers_are_numbered_and_none_has_an_empty_part(bench: CanBench) -> None:
    frames = [frame for _ in range(1000) for frame in bench.frames(*ping(0))]
    transfers = [f for f in frames if f.identifier >> 7 == layout.TRANSFER_UP_FUNCTION]
    assert all(frame.length > 1 for frame in transfers)
    numbers = [frame.data[0] >> 5 for frame in transfers if frame.data[0] & layout.PART_MASK == 0]
    assert numbers == [i % 8 for i in range(len(numbers))]


def test_a_message_that_is_none_of_the_bus_is_not_sent(bench: CanBench) -> None:
    assert lib.host_can_send(bench.robot, 256, b"\0" * 42, 42) == 0  # SETUP_SIGNING: nothing is signed here


def test_a_session_opens_and_numbered_messages_run(bench: CanBench) -> None:
    bench.open()
    assert bench.ask(RobotSession(1, 0, 7, 1, 1, 1, 0)) is Reason.BAD_VALUE, "another major version"
    bench.arm()
    wheels = JuniorWheels(bench.session, bench.next(), speed=(0.5, 0.5), duration=0.5, target_system=1, target_component=1)
    assert bench.ask(wheels) is Reason.NONE
    assert bench.ask(wheels) is Reason.NONE, "the same again: the same answer"
    bench.run(490)
    assert bench.wheels == (500, 500)
    bench.run(5)
    assert bench.wheels == (0, 0), "and no longer than once"


def test_frames_of_29_bits_are_other_people_s(bench: CanBench) -> None:
    bench.frames(CanFrame(layout.ESTOP_FUNCTION << 7 | 1, b"\1", extended=True))
    assert bench.state() is State.DISARMED
