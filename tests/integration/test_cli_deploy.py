"""An advice in the robot's own memory: written, verified, and played from with and without a link."""

from __future__ import annotations

import json
import select
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import serial

from firmware_protocol.clock import ManualClock
from firmware_protocol.events import Received
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.messages import BoutOutcome, Heartbeat, State
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.bridge.bridge import Bridge
from hil.cli.app import run
from hil.jobs.deploy import look_on
from hil.mcaplog import LogReader
from hil.sumo import deploying
from hil.sumo.advice_file import save_advice
from hil.sumo.contest import Ending, follow_contest, start_contest
from hil.sumo.deploying import deploy, read_memory
from hil.sumo.junior import Junior
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings
from simdevice.serving.endpoints import PtyEndpoint
from simdevice.serving.server import Server, wait_readable
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from simdevice.sumo.world import World

PUSH = Advice(
    PalSettings(),
    tuple(
        AdviceEntry(ANY_STIMULUS, current, tuple(Action[name] for name in actions.split()), 1.0, 10)
        for current, actions in enumerate(("LBRF LBRF", "LSRF MF", "LFRS MF", "FF FF FF FF"))
    ),
    "flat-light",
)
LINK = "sim://junior?opponent=flat-light&seed=4"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test, with an advice that pushes."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    save_advice(PUSH, tmp_path / "push.advice.toml")
    return tmp_path


def deployed() -> bytes:
    """The EEPROM of a robot that has been given the advice."""
    world = junior_world(WorldSettings(seed=4))
    with Junior(Bridge(MemoryLink(world), world)) as junior:
        junior.find()
        deploy(junior, PUSH)
    return world.device.nvm


def switched_on(nvm: bytes) -> World:
    """A robot with this EEPROM in a ring."""
    world = junior_world(WorldSettings(seed=4, referee=False, nvm=nvm))
    world.match.reset(11, None)
    return world


def poses(world: World) -> tuple[float, ...]:
    """Where everybody is, and what the wheels do."""
    body, other = world.match.robot.body, world.match.opponent
    return body.x, body.y, body.angle, other.x, other.y, other.angle, *world.device.wheels


def test_deploy_verifies_and_says_what_the_robot_does(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["deploy", "push.advice.toml", LINK]) == 0
    said = capsys.readouterr().out
    assert "4 slots read back as they should be" in said
    assert "FF FF FF FF" in said
    (log,) = Path("runs").glob("*-deploy-*/log.mcap")
    reader = LogReader(log)
    written = list(reader.entries({"/junior/memory_write"}))
    assert len(written) == 4


def test_a_contest_is_won_from_memory_and_told_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["deploy", "push.advice.toml", LINK, "--contest", "--json", "--no-log"]) == 0
    said = capsys.readouterr()
    document = json.loads(said.out)
    assert document["verified"] is True
    assert document["contest"]["ending"] == "decided"
    assert document["contest"]["outcome"] == "win"
    assert [slot["situation"] for slot in document["slots"]] == ["none", "left", "right", "both"]
    assert "stands still for 5 s" in said.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--leave"], "--contest"),
        (["--contest", "--leave"], "hil emulate"),
        (["--countdown", "90"], "--countdown"),
    ],
)
def test_wrong_usage_is_told(capsys: pytest.CaptureFixture[str], arguments: list[str], words: str) -> None:
    assert run(["deploy", "push.advice.toml", LINK, *arguments]) == 2
    assert words in capsys.readouterr().err


def test_an_advice_file_that_is_none_moves_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["deploy", "missing.advice.toml", LINK]) == 4
    assert "missing.advice.toml" in capsys.readouterr().err
    assert not Path("runs").exists()


