"""Maneuvers are timed on board, counted to the tick, and reported until somebody has heard."""

from __future__ import annotations

import pytest
from firmware_bench import HOST, SESSION, TICK, FirmwareBench, forge

from firmware_protocol.messages import (
    JuniorManeuverResult,
    ManeuverOption,
    ParamSet,
    Reason,
    RobotResultAck,
    RobotStatus,
    State,
)
from firmware_protocol.vocabulary import ACTIONS, Action, Outcome, Speed, Stimulus

EFFORT = {Speed.NONE: 0, Speed.FAST: 1000, Speed.MODERATE: 700, Speed.SLOW: 400, Speed.TURN: 350}


@pytest.mark.parametrize("action", list(Action))
def test_every_action_turns_the_wheels_as_the_vocabulary_says(action: Action) -> None:
    bench = FirmwareBench().armed()
    bench.perform((action,), 1.0)
    spec = ACTIONS[action]
    assert bench.wheels == (spec.left * EFFORT[spec.speed], spec.right * EFFORT[spec.speed])


def test_trim_and_speed_parameters_apply() -> None:
    bench = FirmwareBench().armed()
    for name, value in (("TRIM_LEFT", 0.9), ("SPD_FAST", 0.8)):
        bench.tick(ParamSet(1, 1, name, value))
    bench.perform((Action.FF,))
    assert bench.wheels == (720, 800)


@pytest.mark.parametrize(("period", "ticks"), [(0.25, [50] * 3), (0.02, [4] * 3), (0.022, [5, 4, 5]), (0.2, [40] * 3)])
def test_each_action_lasts_its_period_and_the_whole_does_not_drift(period: float, ticks: list[int]) -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF, Action.SB, Action.LBRF), period)
    seen: list[tuple[int, int]] = []
    while bench.state() is State.PERFORMING:
        seen.append(bench.wheels)
        bench.tick(HOST)
    assert [seen.count(pair) for pair in ((1000, 1000), (-400, -400), (-350, 350))] == ticks
    assert bench.wheels == (0, 0)
    result = bench.result()
    assert list(result.samples[:3]) == ticks
    assert (result.outcome, result.reason, result.done) == (Outcome.COMPLETED, Reason.NONE, 3)


def test_eyes_are_counted_in_the_ticks_they_see() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.S, Action.S), 0.1)
    for i in range(40):
        bench.eyes(left=i < 7, right=i % 2 == 0)
        bench.tick(HOST)
    result = bench.result()
    assert result.samples[:3] == (20, 20, 0)
    assert result.eye_left[:3] == (7, 0, 0)
    assert result.eye_right[:3] == (10, 10, 0)


def test_presses_are_debounced_counted_and_measured_within_their_action() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.S, Action.S), 0.1)
    # The switch bounces, closes in ticks 3..29, then twice for a moment too short to count.
    closed = [False, True, False, *([True] * 27), False, True, False, True, False, *([False] * 5)]
    for level in closed:
        bench.io.arm[0] = level
        bench.tick(HOST)
    result = bench.result()
    # Closed from tick 3 on, it counts from tick 5 (steady for 10 ms). It opens in tick 30, but the bounces in 31 and 33
    # put the release off: steady from tick 34 on, it counts until tick 35.
    assert result.edges_left[:2] == (1, 0)
    assert result.press_left[:2] == (0.075, 0.080), "5..19 are 15 ticks; 20..35 are 16"
    assert result.edges_right[:2] == (0, 0)
    assert result.press_right[:2] == (0.0, 0.0)


def test_several_presses_in_an_action_the_longest_counts() -> None:
    bench = FirmwareBench().armed()
    bench.tick(ParamSet(1, 1, "ARM_DEBOUNCE", 0.0))
    bench.perform((Action.S,), 0.2)
    pattern = [1] * 4 + [0] * 2 + [1] * 9 + [0] * 3 + [1] * 5 + [0] * 17
    for level in pattern:
        bench.io.arm[1] = level
        bench.tick(HOST)
    result = bench.result()
    assert result.edges_right[0] == 3
    assert result.press_right[0] == pytest.approx(0.045)


def test_a_press_that_lasts_is_no_edge_of_the_next_action() -> None:
    bench = FirmwareBench().armed()
    bench.io.arm[0] = 1
    bench.run(100)
    bench.perform((Action.S, Action.S), 0.05)
    bench.run(50 * 2)
    result = bench.result()
    assert result.edges_left[:2] == (0, 0)
    assert result.press_left[:2] == (0.05, 0.05)


