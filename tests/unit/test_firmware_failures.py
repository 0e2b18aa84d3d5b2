"""Failures that the firmware rehearses on request: allowed by a parameter, below everything else, safe, and soon forgotten."""

from __future__ import annotations

import pytest
from firmware_bench import HOST, TICK, FirmwareBench, forge

from firmware_protocol.faults.failures import FAILURES, INSTANCES, FailureType, FailureUnit, failing_part, failure_in_words
from firmware_protocol.messages import (
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    ContestCommand,
    JuniorSensors,
    ParamSet,
    ParamValue,
    Reason,
    SensorFlag,
    State,
    Statustext,
)
from firmware_protocol.vocabulary import Action, Outcome, Stimulus
from firmware_protocol.wire.mavlink import MavlinkCodec

OK, OFF, STUCK, GARBAGE, SLOW = FailureType.OK, FailureType.OFF, FailureType.STUCK, FailureType.GARBAGE, FailureType.SLOW


class Rehearsal(FirmwareBench):
    """A robot that allows failures, unless told otherwise."""

    def __init__(self, *, allowed: bool = True) -> None:
        super().__init__()
        self.io.eye = [300, 40]
        self.io.floor = [100, 110]
        self.tick()
        if allowed:
            self.allow(1.0)

    def allow(self, value: float) -> None:
        answers = self.tick(ParamSet(1, 1, "FAIL_ENABLE", value))
        assert [answer.param_value for answer in answers if isinstance(answer, ParamValue)] == [value]

    def fail(self, unit: float, how: float, instance: float = 0.0, *, system: int = 255) -> CommandResult:
        """Send the command; returns the answer."""
        command = CommandLong(1, 1, Command.INJECT_FAILURE, 0, float(unit), float(how), float(instance))
        frame = MavlinkCodec(system=system, component=190).encode(command)
        (ack,) = [answer for answer in self.tick(raw=frame) if isinstance(answer, CommandAck)]
        assert (ack.command, ack.target_system) == (Command.INJECT_FAILURE, system)
        return CommandResult(ack.result)

    def part(self, name: str, how: FailureType) -> None:
        unit, instance = failing_part(name)
        assert self.fail(unit, how, instance) is CommandResult.ACCEPTED

    def sensors(self) -> JuniorSensors:
        """A fresh reading."""
        self.clear()
        self.run(40)
        return self.latest(JuniorSensors)


def test_nothing_fails_that_is_not_allowed() -> None:
    bench = Rehearsal(allowed=False)
    for unit, kinds in FAILURES.items():
        for how in kinds:
            assert bench.fail(unit, how) is CommandResult.DENIED
    assert bench.sensors().eye == (300, 40)
    assert not bench.got(Statustext)


@pytest.mark.parametrize("unit", FailureUnit)
@pytest.mark.parametrize("how", FailureType)
def test_what_it_knows_is_accepted_and_all_else_is_not(unit: FailureUnit, how: FailureType) -> None:
    bench = Rehearsal()
    known = how in FAILURES[unit]
    for instance in range(len(INSTANCES[unit]) + 1):
        assert bench.fail(unit, how, instance) is (CommandResult.ACCEPTED if known else CommandResult.UNSUPPORTED)
    beyond = bench.fail(unit, how, len(INSTANCES[unit]) + 1)
    assert beyond is (CommandResult.DENIED if known else CommandResult.UNSUPPORTED)


@pytest.mark.parametrize(
    ("unit", "how", "instance", "result"),
    [
        (0, OFF, 0, CommandResult.UNSUPPORTED),
        (102, OFF, 0, CommandResult.UNSUPPORTED),
        (7, 8, 0, CommandResult.UNSUPPORTED),
        (7, 300, 0, CommandResult.UNSUPPORTED),
        (7, OFF, 256, CommandResult.DENIED),
        (7, OFF, -1, CommandResult.DENIED),
        (7, OFF, 1e30, CommandResult.DENIED),
        (-7, OFF, 0, CommandResult.UNSUPPORTED),
        (65543, OFF, 0, CommandResult.UNSUPPORTED),
    ],
)
def test_numbers_that_mean_nothing_do_nothing(unit: float, how: float, instance: float, result: CommandResult) -> None:
    bench = Rehearsal()
    assert bench.fail(unit, how, instance) is result
    assert bench.sensors().eye == (300, 40)


