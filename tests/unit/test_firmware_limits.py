"""The firmware where something is at its limit: counters, room to send, numbers, time."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from fastcrc.crc16 import mcrf4xx
from firmware_bench import HOST, TICK, FirmwareBench, forge

from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    CommandLong,
    CommandResult,
    Heartbeat,
    JuniorManeuverResult,
    JuniorSensors,
    JuniorWheels,
    ManeuverOption,
    MissionRequestList,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Ping,
    Reason,
    RobotAck,
    RobotResultAck,
    RobotSession,
    State,
    Statustext,
    SysStatus,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.vocabulary import Action, Outcome
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.mavlink_layout import crc_extra
from simdevice._host import ffi, lib

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message


def sys_status(bench: FirmwareBench) -> SysStatus:
    """What it says now."""
    bench.command(Command.REQUEST_MESSAGE, SysStatus.ID)
    return bench.latest(SysStatus)


def sent(bench: FirmwareBench, raw: bytes = b"") -> bytes:
    """The bytes sent in a control period in which these arrive."""
    bench.now += TICK
    return bytes(ffi.buffer(bench.io.tx, lib.host_tick(bench.robot, bench.now * 1000, raw, len(raw))))


def from_nobody(message: type[Message], payload: bytes) -> bytes:
    """A frame of system 0, component 0."""
    body = struct.pack("<BBBBBBHB", len(payload), 0, 0, 0, 0, 0, message.ID, 0) + payload
    return b"\xfd" + body + struct.pack("<H", mcrf4xx(body + bytes([crc_extra(message)])))


# --- counters -------------------------------------------------------------------------------------------------------


def test_errors_of_sys_status_are_bad_checksums_and_unknown_frames() -> None:
    bench = FirmwareBench()
    assert sys_status(bench).errors_comm == 0
    damaged = bytes([*bench.host.encode(HOST)[:-1], 0])
    unknown = bench.host.encode(ParamValue("FOR_A_HOST", 1.0, 9, 1, 0))
    bench.tick(raw=damaged * 3 + unknown * 2)
    assert sys_status(bench).errors_comm == 5


def test_errors_of_sys_status_stop_at_the_greatest_number() -> None:
    bench = FirmwareBench()
    bench.tick(raw=b"\xfd\0\0" * 65534)
    assert sys_status(bench).errors_comm == 65534
    bench.tick(raw=b"\xfd\0\0")
    assert sys_status(bench).errors_comm == 65535
    bench.tick(raw=b"\xfd\0\0" * 9)
    assert sys_status(bench).errors_comm == 65535


def lose(bench: FirmwareBench, frames: int) -> None:
    """Send one frame behind so many that do not come."""
    codec = bench.host
    for _ in range(frames):
        codec.encode(HOST)
    bench.tick(HOST)


def test_the_share_of_lost_frames() -> None:
    bench = FirmwareBench()
    assert sys_status(bench).drop_rate_comm == 0
    for _ in range(5):
        bench.tick(HOST)
    lose(bench, 2)  # the one that asks is the eighth that came
    assert sys_status(bench).drop_rate_comm == 10000 * 2 // 10


def test_the_share_of_lost_frames_when_there_are_very_many() -> None:
    bench = FirmwareBench()
    frames = bytearray()
    codec = MavlinkCodec(system=255, component=190)
    ring = [codec.encode(HOST) for _ in range(256)]
    for i in range(4000):
        frames += ring[i * 128 % 256]
    bench.host = MavlinkCodec(system=3, component=3)
    bench.tick(raw=bytes(frames))
    lost, good = 3999 * 127, 4001
    assert sys_status(bench).drop_rate_comm == lost // 2 * 10000 // ((good + lost) // 2)


def test_the_share_of_control_period_that_is_used() -> None:
    bench = FirmwareBench()
    assert sys_status(bench).load == 0
    lib.host_be_busy(bench.robot, 2500)
    bench.tick()
    assert sys_status(bench).load == 500


# --- room -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "length"), [(Ping, 14), (MissionRequestList, 2)])
def test_a_message_of_nothing_but_zeros_has_one_byte(kind: type[Message], length: int) -> None:
    bench = FirmwareBench()
    bench.run(5)
    answer = sent(bench, from_nobody(kind, b"\0" * length if kind is Ping else b"\1\1"))
    assert answer[:3] == b"\xfd\1\0"
    assert answer[10] == 0
    assert len(answer) == 10 + 1 + 2


def test_a_frame_is_sent_when_there_is_just_room_for_it() -> None:
    for missing in (0, 1):
        bench = FirmwareBench()
        lib.host_slow_down(bench.robot, 0, 10 + 9 + 2 - missing, 2048)
        bench.run(1100, alive=False)
        assert bool(bench.got(Heartbeat)) is not bool(missing)


def test_a_list_of_parameters_waits_for_room() -> None:
    bench = FirmwareBench()
    lib.host_slow_down(bench.robot, 0, 100, 20)
    bench.tick(ParamRequestList(1, 1))
    bench.run(1000, alive=False)
    assert [value.param_index for value in bench.got(ParamValue)] == list(range(len(JUNIOR_PARAMETERS)))


def test_a_result_waits_for_room() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 0.05)
    lib.host_slow_down(bench.robot, 0, 30, 30)
    bench.run(200)
    assert not bench.got(JuniorManeuverResult)
    lib.host_slow_down(bench.robot, 0, 0, 0)
    bench.tick()
    assert bench.result().outcome == Outcome.COMPLETED


# --- numbers --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("speed", "duration", "reason"),
    [
        ((1.0, -1.0), 5.0, Reason.NONE),
        ((-1.0, 1.0), 5.0, Reason.NONE),
        ((1.001, 0.0), 1.0, Reason.BAD_VALUE),
        ((-1.001, 0.0), 1.0, Reason.BAD_VALUE),
        ((0.0, 1.001), 1.0, Reason.BAD_VALUE),
        ((0.0, -1.001), 1.0, Reason.BAD_VALUE),
        ((0.5, 0.5), 5.001, Reason.BAD_VALUE),
    ],
)
def test_the_limits_of_wheels(speed: tuple[float, float], duration: float, reason: Reason) -> None:
    bench = FirmwareBench().armed()
    good = bench.wheels_message(0.0, 0.0, 1.0)
    assert isinstance(good, JuniorWheels)
    bench.tick(raw=forge(good, speed=speed, duration=duration))
    assert bench.latest(RobotAck).reason == reason
    assert bench.wheels == (tuple(round(1000 * each) for each in speed) if reason is Reason.NONE else (0, 0))


@pytest.mark.parametrize(
    ("message", "interval", "result"),
    [
        (Heartbeat.ID, 5e6, CommandResult.ACCEPTED),
        (Heartbeat.ID, 5_000_001.0, CommandResult.DENIED),
        (Heartbeat.ID, -1.0, CommandResult.DENIED),
        (Heartbeat.ID, 0.0, CommandResult.ACCEPTED),
        (SysStatus.ID, 5_000_001.0, CommandResult.ACCEPTED),
        (SysStatus.ID, 60e6, CommandResult.ACCEPTED),
        (SysStatus.ID, 60_000_004.0, CommandResult.DENIED),
        (SysStatus.ID, -1.0, CommandResult.ACCEPTED),
        (SysStatus.ID, -1.5, CommandResult.DENIED),
        (SysStatus.ID, math.nan, CommandResult.DENIED),
    ],
)
def test_the_limits_of_intervals(message: int, interval: float, result: CommandResult) -> None:
    assert FirmwareBench().command(Command.SET_MESSAGE_INTERVAL, message, interval) is result


def test_an_interval_counts_from_when_it_is_set() -> None:
    bench = FirmwareBench()
    bench.run(500)
    assert bench.command(Command.SET_MESSAGE_INTERVAL, Heartbeat.ID, 5e6) is CommandResult.ACCEPTED
    bench.clear()
    bench.run(4990)
    assert not bench.got(Heartbeat)
    bench.run(10)
    assert len(bench.got(Heartbeat)) == 1


def test_only_the_acknowledgement_of_this_result_ends_its_repetition() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 0.05)
    bench.run(60)
    result = bench.result()
    right = RobotResultAck(result.session, result.sequence, 1, 1)
    for wrong in (replace(right, session=result.session + 1), replace(right, sequence=result.sequence + 1)):
        bench.tick(wrong)
        bench.clear()
        bench.run(200)
        assert bench.got(JuniorManeuverResult)
    bench.tick(right)
    bench.clear()
    bench.run(300)
    assert not bench.got(JuniorManeuverResult)


def test_an_answer_that_others_have_pushed_out_is_still_given_once() -> None:
    bench = FirmwareBench().armed()
    lib.host_slow_down(bench.robot, 1, 0, 0)
    stored = bench.write_message((Action.FF,), current=1)
    assert bench.ask(stored) is None, "not yet"
    for _ in range(9):
        assert bench.ask(bench.read_message(0)) is Reason.NOT_FOUND
    bench.run(300)
    assert [ack.reason for ack in bench.got(RobotAck) if ack.sequence == stored.sequence] == [Reason.NONE]
    assert bench.ask(stored) is Reason.OLD_SEQUENCE


def test_a_session_of_another_major_version_is_refused_and_opens_nothing() -> None:
    bench = FirmwareBench()
    for major in (1, 3):
        assert bench.ask(RobotSession(7, 0, 9, 1, 1, major, 0)) is Reason.BAD_VALUE
    bench.session = 7
    assert bench.ask(bench.read_message(0)) is Reason.WRONG_SESSION


# --- what is counted in a maneuver ----------------------------------------------------------------------------------


def test_more_presses_than_a_byte_holds_are_its_greatest_number() -> None:
    bench = FirmwareBench().armed()
    bench.tick(ParamSet(1, 1, "ARM_DEBOUNCE", 0.0))
    bench.perform((Action.FF,), 5.0)
    for i in range(998):
        bench.io.arm[0] = i % 2
        bench.io.arm[1] = i < 508 and i % 2
        bench.tick(*([HOST] if i % 8 == 0 else []))
    bench.run(50)
    assert (bench.result().edges_left[0], bench.result().edges_right[0]) == (255, 254)


@pytest.mark.parametrize(("step", "travel"), [(99_999, 32.0), (-99_999, -32.0), (100_000, 0.0), (-100_000, 0.0)])
def test_a_long_way_is_the_greatest_and_a_jump_is_a_fault_of_the_odometer(step: int, travel: float) -> None:
    bench = FirmwareBench().armed()
    bench.tick(ParamSet(1, 1, "ARM_DEBOUNCE", 0.0))
    bench.io.arm[0] = 1
    bench.tick()
    bench.perform((Action.FF,), 5.0)
    for i in range(1000):
        bench.io.ground_um = (bench.io.ground_um + step + 2**31) % 2**32 - 2**31
        bench.tick(*([HOST] if i % 8 == 0 else []))
    assert bench.result().travel[0] == travel


@pytest.mark.parametrize(("um", "mm"), [(1499, 1), (1500, 2), (-1499, -1), (-1500, -2), (499, 0), (-499, 0)])
def test_travel_is_rounded(um: int, mm: int) -> None:
    bench = FirmwareBench().armed()
    bench.tick(ParamSet(1, 1, "ARM_DEBOUNCE", 0.0))
    bench.io.arm[1] = 1
    bench.tick()
    bench.perform((Action.FF,), 0.02)
    bench.io.ground_um += um
    bench.run(50)
    assert bench.result().travel[0] == mm / 1000


def test_what_holds_a_maneuver_is_told_by_its_options() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 0.02, ManeuverOption.HOLD)
    bench.run(100)
    assert bench.state() is State.DRIVING
    bench.run(30)
    assert bench.state() is State.READY


def test_sensors_come_as_often_as_ever_after_a_long_pause() -> None:
    bench = FirmwareBench()
    bench.run(100)
    bench.now += 5000
    bench.clear()
    bench.run(200)
    assert len(bench.got(JuniorSensors)) == pytest.approx(10, abs=1), "what was missed is not caught up"


@pytest.mark.parametrize(("step", "travel"), [(700, 0.007), (-700, -0.007), (2300, 0.023), (-2300, -0.023), (999, 0.009)])
def test_travel_keeps_what_is_less_than_a_millimetre(step: int, travel: float) -> None:
    bench = FirmwareBench()
    bench.tick()
    for _ in range(10):
        bench.io.travel_um = [bench.io.travel_um[0] + step, bench.io.travel_um[1] - step]
        bench.tick()
    bench.run(20)
    assert bench.latest(JuniorSensors).travel == pytest.approx((travel, -travel))


@pytest.mark.parametrize("value", [0.5, -1.0, 0.999, 1.001, 2.0, math.nan])
@pytest.mark.parametrize("command", [Command.ARM_DISARM, Command.FLIGHT_TERMINATION, Command.PREFLIGHT_REBOOT])
def test_what_is_neither_yes_nor_no_is_denied(command: Command, value: float) -> None:
    bench = FirmwareBench().armed()
    assert bench.command(command, value) is CommandResult.DENIED
    bench.run(100)
    assert bench.state() is State.READY
    assert not bench.io.reboot


# --- details that nothing else looks at -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["XYE_L_ON", "EYE_L_OX", "EYE_L_O", "EYE_L_ONX", "", "EYE_X_ON"])
def test_a_name_that_is_nearly_one_is_none(name: str) -> None:
    bench = FirmwareBench()
    bench.tick(ParamSet(1, 1, name, 300.0))
    assert not bench.got(ParamValue)
    bench.tick(ParamRequestRead(1, 1, name))
    assert math.isnan(bench.latest(ParamValue).param_value)


def test_travel_by_commands_is_exact() -> None:
    bench = FirmwareBench(encoders=False).armed()
    bench.tick(ParamSet(1, 1, "WHEEL_SPEED", 4999.0))
    assert bench.ask(bench.wheels_message(1.0, -0.5, 1.0)) is Reason.NONE
    bench.run(1200)
    assert bench.latest(JuniorSensors).travel == (4.999, -2.499)


@pytest.mark.parametrize(("after", "restarts"), [(19, False), (20, True)])
def test_a_restart_leaves_time_for_the_answer(after: int, restarts: bool) -> None:  # noqa: FBT001
    bench = FirmwareBench()
    assert bench.command(Command.PREFLIGHT_REBOOT, 1.0) is CommandResult.ACCEPTED
    bench.now += after - TICK
    bench.tick()
    assert bool(bench.io.reboot) is restarts


@pytest.mark.parametrize(("ms", "ended"), [(19, False), (20, True)])
def test_a_stimulus_that_differs_for_20_ms_ends_a_maneuver(ms: int, ended: bool) -> None:  # noqa: FBT001
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 1.0, ManeuverOption.EYES | ManeuverOption.END_ON_CHANGE)
    bench.tick()
    bench.eyes(left=True, right=False)
    bench.tick()
    bench.now += ms - TICK
    bench.tick()
    assert (bench.state() is State.READY) is ended


def test_a_long_control_period_is_as_long_as_the_clock_says() -> None:
    bench = FirmwareBench()
    bench.tick()
    assert bench.command(Command.SET_MESSAGE_INTERVAL, SysStatus.ID, 60e6) is CommandResult.ACCEPTED
    bench.clear()
    bench.now += 59_990
    bench.tick()
    assert not bench.got(SysStatus)
    bench.tick()
    assert len(bench.got(SysStatus)) == 1


def test_a_low_battery_is_said_after_a_second() -> None:
    bench = FirmwareBench()
    bench.tick(ParamSet(1, 1, "BATT_LOW", 7000.0))
    bench.io.battery_mv = 6900
    bench.run(995)
    assert not bench.got(Statustext)
    bench.tick()
    assert len(bench.got(Statustext)) == 1


def test_a_battery_just_at_its_limit_is_not_low() -> None:
    bench = FirmwareBench()
    bench.tick(ParamSet(1, 1, "BATT_LOW", 7000.0))
    bench.io.battery_mv = 7000
    bench.run(3000)
    assert not bench.got(Statustext)


def test_its_version_says_nothing_that_it_does_not_know() -> None:
    bench = FirmwareBench()
    bench.command(Command.REQUEST_MESSAGE, AutopilotVersion.ID)
    version = bench.latest(AutopilotVersion)
    known = {"capabilities", "uid", "flight_sw_version", "middleware_sw_version"}
    others = {name: value for name, value in vars(version).items() if name not in known}
    assert others
    assert all(not any(value) if isinstance(value, tuple) else not value for value in others.values()), others


@pytest.mark.parametrize("used", range(1, 20))
def test_a_part_of_a_long_frame_is_given_up_after_20_ms(used: int) -> None:
    bench = FirmwareBench()
    long = bench.host.encode(CommandLong(1, 1, command=int(Command.REQUEST_MESSAGE), param7=1.0))
    bench.tick(raw=long[:used])
    bench.run(15, alive=False)
    bench.tick()
    assert [ping.seq for ping in bench.tick(Ping(1, 7)) if isinstance(ping, Ping)] == [7]


def test_what_a_part_of_a_frame_hides_is_found_after_20_ms() -> None:
    bench = FirmwareBench()
    long = bench.host.encode(CommandLong(1, 1, command=int(Command.REQUEST_MESSAGE), param7=1.0))
    bench.tick(raw=long[:12] + bench.host.encode(Ping(1, 7)))
    bench.run(15, alive=False)
    assert not bench.got(Ping)
    bench.tick()
    assert [ping.seq for ping in bench.got(Ping)] == [7]
