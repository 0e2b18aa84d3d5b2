"""Losses overcome: in lock-step to the same result as without them, and in real time over ptys and sockets."""

from __future__ import annotations

import itertools
import json
import signal
import socket
import struct
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest
from processes import PATIENCE, Hil
from serving import Stepped, in_thread

import hil
from firmware_protocol.errors import LinkClosedError, PeerLostError
from firmware_protocol.events import Event, LinkNews, PeerBack, PeerLost
from firmware_protocol.roles.junior import perform
from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.sumo.coaching import Coaching, load_checkpoint, new_pal
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import PalSettings
from simdevice.serving.endpoints import TcpEndpoint
from simdevice.sumo.junior_world import junior_world

if TYPE_CHECKING:
    from collections.abc import Iterator

URL: Final = "sim://junior?opponent=flat-light&seed=3"
SETTINGS: Final = PalSettings(budget=40, population=6, elite=1, exam_share=0.2)
COACH: Final = ("--period", "0.05", "--held-out", "0", "--no-report", "--seed", "1")
WATCHDOG: Final = 0.255
"""Silence after which a robot stops its wheels, in s: its parameter and a control period."""

posix = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs POSIX signals and ptys")


# --- in lock-step ----------------------------------------------------------------------------------------------------


def coach(faults: str) -> tuple[dict[str, Any], int, list[Event]]:
    """Coach, and give Pal's state, how many maneuvers the robot says it performed since power-on, and what was told."""
    told: list[Event] = []
    with hil.connect(f"{URL}&faults={faults}", reconnect=30.0) as junior:
        junior.listen(lambda event: told.append(event) if isinstance(event, LinkNews | PeerLost | PeerBack) else None)
        junior.arm()
        coaching = Coaching(open_ring(junior), new_pal(SETTINGS, 3), seed=3)
        coaching.run()
        return coaching.pal.state_dict(), junior.status().maneuvers, told


@pytest.fixture(scope="module")
def undisturbed() -> dict[str, Any]:
    """What is learnt when nothing happens."""
    return coach("drop:0")[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "faults",
    [
        "unplug:0.75+2",
        "unplug:7+0",
        "unplug:7.013+9",
        "unplug:4+3,unplug:9+1,unplug:15.5+8",
        "brownout:6",
        "brownout:6.777",  # it has booted when the next maneuver comes, and nothing was heard of it yet
        "brownout:8.5+4",
        "unplug:6+3,brownout:7+0.5",  # while nobody can see it
    ],
)
def test_a_loss_changes_nothing_of_what_is_learnt(undisturbed: dict[str, Any], faults: str) -> None:
    state, _, told = coach(faults)
    assert state == undisturbed
    assert {type(event) for event in told} >= {LinkNews, PeerLost, PeerBack}


def test_only_the_way_to_where_it_was_is_performed_again(undisturbed: dict[str, Any]) -> None:
    state, performed, told = coach("unplug:7+2")
    assert state == undisturbed
    assert SETTINGS.budget < performed < SETTINGS.budget + 15
    (back,) = [event for event in told if isinstance(event, PeerBack)]
    assert not back.rebooted


def test_the_wheels_are_off_when_the_plug_is_out_and_stay_so_until_somebody_arms() -> None:
    with hil.connect(f"{URL}&faults=unplug:2+3", reconnect=10.0) as junior:
        world: Any = junior.bridge.link._inner._device  # type: ignore[attr-defined]
        junior.arm()
        junior.drive(0.5, 0.5, 0.5)
        maneuver = perform(junior.peer, hil.Maneuver((hil.Action.FF,) * 8, period=1.0, floor_reflex=False))
        moved: list[float] = []
        live = world.run

        def watched(inbound: bytes, _periods: int) -> list[tuple[float, bytes]]:
            out: list[tuple[float, bytes]] = live(inbound, 1)  # to look after each control period
            if world.device.wheels != (0.0, 0.0):
                moved.append(world.now())
            return out

        world.run = watched
        while not maneuver.done:
            junior.step()
        assert isinstance(maneuver.error, PeerLostError)
        told = junior.now()
        assert told == pytest.approx(2.0, abs=0.006)
        with pytest.raises(PeerLostError, match="out of reach"):
            junior.drive(0.5, 0.5)
        junior.wait_until_back()
        assert 5.0 <= junior.now() < 5.6
        assert moved[-1] <= told + WATCHDOG
        junior.wait(2.0)
        assert moved[-1] <= told + WATCHDOG
        assert not junior.armed
        junior.arm()
        junior.perform(["S"], period=0.1)


