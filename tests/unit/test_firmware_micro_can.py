"""The micro-robot on a CAN bus: a move in a single frame, observations as transfers."""

from __future__ import annotations

import math

import pytest
from can_bench import CanBench
from micro_bench import MicroBench, Other

from firmware_protocol.messages import Reason, RobotAck, State, SwarmObservation, SwarmRanges
from firmware_protocol.vocabulary import MoveOption, SwarmOutcome
from firmware_protocol.wire.can.frame import CanFrame
from firmware_protocol.wire.can.layout import FUNCTION_SHIFT, MOVE_FUNCTION, WHEELS_FUNCTION


class MicroCanBench(CanBench, MicroBench):
    """One, node 1 of a bus."""


@pytest.fixture
def bench() -> MicroCanBench:
    bench = MicroCanBench()
    bench.armed()
    return bench


def frame(data: bytes, function: int = MOVE_FUNCTION, node: int = 1) -> CanFrame:
    return CanFrame(function << FUNCTION_SHIFT | node, data)


def test_a_plain_move_is_a_single_frame(bench: MicroCanBench) -> None:
    sequence = bench.next()
    data = sequence.to_bytes(2, "little") + (-15000).to_bytes(2, "little", signed=True) + (80).to_bytes(2, "little")
    bench.frames(frame(data + bytes([0, MoveOption.SENSE])))
    assert bench.latest(RobotAck).reason == Reason.NONE
    observation = bench.finish()
    assert (observation.sequence, observation.outcome) == (sequence, SwarmOutcome.ARRIVED)
    assert math.remainder(bench.angle + 1.5, math.tau) == pytest.approx(0.0, abs=0.05)


def test_its_sectors_are_those_of_swarm_sense(bench: MicroCanBench) -> None:
    bench.ask(bench.sense_message(sectors=4))
    data = bench.next().to_bytes(2, "little") + b"\0\x80" + (100).to_bytes(2, "little") + bytes([2, 0])
    bench.frames(frame(data))
    bench.finish()
    assert math.remainder(bench.angle - 0.75 * math.pi, math.tau) == pytest.approx(0.0, abs=0.07)


@pytest.mark.parametrize("other", [frame(bytes(7)), frame(b"")])
def test_one_of_another_length_is_counted(bench: MicroCanBench, other: CanFrame) -> None:
    before = bench.counters()[2]
    bench.frames(other)
    assert bench.counters()[2] == before + 1
    assert bench.state() is State.READY


@pytest.mark.parametrize("other", [frame(bytes(8), WHEELS_FUNCTION), frame(bytes(8), node=2)])
def test_other_roles_and_other_nodes_frames_are_left_alone(bench: MicroCanBench, other: CanFrame) -> None:
    before = bench.counters()[2]
    bench.frames(other)
    assert bench.counters()[2] == before
    assert bench.state() is State.READY


def test_the_rest_goes_as_transfers(bench: MicroCanBench) -> None:
    bench.others = [Other(1, 0.5, 0.1)]
    bench.set(RANGES=32)
    bench.move(1.0, 0.05, face=0.0, options=MoveOption.SENSE | MoveOption.RANGES)
    assert bench.finish().count == (0, 1)
    assert bench.latest(SwarmRanges).count == 32
    bench.request(SwarmObservation, 3)
    bench.run(10)
    assert bench.latest(SwarmObservation).sequence == 3
