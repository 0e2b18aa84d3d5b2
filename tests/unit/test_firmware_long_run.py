"""The firmware after weeks of power: 2**32 us are 71 minutes, 2**31 ms are 24.8 days, 2**32 ms 49.7."""

from __future__ import annotations

import pytest
from firmware_bench import HOST, TICK, FirmwareBench

from firmware_protocol.messages import (
    Command,
    CommandResult,
    ContestCommand,
    Heartbeat,
    JuniorSensors,
    ManualControl,
    ParamSet,
    Reason,
    SensorFlag,
    State,
    Statustext,
)
from firmware_protocol.vocabulary import ANY_STIMULUS, Action, Outcome

HOUR, DAY = 3_600_000, 86_400_000
US_WRAP, MS_WRAP = 2**32 // 1000, 2**32
"""ms."""
AGES = [
    pytest.param(US_WRAP - 100, id="71 minutes"),
    pytest.param(MS_WRAP // 2 - 100, id="24.8 days"),
    pytest.param(25 * DAY, id="25 days"),
    pytest.param(40 * DAY, id="40 days"),
    pytest.param(MS_WRAP - 100, id="49.7 days"),
]


def aged(age: int) -> FirmwareBench:
    """A robot that has been on for this many ms, looked after once an hour; then a host arms it."""
    bench = FirmwareBench()
    bench.tick()
    while bench.now < age:
        bench.now += min(HOUR, age - bench.now) // TICK * TICK
        bench.tick()
        bench.clear()
    return bench.armed()


@pytest.mark.parametrize("age", AGES)
def test_a_maneuver_lasts_as_long_as_ever(age: int) -> None:
    bench = aged(age)
    bench.perform((Action.FF, Action.SB), 0.1)
    seen = []
    for _ in range(60):
        seen.append(bench.wheels)
        bench.tick(HOST)
    assert seen == [(1000, 1000)] * 20 + [(-400, -400)] * 20 + [(0, 0)] * 20
    assert bench.result().outcome == Outcome.COMPLETED
    assert bench.result().samples[:2] == (20, 20)


@pytest.mark.parametrize("age", AGES)
def test_deadline_dead_man_and_watchdog_stop_the_wheels(age: int) -> None:
    bench = aged(age)
    assert bench.ask(bench.wheels_message(0.5, 0.5, 0.1)) is Reason.NONE
    assert sum(bench.wheels != (0, 0) for _ in range(40) if [bench.tick(HOST)]) == 19
    bench.perform((Action.FF,), 5.0)
    assert sum(bench.wheels != (0, 0) for _ in range(100) if [bench.tick()]) == 49
    assert bench.command(Command.ARM_DISARM, 1.0) is CommandResult.ACCEPTED
    bench.tick(ManualControl(target=1, x=500, r=0))
    assert sum(bench.wheels != (0, 0) for _ in range(100) if [bench.tick(HOST)]) == 49
    assert bench.state() is State.READY


@pytest.mark.parametrize("age", AGES)
def test_it_still_tells_a_person_what_happened(age: int) -> None:
    bench = aged(age)
    bench.tick(ParamSet(1, 1, "BATT_LOW", 8000.0))
    bench.stop()
    bench.run(1500)
    texts = [text.text for text in bench.got(Statustext)]
    assert any("Emergency" in text for text in texts)
    assert any("Battery" in text for text in texts)


@pytest.mark.parametrize("age", AGES)
def test_streams_keep_their_pace(age: int) -> None:
    bench = aged(age)
    bench.clear()
    bench.run(2000)
    assert len(bench.got(JuniorSensors)) == 100
    assert len(bench.got(Heartbeat)) == 2
    times = [sensors.time for sensors in bench.got(JuniorSensors)]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(bench.now / 1000, abs=0.02)


@pytest.mark.parametrize("age", AGES)
def test_arms_and_a_contest_are_timed_as_ever(age: int) -> None:
    bench = aged(age)
    assert bench.ask(bench.write_message((Action.FF,), 0, ANY_STIMULUS)) is Reason.NONE
    bench.io.arm[0] = 1
    flags = []
    for _ in range(60):
        bench.command(Command.REQUEST_MESSAGE, JuniorSensors.ID)
        flags.append(bench.latest(JuniorSensors).flags)
    assert sum(not flag & SensorFlag.ARM_LEFT for flag in flags) == 2
    assert sum(not flag & SensorFlag.HELD_LEFT for flag in flags) == 22
    bench.tick(ParamSet(1, 1, "CONTEST_MAX", 1.0))
    assert bench.ask(bench.contest_message(ContestCommand.START, 0.2)) is Reason.NONE
    states = []
    for _ in range(260):
        bench.tick()
        states.append(bench.state())
    assert states.count(State.COUNTDOWN) == 39
    assert states.count(State.CONTEST) == 200
