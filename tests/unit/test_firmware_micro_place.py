"""Where a micro-robot thinks that it is, and the fence that it keeps within."""

from __future__ import annotations

import math

import pytest
from micro_bench import MicroBench

from firmware_protocol.messages import Reason, SwarmFix, SwarmObservation
from firmware_protocol.vocabulary import MoveOption, ObservationFlag, SwarmOutcome
from simdevice._host import lib


def look(bench: MicroBench) -> SwarmObservation:
    """Ask."""
    bench.request(SwarmObservation, 1)
    return next(o for o in bench.tick() if isinstance(o, SwarmObservation))


# --- angles ---------------------------------------------------------------------------------------------------------


def test_sines_err_by_less_than_a_thousandth() -> None:
    worst = max(abs(lib.host_sine(angle) / 32767 - math.sin(angle / 65536 * math.tau)) for angle in range(65536))
    assert worst < 2e-4


def test_angles_of_vectors_err_by_less_than_a_thousandth() -> None:
    worst = 0.0
    for step in range(20_000):
        angle = step / 20_000 * math.tau
        for length in (3e4, 1e6, 1e9):
            found = lib.host_angle(round(length * math.sin(angle)), round(length * math.cos(angle)))
            worst = max(worst, abs(math.remainder(found / 65536 * math.tau - angle, math.tau)))
    assert worst < 3e-4
    assert lib.host_angle(0, 0) == 0


# --- pose -----------------------------------------------------------------------------------------------------------


def test_it_reckons_by_its_wheels_alone() -> None:
    bench = MicroBench(own_fix=0).armed()
    bench.move(0.8, 0.3)
    observation = bench.finish()
    assert observation.fix_age is None
    assert observation.flags & ObservationFlag.DEAD_RECKONING
    assert observation.position == pytest.approx((bench.x, bench.y), abs=0.002)
    assert observation.heading == pytest.approx(bench.angle, abs=0.005)


def test_a_camera_tells_it_where_it_is() -> None:
    bench = MicroBench(own_fix=0).armed()
    bench.tick(bench.fix_message(0.5, -0.25, 1.0, 0.1))
    observation = look(bench)
    assert observation.position == (0.5, -0.25)
    assert observation.heading == pytest.approx(1.0, abs=2e-4)
    assert observation.fix_age == pytest.approx(0.11, abs=0.006)
    assert not observation.flags & ObservationFlag.DEAD_RECKONING
    bench.run(1000)
    assert look(bench).flags & ObservationFlag.DEAD_RECKONING
    bench.run(70_000)
    assert look(bench).fix_age == 65.534


def test_a_fix_near_by_is_believed_by_a_quarter_and_far_away_at_all() -> None:
    bench = MicroBench(own_fix=0).armed()
    bench.tick(bench.fix_message(0.5, -0.25, 1.0))
    bench.tick(bench.fix_message(0.508, -0.254, 1.04))
    near = look(bench)
    assert near.position == (0.502, -0.251)
    assert near.heading == pytest.approx(1.01, abs=3e-4)
    for x, y, heading in ((0.53, -0.25, 1.0), (0.5, -0.25, 1.0), (0.5, -0.22, 1.0), (0.5, -0.25, 1.0), (0.5, -0.25, 2.0)):
        bench.tick(bench.fix_message(x, y, heading))
        assert look(bench).position == (x, y)


def test_an_old_fix_is_of_where_it_was_then() -> None:
    bench = MicroBench(own_fix=0).armed()
    bench.tick(bench.fix_message(0.0, 0.0, 0.0))
    bench.move(0.0, 1.0)
    places = []
    for step in range(120):
        places.append((bench.x, bench.y))
        if step > 40 and step % 10 == 0:
            x, y = places[-25]
            bench.tick(bench.fix_message(x, y, 0.0, 0.12))
        else:
            bench.run(5)
    assert look(bench).position[0] == pytest.approx(bench.x, abs=0.004)
    bench.tick(bench.fix_message(0.0, 0.0, 0.0, 0.9))
    assert look(bench).position[0] > 0.05, "one that is older than what is remembered is of the oldest"


@pytest.mark.parametrize(
    ("own", "session", "age"), [(50, None, 0.0), (0, 4712, 0.0), (0, None, 1.0)], ids=["has its own", "another's", "too old"]
)
def test_a_fix_that_is_not_for_it_is_ignored(own: int, session: int | None, age: float) -> None:
    bench = MicroBench(own_fix=own).armed()
    assert bench.tick(bench.fix_message(0.5, 0.5, 1.0, age, session=session)) == []
    assert look(bench).position == (0.0, 0.0)


def test_without_a_session_a_fix_is_ignored() -> None:
    bench = MicroBench(own_fix=0)
    bench.tick(SwarmFix(0, (0.5, 0.5), 0.0, 0.0, 1, 1))
    assert look(bench).position == (0.0, 0.0)


