"""A robot with something wrong with it keeps every safety rule, its runs end, and the log says what was wrong."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

import hil
from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError, PeerLostError, RefusedError
from firmware_protocol.faults.failures import FailureType
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.links import FaultyLink, MemoryLink
from firmware_protocol.messages import Command, CommandLong, Heartbeat, State
from firmware_protocol.wire.mavlink import split_frames
from hil.bridge.bridge import Bridge
from hil.bridge.networks import Networks
from hil.cli.app import run
from hil.connecting.connecting import fault_option
from hil.mcaplog.reading.reader import LogReader
from hil.recording.recorder import Recorder
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.ring import open_ring
from hil.sumo.robots import Robots
from pal_advisor.maneuvers import PalSettings
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from simdevice.sumo.world import World

WATCHDOG: Final = 0.25
"""Longest silence of the host, in s."""
BAD_ROBOTS: Final = (
    "wheel:left",
    "wheel:right:0.3@1",
    "stuck:eye_left:1023,stuck:eye_right:0",
    "stuck:floor_left:1023,stuck:floor_right:1023",
    "stuck:floor_left@1,stuck:arm_left:1@1,stuck:arm_right@1",
    "battery:3.7",
    "battery:5@1,wheel:left:0.5@1,stuck:eye_right@1",
)
"""What may be wrong with a robot while it runs."""


class Watched:
    """A world with faults that remembers when it last heard the host, and when its wheels were turned on."""

    def __init__(self, faults: str) -> None:
        self.world: World = junior_world(WorldSettings(seed=5, faults=FaultSpec.parse(faults)))
        self.heard = 0.0
        self.moved = 0.0

    def now(self) -> float:
        return self.world.now()

    def step(self, inbound: bytes) -> bytes:
        out = self.world.step(inbound)
        if inbound:
            self.heard = self.now()
        if self.world.device.wheels != (0.0, 0.0):
            self.moved = self.now()
        return out

    def pass_time(self, seconds: float) -> None:
        """The host is silent."""
        for _ in range(round(seconds / self.world.period)):
            self.step(b"")

    def connect(self, faults: str = "") -> hil.Junior:
        link: MemoryLink | FaultyLink = MemoryLink(self)
        if faults:
            link = FaultyLink(link, FaultSpec.parse(faults), seed=1, clock=self, split=split_frames)
        sessions = count(1)
        junior = hil.Junior(Bridge(link, self, session=sessions.__next__), hil.Limits(duration=5.0))
        junior.find()
        return junior


@pytest.fixture(params=BAD_ROBOTS)
def driven(request: pytest.FixtureRequest) -> Iterator[tuple[Watched, hil.Junior]]:
    """A robot with something wrong with it, 1.2 s old at least, whose wheels are told to turn for 5 s."""
    watched = Watched(request.param)
    junior = watched.connect()
    junior.arm()
    junior.wait(max(0.0, 1.2 - watched.now()))
    junior.drive(-0.5, 0.5, 5.0)
    junior.wait(0.2)
    assert watched.world.device.wheels == (-0.5, 0.5)
    yield watched, junior
    junior.close()


def test_the_watchdog_stops_it(driven: tuple[Watched, hil.Junior]) -> None:
    watched, _ = driven
    watched.pass_time(1.0)
    assert watched.heard < watched.moved <= watched.heard + WATCHDOG + watched.world.period + 1e-9


def test_the_emergency_stop_stops_it_at_once_and_holds(driven: tuple[Watched, hil.Junior]) -> None:
    watched, junior = driven
    junior.bridge.send(CommandLong(1, 1, Command.FLIGHT_TERMINATION, param1=1.0))
    junior.step(watched.world.period)
    assert watched.now() - watched.moved <= watched.world.period + 1e-9
    with pytest.raises(RefusedError, match="emergency stop"):
        junior.drive(0.5, 0.5)
    assert watched.world.device.wheels == (0.0, 0.0)


def test_disarmed_it_does_not_turn_a_wheel(driven: tuple[Watched, hil.Junior]) -> None:
    watched, junior = driven
    junior.disarm()
    asked = watched.now()
    with pytest.raises(RefusedError, match="not armed"):
        junior.drive(0.5, 0.5)
    with pytest.raises(RefusedError, match="not armed"):
        junior.perform("FF FF")
    assert watched.moved <= asked


@pytest.mark.parametrize("dark", ["0", "0.3", "1.5"])
def test_a_brown_out_leaves_it_disarmed_and_the_host_told(dark: str) -> None:
    watched = Watched(f"brownout:2+{dark}")
    junior = watched.connect()
    junior.arm()
    with pytest.raises(PeerLostError):  # noqa: PT012 - whichever of them notices
        while watched.now() < 10:
            junior.perform("FB FF L R")
    assert watched.moved <= 2.0 + watched.world.period  # nothing turned since
    watched.pass_time(2.0)
    while watched.now() < 12 and not junior.peer.ready:
        junior.step(0.05)
    assert junior.finish(junior.peer.request(Heartbeat)).custom_mode == State.DISARMED
    with pytest.raises(RefusedError, match="not armed"):
        junior.drive(0.5, 0.5)
    assert watched.moved <= 2.0 + watched.world.period
    assert junior.status().boot_count == 2
    junior.arm()  # a person's, or a program's, decision
    assert junior.perform("FB FF").done == 2
    junior.close()


def test_a_brown_out_while_nothing_was_asked_is_no_refusal() -> None:
    watched = Watched("brownout:3")
    junior = watched.connect()
    junior.arm()
    junior.wait(4.0 - watched.now())
    assert junior.peer.ready  # lost and back: nobody was told by an error
    with pytest.raises(PeerLostError, match="lost since it was armed"):
        junior.perform("FB FF")
    junior.arm()
    assert junior.perform("FB FF").done == 2
    junior.disarm()
    with pytest.raises(RefusedError, match="not armed"):
        junior.perform("FB FF")
    junior.close()


def test_it_comes_out_of_a_brown_out_with_its_emergency_stop_ended_and_disarmed() -> None:
    watched = Watched("brownout:3+0.2")
    junior = watched.connect()
    junior.arm()
    junior.emergency_stop()
    watched.pass_time(4.0)
    assert watched.moved == 0.0
    assert watched.world.device.uptime < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("faults", BAD_ROBOTS)
def test_coaching_it_comes_to_its_end(faults: str) -> None:
    settings = PalSettings(budget=40, population=6, elite=1)
    with hil.connect(f"sim://junior?seed=3&faults={faults},drop:0.02") as junior:
        junior.arm()
        coaching = Coaching(open_ring(junior), new_pal(settings, 3), seed=3)
        coaching.run()
        assert coaching.pal.used == settings.budget
        assert junior.status().maneuvers <= settings.budget


def test_the_log_holds_the_specification_and_when_faults_began_and_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad-day.toml").write_text(
        'drop = [0.02, {value = 0.2, at = 3, lasts = 1}]\n[[stuck]]\nsensor = "eye_left"\nat = 2\nlasts = 2\n', encoding="utf-8"
    )
    options = ("--budget", "15", "--held-out", "0", "--no-report", "--quiet", "--log", "bad.mcap")
    assert run(["coach", "sim://junior?seed=2&faults=@bad-day.toml", *options]) == 0
    log = LogReader(Path("bad.mcap"))
    told = [(entry.time, entry.value.text) for entry in log.entries({"/events"}) if entry.value.text.startswith("fault")]
    assert [text for _, text in told] == [
        "fault begins: stuck:eye_left@2+2",
        "fault begins: drop:0.2@3+1",
        "fault ends: drop:0.2@3+1",
        "fault ends: stuck:eye_left@2+2",
    ]
    assert [time for time, _ in told] == pytest.approx([2, 3, 4, 4], abs=0.1)
    assert log.metadata["config"]["faults"] == "drop:0.02,drop:0.2@3+1,stuck:eye_left@2+2"


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("sim://junior?faults=stuck:nose", "no sensor 'nose'"),
        ("sim://junior?faults=@nothing.toml", "cannot read the fault file nothing.toml"),
        ("tcp://127.0.0.1:5760?faults=wheel:left", "hil emulate --faults"),
    ],
)
def test_an_address_with_wrong_faults_is_refused(url: str, said: str) -> None:
    with pytest.raises(AddressError, match=said):
        fault_option(parse_address(url))


def test_a_robot_rehearses_a_failure_and_the_log_says_so(tmp_path: Path) -> None:
    watched = Watched("")
    recorder = Recorder(tmp_path / "log.mcap", run={}, config={}, link="sim://junior", lockstep=True)
    bridge = Bridge(MemoryLink(watched), watched, taps=[recorder], session=lambda: 7)
    with recorder, hil.Junior(bridge) as junior:
        junior.find()
        with pytest.raises(RefusedError, match="FAIL_ENABLE is 0"):
            junior.inject_failure("wheel_left")
        junior.set_parameter("FAIL_ENABLE", 1)
        with pytest.raises(RefusedError, match="be garbage"):
            junior.inject_failure("wheel_left", FailureType.GARBAGE)
        with pytest.raises(ValueError, match="no part 'nose'"):
            junior.inject_failure("nose")
        junior.inject_failure("wheel_left")
        junior.inject_failure("eye_right", FailureType.STUCK)
        junior.arm()
        junior.drive(-0.5, -0.5)
        junior.wait(0.1)
        assert watched.world.device.wheels == (0.0, -0.5)
        junior.inject_failure("wheel_left", FailureType.OK)
        junior.drive(-0.5, -0.5)
        junior.wait(0.1)
        assert watched.world.device.wheels == (-0.5, -0.5)
    told = [entry.value for entry in LogReader(tmp_path / "log.mcap").entries({"/events"}) if entry.value.kind == "fault"]
    assert [event.text for event in told] == [
        "fault begins: wheel_left off, rehearsed",
        "fault begins: eye_right stuck, rehearsed",
        "fault ends: wheel_left, rehearsed",
    ]


def test_two_robots_that_rehearse_at_once_are_both_in_the_log(tmp_path: Path) -> None:
    crowd = Crowd(2, WorldSettings(seed=4))
    recorder = Recorder(tmp_path / "log.mcap", run={}, config={}, link="sim://junior?count=2", lockstep=True)
    networks = Networks()
    networks.add("line", Bridge(MemoryLink(crowd), crowd, taps=[recorder]))
    with recorder, Robots(networks) as robots:
        robots.find(expect=2)
        for junior in robots:
            junior.set_parameter("FAIL_ENABLE", 1)
        parts = {1: "wheel_left", 2: "eye_right"}
        asked = robots.ask(lambda junior: junior.peer.inject_failure(parts[junior.peer.system], FailureType.OFF))
        assert len(asked.values) == 2
    told = [entry.value for entry in LogReader(tmp_path / "log.mcap").entries({"/events"}) if entry.value.kind == "fault"]
    assert {(event.text, event.fields) for event in told} == {
        ("fault begins: wheel_left off, rehearsed", '{"system": 1}'),
        ("fault begins: eye_right off, rehearsed", '{"system": 2}'),
    }
