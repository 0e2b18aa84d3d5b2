"""Autonomous play from memory, with no host at all."""

from __future__ import annotations

import pytest
from firmware_bench import FirmwareBench

from firmware_protocol.messages import (
    Command,
    ContestCommand,
    JuniorManeuverResult,
    ManeuverOption,
    ParamSet,
    Reason,
    RobotStatus,
    State,
)
from firmware_protocol.vocabulary import ANY_STIMULUS, Action, Stimulus

LEFT_AND_ARM = Stimulus.EYE_LEFT | Stimulus.ARM_LEFT


def taught(*entries: tuple[int, int, Action], options: int = ManeuverOption.EYES, period: float = 0.1) -> FirmwareBench:
    """A robot that knows (previous, current) -> action; armed."""
    bench = FirmwareBench().armed()
    for previous, current, action in entries:
        message = bench.write_message((action,), current, previous, period=period, options=options)
        assert bench.ask(message) is Reason.NONE
    return bench


def start(bench: FirmwareBench, countdown: float = 0.0) -> None:
    assert bench.ask(bench.contest_message(ContestCommand.START, countdown)) is Reason.NONE


@pytest.mark.parametrize("countdown", [0.0, 0.005, 5.0, 60.0])
def test_it_stands_still_until_the_countdown_is_over(countdown: float) -> None:
    bench = taught((ANY_STIMULUS, 0, Action.FF))
    start(bench, countdown)
    for _ in range(max(round(countdown / 0.005) - 1, 0)):
        bench.tick()
        assert bench.wheels == (0, 0)
        assert bench.state() is State.COUNTDOWN
    bench.tick()
    assert bench.state() is State.CONTEST
    assert bench.wheels == (1000, 1000)


@pytest.mark.parametrize("options", [0, ManeuverOption.HOLD])
def test_it_plays_on_without_a_gap_between_maneuvers(options: int) -> None:
    bench = taught((ANY_STIMULUS, 0, Action.FF), (ANY_STIMULUS, 1, Action.SB), options=options)
    start(bench)
    seen = []
    for i in range(100):
        bench.eyes(left=30 <= i < 61, right=False)
        bench.tick()
        seen.append(bench.wheels)
    assert seen == [(1000, 1000)] * 40 + [(-400, -400)] * 40 + [(1000, 1000)] * 20
    assert not bench.got(JuniorManeuverResult), "nobody asked for it"


def test_what_is_remembered_of_the_pair_comes_first_then_of_the_stimulus() -> None:
    bench = taught((ANY_STIMULUS, 1, Action.SF), (1, 1, Action.FF), (0, 1, Action.SB))
    bench.eyes(left=True, right=False)
    start(bench)
    bench.tick()
    assert bench.wheels == (-400, -400), "previous: none"
    bench.run(100, alive=False)
    assert bench.wheels == (1000, 1000), "previous: left"
    bench.eyes(left=False, right=True)
    bench.run(150, alive=False)
    assert bench.wheels == (-350, 350), "nothing is remembered of right"
    bench.eyes(left=True, right=False)
    bench.run(30, alive=False)
    assert bench.wheels == (400, 400), "previous: right; of that pair nothing is remembered, but of left"


@pytest.mark.parametrize(("counts", "wheels"), [(0.0, (400, 400)), (1.0, (1000, 1000))])
def test_arms_count_as_the_parameter_says(counts: float, wheels: tuple[int, int]) -> None:
    bench = taught((ANY_STIMULUS, LEFT_AND_ARM, Action.FF), (ANY_STIMULUS, Stimulus.EYE_LEFT, Action.SF))
    bench.tick(ParamSet(1, 1, "STIM_ARMS", counts))
    bench.eyes(left=True, right=False)
    bench.io.arm[0] = 1
    bench.run(50)
    start(bench)
    bench.tick()
    assert bench.wheels == wheels


def test_what_is_not_known_with_arms_is_looked_up_without_them() -> None:
    bench = taught((ANY_STIMULUS, Stimulus.EYE_LEFT, Action.SF))
    bench.tick(ParamSet(1, 1, "STIM_ARMS", 1.0))
    bench.eyes(left=True, right=False)
    bench.io.arm[1] = 1
    bench.run(50)
    start(bench)
    bench.tick()
    assert bench.wheels == (400, 400)


def test_it_looks_around_where_it_remembers_nothing_and_stops_looking_when_it_sees() -> None:
    bench = taught((ANY_STIMULUS, 3, Action.FF))
    start(bench)
    bench.tick()
    assert bench.wheels == (-350, 350)
    bench.run(1000, alive=False)
    assert bench.wheels == (-350, 350)
    bench.eyes(left=True, right=True)
    bench.run(25, alive=False)
    assert bench.wheels == (1000, 1000)


def test_the_floor_reflex_is_on_whatever_the_maneuver_says() -> None:
    bench = taught((ANY_STIMULUS, 0, Action.FF), options=0)
    start(bench)
    bench.tick()
    bench.floor(left=True, right=False)
    bench.tick()
    assert bench.wheels == (-700, -700)
    bench.floor(left=False, right=False)
    bench.run(250, alive=False)
    assert bench.wheels == (350, -350)
    bench.run(350, alive=False)
    assert bench.wheels == (1000, 1000)
    assert bench.state() is State.CONTEST