def test_travel_over_the_ground_counts_while_an_arm_is_pressed() -> None:
    bench = FirmwareBench().armed()
    bench.tick(ParamSet(1, 1, "ARM_DEBOUNCE", 0.0))
    bench.io.ground_um = 2**31 - 2000  # the odometer wraps on the way
    bench.run(20)
    bench.perform((Action.FF, Action.FB, Action.S), 0.1)
    ground = bench.io.ground_um
    for i in range(60):
        ground += 1200 if i < 20 else -800
        bench.io.ground_um = (ground + 2**31) % 2**32 - 2**31
        bench.io.arm[0] = 5 <= i < 15 or 30 <= i < 40
        bench.tick(HOST)
    assert bench.result().travel == (0.012, -0.008, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("jump", "counts"), [(99_000, True), (-99_000, True), (101_000, False), (-101_000, False), (2_000_000, False)]
)
def test_a_ground_sensor_that_jumps_a_decimetre_in_a_tick_is_not_believed(jump: int, *, counts: bool) -> None:
    bench = FirmwareBench().armed()
    bench.tick(ParamSet(1, 1, "ARM_DEBOUNCE", 0.0))
    bench.io.arm[0] = 1
    bench.run(20)
    bench.perform((Action.FF,), 0.1)
    for i in range(21):
        bench.io.ground_um += 1000 if i != 10 else jump
        bench.tick(HOST)
    way = bench.result().travel[0]
    assert way is not None
    assert way == pytest.approx(0.019 + (jump / 1e6 if counts else 0.0), abs=0.0011)


def test_without_a_ground_odometer_travel_says_so() -> None:
    bench = FirmwareBench(ground=False).armed()
    bench.io.arm[0] = 1
    bench.perform((Action.FF,), 0.1)
    bench.run(100)
    assert bench.result().travel == (None,) * 8


def test_a_result_is_repeated_every_100_ms_until_it_is_acknowledged() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 0.1)
    bench.run(100)
    assert len(bench.got(JuniorManeuverResult)) == 1
    bench.run(300)
    assert len(bench.got(JuniorManeuverResult)) == 4
    bench.tick(RobotResultAck(SESSION, bench.sequence + 1, 1, 1))
    bench.run(100)
    assert len(bench.got(JuniorManeuverResult)) == 5, "that was for another one"
    bench.tick(RobotResultAck(SESSION, bench.sequence, 1, 1))
    bench.run(500)
    assert len(bench.got(JuniorManeuverResult)) == 5


def test_a_new_maneuver_replaces_the_old_and_supersedes_its_result() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,) * 4)
    bench.run(300)
    bench.clear()
    bench.perform((Action.SB,))
    assert bench.wheels == (-400, -400)
    (replaced,) = bench.got(JuniorManeuverResult)
    assert (replaced.sequence, replaced.outcome, replaced.done) == (1, Outcome.REPLACED, 1)
    assert replaced.samples[:3] == (50, 11, 0), "the tick in which the next one arrives is still its own"
    bench.run(250)
    assert [message.sequence for message in bench.got(JuniorManeuverResult)] == [1, 2]


def test_ends_when_the_stimulus_has_changed_for_20_ms_but_not_on_a_flicker() -> None:
    options = ManeuverOption.END_ON_CHANGE | ManeuverOption.EYES
    bench = FirmwareBench().armed()
    bench.eyes(left=True, right=False)
    bench.run(20)
    bench.perform((Action.FF,), 1.0, options)
    bench.eyes(left=True, right=True)
    bench.run(20)
    bench.eyes(left=True, right=False)
    bench.run(50)
    assert bench.state() is State.PERFORMING
    bench.eyes(left=False, right=False)
    bench.run(20)
    assert bench.state() is State.PERFORMING
    bench.tick(HOST)
    assert bench.state() is State.READY
    assert bench.wheels == (0, 0)
    result = bench.result()
    assert (result.outcome, result.done) == (Outcome.STIMULUS_CHANGED, 0)
    assert (result.stimulus_before, result.stimulus_after) == (Stimulus.EYE_LEFT, Stimulus.NONE)
    assert sum(result.samples) * TICK == 20 + 50 + 20 + TICK


