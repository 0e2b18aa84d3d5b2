"""What stops the wheels when nobody says so: silence, a deadline, a stick let go."""

from __future__ import annotations

import pytest
from firmware_bench import HEARTBEAT, HOST, TICK, FirmwareBench

from firmware_protocol.messages import (
    ContestCommand,
    JuniorManeuverResult,
    ManualControl,
    ParamSet,
    Ping,
    Reason,
    State,
    Statustext,
)
from firmware_protocol.vocabulary import Action, Outcome
from firmware_protocol.wire.mavlink import MavlinkCodec


def silent_ticks(bench: FirmwareBench, raw: bytes = b"") -> int:
    """Ticks of silence until the wheels stand."""
    for ticks in range(1, 2000):
        bench.tick(raw=raw)
        if bench.wheels == (0, 0):
            return ticks
    raise AssertionError("the wheels never stopped")


@pytest.mark.parametrize("watchdog", [50, 250, 1000])
def test_silence_stops_a_maneuver_when_the_watchdog_says_so(watchdog: int) -> None:
    bench = FirmwareBench().armed()
    bench.tick(ParamSet(1, 1, "WATCHDOG", float(watchdog)))
    bench.perform((Action.FF,), 5.0)
    assert silent_ticks(bench) * TICK == watchdog
    assert bench.state() is State.READY
    result = bench.result()
    assert (result.outcome, result.reason) == (Outcome.STOPPED, Reason.WATCHDOG)
    bench.run(300, alive=False)
    assert "host" in bench.latest(Statustext).text


def test_silence_stops_driving_before_its_deadline() -> None:
    bench = FirmwareBench().armed()
    assert bench.ask(bench.wheels_message(0.5, 0.5, 5.0)) is Reason.NONE
    assert silent_ticks(bench) * TICK == 250


def test_the_host_s_word_that_it_is_there_keeps_it_going() -> None:
    bench = FirmwareBench().armed()
    bench.perform((Action.FF,), 5.0)
    for i in range(400):
        bench.tick(*([HOST] if i % 49 == 48 else []))
        assert bench.state() is State.PERFORMING


def test_any_good_frame_of_a_ground_station_that_armed_keeps_it_going() -> None:
    bench = FirmwareBench()
    bench.arm()
    bench.tick(ParamSet(1, 1, "WATCHDOG", 50.0))
    bench.tick(ManualControl(target=1, x=600, r=0))
    for _ in range(24):
        bench.tick()
        bench.tick(Ping(time_usec=1, seq=1))
        assert bench.state() is State.DRIVING
    bench.tick(ManualControl(target=1, x=600, r=0))
    assert silent_ticks(bench) * TICK == 50


def test_others_and_damaged_frames_do_not_keep_it_going() -> None:
    other = MavlinkCodec(system=254, component=190)
    for raw in (other.encode(HEARTBEAT), bytes([*FirmwareBench().host.encode(HOST)[:-1], 0])):
        bench = FirmwareBench().armed()
        bench.perform((Action.FF,), 5.0)
        assert silent_ticks(bench, raw) * TICK == 250


def test_a_contest_ignores_silence() -> None:
    bench = FirmwareBench().armed()
    bench.ask(bench.write_message((Action.FF,), current=0))
    assert bench.ask(bench.contest_message(ContestCommand.START, 1.0)) is Reason.NONE
    bench.run(5000, alive=False)
    assert bench.state() is State.CONTEST
    assert bench.wheels == (1000, 1000)


@pytest.mark.parametrize(("duration", "ticks"), [(0.0, 0), (0.001, 1), (0.1, 20), (0.102, 21)])
def test_wheels_stop_when_their_time_is_over(duration: float, ticks: int) -> None:
    bench = FirmwareBench().armed()
    assert bench.ask(bench.wheels_message(-0.25, 1.0, duration)) is Reason.NONE
    seen = 0
    while bench.wheels != (0, 0):
        assert bench.wheels == (-250, 1000)
        assert bench.state() is State.DRIVING
        seen += 1
        bench.tick(HOST)
    assert seen == ticks
    assert bench.state() is State.READY


def test_a_stick_let_go_stops_the_wheels() -> None:
    bench = FirmwareBench()
    bench.arm()
    bench.tick(ManualControl(target=1, x=600, r=300))
    assert bench.wheels == (900, 300)
    for _ in range(49):
        bench.tick(HOST)
        assert bench.wheels == (900, 300)
    bench.tick(HOST)
    assert bench.wheels == (0, 0)
    assert bench.state() is State.READY


@pytest.mark.parametrize(
    ("control", "wheels"),
    [
        (ManualControl(target=1, x=1000, r=1000), (1000, 0)),
        (ManualControl(target=1, x=-1000, r=1000), (0, -1000)),
        (ManualControl(target=1, x=32767, r=200), (200, -200)),
        (ManualControl(target=1, x=500, r=32767), (500, 500)),
        (ManualControl(target=1, x=1001, r=0), (0, 0)),
        (ManualControl(target=1, x=0, r=-1001), (0, 0)),
        (ManualControl(target=2, x=500, r=0), (0, 0)),
        (ManualControl(target=0, x=500, r=0), (0, 0)),
    ],
)
def test_sticks(control: ManualControl, wheels: tuple[int, int]) -> None:
    bench = FirmwareBench()
    bench.arm()
    bench.tick(control)
    assert bench.wheels == wheels


def test_only_the_system_that_armed_drives_by_stick() -> None:
    bench = FirmwareBench()
    bench.arm()
    bench.tick(raw=MavlinkCodec(system=9, component=1).encode(ManualControl(target=1, x=500, r=0)))
    assert bench.wheels == (0, 0)


def test_the_watchdog_says_nothing_to_a_robot_at_rest() -> None:
    bench = FirmwareBench().armed()
    bench.run(5000, alive=False)
    assert bench.state() is State.READY
    assert not bench.got(Statustext)
    assert not bench.got(JuniorManeuverResult)