def test_it_ends_after_its_time() -> None:
    bench = taught((ANY_STIMULUS, 0, Action.FF))
    bench.tick(ParamSet(1, 1, "CONTEST_MAX", 2.0))
    start(bench, 1.0)
    bench.run(2995, alive=False)
    assert bench.state() is State.CONTEST
    bench.tick()
    assert bench.state() is State.READY
    assert bench.wheels == (0, 0)


def test_it_never_ends_when_told_so() -> None:
    bench = taught((ANY_STIMULUS, 0, Action.FF))
    bench.tick(ParamSet(1, 1, "CONTEST_MAX", 0.0))
    start(bench)
    bench.run(400_000, alive=False)
    assert bench.state() is State.CONTEST


@pytest.mark.parametrize(("before", "after"), [(0.0, 3.0), (3.0, 2.0), (2.0, 3.0)])
def test_its_time_counts_from_its_beginning_when_it_is_changed_meanwhile(before: float, after: float) -> None:
    bench = taught((ANY_STIMULUS, 0, Action.FF))
    bench.tick(ParamSet(1, 1, "CONTEST_MAX", before))
    start(bench, 1.0)
    bench.run(1995, alive=False)
    bench.tick(ParamSet(1, 1, "CONTEST_MAX", after))
    bench.run(round(after * 1000) - 1005, alive=False)
    assert bench.state() is State.CONTEST
    bench.tick()
    assert bench.state() is State.READY


@pytest.mark.parametrize(
    ("command", "param", "state"),
    [(Command.ARM_DISARM, 0.0, State.DISARMED), (Command.FLIGHT_TERMINATION, 1.0, State.STOPPED)],
)
@pytest.mark.parametrize("countdown", [0.0, 5.0])
def test_it_is_stopped_at_once(command: Command, param: float, state: State, countdown: float) -> None:
    bench = taught((ANY_STIMULUS, 0, Action.FF))
    start(bench, countdown)
    bench.run(100)
    bench.command(command, param)
    assert bench.state() is state
    assert bench.wheels == (0, 0)
    bench.run(6000, alive=False)
    assert bench.wheels == (0, 0)


def test_an_empty_memory_has_nothing_to_play() -> None:
    bench = FirmwareBench().armed()
    assert bench.ask(bench.contest_message(ContestCommand.START)) is Reason.NOT_FOUND
    assert bench.state() is State.READY


def test_the_start_module_plays_with_no_host_at_all() -> None:
    nvm = taught((ANY_STIMULUS, 0, Action.FF)).nvm
    bench = FirmwareBench(nvm)
    bench.run(1000, alive=False)
    bench.io.start = 1
    bench.tick()
    assert bench.state() is State.COUNTDOWN
    bench.run(4995, alive=False)
    assert bench.wheels == (0, 0)
    bench.tick()
    assert bench.wheels == (1000, 1000)
    bench.run(10_000, alive=False)
    assert bench.state() is State.CONTEST
    bench.io.start = 0
    bench.tick()
    assert bench.state() is State.DISARMED
    assert bench.wheels == (0, 0)


def test_the_start_module_switched_off_disarms_also_when_the_contest_was_over() -> None:
    bench = taught((ANY_STIMULUS, 0, Action.FF))
    bench.tick(ParamSet(1, 1, "CONTEST_MAX", 1.0))
    bench = FirmwareBench(bench.nvm)
    bench.io.start = 1
    bench.run(7000, alive=False)
    assert bench.state() is State.READY
    bench.io.start = 0
    bench.tick()
    assert bench.state() is State.DISARMED


def test_the_start_module_does_not_end_an_emergency_stop() -> None:
    bench = taught((ANY_STIMULUS, 0, Action.FF))
    bench.io.start = 1
    bench.run(6000)
    bench.stop()
    for signal in (0, 1, 0, 1):
        bench.io.start = signal
        bench.run(6000)
        assert bench.state() is State.STOPPED
        assert bench.wheels == (0, 0)


def test_the_start_module_being_on_at_power_on_is_no_start() -> None:
    nvm = taught((ANY_STIMULUS, 0, Action.FF)).nvm
    bench = FirmwareBench(nvm, start=True)
    bench.run(10_000, alive=False)
    assert bench.state() is State.DISARMED


@pytest.mark.parametrize("stopped", [True, False])
def test_the_start_module_does_not_start_what_must_not_move(stopped: bool) -> None:  # noqa: FBT001
    bench = taught((ANY_STIMULUS, 0, Action.FF)) if stopped else FirmwareBench()
    if stopped:
        bench.stop()
    bench.io.start = 1
    bench.run(10_000)
    assert bench.state() is (State.STOPPED if stopped else State.DISARMED)


def test_maneuvers_of_a_contest_are_counted() -> None:
    bench = taught((ANY_STIMULUS, 0, Action.S))
    start(bench)
    bench.run(995, alive=False)
    bench.command(Command.REQUEST_MESSAGE, RobotStatus.ID)
    assert bench.latest(RobotStatus).maneuvers == 10


def test_a_contest_remembers_nothing_of_the_one_before() -> None:
    bench = taught((ANY_STIMULUS, 1, Action.SF), (1, 1, Action.FF), (0, 1, Action.SB))
    bench.eyes(left=True, right=False)
    for _ in range(2):
        start(bench)
        bench.tick()
        assert bench.wheels == (-400, -400), "previous: none"
        bench.run(100, alive=False)
        assert bench.wheels == (1000, 1000), "previous: left"
        assert bench.ask(bench.contest_message(ContestCommand.STOP)) is Reason.NONE
        bench.run(50)