def test_one_that_is_not_waited_for_is_lost_as_ever() -> None:
    with hil.connect(f"{URL}&faults=unplug:1+1") as junior:
        with pytest.raises(LinkClosedError, match=r"unplugged$"):
            junior.wait(5.0)
        assert junior.now() < 1.1
    with hil.connect(f"{URL}&faults=brownout:1", reconnect=0.0) as junior:
        junior.arm()
        with pytest.raises(PeerLostError, match="has restarted"):
            junior.perform("F F F F")
        with pytest.raises(PeerLostError, match="has restarted"):
            junior.wait_until_back()


def test_one_that_stays_silent_is_given_up_after_the_patience() -> None:
    with hil.connect(f"{URL}&faults=drop:1@2", reconnect=4.0) as junior:
        junior.arm()
        with pytest.raises(PeerLostError, match="fell silent"):
            junior.perform("S S S S", period=1.0)
        lost = junior.now()
        with pytest.raises(PeerLostError, match="did not come back within 4 s"):
            junior.wait_until_back()
        assert junior.now() == pytest.approx(lost + 4.0, abs=0.01)


@pytest.mark.parametrize("patience", [-1.0, float("nan"), float("inf")])
def test_a_patience_that_is_no_time_is_refused(patience: float) -> None:
    with pytest.raises(ValueError, match="number of seconds"):
        hil.connect(URL, reconnect=patience)


