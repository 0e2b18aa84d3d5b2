"""The firmware where something is at its limit: counters, room to send, time, and what an EEPROM may hold."""

from __future__ import annotations

import math
import struct
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from fastcrc.crc16 import mcrf4xx
from firmware_bench import BLANK, HOST, TICK, FirmwareBench, forge

from firmware_protocol.firmware._host import ffi, lib
from firmware_protocol.mavlink import MavlinkCodec
from firmware_protocol.mavlink_layout import crc_extra
from firmware_protocol.messages import (
    Command,
    CommandResult,
    ContestCommand,
    Heartbeat,
    JuniorManeuverResult,
    JuniorMemoryEntry,
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
from firmware_protocol.parameters import PARAMETERS
from firmware_protocol.vocabulary import Action, Outcome

if TYPE_CHECKING:
    from firmware_protocol.wire import Message

RECORD, COPY, FIRST_PARAMETER = 14, 7, 1
"""Bytes of a record in EEPROM, of each of its two copies, and the record of the first parameter."""
MEMORY = 1024 - 33 * 16
"""Where the memory begins in EEPROM; a slot is 16 bytes."""


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
    assert sys_status(bench).drop_rate_comm == pytest.approx(10000 * 127 / 128, abs=3)


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
    assert [value.param_index for value in bench.got(ParamValue)] == list(range(len(PARAMETERS)))


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


# --- memory ---------------------------------------------------------------------------------------------------------


def remembering(state: State) -> FirmwareBench:
    """A robot that remembers what to do when it sees nothing, in this state."""
    bench = FirmwareBench().armed()
    assert bench.ask(bench.write_message((Action.FF,), current=0)) is Reason.NONE
    if state is not State.READY:
        assert bench.ask(bench.contest_message(ContestCommand.START, 0.0 if state is State.CONTEST else 60.0)) is Reason.NONE
        bench.run(100)
    assert bench.state() is state
    return bench


@pytest.mark.parametrize("state", [State.COUNTDOWN, State.CONTEST])
def test_nothing_is_stored_while_it_plays(state: State) -> None:
    bench = remembering(state)
    assert bench.ask(bench.write_message((Action.SB,), current=1)) is Reason.BUSY
    assert bench.ask(bench.read_message(1)) is Reason.NOT_FOUND


def test_a_slot_that_rots_while_it_plays_is_not_played() -> None:
    bench = remembering(State.CONTEST)
    assert bench.wheels == (1000, 1000)
    bench.io.nvm[MEMORY + 15] = 9  # actions: more than there are
    bench.run(300)
    assert bench.wheels == (-350, 350), "it looks around"
    assert bench.state() is State.CONTEST


def test_a_slot_that_rots_while_it_is_on_is_not_there() -> None:
    bench = remembering(State.READY)
    bench.io.nvm[MEMORY + 15] = 0
    assert bench.ask(bench.read_message(0)) is Reason.NOT_FOUND
    assert not bench.got(JuniorMemoryEntry)


# --- stored parameters ----------------------------------------------------------------------------------------------


def place(name: str) -> int:
    """Where a parameter's record is in EEPROM."""
    return RECORD * (FIRST_PARAMETER + [parameter.name for parameter in PARAMETERS].index(name))


def copy_of(name: str, value: float, turn: int) -> bytes:
    """One copy of a record."""
    data = struct.pack("<f", value)
    crc = mcrf4xx(name.encode().ljust(16, b"\0") + data + bytes([turn]))
    return data + struct.pack("<HB", crc, turn)


def stored(name: str, first: bytes = b"", second: bytes = b"") -> FirmwareBench:
    """A robot whose EEPROM holds these two copies of a parameter, and nothing else."""
    nvm = bytearray(BLANK)
    at = place(name)
    nvm[at : at + len(first)] = first
    nvm[at + COPY : at + COPY + len(second)] = second
    bench = FirmwareBench(bytes(nvm))
    bench.run(300)
    return bench


def value_of(bench: FirmwareBench, name: str) -> float:
    """A parameter's value in force."""
    bench.tick(ParamRequestRead(1, 1, name))
    return bench.latest(ParamValue).param_value


def test_of_two_copies_the_newer_one_counts() -> None:
    for first, second, newer in [(0, 1, 301.0), (1, 2, 301.0), (2, 0, 301.0), (1, 0, 300.0), (2, 1, 300.0), (0, 2, 300.0)]:
        bench = stored("EYE_L_ON", copy_of("EYE_L_ON", 300.0, first), copy_of("EYE_L_ON", 301.0, second))
        assert value_of(bench, "EYE_L_ON") == newer, (first, second)
        assert not bench.got(Statustext)


def test_a_copy_whose_turn_is_none_is_spoilt() -> None:
    bench = stored("EYE_L_ON", copy_of("EYE_L_ON", 300.0, 3))
    assert value_of(bench, "EYE_L_ON") == 250.0
    assert "defaults" in bench.latest(Statustext).text


@pytest.mark.parametrize("position", range(6))
def test_a_spoilt_second_copy_without_a_first_one_is_said(position: int) -> None:
    copy = bytearray(copy_of("EYE_L_ON", 300.0, 0))
    copy[position] ^= 0x40
    bench = stored("EYE_L_ON", b"", bytes(copy))
    assert value_of(bench, "EYE_L_ON") == 250.0
    assert "defaults" in bench.latest(Statustext).text


def test_a_second_copy_alone_counts() -> None:
    bench = stored("EYE_L_ON", b"", copy_of("EYE_L_ON", 300.0, 2))
    assert value_of(bench, "EYE_L_ON") == 300.0
    assert not bench.got(Statustext)


@pytest.mark.parametrize("value", [1024.0, -1.0, 300.5, math.nan])
def test_a_stored_value_that_is_not_allowed_any_more_is_not_taken(value: float) -> None:
    bench = stored("EYE_L_ON", copy_of("EYE_L_ON", value, 0))
    assert value_of(bench, "EYE_L_ON") == 250.0


def test_the_record_of_another_parameter_is_not_taken() -> None:
    bench = stored("EYE_L_ON", copy_of("EYE_R_ON", 300.0, 0))
    assert value_of(bench, "EYE_L_ON") == 250.0


def test_a_value_changed_and_changed_back_at_once_is_not_written() -> None:
    bench = FirmwareBench()
    bench.tick(ParamSet(1, 1, "EYE_L_ON", 300.0))
    bench.run(100)
    writes = lib.host_nvm_writes(bench.robot)
    bench.tick(ParamSet(1, 1, "EYE_L_ON", 301.0), ParamSet(1, 1, "EYE_L_ON", 300.0))
    bench.run(100)
    assert lib.host_nvm_writes(bench.robot) == writes
    bench.power_on()
    assert value_of(bench, "EYE_L_ON") == 300.0


def test_every_parameter_is_stored_in_its_own_place() -> None:
    bench = FirmwareBench()
    wanted = {}
    for parameter in PARAMETERS:
        if not parameter.read_only:
            wanted[parameter.name] = parameter.maximum if parameter.default != parameter.maximum else parameter.minimum
    wanted["SYS_ID"] = 1.0
    bench.tick(*(ParamSet(1, 1, name, value) for name, value in wanted.items()))
    bench.run(1000)
    bench.power_on()
    assert {name: value_of(bench, name) for name in wanted} == pytest.approx(wanted, rel=1e-7)


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
