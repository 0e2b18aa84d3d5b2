"""The firmware's ELF on an emulated ATmega328P: every driver does what the board's header says."""

from __future__ import annotations

import re
import shutil
import signal
from typing import TYPE_CHECKING

import pytest
from avr_bench import UID, AvrBench
from firmware_bench import BLANK
from processes import PATIENCE, Hil

import hil
from firmware_protocol.errors import LinkOpenError
from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    CommandResult,
    ContestCommand,
    Heartbeat,
    JuniorMemoryEntry,
    JuniorSensors,
    ParamSet,
    ParamValue,
    Reason,
    RobotAck,
    RobotStatus,
    SensorFlag,
    State,
    SysStatus,
)
from firmware_protocol.vocabulary import Action
from hil.cli.app import run
from simdevice.avr import board as avr_board
from simdevice.avr import build as avr_build
from simdevice.avr.board import CYCLES, AvrBoard, battery_counts, declarations, whole_frames
from simdevice.avr.build import SHIM
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.avr
RAM_LIMIT = 1600
RAM_BEGIN = 0x100
TIMSK0 = 0x6E


@pytest.fixture
def bench() -> AvrBench:
    return AvrBench()


@pytest.fixture
def armed() -> AvrBench:
    bench = AvrBench()
    bench.open()
    bench.arm()
    return bench


def test_it_boots_and_its_periods_are_those_of_the_world(bench: AvrBench) -> None:
    bench.run(1000)
    times = [sensors.time for sensors in bench.got(JuniorSensors)]
    assert times == [pytest.approx(0.02 * i, abs=1e-9) for i in range(50)]
    assert len(bench.got(Heartbeat)) == 1
    assert bench.got(RobotStatus)[0].boot_count == 1
    assert bench.command(Command.REQUEST_MESSAGE, float(SysStatus.ID)) is CommandResult.ACCEPTED
    assert 20 < bench.latest(SysStatus).load < 500, "permille of a control period"


def test_it_has_the_serial_number_of_its_chip(bench: AvrBench) -> None:
    assert bench.command(Command.REQUEST_MESSAGE, float(AutopilotVersion.ID)) is CommandResult.ACCEPTED
    assert bench.latest(AutopilotVersion).uid == UID


@pytest.mark.parametrize("count", [0, 1, 511, 512, 1022, 1023])
def test_the_converter_reads_every_channel_to_the_count(bench: AvrBench, count: int) -> None:
    inputs = bench.inputs
    for name in ("eye_left", "eye_right", "floor_left", "floor_right"):
        before = vars(inputs).copy()
        setattr(inputs, name, count)
        bench.run(50)
        sensors = bench.latest(JuniorSensors)
        assert (*sensors.eye, *sensors.floor) == (inputs.eye_left, inputs.eye_right, inputs.floor_left, inputs.floor_right)
        vars(inputs).update(before)


@pytest.mark.parametrize("voltage", [0.0, 6.4, 7.4, 8.4, 12.0])
def test_the_battery_is_measured_behind_its_divider(bench: AvrBench, voltage: float) -> None:
    bench.inputs.voltage = voltage
    bench.run(50)
    assert bench.latest(JuniorSensors).battery == int(battery_counts(voltage) * 10000 / 1024) / 1000
    assert bench.latest(JuniorSensors).battery == pytest.approx(min(voltage, 9.99), abs=0.011)


def test_arm_switches_pull_their_pins_low(bench: AvrBench) -> None:
    for left, right, flags in ((1, 0, SensorFlag.ARM_LEFT), (0, 1, SensorFlag.ARM_RIGHT), (0, 0, SensorFlag(0))):
        bench.inputs.arm_left, bench.inputs.arm_right = left, right
        bench.run(200)
        assert bench.latest(JuniorSensors).flags & (SensorFlag.ARM_LEFT | SensorFlag.ARM_RIGHT) == flags


@pytest.mark.parametrize("efforts", [(1000, -1000), (1, -1), (-500, 333), (0, 700), (999, 0)])
def test_the_driver_gives_the_motors_what_was_asked_for(armed: AvrBench, efforts: tuple[int, int]) -> None:
    assert armed.ask(armed.wheels_message(efforts[0] / 1000, efforts[1] / 1000, 0.2)) is Reason.NONE
    assert armed.wheels == efforts
    armed.run(300)
    assert armed.wheels == (0, 0)