def test_a_memory_that_does_not_hold_what_was_written_falls_short(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(deploying, "read_memory", lambda junior: (read_memory(junior)[0], 0x1234))
    assert run(["deploy", "push.advice.toml", LINK, "--no-log"]) == 1
    assert "checksum is 0x1234" in capsys.readouterr().err


def test_the_robot_stands_still_in_the_countdown_then_plays_and_stops_when_the_host_closes() -> None:
    world = junior_world(WorldSettings(seed=4))
    with Junior(Bridge(MemoryLink(world), world)) as junior:
        junior.find()
        deploy(junior, PUSH)
        start_contest(junior, countdown=2.0)
        begun = world.now()
        moved_after: list[float] = []

        def each(_: State) -> None:
            if any(world.device.wheels):
                moved_after.append(world.now() - begun)

        ended = follow_contest(junior, 2.0, seed=3, each=each)
        assert ended.ending is Ending.DECIDED
        assert ended.outcome is BoutOutcome.WIN
        assert moved_after[0] >= 2.0 - 0.01
    assert world.device.wheels == (0.0, 0.0)


def test_a_robot_that_is_left_plays_on() -> None:
    world = junior_world(WorldSettings(seed=4))
    with Junior(Bridge(MemoryLink(world), world)) as junior:
        junior.find()
        deploy(junior, PUSH)
        start_contest(junior, countdown=1.0)
        junior.leave()
    moved = False
    for _ in range(600):
        world.step(b"")
        moved = moved or any(world.device.wheels)
    assert moved


def test_a_robot_that_ends_its_contest_itself_is_seen_to() -> None:
    world = junior_world(WorldSettings(seed=4, referee=False))
    with Junior(Bridge(MemoryLink(world), world)) as junior:
        junior.find()
        junior.set_parameter("CONTEST_MAX", 3)
        deploy(junior, PUSH)
        start_contest(junior, countdown=1.0)
        assert follow_contest(junior, 1.0).ending is Ending.ROBOT


def test_what_another_robot_on_the_link_says_does_not_end_a_contest() -> None:
    crowd = Crowd(2, WorldSettings(seed=4, referee=False))
    with Junior(Bridge(MemoryLink(crowd), crowd, open_sessions=False)) as junior:
        junior.find(1)
        junior.set_parameter("CONTEST_MAX", 2)
        deploy(junior, PUSH)
        while not any(
            isinstance(event, Received) and event.system == 1 and isinstance(event.message, Heartbeat)
            for event in junior.step()
        ):
            pass
        start_contest(junior, countdown=1.0)  # the next heartbeat is the neighbour's, and it is disarmed
        begun = junior.now()
        assert follow_contest(junior, 1.0).ending is Ending.ROBOT
        assert junior.now() - begun >= 3.0


def test_a_heartbeat_from_before_the_start_does_not_end_a_contest(monkeypatch: pytest.MonkeyPatch) -> None:
    world = junior_world(WorldSettings(seed=4, referee=False))
    with Junior(Bridge(MemoryLink(world), world)) as junior:
        junior.find()
        junior.set_parameter("CONTEST_MAX", 2)
        deploy(junior, PUSH)
        start_contest(junior, countdown=1.0)
        begun, step = junior.now(), junior.step
        heartbeat = junior.peer.heartbeat
        assert heartbeat is not None
        late = [Received(heartbeat, 1, 1, 0, begun + 0.02, b"")]

        def reordered(wait: float) -> list[object]:
            return [*step(wait), *([late.pop()] if late else [])]

        monkeypatch.setattr(junior, "step", reordered)
        assert follow_contest(junior, 1.0).ending is Ending.ROBOT
        assert junior.now() - begun >= 3.0


def test_a_robot_that_is_out_of_reach_is_not_stopped_by_leaving_it() -> None:
    class OneWay:
        """A world that hears, and after a while is not heard any more."""

        def __init__(self) -> None:
            self.world = junior_world(WorldSettings(seed=4, referee=False))
            self.mute = False

        def now(self) -> float:
            return self.world.now()

        def step(self, inbound: bytes) -> bytes:
            out = self.world.step(inbound)
            return b"" if self.mute else out

    line = OneWay()
    with Junior(Bridge(MemoryLink(line), line)) as junior:
        junior.find()
        deploy(junior, PUSH)
        start_contest(junior, countdown=1.0)
        line.mute = True
        ended = look_on(junior, 1.0, 1, lambda _: None)
        assert ended.ending is Ending.OUT_OF_REACH
    moved = False
    for _ in range(200):
        line.step(b"")
        moved = moved or any(line.world.device.wheels)
    assert moved


@pytest.mark.skipif(sys.platform == "win32", reason="there are no ptys on Windows")
def test_a_contest_without_a_link_goes_as_one_with_a_silent_link() -> None:
    nvm = deployed()
    alone = switched_on(nvm)
    alone.device.set_start(go=True)
    path = []
    for _ in range(1800):  # 5 s of countdown, 4 s of play
        alone.step(b"")
        path.append(poses(alone))
    assert alone.match.outcome is BoutOutcome.WIN

    linked = switched_on(nvm)
    linked.device.set_start(go=True)
    seen = []

    class Watched:
        """Notes what the world does while it is served."""

        period = linked.period

        def step(self, inbound: bytes) -> bytes:
            sent = linked.step(inbound)
            seen.append(poses(linked))
            return sent

    clock = ManualClock()

    def wait(files: list[int], timeout: float) -> None:
        wait_readable(files, 0.0)
        clock.advance(timeout)

    endpoint = PtyEndpoint()
    try:
        with serial.Serial(endpoint.path, 115200, timeout=0) as port:
            server = Server(Watched(), endpoint, clock, wait=wait)
            while len(seen) < len(path):
                server.turn()
                if select.select([port], [], [], 0)[0]:
                    port.read(4096)
    finally:
        endpoint.close()
    assert seen[: len(path)] == path
