"""The micro-robot's move controller: where a move ends, what ends it, and what is refused."""

from __future__ import annotations

import math

import pytest
from firmware_bench import TICK, forge
from micro_bench import SENSE, MicroBench

from firmware_protocol.messages import (
    Command,
    CommandLong,
    ManualControl,
    Reason,
    RobotAck,
    RobotStatus,
    State,
    SwarmMove,
    SwarmObservation,
)
from firmware_protocol.vocabulary import MoveOption, ObservationFlag, SwarmOutcome

STOP_ON_CONTACT = int(MoveOption.STOP_ON_CONTACT)
NOSE = 0b1000_0001
"""Sectors 1 and 8."""


@pytest.fixture
def bench() -> MicroBench:
    return MicroBench().armed()


def off(bench: MicroBench, heading: float) -> float:
    """How far the robot's nose is from a heading."""
    return abs(math.remainder(bench.angle - heading, math.tau))


@pytest.mark.parametrize("heading", [-3.1, -1.7, -0.5, 0.0, 0.02, 1.2, 2.9])
@pytest.mark.parametrize("distance", [0.0, 0.03, 0.25])
def test_it_arrives(bench: MicroBench, heading: float, distance: float) -> None:
    bench.move(heading, distance)
    assert bench.state() is State.PERFORMING
    observation = bench.finish()
    assert (observation.outcome, observation.reason) == (SwarmOutcome.ARRIVED, Reason.NONE)
    assert bench.state() is State.READY
    assert bench.wheels == (0, 0)
    bench.run(200)
    assert math.dist((bench.x, bench.y), (distance * math.cos(heading), distance * math.sin(heading))) < 0.004
    assert off(bench, heading) < 0.05
    assert observation.travelled == pytest.approx(distance, abs=0.0025)


def test_it_turns_to_face_something_in_the_end(bench: MicroBench) -> None:
    bench.move(0.5, 0.1, face=-2.0)
    bench.finish()
    assert off(bench, -2.0) < 0.05
    assert math.hypot(bench.x, bench.y) == pytest.approx(0.1, abs=0.004)


def test_a_heading_may_be_the_bodys(bench: MicroBench) -> None:
    bench.move(1.0, 0.05)
    bench.finish()
    bench.move(0.5, 0.05, options=MoveOption.BODY)
    bench.finish()
    assert off(bench, 1.5) < 0.1


@pytest.mark.parametrize(("sector", "sectors"), [(1, 8), (8, 8), (3, 5), (1, 1), (16, 16)])
def test_a_sector_is_the_bodys_and_its_bisector_is_the_way(bench: MicroBench, sector: int, sectors: int) -> None:
    bench.move(1.0, 0.0)
    bench.finish()
    bench.move(None, 0.2, sector=sector, sectors=sectors)
    bench.finish()
    assert off(bench, 1.0 + (sector - 0.5) * math.tau / sectors) < 0.07


def test_backward_its_tail_goes_ahead(bench: MicroBench) -> None:
    bench.move(2.0, 0.1, options=MoveOption.BACKWARD)
    bench.finish()
    assert off(bench, 2.0 - math.pi) < 0.05
    assert math.dist((bench.x, bench.y), (0.1 * math.cos(2.0), 0.1 * math.sin(2.0))) < 0.004


def test_speed_is_what_was_said_or_the_parameter(bench: MicroBench) -> None:
    def took(speed: float) -> int:
        before = bench.now
        bench.move(0.0, 0.2, speed=speed)
        bench.finish()
        return bench.now - before

    slow, usual = took(0.05), took(0.0)
    assert 4000 < slow < 4600
    assert 1000 < usual < 1300
    bench.set(MOVE_SPEED=0.05)
    assert abs(took(0.0) - slow) <= 50


def test_no_wheel_is_commanded_more_than_it_can(bench: MicroBench) -> None:
    bench.set(TURN_SPEED=31.0)
    bench.move(3.0, 0.3, speed=60.0)
    greatest = 0
    for _ in range(200):
        bench.run(TICK)
        greatest = max(greatest, *map(abs, bench.wheels))
    assert greatest == 1000


