"""The firmware on a board whose memory and line are slow, as on a micro-controller at 115200 baud."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
from firmware_bench import HOST, TICK, FirmwareBench

from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    CommandResult,
    Heartbeat,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorSensors,
    ParamRequestList,
    ParamSet,
    ParamValue,
    Ping,
    Reason,
    RobotAck,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.vocabulary import Action
from simdevice._host import lib

EEPROM, BUFFER, LINE = 1, 192, 57
"""Bytes a tick, bytes, bytes a tick."""


@pytest.fixture
def bench() -> FirmwareBench:
    bench = FirmwareBench().armed()
    lib.host_slow_down(bench.robot, EEPROM, BUFFER, LINE)
    bench.clear()
    return bench


def test_everything_gets_through_and_nothing_starves(bench: FirmwareBench) -> None:
    bench.perform((Action.FF,), 0.05)
    bench.tick(ParamRequestList(1, 1))
    bench.command(Command.REQUEST_MESSAGE, AutopilotVersion.ID)
    bench.run(995)
    assert [value.param_index for value in bench.got(ParamValue)] == list(range(len(JUNIOR_PARAMETERS)))
    assert len(bench.got(AutopilotVersion)) == 1
    assert len(bench.got(JuniorManeuverResult)) >= 5
    assert len(bench.got(Heartbeat)) == 1
    assert len(bench.got(JuniorSensors)) >= 45


def test_no_more_is_sent_than_the_line_carries(bench: FirmwareBench) -> None:
    bench.command(Command.SET_MESSAGE_INTERVAL, JuniorSensors.ID, 5000.0)
    sent = 0
    for i in range(200):
        bench.tick(*[Ping(time_usec=2**60 + i, seq=j) for j in range(4)])
        sent += bench.io.tx_len
    assert sent <= 201 * LINE + BUFFER


def test_a_maneuver_is_stored_byte_by_byte_while_the_robot_goes_on(bench: FirmwareBench) -> None:
    bench.perform((Action.FF,), 5.0)
    message = bench.write_message((Action.FF, Action.SB), current=1)
    assert bench.ask(message) is None, "not yet"
    ticks = 1
    while bench.latest(RobotAck).sequence != message.sequence:
        assert bench.tick(*([message] if ticks % 5 == 0 else [HOST])) is not None
        assert bench.wheels == (1000, 1000)
        ticks += 1
    assert 10 <= ticks <= 20
    assert [ack.reason for ack in bench.got(RobotAck) if ack.sequence == message.sequence] == [Reason.NONE]
    bench.tick(bench.read_message(0))
    assert bench.latest(JuniorMemoryEntry).actions[:2] == (Action.FF, Action.SB)


def test_a_write_that_finds_the_memory_busy_is_done_when_it_is_repeated(bench: FirmwareBench) -> None:
    for i, name in enumerate(("EYE_L_ON", "EYE_R_ON", "ARM_HOLD")):
        bench.tick(ParamSet(1, 1, name, 300.0 + i))
    message = bench.write_message((Action.FF,), current=1)
    for _ in range(4):
        bench.tick(message)
        bench.run(60)
    assert {ack.reason for ack in bench.got(RobotAck) if ack.sequence == message.sequence} == {Reason.NONE}
    bench.power_on()
    bench.open()
    bench.tick(bench.read_message(0))
    assert bench.latest(JuniorMemoryEntry).used == 1
    for i, name in enumerate(("EYE_L_ON", "EYE_R_ON", "ARM_HOLD")):
        bench.tick(ParamSet(1, 1, name, -1.0))
        assert bench.latest(ParamValue).param_value == 300.0 + i


def test_what_was_being_stored_for_one_host_is_not_answered_to_the_next(bench: FirmwareBench) -> None:
    taken = bench.write_message((Action.FF,), current=1)
    assert bench.ask(taken) is None, "not yet"
    bench.session = 99
    bench.open(99)
    bench.clear()
    other = replace(bench.write_message((Action.SF,), current=2), sequence=taken.sequence)
    assert bench.ask(other) is None, "the memory is busy"
    bench.run(300)
    assert not bench.got(RobotAck), "what the new host asked for has not been stored"
    bench.tick(other)
    bench.run(300)
    assert bench.latest(RobotAck).reason == Reason.NONE
    bench.tick(bench.read_message(255, current=2))
    assert bench.latest(JuniorMemoryEntry).actions[0] == Action.SF


def test_an_emergency_stop_does_not_wait_for_the_memory(bench: FirmwareBench) -> None:
    bench.perform((Action.FF,), 5.0)
    bench.tick(bench.write_message((Action.FF,), current=1))
    bench.stop()
    assert bench.wheels == (0, 0)


def test_a_reboot_waits_for_what_is_being_stored(bench: FirmwareBench) -> None:
    bench.tick(ParamSet(1, 1, "EYE_L_ON", 321.0))
    bench.command(Command.PREFLIGHT_REBOOT, 1.0)
    for _ in range(20):
        bench.tick()
        if bench.io.reboot:
            break
    assert bench.now >= 8 * TICK
    bench.power_on()
    bench.tick(ParamSet(1, 1, "EYE_L_ON", -1.0))
    assert bench.latest(ParamValue).param_value == 321.0


def test_a_robot_about_to_reboot_does_not_arm(bench: FirmwareBench) -> None:
    bench.tick(ParamSet(1, 1, "EYE_L_ON", 321.0))
    bench.command(Command.PREFLIGHT_REBOOT, 1.0)
    while not bench.io.reboot:
        assert bench.command(Command.ARM_DISARM, 1.0) is CommandResult.TEMPORARILY_REJECTED
    assert bench.command(Command.ARM_DISARM, 1.0) is CommandResult.TEMPORARILY_REJECTED, "it may take a moment"
    bench.power_on()
    bench.arm()


@pytest.mark.parametrize("late", [45, 500, 5000])
def test_a_stream_does_not_catch_up_in_a_burst_after_a_late_tick(late: int) -> None:
    bench = FirmwareBench()
    bench.run(1000)
    bench.clear()
    bench.now += late  # ms in which it did not get to its streams
    counts = []
    for _ in range(60):
        before = len(bench.got(JuniorSensors))
        bench.tick()
        counts.append(len(bench.got(JuniorSensors)) - before)
    assert max(counts) == 1
    sent = [index for index, count in enumerate(counts) if count]
    assert sent[0] == 0
    assert all(b - a >= 3 for a, b in itertools.pairwise(sent)), "50 Hz, as ever"
    assert len(sent) in {15, 16}