@pytest.mark.parametrize(
    ("options", "ends"),
    [(ManeuverOption.EYES, False), (ManeuverOption.ARMS, True), (ManeuverOption.ARMS | 4, True), (0, False)],
)
def test_only_what_counts_as_the_stimulus_ends_it(options: int, ends: bool) -> None:  # noqa: FBT001
    bench = FirmwareBench().armed()
    bench.perform((Action.S,), 1.0, options | ManeuverOption.END_ON_CHANGE)
    bench.io.arm[1] = 1
    bench.run(100)
    assert (bench.state() is State.READY) is ends


def reflex(left: bool, right: bool) -> tuple[FirmwareBench, list[tuple[int, int]]]:  # noqa: FBT001
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 1.0, ManeuverOption.FLOOR_REFLEX | ManeuverOption.EYES)
    bench.run(100)
    bench.floor(left=left, right=right)
    seen: list[tuple[int, int]] = []
    while True:
        bench.tick(HOST)
        if bench.state() is not State.PERFORMING:
            return bench, seen
        bench.floor(left=False, right=False)
        seen.append(bench.wheels)


@pytest.mark.parametrize(
    ("left", "right", "turn"), [(True, False, (350, -350)), (False, True, (-350, 350)), (True, True, (350, -350))]
)
def test_the_floor_reflex_backs_off_and_turns_away(left: bool, right: bool, turn: tuple[int, int]) -> None:  # noqa: FBT001
    bench, seen = reflex(left, right)
    assert seen == [(-700, -700)] * 50 + [turn] * 70
    assert bench.wheels == (0, 0)
    result = bench.result()
    assert (result.outcome, result.done, result.samples[:2]) == (Outcome.FLOOR_REFLEX, 0, (21, 0))


def test_without_the_option_the_border_is_crossed() -> None:
    bench = FirmwareBench().armed()
    bench.floor(left=True, right=True)
    bench.perform((Action.FF,), 0.1)
    bench.run(100)
    assert bench.result().outcome == Outcome.COMPLETED


def test_a_reflex_of_no_length_just_ends_the_maneuver() -> None:
    bench = FirmwareBench().armed()
    for name in ("REFLEX_BACK", "REFLEX_TURN"):
        bench.tick(ParamSet(1, 1, name, 0.0))
    bench.floor(left=True, right=False)
    bench.perform((Action.FF,), 1.0, ManeuverOption.FLOOR_REFLEX)
    bench.tick(HOST)
    assert bench.state() is State.READY
    assert bench.wheels == (0, 0)


def test_a_light_floor_can_be_the_ring() -> None:
    bench = FirmwareBench().armed()
    bench.tick(ParamSet(1, 1, "FLOOR_INVERT", 1.0))
    bench.floor(left=True, right=True)
    bench.run(20)
    bench.perform((Action.FF,), 1.0, ManeuverOption.FLOOR_REFLEX)
    bench.tick(HOST)
    assert bench.wheels == (1000, 1000)
    bench.floor(left=True, right=False)
    bench.tick(HOST)
    assert bench.wheels == (-700, -700)


@pytest.mark.parametrize(
    "changes",
    [
        {"count": 0}, {"count": 9}, {"period": 0.019}, {"period": 5.001}, {"options": 32},
        {"actions": (17, 0, 0, 0, 0, 0, 0, 0)}, {"actions": (1, 0, 0, 0, 0, 0, 0, 255)},
    ],
    ids=str,
)  # fmt: skip
def test_what_cannot_be_performed_is_refused_and_does_not_move(changes: dict[str, object]) -> None:
    bench = FirmwareBench().armed()
    bench.tick(raw=forge(bench.maneuver_message((Action.FF,)), **changes))
    ack = bench.sent[-1]
    assert getattr(ack, "reason", None) == Reason.BAD_VALUE
    assert bench.wheels == (0, 0)
    assert bench.state() is State.READY
    bench.run(1000)
    assert bench.latest(RobotStatus).maneuvers == 0


def holding(options: int = 0, **parameters: float) -> FirmwareBench:
    """A robot whose maneuver is just over."""
    bench = FirmwareBench().armed()
    for name, value in parameters.items():
        bench.tick(ParamSet(1, 1, name, value))
    bench.perform((Action.FF, Action.SF), 0.1, ManeuverOption.HOLD | options)
    bench.run(195)
    assert bench.wheels == (400, 400)
    bench.tick(HOST)
    return bench