def test_the_fix_leads_it_where_wheels_slip(bench: MicroBench) -> None:
    bench.io.track_um = 31000  # the bench's is 30 mm
    bench.power_on(bench.nvm)
    bench.armed()
    bench.move(1.5, 0.4)
    bench.finish()
    assert math.dist((bench.x, bench.y), (0.4 * math.cos(1.5), 0.4 * math.sin(1.5))) < 0.006


def test_effort_limits_the_force_while_it_moves(bench: MicroBench) -> None:
    assert bench.io.force == 100
    bench.move(0.0, 0.05, effort=40)
    bench.run(50)
    assert bench.io.force == 40
    bench.finish()
    bench.run(TICK)
    assert bench.io.force == 100
    bench.move(0.0, 0.05)
    bench.run(50)
    assert bench.io.force == 100


# --- what ends it ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bumps", [0b1000_0000, 0b0000_0001, NOSE])
def test_contact_ahead_blocks_it(bench: MicroBench, bumps: int) -> None:
    bench.move(0.0, 0.3, options=STOP_ON_CONTACT)
    bench.run(500)
    bench.io.bump = bumps
    observation = bench.finish()
    assert observation.outcome == SwarmOutcome.BLOCKED
    assert observation.flags & ObservationFlag.CONTACT_AHEAD
    assert observation.flags & ObservationFlag.CONTACT
    assert 0.05 < observation.travelled < 0.15


def test_contact_that_is_there_when_the_drive_starts_blocks_it(bench: MicroBench) -> None:
    bench.io.bump = NOSE
    bench.move(0.0, 0.3, options=STOP_ON_CONTACT)
    assert bench.finish().outcome == SwarmOutcome.BLOCKED
    assert math.hypot(bench.x, bench.y) < 0.001


@pytest.mark.parametrize("bumps", [0b0100_0000, 0b0010_0000, 0b0000_1000, 0b0000_0010])
def test_contact_elsewhere_does_not(bench: MicroBench, bumps: int) -> None:
    bench.io.bump = bumps
    bench.move(0.0, 0.1, options=STOP_ON_CONTACT)
    observation = bench.finish()
    assert observation.outcome == SwarmOutcome.ARRIVED
    assert not observation.flags & ObservationFlag.CONTACT_AHEAD
    assert observation.flags & ObservationFlag.CONTACT


def test_backward_the_tail_is_ahead(bench: MicroBench) -> None:
    bench.io.bump = NOSE
    bench.move(math.pi, 0.1, options=STOP_ON_CONTACT | MoveOption.BACKWARD)
    assert bench.finish().outcome == SwarmOutcome.ARRIVED
    bench.io.bump = 0b0001_0000
    bench.move(math.pi, 0.1, options=STOP_ON_CONTACT | MoveOption.BACKWARD)
    assert bench.finish().outcome == SwarmOutcome.BLOCKED


@pytest.mark.parametrize("options", [0, MoveOption.PUSH, MoveOption.PUSH | MoveOption.STOP_ON_CONTACT])
def test_without_the_option_or_with_push_contact_does_not_end_it(bench: MicroBench, options: int) -> None:
    bench.io.bump = NOSE
    bench.move(0.0, 0.1, options=options)
    assert bench.finish().outcome == SwarmOutcome.ARRIVED


def test_wheels_that_stand_are_blocked_after_the_time_for_it(bench: MicroBench) -> None:
    bench.set(STALL_TIME=0.3)
    bench.move(0.0, 0.3, options=STOP_ON_CONTACT)
    bench.run(400)
    bench.held = True
    since = bench.now
    assert bench.finish().outcome == SwarmOutcome.BLOCKED
    assert 300 <= bench.now - since <= 310


def test_wheels_that_stand_when_the_drive_starts_are_given_the_time(bench: MicroBench) -> None:
    bench.run(1000)
    bench.held = True
    bench.move(0.0, 0.3, options=STOP_ON_CONTACT)
    since = bench.now
    assert bench.finish().outcome == SwarmOutcome.BLOCKED
    assert 95 <= bench.now - since <= 110


