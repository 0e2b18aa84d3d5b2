"""The micro-robot's observations: those of moves, repeated until somebody has them, and those that are asked for."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from firmware_bench import HOST_NUMBER, TICK
from micro_bench import MicroBench, Other

from firmware_protocol.messages import (
    Command,
    CommandAck,
    CommandResult,
    Reason,
    SwarmObservation,
    SwarmRanges,
    SysStatus,
)
from firmware_protocol.vocabulary import MoveOption, ObservationFlag, SwarmOutcome
from simdevice._host import lib


@pytest.fixture
def bench() -> MicroBench:
    return MicroBench().armed()


def times(bench: MicroBench, ms: int) -> list[int]:
    """When observations leave within this time, in ms from its beginning."""
    begin, found = bench.now, []
    while bench.now < begin + ms:
        bench.clear()
        bench.run(TICK)
        found += [bench.now - begin] * len(bench.got(SwarmObservation))
    return found


def test_it_is_repeated_until_it_is_acknowledged(bench: MicroBench) -> None:
    bench.move(0.0, 0.0)
    observation = bench.finish()
    assert times(bench, 4000) == [250, 750, 1750, 2750, 3750]
    bench.acknowledge(observation)
    assert times(bench, 3000) == []


def test_another_ones_acknowledgement_is_not_its_own(bench: MicroBench) -> None:
    bench.move(0.0, 0.0)
    observation = bench.finish()
    for session, sequence in ((observation.session + 1, observation.sequence), (observation.session, 77)):
        bench.acknowledge(replace(observation, session=session, sequence=sequence))
    assert times(bench, 300) != []


def test_the_next_numbered_message_ends_that(bench: MicroBench) -> None:
    bench.move(0.0, 0.0)
    bench.finish()
    assert bench.ask(bench.sense_message()) is Reason.NONE
    assert times(bench, 3000) == []


def test_it_says_where_the_robot_is(bench: MicroBench) -> None:
    bench.move(0.7, 0.2)
    observation = bench.finish()
    assert observation.position == pytest.approx((bench.x, bench.y), abs=0.003)
    assert observation.heading == pytest.approx(bench.angle, abs=0.01)
    assert observation.session == bench.session
    assert observation.time * 1000 == pytest.approx(bench.now)
    assert observation.fix_age is not None
    assert observation.fix_age <= 0.05


def test_box_and_goal_are_told_where_they_are_sensed(bench: MicroBench) -> None:
    bench.move(0.0, 0.0)
    nothing = bench.finish()
    assert (nothing.box_bearing, nothing.box_distance, nothing.goal_bearing) == (None, None, None)
    bench.io.has_box = bench.io.has_goal = bench.io.touch = 1
    bench.io.box_bearing, bench.io.box_distance = 8192, 123
    bench.io.goal_bearing = 65536 - 8192
    bench.move(0.0, 0.0)
    found = bench.finish()
    assert found.box_bearing == pytest.approx(math.pi / 4, abs=1e-4)
    assert found.box_distance == 0.123
    assert found.goal_bearing == pytest.approx(-math.pi / 4, abs=1e-4)
    assert found.flags & ObservationFlag.TOUCHES_BOX
    bench.move(0.0, 0.0, options=0)
    assert bench.finish().box_bearing is None


def test_without_the_option_the_ring_is_not_read(bench: MicroBench) -> None:
    bench.others = [Other(1, 0.0, 0.1)]
    bench.move(0.0, 0.0, options=0)
    observation = bench.finish()
    assert observation.flags & ObservationFlag.RING_NOT_READ
    assert (observation.near, observation.seen, observation.count, observation.count_before) == ((0, 0),) * 4
    assert bench.readings == 0


def test_sensing_waits_for_the_ring(bench: MicroBench) -> None:
    bench.io.ready = 0
    bench.others = [Other(1, 0.0, 0.1)]
    bench.move(0.0, 0.0)
    bench.run(200)
    assert not bench.got(SwarmObservation)
    bench.io.ready = 1
    bench.run(TICK)
    assert bench.latest(SwarmObservation).count == (0, 1)


def test_ranges_come_with_the_observation_of_a_move(bench: MicroBench) -> None:
    bench.ask(bench.sense_message(ranges=4))
    bench.io.range = [100, 200, 65535, 400, *[7] * 28]
    bench.io.range_robots = 0b1011
    bench.move(0.0, 0.0, options=MoveOption.RANGES)
    bench.finish()
    bench.run(300)
    first, again = bench.got(SwarmRanges)
    assert first == again
    assert (first.sequence, first.count, first.robots) == (2, 4, 0b1011)
    assert first.ranges[:5] == (0.1, 0.2, None, 0.4, 0.0)
    assert (bench.io.ranges, bench.io.farthest) == (4, 2500)


def test_a_robot_without_a_ring_never_says_ranges() -> None:
    bench = MicroBench(ring=False).armed()
    bench.command(Command.SET_MESSAGE_INTERVAL, SwarmRanges.ID, 100_000)
    bench.move(0.0, 0.0, options=MoveOption.RANGES)
    bench.finish()
    bench.run(500)
    assert bench.got(SwarmObservation)
    assert not bench.got(SwarmRanges)


# --- asked for ------------------------------------------------------------------------------------------------------


def test_it_answers_in_the_next_period(bench: MicroBench) -> None:
    bench.others = [Other(0, 1.0, 0.15)]
    (ack,) = bench.request(SwarmObservation, 300, HOST_NUMBER)
    assert isinstance(ack, CommandAck)
    assert ack.result == CommandResult.ACCEPTED
    (observation,) = bench.tick()
    assert isinstance(observation, SwarmObservation)
    assert (observation.sequence, observation.session, observation.outcome) == (300, bench.session, SwarmOutcome.NONE)
    assert observation.count == (1, 0)
    bench.clear()
    bench.run(1000)
    assert not bench.got(SwarmObservation), "it is not repeated"


def test_asked_of_all_the_message_alone_answers(bench: MicroBench) -> None:
    assert bench.request(SwarmObservation, 1, HOST_NUMBER, system=0) == []
    (observation,) = bench.tick()
    assert isinstance(observation, SwarmObservation)
    assert bench.request(SysStatus, 1, system=0) == [], "other messages are not asked of all"
    assert bench.tick() == []


def test_without_a_session_it_says_so() -> None:
    bench = MicroBench()
    bench.request(SwarmObservation, 5)
    (observation,) = bench.tick()
    assert isinstance(observation, SwarmObservation)
    assert (observation.session, observation.sequence) == (0, 5)


def test_two_who_ask_at_once_are_both_answered(bench: MicroBench) -> None:
    bench.request(SwarmObservation, 5, HOST_NUMBER, system=0)
    bench.io.ready = 0
    bench.request(SwarmObservation, 9, system=0)
    bench.io.ready = 1
    sequences = [o.sequence for o in bench.tick() if isinstance(o, SwarmObservation)]
    assert sequences in ([9], [5, 9])
    assert {o.sequence for o in bench.got(SwarmObservation)} == {5, 9}


def test_ranges_are_asked_for_likewise(bench: MicroBench) -> None:
    bench.set(RANGES=2, RANGE_MAX=1.0)
    bench.io.range = [100, 200, *[0] * 30]
    bench.request(SwarmRanges, 7, HOST_NUMBER)
    (ranges,) = bench.tick()
    assert isinstance(ranges, SwarmRanges)
    assert (ranges.sequence, ranges.count, ranges.ranges[:3]) == (7, 2, (0.1, 0.2, 0.0))
    assert bench.io.farthest == 1000


def test_without_a_ring_there_are_no_ranges_and_the_observation_says_so() -> None:
    bench = MicroBench(ring=False).armed()
    (ack,) = bench.request(SwarmRanges, 7)
    assert isinstance(ack, CommandAck)
    assert ack.result == CommandResult.DENIED
    bench.others = [Other(0, 0.0, 0.1)]
    bench.request(SwarmObservation, 8)
    (observation,) = bench.tick()
    assert isinstance(observation, SwarmObservation)
    assert observation.flags & ObservationFlag.RING_NOT_READ
    assert observation.count == (0, 0)


@pytest.mark.parametrize("kind", [SwarmObservation, SwarmRanges])
def test_they_may_come_at_intervals(bench: MicroBench, kind: type[SwarmObservation | SwarmRanges]) -> None:
    assert bench.command(Command.SET_MESSAGE_INTERVAL, kind.ID, 100_000) is CommandResult.ACCEPTED
    bench.clear()
    bench.run(1000)
    assert 9 <= len(bench.got(kind)) <= 11
    assert {message.sequence for message in bench.got(kind)} == {0}


def test_what_finds_no_room_comes_later(bench: MicroBench) -> None:
    bench.set(RANGES=1)
    lib.host_slow_down(bench.robot, 0, 60, 10)
    bench.request(SwarmObservation, 3, HOST_NUMBER)
    bench.run(300)
    assert [o.sequence for o in bench.got(SwarmObservation)] == [3]
    bench.clear()
    bench.request(SwarmRanges, 4, HOST_NUMBER)
    bench.run(300)
    bench.move(0.0, 0.0)
    bench.finish()


# --- before ---------------------------------------------------------------------------------------------------------


def ask(bench: MicroBench, host: int) -> SwarmObservation:
    """What it answers."""
    bench.request(SwarmObservation, 1, host)
    return next(o for o in bench.tick() if isinstance(o, SwarmObservation))


def test_before_is_the_last_observation_of_a_move_or_for_the_holder(bench: MicroBench) -> None:
    bench.others = [Other(1, 0.0, 0.31), Other(1, 1.0, 0.33)]
    first = ask(bench, HOST_NUMBER)
    assert (first.radius, first.radius_before) == (0.35, 0.2)
    assert (first.count, first.count_before) == ((0, 2), (0, 0))
    bench.others = [Other(1, 0.0, 0.21), Other(1, 1.0, 0.33)]
    bench.move(0.0, 0.0)
    moved = bench.finish()
    assert (moved.radius, moved.radius_before) == (0.25, 0.35)
    assert (moved.count, moved.count_before) == ((0, 1), (0, 2))
    bench.acknowledge(moved)
    assert ask(bench, HOST_NUMBER).radius_before == 0.25


@pytest.mark.parametrize("host", [0, HOST_NUMBER + 1, 65535, math.nan])
def test_a_watchers_asking_moves_nothing(bench: MicroBench, host: float) -> None:
    bench.others = [Other(1, 0.0, 0.31)]
    for _ in range(2):
        bench.request(SwarmObservation, 1, host)  # type: ignore[arg-type]
        (observation,) = [o for o in bench.tick() if isinstance(o, SwarmObservation)]
        assert (observation.radius, observation.radius_before) == (0.35, 0.2)


def test_an_observation_without_the_ring_moves_nothing(bench: MicroBench) -> None:
    bench.others = [Other(1, 0.0, 0.31)]
    ask(bench, HOST_NUMBER)
    bench.others = []
    bench.move(0.0, 0.0, options=0)
    bench.finish()
    assert ask(bench, 0).radius_before == 0.35


def test_counts_end_at_255(bench: MicroBench) -> None:
    bench.others = [Other(1, i / 50, 0.1) for i in range(300)]
    observation = ask(bench, 0)
    assert observation.count == observation.count_before == (0, 255)