def test_what_is_no_number_does_nothing() -> None:
    bench = Rehearsal()
    command = CommandLong(1, 1, Command.INJECT_FAILURE)
    for wrong in ({"param1": float("nan")}, {"param1": 7.0, "param2": float("nan")}, {"param1": 7.0, "param3": float("inf")}):
        (ack,) = [a for a in bench.tick(raw=forge(command, **{"param2": 1.0} | wrong)) if isinstance(a, CommandAck)]
        assert ack.result != CommandResult.ACCEPTED
    assert bench.sensors().eye == (300, 40)


@pytest.mark.parametrize(
    ("part", "field", "side"),
    [("eye_left", "eye", 0), ("eye_right", "eye", 1), ("floor_left", "floor", 0), ("floor_right", "floor", 1)],
)
def test_a_sensor_fails_in_every_way_and_is_well_again(part: str, field: str, side: int) -> None:
    bench = Rehearsal()
    before = bench.sensors()
    told = getattr(before, field)[side]
    bench.part(part, OFF)
    assert getattr(bench.sensors(), field)[side] == 0
    bench.part(part, OK)
    bench.part(part, STUCK)
    setattr(bench.io, field, [700, 800])
    assert getattr(bench.sensors(), field)[side] == told
    bench.part(part, GARBAGE)
    garbage = [getattr(bench.sensors(), field)[side] for _ in range(30)]
    assert len(set(garbage)) > 20
    assert all(0 <= value <= 1023 for value in garbage)
    other = 1 - side
    assert getattr(bench.sensors(), field)[other] == (700, 800)[other]
    bench.part(part, OK)
    assert getattr(bench.sensors(), field) == (700, 800)


def test_a_stuck_eye_keeps_seeing_what_is_gone() -> None:
    bench = Rehearsal()
    bench.sensors()
    bench.part("eye_left", STUCK)
    bench.io.eye = [0, 0]
    after = bench.sensors()
    assert after.eye == (300, 0)
    assert after.flags & SensorFlag.EYE_LEFT


def test_an_arm_that_is_stuck_or_off() -> None:
    bench = Rehearsal()
    bench.io.arm = [1, 1]
    assert bench.sensors().flags & SensorFlag.ARM_LEFT
    bench.part("arm_left", STUCK)
    bench.part("arm_right", OFF)
    bench.io.arm = [0, 1]
    flags = bench.sensors().flags
    assert flags & SensorFlag.ARM_LEFT
    assert not flags & SensorFlag.ARM_RIGHT
    bench.part("arm_left", OK)
    assert not bench.sensors().flags & SensorFlag.ARM_LEFT


def test_a_battery_that_cannot_be_measured_raises_the_warning() -> None:
    bench = Rehearsal()
    bench.tick(ParamSet(1, 1, "BATT_LOW", 6000.0))
    bench.part("battery", OFF)
    bench.run(1500)
    assert bench.latest(JuniorSensors).battery == 0
    assert "Battery low" in {text.text for text in bench.got(Statustext)}


@pytest.mark.parametrize(("part", "how", "expected"), [("wheel_left", OFF, (0, 700)), ("wheel_right", SLOW, (700, 350))])
def test_a_wheel_gets_less_and_a_maneuver_goes_on(part: str, how: FailureType, expected: tuple[int, int]) -> None:
    bench = Rehearsal().armed()
    assert isinstance(bench, Rehearsal)
    bench.perform((Action.MF,), 1.0)
    bench.run(100)
    assert bench.wheels == (700, 700)
    bench.part(part, how)
    assert bench.wheels == expected
    bench.run(1000)
    assert bench.result().outcome == Outcome.COMPLETED
    assert bench.wheels == (0, 0)
    bench.part(part, OK)
    assert bench.ask(bench.wheels_message(-0.5, -0.5, 1.0)) is Reason.NONE
    assert bench.wheels == (-500, -500)


@pytest.mark.parametrize("part", [name for names in INSTANCES.values() for name in names])
def test_whatever_fails_the_wheels_stop_when_they_must(part: str) -> None:
    unit, _ = failing_part(part)
    for how in FAILURES[unit] - {OK}:
        for stop in ("disarm", "stop", "silence", "deadline"):
            bench = Rehearsal().armed()
            assert isinstance(bench, Rehearsal)
            bench.part(part, how)
            assert bench.ask(bench.wheels_message(0.6, 0.8, 0.2 if stop == "deadline" else 5.0)) is Reason.NONE
            assert bench.wheels != (0, 0)
            if stop in {"disarm", "stop"}:
                getattr(bench, stop)()
            else:
                bench.run(250 if stop == "silence" else 200, alive=stop != "silence")
            assert bench.wheels == (0, 0)
            bench.part(part, OK)
            assert bench.wheels == (0, 0)