@pytest.mark.parametrize(("options", "times"), [(0, 2), (MoveOption.PUSH, 3)])
def test_it_times_out(bench: MicroBench, options: int, times: int) -> None:
    bench.held = True
    bench.move(1.0, 0.2, face=0.0, options=options)
    since = bench.now
    assert bench.finish(20_000).outcome == SwarmOutcome.TIMED_OUT
    planned = 0.2 / 0.2 + 2 * 1.0 / 6.28
    assert (bench.now - since) / 1000 == pytest.approx(times * planned + 1, abs=0.02)
    assert bench.state() is State.READY


def test_another_move_replaces_it_at_once(bench: MicroBench) -> None:
    bench.move(0.0, 0.3)
    bench.run(300)
    answers = bench.tick(bench.move_message(2.0, 0.1))
    replaced, ack = answers
    assert isinstance(replaced, SwarmObservation)
    assert (replaced.sequence, replaced.outcome, replaced.reason) == (1, SwarmOutcome.REPLACED, Reason.BY_COMMAND)
    assert replaced.flags & ObservationFlag.RING_NOT_READ
    assert isinstance(ack, RobotAck)
    assert bench.state() is State.PERFORMING
    observation = bench.finish()
    assert (observation.sequence, observation.outcome) == (2, SwarmOutcome.ARRIVED)
    assert [o.sequence for o in bench.observations()] == [2], "nobody waits for the other any more"


def test_one_that_is_only_sensing_has_arrived_when_it_is_replaced(bench: MicroBench) -> None:
    bench.io.ready = 0
    bench.move(0.0, 0.0)
    bench.run(50)
    old, _ = bench.tick(bench.move_message(1.0, 0.0, options=0))
    assert isinstance(old, SwarmObservation)
    assert old.outcome == SwarmOutcome.ARRIVED
    assert old.flags & ObservationFlag.RING_NOT_READ


def test_a_refused_move_replaces_nothing(bench: MicroBench) -> None:
    bench.move(0.0, 0.1)
    assert bench.ask(bench.move_message(None, 0.1)) is Reason.BAD_VALUE
    assert bench.finish().sequence == 1


@pytest.mark.parametrize(
    ("command", "reason", "state"),
    [
        (Command.ARM_DISARM, Reason.DISARMED, State.DISARMED),
        (Command.FLIGHT_TERMINATION, Reason.EMERGENCY_STOP, State.STOPPED),
    ],
)
def test_disarming_and_the_emergency_stop_stop_it(bench: MicroBench, command: Command, reason: Reason, state: State) -> None:
    bench.move(0.0, 0.3)
    bench.run(300)
    bench.clear()
    bench.command(command, float(command is Command.FLIGHT_TERMINATION))
    assert bench.wheels == (0, 0)
    observation = bench.finish()
    assert (observation.outcome, observation.reason) == (SwarmOutcome.STOPPED, reason)
    assert not observation.flags & ObservationFlag.RING_NOT_READ
    assert bench.state() is state


def test_it_stops_when_its_keeper_is_lost_in_mid_move(bench: MicroBench) -> None:
    bench.move(0.0, 5.0)
    bench.run(300)
    bench.clear()
    bench.run(255, alive=False)
    assert bench.wheels == (0, 0)
    assert bench.state() is State.READY
    observation = bench.finish()
    assert (observation.outcome, observation.reason) == (SwarmOutcome.STOPPED, Reason.WATCHDOG)


def test_a_new_session_stops_it_and_nobody_is_told(bench: MicroBench) -> None:
    bench.move(0.0, 0.3)
    bench.run(300)
    bench.clear()
    bench.open(bench.session + 1)
    assert bench.state() is State.DISARMED
    bench.run(2000)
    assert not list(bench.observations())


