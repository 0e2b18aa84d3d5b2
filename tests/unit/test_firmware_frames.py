"""The firmware's framing: what is counted, what is lost, what is not."""

from __future__ import annotations

import importlib

import pytest
from firmware_bench import HOST, FirmwareBench

from firmware_protocol.generate.vectors import Vector, vectors
from firmware_protocol.messages import (
    Command,
    CommandLong,
    JuniorSensors,
    ParamRequestRead,
    ParamValue,
    Ping,
    RobotStatus,
)
from firmware_protocol.wire.fields import Direction, Party
from firmware_protocol.wire.mavlink import MavlinkCodec, split_frames
from simdevice._host import ffi

INBOUND = [
    vector
    for vector in vectors()
    if vector.message.DIRECTION is not Direction.UP and vector.message.PARTY in {Party.ROBOT, Party.JUNIOR}
]


def frame(sequence: int, number: int = 0, system: int = 255) -> bytes:
    """A ping with a frame sequence of its own."""
    codec = MavlinkCodec(system=system, component=190)
    for _ in range(sequence % 256):
        codec.encode(HOST)
    return codec.encode(Ping(time_usec=1, seq=number))


def answered(bench: FirmwareBench) -> list[int]:
    """Numbers of the pings that were answered."""
    return [ping.seq for ping in bench.got(Ping)]


def counters(bench: FirmwareBench) -> tuple[int, int, int, int]:
    """Good, bad checksum, unknown, lost; before the request that asks for them, which is a frame of another system."""
    request = CommandLong(target_system=1, target_component=1, command=int(Command.REQUEST_MESSAGE), param1=RobotStatus.ID)
    bench.tick(raw=MavlinkCodec(system=77, component=1).encode(request))
    status = bench.latest(RobotStatus)
    return status.good - 1, status.bad_checksum, status.unknown, status.lost


@pytest.mark.parametrize("vector", INBOUND, ids=lambda vector: vector.name)
def test_every_message_is_understood_at_the_limits_of_its_fields(vector: Vector) -> None:
    bench = FirmwareBench()
    bench.tick(raw=vector.frame)
    good, bad, unknown, _ = counters(bench)
    assert (good, bad, unknown) == (1, 0, 0)
    bench = FirmwareBench()
    for i in range(len(vector.frame)):
        bench.tick(raw=vector.frame[i : i + 1])
    assert counters(bench)[:3] == (1, 0, 0)


def test_every_message_of_a_robot_is_understood_by_the_host() -> None:
    bench = FirmwareBench(encoders=False)  # the bench decodes all it sends, and takes no rejection
    bench.io.eye = [1023, 0]
    bench.io.floor = [0, 1023]
    bench.io.battery_mv = 65535
    bench.io.arm = [1, 1]
    bench.run(1000)
    bench.tick(ParamRequestRead(1, 1, "WHEEL_SPEED"))
    assert bench.latest(JuniorSensors).battery == 65.535
    assert bench.latest(ParamValue).param_id == "WHEEL_SPEED"


def test_a_damaged_frame_takes_no_good_one_with_it() -> None:
    frames = [frame(i, i) for i in range(9)]
    for position in range(len(frames[4])):
        for bit in range(8):
            bench = FirmwareBench()
            damaged = bytearray(frames[4])
            damaged[position] ^= 1 << bit
            bench.tick(raw=b"".join(frames[:4]) + damaged + b"".join(frames[5:]))
            bench.run(30, alive=False)
            assert answered(bench) == [0, 1, 2, 3, 5, 6, 7, 8], (position, bit)


def test_what_is_not_for_us_to_know_is_unknown_and_not_lost() -> None:
    bench = FirmwareBench()
    codec = MavlinkCodec(system=255, component=190)
    bench.tick(raw=codec.encode(HOST) + codec.encode(ParamValue("FOR_A_HOST", 1.0, 9, 1, 0)) + codec.encode(HOST))
    assert counters(bench) == (2, 0, 1, 0)


def test_a_damaged_frame_is_lost_by_its_number() -> None:
    bench = FirmwareBench()
    bench.tick(raw=frame(0) + frame(1)[:-1] + b"\0" + frame(2))
    assert counters(bench) == (2, 1, 0, 1)


@pytest.mark.parametrize(("numbers", "lost"), [([5, 6, 9], 2), ([250, 2], 7), ([1, 1, 1], 0), ([3, 2, 4], 0), ([200], 0)])
def test_gaps_are_counted_repetitions_are_not(numbers: list[int], lost: int) -> None:
    bench = FirmwareBench()
    bench.tick(raw=b"".join(frame(number) for number in numbers))
    assert counters(bench)[3] == lost


def test_gaps_are_counted_for_each_sender() -> None:
    bench = FirmwareBench()
    bench.tick(raw=b"".join(frame(i * (system - 247), system=system) for i in range(4) for system in (248, 249, 250)))
    assert counters(bench)[3] == 3 + 6


@pytest.mark.parametrize("length", range(1, len(frame(0))))
def test_a_partial_frame_is_given_up_after_20_ms_and_what_it_hid_is_found(length: int) -> None:
    bench = FirmwareBench()
    bench.tick(raw=frame(0)[:length] + frame(1, 7))
    bench.run(25, alive=False)
    assert answered(bench) == [7]
    bench.tick(raw=frame(2, 8))
    assert answered(bench) == [7, 8]


def test_a_frame_may_come_in_pieces_less_than_20_ms_apart() -> None:
    bench = FirmwareBench()
    whole = frame(0, 3)
    for i in range(0, len(whole), 4):
        bench.tick(raw=whole[i : i + 4])
        bench.run(10, alive=False)
    assert answered(bench) == [3]


def test_a_signed_frame_is_taken_as_one_without_a_signature() -> None:
    common = importlib.import_module("pymavlink.dialects.v20.common")
    link = common.MAVLink(None, srcSystem=255, srcComponent=190)
    link.signing.secret_key = b"k" * 32
    link.signing.sign_outgoing = True
    bench = FirmwareBench()
    bench.tick(raw=bytes(link.ping_encode(1, 5, 0, 0).pack(link)))
    bench.tick(raw=frame(1, 6))
    assert answered(bench) == [5, 6]


def test_an_echo_of_its_own_does_nothing() -> None:
    bench = FirmwareBench()
    codec = MavlinkCodec(system=1, component=1)
    bench.tick(raw=codec.encode(Ping(1, 1)))
    assert bench.sent == []


def test_more_is_asked_than_fits_into_the_buffer() -> None:
    bench = FirmwareBench()
    bench.tick(raw=b"".join(frame(i, i) for i in range(200)))
    replies = answered(bench)
    assert replies == list(range(len(replies)))
    assert len(replies) > 50, "what fits is sent, the rest left out"
    bench.tick(raw=frame(200, 200))
    assert answered(bench)[-1] == 200


def test_frames_of_a_robot_can_be_cut_apart() -> None:
    bench = FirmwareBench()
    bench.tick()
    data = bytes(ffi.buffer(bench.io.tx, bench.io.tx_len))
    assert len(split_frames(data)) == len(bench.streamed) == 4