def test_a_robot_stops_in_the_period_after_the_emergency_stop_has_come(armed: AvrBench) -> None:
    armed.ask(armed.wheels_message(1.0, 1.0, 5.0))
    assert armed.wheels == (1000, 1000)
    assert armed.command(Command.FLIGHT_TERMINATION, 1.0) is CommandResult.ACCEPTED
    assert armed.wheels == (0, 0)
    armed.run(1000)
    assert armed.latest(Heartbeat).custom_mode == State.STOPPED


def test_the_start_module_starts_and_stops_a_contest(bench: AvrBench) -> None:
    bench.open()
    bench.tick(bench.write_message((Action.R,), current=0))
    bench.run(200)
    assert bench.latest(RobotAck).reason == Reason.NONE
    bench.board.start = True
    bench.run(4980)
    assert bench.wheels == (0, 0), "the countdown"
    bench.run(40)
    assert bench.wheels == (350, -350)
    bench.board.start = False
    bench.run(10)
    assert bench.wheels == (0, 0)


def test_a_start_module_that_is_on_at_power_on_starts_nothing() -> None:
    bench = AvrBench(start=True)
    bench.open()
    bench.tick(bench.write_message((Action.R,), current=0))
    bench.run(6000)
    assert bench.latest(Heartbeat).custom_mode == State.DISARMED


def test_power_off_keeps_the_eeprom_and_nothing_else(armed: AvrBench) -> None:
    armed.tick(ParamSet(1, 1, "SPD_FAST", 0.75))
    armed.tick(armed.write_message((Action.FF, Action.SB), current=3, previous=1))
    armed.run(400)
    assert armed.latest(RobotAck).reason == Reason.NONE
    armed.power_on()
    armed.run(1000)
    assert armed.got(RobotStatus)[0].boot_count == 2
    assert armed.latest(Heartbeat).custom_mode == State.DISARMED
    armed.open()
    armed.answers_to(armed.read_message(0))
    entry = armed.latest(JuniorMemoryEntry)
    assert (entry.previous, entry.current, entry.count, entry.actions[:2]) == (1, 3, 2, (Action.FF, Action.SB))
    armed.answers_to(ParamSet(1, 1, "SPD_FAST", -1.0))
    assert armed.latest(ParamValue).param_value == 0.75
    other = AvrBench(armed.nvm)
    other.run(100)
    assert other.got(RobotStatus)[0].boot_count == 3


def test_an_eeprom_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="1024"):
        AvrBoard(uid=1, nvm=b"\xff" * 512)


def test_a_reboot_is_a_reset_by_the_watchdog(armed: AvrBench) -> None:
    armed.ask(armed.wheels_message(1.0, 1.0, 5.0))
    assert armed.command(Command.PREFLIGHT_REBOOT, 1.0) is CommandResult.ACCEPTED
    periods = 0
    while not armed.board.reboot:
        assert armed.wheels == (0, 0)
        armed.tick()
        periods += 1
    assert 1 <= periods <= 4, "20 ms for the answer and 15 for the watchdog, of which 35 are over"
    armed.board.restart()
    armed.raw = b""
    armed.streamed.clear()
    armed.run(1000)
    assert armed.got(RobotStatus)[0].boot_count == 2
    assert armed.got(RobotStatus)[0].time == 0.0
    assert armed.latest(Heartbeat).custom_mode == State.DISARMED


def test_a_processor_that_hangs_is_reset_and_its_wheels_float(armed: AvrBench) -> None:
    armed.ask(armed.wheels_message(1.0, 1.0, 5.0))
    assert armed.wheels == (1000, 1000)
    armed.board.poke(TIMSK0, 0)  # no more control periods
    armed.run(110)
    early = armed.board.reboot
    armed.run(20)
    assert (early, armed.board.reboot) == (False, True)
    assert armed.wheels == (0, 0)
    armed.board.restart()
    armed.run(100)
    assert armed.got(RobotStatus)[-1].boot_count == 2


def test_stack_and_variables_stay_within_their_bounds(armed: AvrBench) -> None:
    for current in range(16):
        armed.ask(armed.write_message((Action.F, Action.B), current=current))
        armed.run(100)
    armed.tick(ParamSet(1, 1, "SPD_FAST", 0.75))
    for index in (0, 15, 16):
        armed.answers_to(armed.read_message(index))
    armed.ask(armed.maneuver_message((Action.F,) * 8, 0.05))
    armed.ask(armed.contest_message(ContestCommand.START, 0.05))
    armed.run(500)
    armed.tick(raw=b"\xfd" * 50)
    armed.run(100)
    static = armed.board.address("_end") - RAM_BEGIN
    assert armed.board.stack > 100
    assert static + armed.board.stack <= RAM_LIMIT
    assert armed.busiest < CYCLES * 0.7, "what a control period's work takes at most"


