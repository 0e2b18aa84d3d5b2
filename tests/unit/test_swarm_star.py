"""The star of a network: a robot's firmware is handed what is for it or for all, and nothing else."""

from __future__ import annotations

import pytest
from swarm_bench import BOOTED, SwarmBench

from firmware_protocol.messages import ROBOT_COMPONENT, RobotAlive, RobotStatus, Timesync
from firmware_protocol.wire.fields import CAN, MAVLINK


def statuses(bench: SwarmBench) -> dict[int, RobotStatus]:
    """The last status of every robot."""
    bench.live(1.01)
    return {system: bench.of(RobotStatus, system)[-1] for system in range(1, bench.world.settings.count + 1)}


@pytest.mark.parametrize("wire", [MAVLINK, CAN])
def test_a_frame_goes_to_whom_it_is_for(wire: str) -> None:
    bench = SwarmBench(rangers=3, wilds=1, wire=wire)
    bench.live(BOOTED)
    bench.say(*[Timesync(0, number, 2, ROBOT_COMPONENT) for number in range(1, 11)], RobotAlive(9, 0, 0))
    assert {system for _, event in bench.heard if isinstance(event.message, Timesync) for system in [event.system]} == {2}
    assert {system: status.good for system, status in statuses(bench).items()} == {1: 1, 2: 11, 3: 1, 4: 1}


def test_frames_that_go_to_others_are_not_lost_and_lost_ones_are_told_once() -> None:
    bench = SwarmBench(rangers=3, wilds=0)
    bench.live(BOOTED)
    for system in (1, 2, 3, 1, 2, 3):
        bench.say(Timesync(0, 1, system, ROBOT_COMPONENT), RobotAlive(9, 0, 0))
    assert [status.lost for status in statuses(bench).values()] == [0, 0, 0]
    for _ in range(4):
        bench.encode(Timesync(0, 1, 3, ROBOT_COMPONENT))  # never sent
    bench.say(RobotAlive(9, 0, 0), Timesync(0, 1, 2, ROBOT_COMPONENT), Timesync(0, 1, 3, ROBOT_COMPONENT))
    bench.say(Timesync(0, 1, 1, ROBOT_COMPONENT))
    found = statuses(bench)
    assert [status.lost for status in found.values()] == [0, 4, 0]
    assert [(status.bad_checksum, status.unknown) for status in found.values()] == [(0, 0)] * 3


@pytest.mark.parametrize("size", [1, 2, 7, 20])
def test_frames_may_come_in_pieces(size: int) -> None:
    bench = SwarmBench(rangers=2, wilds=0)
    bench.live(BOOTED)
    data = bench.encode(Timesync(0, 1, 1, ROBOT_COMPONENT), Timesync(0, 2, 2, ROBOT_COMPONENT), RobotAlive(9, 0, 0))
    bench.heard.clear()
    for at in range(0, len(data), size):
        bench.live(0.005, data[at : at + size])
    assert [answer.ts1 for answer in bench.of(Timesync)] == [1, 2]


@pytest.mark.parametrize("damage", [b"\xfd", b"\xfd\x10\x00", b"noise", b"\xfd\x09\x00\x00\x01\xff\xbe\x00\x00\x00\x01\x02"])
def test_garbage_takes_no_good_frame_with_it(damage: bytes) -> None:
    bench = SwarmBench(rangers=2, wilds=0)
    bench.live(BOOTED)
    data = damage + bench.encode(Timesync(0, 1, 2, ROBOT_COMPONENT))
    bench.heard.clear()
    bench.live(0.1, data)
    bench.live(0.1, bench.encode(Timesync(0, 2, 1, ROBOT_COMPONENT)))
    assert [answer.ts1 for answer in bench.of(Timesync)] == [1, 2]
    assert bench.world.arrays.bad >= len(damage)


def test_a_frame_that_was_damaged_goes_to_nobody() -> None:
    bench = SwarmBench(rangers=2, wilds=0)
    bench.live(BOOTED)
    frame = bytearray(bench.encode(Timesync(0, 1, 2, ROBOT_COMPONENT)))
    frame[12] ^= 1
    bench.heard.clear()
    bench.live(0.1, bytes(frame))
    assert not bench.of(Timesync)
    assert all(status.bad_checksum == 0 for status in statuses(bench).values())


def test_one_robot_alone_hears_the_line_as_it_is() -> None:
    bench = SwarmBench(rangers=1, wilds=0)
    bench.live(BOOTED)
    frame = bytearray(bench.encode(Timesync(0, 1, 1, ROBOT_COMPONENT)))
    frame[12] ^= 1
    bench.live(0.1, bytes(frame))
    assert statuses(bench)[1].bad_checksum == 1
