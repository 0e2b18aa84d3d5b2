"""Standard MAVLink as a ground station speaks it: commands, streams, parameters, ping, time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from firmware_bench import HOST, FirmwareBench, forge

from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    CommandResult,
    Heartbeat,
    JuniorSensors,
    MissionCount,
    MissionRequestList,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Ping,
    RobotStatus,
    SensorFlag,
    State,
    Statustext,
    SysStatus,
    Timesync,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS, Parameter
from firmware_protocol.peer.pacing import by_itself
from firmware_protocol.roles.junior import JUNIOR

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

WRITABLE = [parameter for parameter in JUNIOR_PARAMETERS if not parameter.read_only]


def ask_value(bench: FirmwareBench, name: str) -> ParamValue:
    (value,) = bench.tick(ParamRequestRead(1, 1, name))
    assert isinstance(value, ParamValue)
    return value


def test_streams_come_at_their_rates() -> None:
    bench = FirmwareBench()
    bench.run(10000)
    counts = {kind: len(bench.got(kind)) for kind in by_itself(JUNIOR)}
    due = {kind: round(10 / interval) + 1 for kind, interval in by_itself(JUNIOR).items()}
    assert counts == due, "the first ones in the first tick"
    assert (counts[Heartbeat], counts[JuniorSensors]) == (11, 501)


def test_a_heartbeat_says_what_the_robot_is_and_does() -> None:
    bench = FirmwareBench()
    bench.tick()
    assert bench.latest(Heartbeat) == Heartbeat(
        type=10, autopilot=0, base_mode=1 | 64, custom_mode=State.DISARMED, system_status=3, mavlink_version=3
    )
    bench.arm()
    bench.run(1000)
    assert (bench.latest(Heartbeat).base_mode, bench.latest(Heartbeat).system_status) == (1 | 64 | 128, 4)
    bench.stop()
    bench.run(1000)
    assert (bench.latest(Heartbeat).base_mode, bench.latest(Heartbeat).system_status) == (1 | 64, 6)
    assert "stop" in bench.latest(Statustext).text.lower()


def test_sensors_say_what_the_drivers_read() -> None:
    bench = FirmwareBench()
    bench.io.eye = [250, 249]
    bench.io.floor = [499, 500]
    bench.io.battery_mv = 65535
    bench.io.arm[1] = 1
    bench.run(200)
    bench.io.travel_um = [1234567, -2345678]
    bench.run(20)
    sensors = bench.latest(JuniorSensors)
    assert sensors.eye == (250, 249)
    assert sensors.floor == (499, 500)
    assert sensors.battery == 65.535
    assert sensors.travel == (1.234, -2.345)
    assert sensors.flags == (
        SensorFlag.EYE_LEFT | SensorFlag.ARM_RIGHT | SensorFlag.HELD_RIGHT | SensorFlag.OFF_RING_RIGHT
        | SensorFlag.TRAVEL_FROM_ENCODERS | SensorFlag.GROUND_ODOMETER
    )  # fmt: skip
    assert sensors.time == 0.22


def test_an_eye_ceases_to_see_below_its_hysteresis() -> None:
    bench = FirmwareBench()
    seen = []
    for counts in (249, 250, 231, 230, 229, 240, 250):
        bench.io.eye[0] = counts
        bench.command(Command.REQUEST_MESSAGE, JuniorSensors.ID)
        seen.append(bool(bench.latest(JuniorSensors).flags & SensorFlag.EYE_LEFT))
    assert seen == [False, True, True, True, False, False, True]


def test_without_encoders_travel_is_integrated_from_commands() -> None:
    bench = FirmwareBench(encoders=False).armed()
    bench.ask(bench.wheels_message(1.0, -0.5, 1.0))
    bench.run(1100)
    sensors = bench.latest(JuniorSensors)
    assert sensors.travel == (0.4, -0.2)
    assert not sensors.flags & SensorFlag.TRAVEL_FROM_ENCODERS


@pytest.mark.parametrize("kind", [*by_itself(JUNIOR), AutopilotVersion])
def test_a_message_on_request(kind: type[Message]) -> None:
    bench = FirmwareBench()
    bench.run(10)
    bench.clear()
    assert bench.command(Command.REQUEST_MESSAGE, kind.ID) is CommandResult.ACCEPTED
    assert len(bench.got(kind)) == 1


def test_the_version_says_who_it_is() -> None:
    bench = FirmwareBench()
    bench.command(Command.REQUEST_MESSAGE, AutopilotVersion.ID)
    version = bench.latest(AutopilotVersion)
    assert version.middleware_sw_version == 2 << 24 | 1 << 16
    assert version.uid == 0x1122334455667788
    assert version.capabilities & 8192, "speaks MAVLink 2"


@pytest.mark.parametrize("message", [33, 24, 65536, -1, 47100.5 + 2**20, math.nan, 3e38])
def test_messages_it_does_not_have(message: float) -> None:
    bench = FirmwareBench()
    assert bench.command(Command.REQUEST_MESSAGE, message) is CommandResult.UNSUPPORTED
    assert bench.command(Command.SET_MESSAGE_INTERVAL, message, 1000.0) is CommandResult.UNSUPPORTED


@pytest.mark.parametrize(("interval", "per_second"), [(100000.0, 10), (5000.0, 200), (1.0, 200), (-1.0, 0), (0.0, 50)])
def test_intervals(interval: float, per_second: int) -> None:
    bench = FirmwareBench()
    bench.run(100)
    assert bench.command(Command.SET_MESSAGE_INTERVAL, JuniorSensors.ID, interval) is CommandResult.ACCEPTED
    bench.clear()
    bench.run(1000)
    assert len(bench.got(JuniorSensors)) == per_second


@pytest.mark.parametrize("interval", [math.nan, 3e38, -2.0, 3e9, 1e8])
def test_intervals_that_cannot_be(interval: float) -> None:
    bench = FirmwareBench()
    assert bench.command(Command.SET_MESSAGE_INTERVAL, JuniorSensors.ID, interval) is CommandResult.DENIED


def test_a_robot_cannot_be_told_to_hide() -> None:
    assert FirmwareBench().command(Command.SET_MESSAGE_INTERVAL, Heartbeat.ID, -1.0) is CommandResult.DENIED


def test_unknown_commands_are_unsupported_and_those_for_others_unanswered() -> None:
    bench = FirmwareBench()
    assert bench.command(16) is CommandResult.UNSUPPORTED
    assert bench.command(Command.ARM_DISARM, 2.0) is CommandResult.DENIED
    assert bench.command(Command.ARM_DISARM, math.nan) is CommandResult.DENIED
    assert bench.command(Command.ARM_DISARM, 1.0, system=2) is None
    assert bench.command(Command.ARM_DISARM, 1.0, system=0) is None, "to all, only stop and e-stop"
    assert bench.command(Command.REQUEST_MESSAGE, 0.0, system=0) is None
    assert bench.state() is State.DISARMED


def test_all_robots_are_disarmed_at_once() -> None:
    bench = FirmwareBench().armed()
    assert bench.command(Command.ARM_DISARM, 0.0, system=0) is CommandResult.ACCEPTED
    assert bench.state() is State.DISARMED


def test_reboot_is_answered_before_it_happens() -> None:
    bench = FirmwareBench().armed()
    bench.ask(bench.wheels_message(1.0, 1.0, 5.0))
    assert bench.command(Command.PREFLIGHT_REBOOT, 0.0) is CommandResult.DENIED
    assert bench.command(Command.PREFLIGHT_REBOOT, 1.0) is CommandResult.ACCEPTED
    assert bench.wheels == (0, 0)
    assert not bench.io.reboot
    bench.run(20)
    assert bench.io.reboot
    bench.power_on()
    bench.tick()
    assert bench.state() is State.DISARMED
    assert not bench.io.reboot
    assert bench.latest(RobotStatus).boot_count == 2


def test_ping_and_time() -> None:
    bench = FirmwareBench()
    bench.run(100)
    (answer,) = bench.tick(Ping(time_usec=2**63, seq=7))
    assert answer == Ping(time_usec=2**63, seq=7, target_system=255, target_component=190)
    assert bench.tick(Ping(1, 2, 1, 1)) == [], "that is an answer"
    (time,) = bench.tick(Timesync(tc1=0, ts1=-(2**62)))
    assert time == Timesync(tc1=115_000_000, ts1=-(2**62), target_system=255, target_component=190)
    assert bench.tick(Timesync(tc1=5, ts1=6)) == []


def test_the_parameter_list_is_the_table() -> None:
    bench = FirmwareBench()
    bench.tick(ParamRequestList(1, 1))
    bench.run(200)
    values = bench.got(ParamValue)
    assert [(value.param_id, value.param_index) for value in values] == [(p.name, i) for i, p in enumerate(JUNIOR_PARAMETERS)]
    assert [value.param_value for value in values] == pytest.approx([p.default for p in JUNIOR_PARAMETERS], rel=1e-7)
    assert {(value.param_type, value.param_count) for value in values} == {(9, len(JUNIOR_PARAMETERS))}


@pytest.mark.parametrize("index", range(len(JUNIOR_PARAMETERS)))
def test_reading_one_parameter(index: int) -> None:
    bench = FirmwareBench()
    by_name = ask_value(bench, JUNIOR_PARAMETERS[index].name)
    assert bench.tick(ParamRequestRead(1, 1, "", index)) == [by_name]
    assert by_name.param_index == index


def test_a_parameter_that_is_not_there() -> None:
    bench = FirmwareBench()
    for name in ("NO_SUCH", "SPD_FAS", "SPD_FAST2", "", "X" * 16):
        value = ask_value(bench, name)
        assert (value.param_id, value.param_index) == (name, 65535)
        assert math.isnan(value.param_value), "nobody takes it for a value"
        assert bench.tick(ParamSet(1, 1, name, 1.0)) == []
    bench.tick(ParamRequestRead(1, 1, "", len(JUNIOR_PARAMETERS)))
    assert bench.latest(ParamValue).param_index == 65535


@pytest.mark.parametrize("parameter", WRITABLE, ids=lambda p: p.name)
def test_limits_are_kept(parameter: Parameter) -> None:
    bench = FirmwareBench()
    for good in (parameter.minimum, parameter.maximum):
        bench.tick(ParamSet(1, 1, parameter.name, good))
        assert bench.latest(ParamValue).param_value == pytest.approx(good, rel=1e-7)
    bad = [parameter.minimum - 1, parameter.maximum * 1.01 + 1, math.nan, math.inf, -math.inf]
    if parameter.whole:
        bad.append(parameter.minimum + 0.5)
    for value in bad:
        bench.tick(raw=forge(ParamSet(1, 1, parameter.name, 0.0), param_value=value))
        assert bench.latest(ParamValue).param_value == pytest.approx(parameter.maximum, rel=1e-7), "not changed"


def test_read_only_parameters_do_not_change() -> None:
    bench = FirmwareBench()
    (answer,) = bench.tick(ParamSet(1, 1, "MEM_SLOTS", 8.0))
    assert isinstance(answer, ParamValue)
    assert answer.param_value == 32.0


def test_a_new_system_id_is_in_force_after_a_reboot() -> None:
    bench = FirmwareBench()
    bench.tick(ParamSet(1, 1, "SYS_ID", 42.0))
    bench.run(100)
    assert ask_value(bench, "SYS_ID").param_value == 42.0
    bench.power_on()
    bench.tick(HOST)
    assert bench.tick(ParamRequestRead(1, 1, "SYS_ID")) == []
    assert bench.tick(ParamRequestRead(42, 1, "SYS_ID")) != []


def test_a_low_battery_is_said_but_not_all_the_time() -> None:
    bench = FirmwareBench()
    bench.tick(ParamSet(1, 1, "BATT_LOW", 7000.0))
    bench.io.battery_mv = 6900
    bench.run(500)
    bench.io.battery_mv = 7100
    bench.run(500)
    assert not bench.got(Statustext), "a short dip under load is no low battery"
    bench.io.battery_mv = 6900
    bench.run(10000)
    assert len(bench.got(Statustext)) == 1
    assert "attery" in bench.latest(Statustext).text
    bench.run(30000)
    assert len(bench.got(Statustext)) == 2
    assert bench.latest(SysStatus).voltage_battery == 6900


WHEELS, BATTERY, ARMING = 0x8000, 0x2000000, 0x10000000
"""Bits of SYS_STATUS (MAV_SYS_STATUS_SENSOR)."""


def test_the_sensors_of_sys_status_say_what_a_ground_station_shows() -> None:
    bench = FirmwareBench()
    bench.tick(ParamSet(1, 1, "BATT_LOW", 7000.0))

    def sensors(bit: int) -> tuple[bool, bool, bool]:
        status = ask_status(bench)
        words = (
            status.onboard_control_sensors_present,
            status.onboard_control_sensors_enabled,
            status.onboard_control_sensors_health,
        )
        return bool(words[0] & bit), bool(words[1] & bit), bool(words[2] & bit)

    assert [sensors(bit) for bit in (WHEELS, BATTERY, ARMING)] == [(True, False, True), (True, True, True), (True, True, True)]
    assert sensors(0x100000) == (False, False, True), "a geofence that there is not is not breached"
    bench.command(Command.ARM_DISARM, 1.0)
    assert sensors(WHEELS) == (True, True, True)
    bench.command(Command.FLIGHT_TERMINATION, 1.0)
    assert sensors(ARMING) == (True, True, False)
    bench.command(Command.ARM_DISARM, 0.0)
    assert sensors(ARMING) == (True, True, True)
    bench.io.battery_mv = 6900
    assert sensors(BATTERY) == (True, True, False)


def ask_status(bench: FirmwareBench) -> SysStatus:
    bench.command(Command.REQUEST_MESSAGE, SysStatus.ID)
    return bench.latest(SysStatus)


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_there_are_no_missions(kind: int) -> None:
    bench = FirmwareBench()
    assert bench.tick(MissionRequestList(1, 1, kind)) == [MissionCount(255, 190, 0, kind)]
    assert bench.tick(MissionRequestList(0, 0, kind)) == [], "not a question to all"