def test_the_last_action_goes_on_for_the_time_set() -> None:
    bench = holding()
    result = bench.result()
    assert (result.outcome, result.done, result.samples[:3]) == (Outcome.COMPLETED, 2, (20, 20, 0))
    for _ in range(20):
        assert (bench.state(), bench.wheels) == (State.DRIVING, (400, 400))
        bench.tick(HOST)
    assert (bench.state(), bench.wheels) == (State.READY, (0, 0))
    assert bench.result() == result, "what was held is no part of what was performed"


@pytest.mark.parametrize(("milliseconds", "ticks"), [(0.0, 0), (250.0, 50)])
def test_how_long_is_a_parameter(milliseconds: float, ticks: int) -> None:
    bench = holding(MAN_HOLD=milliseconds)
    held = 0
    while bench.wheels != (0, 0):
        held += 1
        bench.tick(HOST)
    assert held == ticks
    assert bench.state() is State.READY


def test_the_next_maneuver_follows_without_a_halt() -> None:
    bench = holding()
    bench.tick(HOST)
    bench.perform((Action.FB,), 0.1)
    assert (bench.state(), bench.wheels) == (State.PERFORMING, (-1000, -1000))
    assert [result.outcome for result in bench.got(JuniorManeuverResult)] == [Outcome.COMPLETED], "nothing was replaced"
    bench.run(100)
    assert (bench.state(), bench.wheels) == (State.READY, (0, 0))
    assert bench.result().outcome == Outcome.COMPLETED


def test_a_maneuver_ended_by_a_change_is_held_too() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 1.0, ManeuverOption.END_ON_CHANGE | ManeuverOption.EYES | ManeuverOption.HOLD)
    bench.eyes(left=True, right=True)
    bench.run(30)
    assert bench.result().outcome == Outcome.STIMULUS_CHANGED
    assert (bench.state(), bench.wheels) == (State.DRIVING, (1000, 1000))


def test_after_the_floor_reflex_nothing_is_held() -> None:
    bench = FirmwareBench().armed()
    for name in ("REFLEX_BACK", "REFLEX_TURN"):
        bench.tick(ParamSet(1, 1, name, 50.0))
    bench.perform((Action.FF,), 1.0, ManeuverOption.FLOOR_REFLEX | ManeuverOption.HOLD)
    bench.floor(left=True, right=False)
    bench.run(110)
    assert bench.result().outcome == Outcome.FLOOR_REFLEX
    assert (bench.state(), bench.wheels) == (State.READY, (0, 0))


def test_the_border_ends_what_is_held_where_the_reflex_was_asked_for() -> None:
    for options, wheels in ((ManeuverOption.FLOOR_REFLEX, (0, 0)), (0, (400, 400))):
        bench = holding(options)
        bench.floor(left=False, right=True)
        bench.tick(HOST)
        assert bench.wheels == wheels


def test_who_drives_is_not_stopped_by_the_border() -> None:
    bench = holding(ManeuverOption.FLOOR_REFLEX)
    assert bench.ask(bench.wheels_message(0.5, 0.5, 1.0)) is Reason.NONE
    bench.floor(left=True, right=True)
    bench.run(200)
    assert bench.wheels == (500, 500)


def test_stop_disarm_and_emergency_stop_end_it_at_once() -> None:
    for end in (FirmwareBench.disarm, FirmwareBench.stop, lambda bench: bench.ask(bench.wheels_message(0.0, 0.0, 0.0))):
        bench = holding(MAN_HOLD=250.0)
        end(bench)
        assert bench.wheels == (0, 0)


def test_the_watchdog_ends_it() -> None:
    bench = FirmwareBench().armed()
    for name, value in (("MAN_HOLD", 250.0), ("WATCHDOG", 100.0)):
        bench.tick(ParamSet(1, 1, name, value))
    bench.perform((Action.FF,), 0.05, ManeuverOption.HOLD)
    bench.run(95, alive=False)
    assert (bench.state(), bench.wheels) == (State.DRIVING, (1000, 1000))
    bench.run(5, alive=False)
    assert (bench.state(), bench.wheels) == (State.READY, (0, 0))


def test_maneuvers_are_counted() -> None:
    bench = FirmwareBench().armed()
    for _ in range(3):
        bench.perform((Action.S,), 0.05)
        bench.run(1000)
    assert bench.latest(RobotStatus).maneuvers == 3