def test_frames_come_whole() -> None:
    frame = bytes.fromhex("fd010000000101000000") + b"abc"
    assert whole_frames(b"") == 0
    assert [whole_frames((frame + frame)[:length]) for length in range(2, 27)] == [0] * 11 + [13] * 13 + [26]
    assert whole_frames(b"noise" + frame + b"x") == 19


def test_a_world_with_this_board_power_cycles_and_reboots() -> None:
    world = junior_world(WorldSettings(board=AvrBoard))
    for _ in range(20):
        world.step(b"")
    assert world.device.uptime == pytest.approx(0.1)
    world.device.power_cycle()
    assert world.device.uptime == 0.0
    assert world.device.nvm != BLANK


def test_a_host_has_a_maneuver_performed_and_stored() -> None:
    with hil.connect("sim://junior?board=avr&opponent=flat-heavy&seed=2") as junior:
        junior.arm()
        report = junior.perform(["LFRB", "FF"], period=0.1)
        assert report.done == 2
        junior.disarm()
        assert junior.sense() is not None


@pytest.mark.slow
def test_it_is_served_in_real_time(tmp_path: Path) -> None:
    memory = tmp_path / "robot.eeprom"
    with Hil(tmp_path, "emulate", "junior", "--board", "avr", "--link", "tcp://127.0.0.1:0", "--memory", str(memory)) as robot:
        url = robot.until("Junior is at").split()[-1]
        with hil.connect(url, timeout=PATIENCE) as junior:
            assert junior.status().boot_count == 1
        robot.send(signal.SIGINT)
        assert robot.end() in {0, 130}
    assert len(memory.read_bytes()) == len(BLANK)


# --- where it can't be run -------------------------------------------------------------------------------------------


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with pytest.raises(LinkOpenError, match="apt install gcc-avr avr-libc make gcc"):
        avr_build.build()
    assert run(["check", "sim://junior?board=avr"]) == 3
    said = capsys.readouterr().err
    assert "lacks gcc-avr avr-libc" in said
    assert "sudo apt install" in said
    assert run(["emulate", "junior", "--board", "avr", "--link", "tcp://127.0.0.1:0"]) == 3
    assert "sudo apt install" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("url", "said"),
    [("sim://junior?board=z80", "board is host or avr"), ("sim://junior?board=avr&wire=can", "a serial line and no CAN")],
)
def test_a_wrong_board_is_a_wrong_address(url: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", url]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.slow
def test_it_is_built_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = avr_build.build(cache=tmp_path)
    monkeypatch.setattr(avr_build, "_make", None)
    assert avr_build.build(cache=tmp_path) == built
    assert [path.name for path in tmp_path.iterdir()] == [built.elf.parent.name]


@pytest.mark.slow
def test_a_mistake_in_the_firmware_is_told(tmp_path: Path) -> None:
    source = tmp_path / "firmware_protocol" / "firmware"
    shutil.copytree(avr_build.FIRMWARE, source, ignore=shutil.ignore_patterns("_build"))
    shutil.copytree(avr_build.FIRMWARE.parent / "dialect", source.parent / "dialect")
    with (source / "core" / "time.c").open("a") as file:
        file.write("int nonsense(void) { return 1 }\n")
    with pytest.raises(LinkOpenError, match="expected"):
        avr_build.build(source, tmp_path / "cache")


def test_cffi_is_told_what_the_shim_says() -> None:
    text = SHIM.read_text(encoding="utf-8")
    told = declarations(text)
    assert "uint16_t counts[5];" in told
    assert len(re.findall(r"avr_board_\w+\(", told)) == len(
        re.findall(r"^(?!static)\w.* \*?avr_board_\w+\(", text, re.MULTILINE)
    )


@pytest.mark.parametrize(
    ("source", "channels"), [("uint8_t closed[2];", 5), ("uint16_t counts[CHANNELS];", 6)], ids=["source", "channels"]
)
def test_a_shim_with_another_struct_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str, channels: int
) -> None:
    other = tmp_path / "simavr_shim.c"
    text = SHIM.read_text(encoding="utf-8")
    assert source in text
    other.write_text(text if channels != 5 else text.replace(source, f"uint8_t tilt; {source}", 1), encoding="utf-8")
    made = avr_build.build()
    monkeypatch.setattr(avr_board, "SHIM", other)
    monkeypatch.setattr(avr_board, "_CHANNELS", channels)
    with pytest.raises(LinkOpenError, match="was built for another version of this package"):
        avr_board._load.__wrapped__(made.shim)