def test_the_command_tells_what_happens_and_the_log_goes_on(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    coaching = ["coach", "--budget", "30", "--held-out", "0", "--no-report", "--quiet"]
    assert run([*coaching, "sim://junior?seed=1&faults=drop:0", "--no-log", "--advice-out", "plain.toml"]) == 0
    faulty = "sim://junior?seed=1&faults=unplug:5+2,brownout:10+0.5"
    assert run([*coaching[:-1], faulty, "--log", "run.mcap", "--advice-out", "lost.toml"]) == 0
    assert Path("lost.toml").read_text() == Path("plain.toml").read_text()
    said = capsys.readouterr().out
    assert "unplugged; trying for 30 s to open it again" in said
    assert "the link is back after 2." in said
    assert "robot 1 is lost: it has restarted; waiting 30 s for it" in said
    assert "robot 1 is back, restarted" in said
    reader = LogReader(Path("run.mcap"))
    events = [entry.value.text for entry in reader.entries({"/events"})]
    assert sum("is interrupted: robot 1" in text for text in events) == 2
    assert sum("robot 1 is lost" in text for text in events) == 2
    trials = [entry.value.id for entry in reader.entries({"/pal/trial"})]
    assert len(trials) == len(set(trials)) == 30
    heard = [entry.time for entry in reader.entries({"/wire/rx"})]
    assert max(b - a for a, b in itertools.pairwise(heard)) >= 2.0
    assert heard[-1] > 15
    assert not reader.truncated
    assert not reader.damage


def test_the_command_gives_up_after_the_time_asked_for(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    url = "sim://junior?seed=1&faults=unplug:5+100"
    for verb in (["coach", "--held-out", "0"], ["bout", "--controller", "chase"], ["monitor"]):
        assert run([*verb, url, "--reconnect", "2", "--no-log", "--quiet"]) == 3
        assert "unplugged; it did not come back within 2 s" in capsys.readouterr().err
        assert run([*verb, url, "--reconnect", "0", "--no-log", "--quiet"]) == 3
        assert capsys.readouterr().err == f"hil: {url}: unplugged\n"
    saved = [load_checkpoint(path).pal.used for path in Path("runs").glob("*-coach-robot*/checkpoint.json")]
    assert len(saved) == 2
    assert not list(Path("runs").glob("*-bout-*")) + list(Path("runs").glob("*-monitor-*"))


def test_the_monitor_says_that_the_link_is_lost_and_comes_back(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["monitor", "sim://junior?seed=1&faults=unplug:3+2", "--duration", "8", "--no-log"]) == 0
    lines = capsys.readouterr().out.splitlines()
    lost = next(k for k, line in enumerate(lines) if "trying for 30 s" in line)
    back = next(k for k, line in enumerate(lines) if "robot 1 is back" in line)
    assert all("no link" in line for line in lines[lost + 1 : back] if "battery" in line)
    assert "disarmed" in lines[back + 1]


# --- in real time ----------------------------------------------------------------------------------------------------


def emulator(folder: Path, link: str) -> Hil:
    return Hil(folder, "emulate", "junior", "--link", link, "--speed", "2", "--memory", "robot.nvm", "--json")


def address_of(robot: Hil) -> str:
    return str(json.loads(robot.until('"url"'))["url"])


@pytest.mark.slow
@posix
def test_an_emulator_killed_and_started_again_on_another_pty_is_found_and_coached_on(tmp_path: Path) -> None:
    port = tmp_path / "robot"
    with emulator(tmp_path, "pty") as robot:
        port.symlink_to(address_of(robot).removeprefix("serial://").partition(":")[0])
        with Hil(tmp_path, "coach", f"serial://{port}:115200", *COACH, "--budget", "14", "--log", "run.mcap") as coaching:
            coaching.until("Connected to Junior")
            coaching.until("/14 maneuvers")
            port.unlink()
            robot.send(signal.SIGKILL)
            coaching.until("trying for 30 s to open it again")
            with emulator(tmp_path, "pty") as again:
                port.symlink_to(address_of(again).removeprefix("serial://").partition(":")[0])
                coaching.until("robot 1 is back, restarted")
                assert coaching.end() == 0, coaching.text
    assert "Traceback" not in coaching.text
    (made,) = (tmp_path / "runs").iterdir()
    saved = load_checkpoint(made / "checkpoint.json")
    assert saved.pal.finished
    assert saved.pal.used == 14
    reader = LogReader(tmp_path / "run.mcap")
    trials = [entry.value.id for entry in reader.entries({"/pal/trial"})]
    assert len(trials) == len(set(trials)) == 14
    assert not reader.truncated


class Resetting(TcpEndpoint):
    """A TCP port whose connection is reset when the test says so."""

    def __init__(self) -> None:
        super().__init__("127.0.0.1", 0)
        self.reset = threading.Event()

    def poll(self, now: float) -> None:
        if self.reset.is_set() and self._client is not None:
            self.reset.clear()
            self._client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self._drop()
        super().poll(now)


class Watched(Stepped):
    """A world that can be waited for."""

    def __init__(self) -> None:
        self.world = junior_world()
        super().__init__(self.world)


@contextmanager
def served() -> Iterator[tuple[Resetting, Watched]]:
    """An emulated robot in a thread of this process, over TCP."""
    world, endpoint = Watched(), Resetting()
    with in_thread(world, endpoint, speed=2):
        yield endpoint, world


@pytest.mark.slow
def test_a_connection_that_is_reset_in_the_middle_of_a_maneuver_is_overcome(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with served() as (endpoint, robot):

        def pull() -> None:
            robot.until(lambda: robot.world.device.wheels != (0.0, 0.0))
            endpoint.reset.set()

        puller = threading.Thread(target=pull)
        puller.start()
        assert run(["coach", endpoint.url, *COACH, "--budget", "8", "--no-log", "--json"]) == 0
        puller.join(PATIENCE)
    said = capsys.readouterr()
    assert json.loads(said.out)["maneuvers"] == 8
    assert "trying for 30 s to open it again" in said.err
    assert "robot 1 is back\n" in said.err