def test_what_is_too_far_away_for_the_wire_is_at_its_end() -> None:
    for x, told in ((40.0, 32.767), (-40.0, -32.767)):
        bench = MicroBench(own_fix=5)
        bench.x = x
        bench.tick()
        bench.tick()
        assert look(bench).position == (told, 0.0)


def test_encoders_that_leap_are_not_believed() -> None:
    bench = MicroBench(own_fix=0)
    bench._travel[:] = 5.0
    assert look(bench).position[0] == pytest.approx(0.03)
    bench._travel[:] = -5.0
    assert look(bench).position[0] == pytest.approx(0.0)


# --- fence ----------------------------------------------------------------------------------------------------------


def fenced(x: float = 0.0, y: float = 0.0, **fence: float) -> MicroBench:
    """A robot in a fence of 0.5 m by 0.3 m, which stands somewhere."""
    bench = MicroBench().armed()
    bench.x, bench.y = x, y
    bench.run(100)
    bench.set(**(fence or {"FENCE_X": 0.5, "FENCE_Y": 0.3}))
    return bench


@pytest.mark.parametrize(
    ("heading", "distance", "reason"),
    [
        (0.0, 0.49, Reason.NONE),
        (0.0, 0.52, Reason.BAD_VALUE),
        (math.pi, 0.52, Reason.BAD_VALUE),
        (math.pi / 2, 0.29, Reason.NONE),
        (math.pi / 2, 0.32, Reason.BAD_VALUE),
        (-math.pi / 2, 0.32, Reason.BAD_VALUE),
        (0.0, 60.0, Reason.BAD_VALUE),
        (0.0, 0.0, Reason.NONE),
    ],
)
def test_a_move_that_ends_outside_is_refused(heading: float, distance: float, reason: Reason) -> None:
    bench = fenced()
    assert bench.ask(bench.move_message(heading, distance)) is reason


def test_each_side_may_be_without_a_fence() -> None:
    bench = fenced(FENCE_X=0.5)
    assert bench.ask(bench.move_message(math.pi / 2, 5.0)) is Reason.NONE
    assert bench.ask(bench.move_message(0.0, 5.0)) is Reason.BAD_VALUE
    bench = fenced(FENCE_Y=0.5)
    assert bench.ask(bench.move_message(0.0, 5.0)) is Reason.NONE
    assert bench.ask(bench.move_message(math.pi / 2, 5.0)) is Reason.BAD_VALUE


def test_from_outside_it_may_come_nearer_but_not_go_further() -> None:
    bench = fenced(0.8, 0.0)
    assert bench.ask(bench.move_message(0.0, 0.05)) is Reason.BAD_VALUE
    assert bench.ask(bench.move_message(math.pi, 0.1)) is Reason.NONE
    assert bench.finish().outcome == SwarmOutcome.ARRIVED
    assert bench.ask(bench.move_message(math.pi, 0.3)) is Reason.NONE


def test_one_that_is_pushed_outside_stops_when_it_goes_outward() -> None:
    bench = fenced()
    bench.move(0.6, 0.45)
    bench.run(1000)
    bench.x, bench.y = 0.2, 0.34
    observation = bench.finish()
    assert (observation.outcome, observation.reason) == (SwarmOutcome.STOPPED, Reason.BAD_VALUE)


@pytest.mark.parametrize(
    ("turned", "options", "stops"),
    [
        (math.pi, MoveOption(0), True),
        (2.0, MoveOption(0), True),
        (-2.0, MoveOption(0), True),
        (1.0, MoveOption(0), False),
        (math.pi, MoveOption.BACKWARD, True),
        (0.0, MoveOption.BACKWARD, False),
    ],
)
def test_one_that_is_put_outside_stops_when_it_was_turned_outward(turned: float, options: MoveOption, *, stops: bool) -> None:
    bench = fenced(0.08, FENCE_X=0.1)
    bench.move(math.pi, 0.15, options=options)
    bench.run(400 if options else 900)  # backward it need not turn first
    bench.x, bench.y, bench.angle = 0.12, 0.0, bench.angle + turned
    observation = bench.finish()
    ended = (SwarmOutcome.STOPPED, Reason.BAD_VALUE) if stops else (SwarmOutcome.ARRIVED, Reason.NONE)
    assert (observation.outcome, observation.reason) == ended
    assert bench.x < (0.13 if stops else 0.0)


def test_with_a_fence_and_no_fix_it_only_turns() -> None:
    bench = MicroBench(own_fix=0).armed()
    bench.set(FENCE_X=0.5, FENCE_Y=0.5)
    assert bench.ask(bench.move_message(0.0, 0.1)) is Reason.NOT_FOUND
    assert bench.ask(bench.move_message(1.0, 0.0)) is Reason.NONE
    assert bench.finish().outcome == SwarmOutcome.ARRIVED
    bench.tick(bench.fix_message(0.0, 0.0, 1.0))
    bench.move(1.0, 0.4, speed=0.1)
    observation = bench.finish()
    assert (observation.outcome, observation.reason) == (SwarmOutcome.REFUSED, Reason.NOT_FOUND)
    assert 0.05 < observation.travelled < 0.12
