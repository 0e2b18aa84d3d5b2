"""Every state of the firmware meets every event."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import pytest
from firmware_bench import HOST, HOST_NUMBER, FirmwareBench

from firmware_protocol.messages import (
    Command,
    CommandResult,
    ContestCommand,
    JuniorManeuverResult,
    ManualControl,
    Reason,
    State,
)
from firmware_protocol.vocabulary import Action, Outcome

if TYPE_CHECKING:
    from collections.abc import Callable

FORWARD: Final = (Action.FF, Action.FF)
PUSH: Final = ManualControl(target=1, x=500, r=0)


def bench_in(state: State) -> FirmwareBench:
    """A robot that has been brought into a state by messages alone; its memory is not empty."""
    bench = FirmwareBench()
    bench.tick()
    bench.open()
    assert bench.ask(bench.write_message(FORWARD, current=0)) is Reason.NONE
    if state is State.DISARMED:
        return bench
    bench.arm()
    if state is State.DRIVING:
        assert bench.ask(bench.wheels_message(0.3, 0.3, 5.0)) is Reason.NONE
    elif state is State.PERFORMING:
        bench.perform(FORWARD, 5.0)
    elif state is State.COUNTDOWN:
        assert bench.ask(bench.contest_message(ContestCommand.START)) is Reason.NONE
    elif state is State.CONTEST:
        assert bench.ask(bench.contest_message(ContestCommand.START, 0.0)) is Reason.NONE
        bench.tick()
    elif state is State.STOPPED:
        bench.stop()
    assert bench.state() is state
    return bench


def arm(bench: FirmwareBench) -> bool:
    return bench.command(Command.ARM_DISARM, 1.0, param3=HOST_NUMBER) is CommandResult.ACCEPTED


def disarm(bench: FirmwareBench) -> bool:
    return bench.command(Command.ARM_DISARM, 0.0) is CommandResult.ACCEPTED


def emergency_stop(bench: FirmwareBench) -> bool:
    return bench.command(Command.FLIGHT_TERMINATION, 1.0) is CommandResult.ACCEPTED


def new_session(bench: FirmwareBench) -> bool:
    bench.open(4712)
    return True


def drive(bench: FirmwareBench) -> bool:
    return bench.ask(bench.wheels_message(0.2, 0.2, 1.0)) is Reason.NONE


def host_s_manual(bench: FirmwareBench) -> bool:
    before = bench.wheels
    bench.tick(PUSH)
    return bench.wheels == (500, 500) and before != bench.wheels


def manual(bench: FirmwareBench) -> bool:
    """As a ground station, which takes over first what is armed: that stops what goes on, but for a contest."""
    if bench.state() is not State.DISARMED:
        bench.command(Command.ARM_DISARM, 1.0)
    return host_s_manual(bench)


def perform(bench: FirmwareBench) -> bool:
    return bench.ask(bench.maneuver_message((Action.SF,))) is Reason.NONE


def start_contest(bench: FirmwareBench) -> bool:
    return bench.ask(bench.contest_message(ContestCommand.START)) is Reason.NONE


def stop_contest(bench: FirmwareBench) -> bool:
    return bench.ask(bench.contest_message(ContestCommand.STOP)) is Reason.NONE


def silence(bench: FirmwareBench) -> bool:
    bench.run(300, alive=False)
    return True


NOT: Final = None
"""Refused; the state stays what it is."""
DIS, RDY, DRV, PRF, CNT, CON, STP = State

TABLE: Final[dict[Callable[[FirmwareBench], bool], tuple[State | None, ...]]] = {
    # in:             DIS  RDY  DRV  PRF  CNT  CON  STP
    arm: (RDY, RDY, DRV, PRF, CNT, CON, NOT),
    disarm: (DIS, DIS, DIS, DIS, DIS, DIS, DIS),
    emergency_stop: (STP, STP, STP, STP, STP, STP, STP),
    new_session: (DIS, DIS, DIS, DIS, CNT, CON, STP),
    drive: (NOT, DRV, DRV, DRV, NOT, NOT, NOT),
    manual: (NOT, DRV, DRV, DRV, NOT, NOT, NOT),
    host_s_manual: (NOT, NOT, NOT, NOT, NOT, NOT, NOT),
    perform: (NOT, PRF, PRF, PRF, NOT, NOT, NOT),
    start_contest: (NOT, CNT, CNT, CNT, NOT, NOT, NOT),
    stop_contest: (DIS, RDY, DRV, PRF, RDY, RDY, STP),
    silence: (DIS, RDY, RDY, RDY, CNT, CON, STP),
}

CASES: Final = [(state, event, TABLE[event][state]) for event in TABLE for state in State]


@pytest.mark.parametrize(("state", "event", "after"), CASES, ids=lambda case: getattr(case, "__name__", str(case)))
def test_transition(state: State, event: Callable[[FirmwareBench], bool], after: State | None) -> None:
    bench = bench_in(state)
    wheels = bench.wheels
    assert event(bench) is (after is not NOT)
    if after is NOT:
        assert bench.state() is state
        assert bench.wheels == wheels, "what is refused does not touch the wheels"
    else:
        assert bench.state() is after
    if bench.state() not in {State.DRIVING, State.PERFORMING, State.CONTEST}:
        assert bench.wheels == (0, 0)
    moving = bench.wheels != (0, 0)
    assert moving is (bench.state() in {State.DRIVING, State.PERFORMING, State.CONTEST})


@pytest.mark.parametrize(
    ("state", "reason"),
    [
        (State.DISARMED, Reason.DISARMED),
        (State.COUNTDOWN, Reason.BUSY),
        (State.CONTEST, Reason.BUSY),
        (State.STOPPED, Reason.EMERGENCY_STOP),
    ],
)
def test_a_refusal_says_why(state: State, reason: Reason) -> None:
    bench = bench_in(state)
    assert bench.ask(bench.maneuver_message(FORWARD)) is reason
    assert bench.ask(bench.wheels_message(0.1, 0.1, 1.0)) is reason
    assert bench.ask(bench.contest_message(ContestCommand.START)) is reason


@pytest.mark.parametrize(
    ("event", "outcome", "reason"),
    [
        (disarm, Outcome.STOPPED, Reason.DISARMED),
        (emergency_stop, Outcome.STOPPED, Reason.EMERGENCY_STOP),
        (silence, Outcome.STOPPED, Reason.WATCHDOG),
        (drive, Outcome.REPLACED, Reason.BY_COMMAND),
        (perform, Outcome.REPLACED, Reason.BY_COMMAND),
        (start_contest, Outcome.STOPPED, Reason.BY_COMMAND),
    ],
)
def test_what_cuts_a_maneuver_short_is_reported(
    event: Callable[[FirmwareBench], bool], outcome: Outcome, reason: Reason
) -> None:
    bench = bench_in(State.PERFORMING)
    event(bench)
    result = bench.got(JuniorManeuverResult)[0]
    assert (result.outcome, result.reason, result.done) == (outcome, reason, 0)


def test_comes_up_disarmed_with_wheels_at_rest() -> None:
    bench = FirmwareBench()
    assert bench.state() is State.DISARMED
    for _ in range(400):
        bench.tick(HOST)
        assert bench.wheels == (0, 0)


def test_an_emergency_stop_holds_until_disarmed_and_armed() -> None:
    bench = bench_in(State.DRIVING)
    bench.stop()
    assert bench.wheels == (0, 0)
    assert bench.command(Command.ARM_DISARM, 1.0) is CommandResult.TEMPORARILY_REJECTED
    assert bench.ask(bench.wheels_message(1.0, 1.0, 1.0)) is Reason.EMERGENCY_STOP
    assert bench.command(Command.FLIGHT_TERMINATION, 0.0) is CommandResult.DENIED
    assert bench.state() is State.STOPPED
    bench.disarm()
    bench.arm()
    assert bench.ask(bench.wheels_message(1.0, 1.0, 1.0)) is Reason.NONE
    assert bench.wheels == (1000, 1000)


@pytest.mark.parametrize("state", [State.DRIVING, State.PERFORMING, State.CONTEST])
@pytest.mark.parametrize("system", [1, 0])
def test_an_emergency_stop_takes_effect_in_the_tick_it_arrives_in(state: State, system: int) -> None:
    bench = bench_in(state)
    assert bench.wheels != (0, 0)
    bench.command(Command.FLIGHT_TERMINATION, 1.0, system=system)
    assert bench.wheels == (0, 0)
    assert bench.state() is State.STOPPED


def test_an_emergency_stop_wins_over_what_arrives_with_it() -> None:
    bench = bench_in(State.READY)
    from_afar = bench.host.encode(bench.wheels_message(1.0, 1.0, 1.0))
    bench.stop()
    bench.tick(raw=from_afar)
    assert bench.wheels == (0, 0)