def test_what_has_ended_is_told_before_the_next_command_is_answered(bench: MicroBench) -> None:
    bench.move(0.0, 0.3)
    bench.run(300)
    bench.disarm()
    bench.clear()
    observation, ack = bench.tick(bench.move_message(0.0, 0.1))
    assert isinstance(observation, SwarmObservation)
    assert (observation.sequence, observation.outcome) == (1, SwarmOutcome.STOPPED)
    assert isinstance(ack, RobotAck)
    assert ack.reason == Reason.DISARMED
    bench.run(1000)
    assert list(bench.observations()) == [observation]


# --- said twice -----------------------------------------------------------------------------------------------------


def test_a_move_said_twice_is_done_once_and_answered_twice(bench: MicroBench) -> None:
    message = bench.move_message(0.0, 0.1)
    assert bench.ask(message) is Reason.NONE
    bench.run(100)
    assert bench.ask(message) is Reason.NONE
    first = bench.finish()
    bench.acknowledge(first)
    x = bench.x
    bench.clear()
    bench.tick(message)
    again = bench.latest(SwarmObservation)
    assert again == first
    bench.run(500)
    assert bench.x == pytest.approx(x, abs=0.002)
    bench.command(Command.REQUEST_MESSAGE, RobotStatus.ID)
    assert bench.latest(RobotStatus).maneuvers == 1


def test_a_refused_move_said_twice_is_refused_twice(bench: MicroBench) -> None:
    message = bench.move_message(None, 0.1)
    assert bench.ask(message) is Reason.BAD_VALUE
    assert bench.ask(message) is Reason.BAD_VALUE
    assert not list(bench.observations())


# --- refused --------------------------------------------------------------------------------------------------------


def test_disarmed_it_moves_nowhere() -> None:
    bench = MicroBench()
    bench.open()
    assert bench.ask(bench.move_message(0.0, 0.1)) is Reason.DISARMED
    bench.run(300)
    assert bench.wheels == (0, 0)
    assert not list(bench.observations())


def test_stopped_it_moves_nowhere(bench: MicroBench) -> None:
    bench.stop()
    assert bench.ask(bench.move_message(0.0, 0.1)) is Reason.EMERGENCY_STOP


@pytest.mark.parametrize(
    "changes",
    [
        {"distance": 60.001},
        {"heading": -3.2768, "sector": 0},
        {"sector": 1, "sectors": 0},
        {"sector": 9, "sectors": 8},
        {"sectors": 17},
        {"effort": 101},
        {"options": 64},
        {"options": 128},
    ],
)
def test_what_makes_no_sense_is_refused(bench: MicroBench, changes: dict[str, float]) -> None:
    before = bench.move_message(0.0, 0.1)
    (ack,) = [answer for answer in bench.tick(raw=forge(before, **{"face": 0.0, **changes})) if isinstance(answer, RobotAck)]
    assert (ack.message, ack.reason) == (SwarmMove.ID, Reason.BAD_VALUE)
    assert bench.state() is State.READY


def test_what_is_said_to_all_moves_nobody(bench: MicroBench) -> None:
    message = bench.move_message(0.0, 0.1)
    assert bench.tick(raw=forge(message, target_system=0, face=0.0)) == []
    assert bench.state() is State.READY


# --- by hand --------------------------------------------------------------------------------------------------------


def test_a_ground_station_drives_it() -> None:
    bench = MicroBench()
    bench.arm()
    bench.tick(ManualControl(x=500, y=0, z=0, r=200, target=1, buttons=0))
    assert bench.wheels == (700, 300)
    assert bench.state() is State.DRIVING
    bench.run(300, alive=False)
    assert bench.wheels == (0, 0)


def test_a_wheel_may_be_made_to_fail(bench: MicroBench) -> None:
    bench.set(FAIL_ENABLE=1)
    motor, off = 101, 1
    bench.tick(CommandLong(1, 1, command=int(Command.INJECT_FAILURE), param1=motor, param2=off, param3=1))
    bench.move(0.0, 0.3, options=SENSE)
    bench.run(100)
    assert bench.wheels[0] == 0
    assert bench.wheels[1] != 0