def test_not_hearing_its_host_an_armed_robot_stops_by_its_watchdog_and_still_obeys_a_stop() -> None:
    bench = Rehearsal().armed()
    assert isinstance(bench, Rehearsal)
    bench.perform((Action.FF,), 5.0)
    bench.run(400)
    assert bench.state() is State.PERFORMING
    bench.tick(HOST)
    bench.part("host", OFF)
    bench.run(250 - 2 * TICK)
    assert bench.state() is State.PERFORMING
    bench.run(2 * TICK)
    assert (bench.state(), bench.wheels) == (State.READY, (0, 0))
    assert bench.result().reason == Reason.WATCHDOG
    bench.stop()
    assert bench.state() is State.STOPPED
    bench.part("host", OK)
    bench.disarm()
    bench.arm()
    bench.perform((Action.FF,), 1.0)
    bench.run(900)
    assert bench.state() is State.PERFORMING


def test_while_armed_only_the_system_that_armed_has_it_fail() -> None:
    bench = Rehearsal()
    assert bench.fail(101, OFF, system=200) is CommandResult.ACCEPTED
    assert bench.fail(101, OK, system=200) is CommandResult.ACCEPTED
    bench.open()
    bench.arm()
    assert bench.fail(101, OFF, system=200) is CommandResult.TEMPORARILY_REJECTED
    assert bench.fail(101, OFF) is CommandResult.ACCEPTED


def test_in_a_contest_nothing_can_be_made_to_fail() -> None:
    bench = Rehearsal().armed()
    assert isinstance(bench, Rehearsal)
    assert bench.ask(bench.write_message((Action.FF,), int(Stimulus.NONE))) in {Reason.NONE, None}
    bench.run(200)
    assert bench.ask(bench.contest_message(ContestCommand.START, 1.0)) is Reason.NONE
    assert bench.fail(101, OFF) is CommandResult.TEMPORARILY_REJECTED
    bench.run(1100)
    assert bench.state() is State.CONTEST
    assert bench.fail(101, OFF) is CommandResult.TEMPORARILY_REJECTED
    assert bench.wheels != (0, 0)


def test_a_command_to_all_robots_has_none_fail() -> None:
    bench = Rehearsal()
    assert bench.command(Command.INJECT_FAILURE, 7.0, 1.0, system=0) is None
    assert bench.sensors().eye == (300, 40)


def test_it_is_forgotten_when_no_longer_allowed_and_when_it_restarts() -> None:
    bench = Rehearsal()
    for unit in FailureUnit:
        assert bench.fail(unit, OFF) is CommandResult.ACCEPTED
    assert bench.sensors().eye == (0, 0)
    bench.allow(0.0)
    assert bench.sensors().eye == (300, 40)
    bench.allow(1.0)
    assert bench.sensors().eye == (300, 40)
    assert bench.fail(7, OFF) is CommandResult.ACCEPTED
    bench.run(100)  # the parameter is stored meanwhile
    bench.power_on()
    assert bench.sensors().eye == (300, 40)
    assert bench.fail(7, OFF) is CommandResult.ACCEPTED


def test_a_person_is_told() -> None:
    bench = Rehearsal()
    bench.run(300)
    assert not bench.got(Statustext)
    bench.part("eye_left", OFF)
    bench.run(300)
    assert "rehearsed" in bench.latest(Statustext).text
    bench.clear()
    bench.part("eye_left", OK)
    bench.run(300)
    assert not bench.got(Statustext)


def test_in_words() -> None:
    assert failure_in_words(7, 1, 3) == "floor_left off"
    assert failure_in_words(101, 5, 0) == "wheel_left and wheel_right slow"
    assert failure_in_words(3, 9, 2) == "unit 3 number 2 9"
    assert failure_in_words(7, 0, 9) == "unit 7 number 9"
    assert failure_in_words(3, 2, 0) == "every unit 3 stuck"
    with pytest.raises(ValueError, match="known are eye_left"):
        failing_part("nose")
