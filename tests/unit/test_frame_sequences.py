"""Frames that are missing in a row are counted as lost, up to half of what a sequence number can tell: 127."""

from __future__ import annotations

import pytest
from firmware_bench import FirmwareBench
from peer_bench import Bench

from firmware_protocol.messages import Command, CommandLong, Ping, RobotStatus
from firmware_protocol.wire.mavlink import MavlinkCodec

STEPS = (2, 64, 65, 100, 127)


@pytest.mark.parametrize("step", STEPS)
def test_the_host_counts_them(step: int) -> None:
    bench = Bench()
    bench.connect()
    counters = bench.peer.counters
    bench.heard(Ping(1, 1, 255, 190))
    lost = counters.lost
    bench.heard(Ping(1, 2, 255, 190), step=step)
    assert (counters.lost - lost, counters.late) == (step - 1, 0)
    bench.heard(Ping(1, 3, 255, 190))
    assert counters.lost - lost == step - 1


@pytest.mark.parametrize("step", STEPS)
def test_a_number_that_was_not_used_is_no_repetition(step: int) -> None:
    bench = Bench()
    bench.connect()
    bench.heard(Ping(1, 1, 255, 190), raw=b"same")
    shown = len(bench.shown)
    bench.heard(Ping(1, 1, 255, 190), step=step, raw=b"same")
    assert (bench.peer.counters.duplicates, len(bench.shown)) == (0, shown + 1)


@pytest.mark.parametrize("step", [128, 255])
def test_the_host_takes_more_for_one_that_comes_late(step: int) -> None:
    bench = Bench()
    bench.connect()
    counters = bench.peer.counters
    bench.heard(Ping(1, 1, 255, 190), step=5)
    lost = counters.lost
    bench.heard(Ping(1, 2, 255, 190), step=step)
    assert (counters.lost, counters.late) == (lost - 1, 1)


def frame(sequence: int) -> bytes:
    codec = MavlinkCodec(system=7, component=1)
    codec.sequence = sequence & 255
    return codec.encode(Ping(time_usec=1, seq=sequence))


@pytest.mark.parametrize("step", STEPS)
def test_the_robot_counts_them(step: int) -> None:
    bench = FirmwareBench()
    bench.tick(raw=frame(200) + frame(200 + step) + frame(200 + step + 1))
    bench.tick(CommandLong(1, 1, Command.REQUEST_MESSAGE, 0, float(RobotStatus.ID)))
    assert bench.latest(RobotStatus).lost == step - 1


@pytest.mark.parametrize("step", [129, 255])
def test_the_robot_takes_more_for_one_that_comes_late(step: int) -> None:
    bench = FirmwareBench()
    bench.tick(raw=frame(200) + frame(200 + step) + frame(201))
    bench.tick(CommandLong(1, 1, Command.REQUEST_MESSAGE, 0, float(RobotStatus.ID)))
    assert bench.latest(RobotStatus).lost == 0
