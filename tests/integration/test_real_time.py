"""The same job over a pty and a socket, as time passes; and what happens when somebody pulls the plug."""

from __future__ import annotations

import json
import re
import signal
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import pytest
from processes import Hil
from serving import Stepped, in_thread

from firmware_protocol.events import Received
from firmware_protocol.messages import Heartbeat, State
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.mcaplog.writing.writer import CUT
from hil.runs import load_run
from hil.sumo.coaching import load_checkpoint
from simdevice.serving.opening import open_endpoint
from simdevice.sumo.junior_world import junior_world

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SPEED: Final = 2
"""Seconds of emulation per second: the watchdog then takes 125 ms, three of the host's keep-alives."""
COACH: Final = ("--period", "0.05", "--held-out", "0", "--no-report")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs POSIX signals and ptys"),
]


class Watched(Stepped):
    """An emulated robot that another thread serves, and the test can wait for.

    Attributes:
        state: What the robot's last heartbeat said it does.
    """

    def __init__(self) -> None:
        self.state = State.DISARMED
        self._world = junior_world()
        self._codec = MavlinkCodec(system=250, component=1)
        super().__init__(self._world)

    @property
    def wheels(self) -> tuple[float, float]:
        return self._world.device.wheels

    def now(self) -> float:
        return self._world.now()

    def heard(self, out: bytes) -> None:
        for event in self._codec.receive(out, self.now()):
            if isinstance(event, Received) and isinstance(event.message, Heartbeat) and event.component == 1:
                self.state = State(event.message.custom_mode)

    def moving(self) -> bool:
        return self.wheels != (0.0, 0.0)


@contextmanager
def served(link: str) -> Iterator[tuple[str, Watched]]:
    """An emulated robot in real time, in a thread of this process: its address, and the robot to look at."""
    watched, endpoint = Watched(), open_endpoint(link)
    with in_thread(watched, endpoint, speed=SPEED):
        yield endpoint.url, watched


def emulator(folder: Path) -> Hil:
    """An emulated robot in a process of its own."""
    return Hil(folder, "emulate", "junior", "--link", "pty", "--speed", str(SPEED), "--json")


def address_of(robot: Hil) -> str:
    """Where an emulator says that it is."""
    return str(json.loads(robot.until('"url"'))["url"])


def watch(log: Path) -> tuple[LogReader, set[str]]:
    """Read a whole log: the reader, and the kinds of its events."""
    reader = LogReader(log)
    return reader, {entry.value.kind for entry in reader.entries({"/events"})}


@pytest.mark.parametrize(
    ("link", "options"),
    [
        ("pty", ""),
        ("tcp://127.0.0.1:0", ""),
        ("udp://127.0.0.1:0", ""),
        ("pty", "?faults=drop:0.05,corrupt:0.01,jitter:0.01&seed=3"),
    ],
)
def test_the_main_job_in_real_time(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, link: str, options: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with served(link) as (url, robot):
        assert run(["coach", url + options, *COACH, "--budget", "10", "--json", "--log", "run.mcap"]) == 0
        assert not robot.moving()
    document = json.loads(capsys.readouterr().out)
    assert (document["maneuvers"], document["opponent"], document["objective"]) == (10, "flat-light", "outcome")
    assert document["robot_seconds"] > 10 * 0.15 / SPEED
    reader, kinds = watch(tmp_path / "run.mcap")
    assert not reader.truncated
    assert {"link", "series", "result"} <= kinds
    assert (tmp_path / document["advice"]).is_file()


def test_a_robot_that_dies_is_told_and_the_run_can_be_gone_on_with(tmp_path: Path) -> None:
    with emulator(tmp_path) as robot:
        url = address_of(robot)
        with Hil(tmp_path, "coach", url, *COACH, "--budget", "20", "--log", "first.mcap", "--reconnect", "0.3") as coach:
            coach.until("6/20 maneuvers")
            robot.send(signal.SIGKILL)
            assert coach.end() == 3
    # Another program may have been given a terminal of that name meanwhile: then the port is there, and no robot at it.
    assert re.search(rf"hil: {re.escape(url)}: (the port is gone|robot 1 did not come back)", coach.text)
    (first,) = (tmp_path / "runs").iterdir()
    assert f"hil coach {url} --resume-from runs/{first.name}" in coach.text
    assert load_run(first).record.state == "failed"
    assert "Traceback" not in coach.text
    reader, kinds = watch(tmp_path / "first.mcap")
    assert not reader.truncated
    assert not reader.damage
    assert "link" in kinds
    saved = load_checkpoint(first / "checkpoint.json")
    assert 6 <= saved.pal.used < 20
    with emulator(tmp_path) as robot:
        url = address_of(robot)
        with Hil(tmp_path, "coach", url, *COACH, "--resume", "--log", "second.mcap") as coach:
            assert coach.end() == 0, coach.text
        assert f"{saved.pal.used} of them done already" in coach.text
        robot.send(signal.SIGTERM)
        assert robot.end() == 130
    (second,) = set((tmp_path / "runs").iterdir()) - {first}
    assert load_checkpoint(second / "checkpoint.json").pal.finished
    assert load_run(second).record.resumed_from == f"runs/{first.name}/checkpoint.json"
    assert load_checkpoint(first / "checkpoint.json").pal.used == saved.pal.used
    assert not watch(tmp_path / "second.mcap")[0].truncated


def test_a_robot_that_falls_silent_is_told_with_its_address(tmp_path: Path) -> None:
    with emulator(tmp_path) as robot:
        url = address_of(robot)
        with Hil(tmp_path, "coach", url, *COACH, "--budget", "1000", "--log", "run.mcap", "--reconnect", "0.3") as coach:
            assert "coaches it against flat-light" in coach.until("Connected to Junior")
            robot.send(signal.SIGSTOP)
            assert coach.end() == 3
    assert f"hil: {url}: robot 1 did not come back within 0.3 s. Is it switched on" in coach.text
    assert not watch(tmp_path / "run.mcap")[0].truncated


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_the_robot_stopped_and_disarmed(tmp_path: Path, number: signal.Signals) -> None:
    with served("pty") as (url, robot), Hil(tmp_path, "coach", url, *COACH, "--budget", "1000", "--log", "run.mcap") as coach:
        robot.until(robot.moving)
        coach.send(number)
        assert coach.end() == 130
        assert not robot.moving()
        heard = robot.now()
        robot.until(lambda: robot.now() > heard + 1.1)  # a heartbeat later
        assert robot.state is State.DISARMED
    assert "Interrupted." in coach.text
    assert "--resume" in coach.text
    assert "Traceback" not in coach.text
    assert not watch(tmp_path / "run.mcap")[0].truncated
    (made,) = (tmp_path / "runs").iterdir()
    assert not load_checkpoint(made / "checkpoint.json").pal.finished
    assert load_run(made).record.state == "interrupted"


def test_a_host_that_is_killed_leaves_a_robot_that_stops_by_itself(tmp_path: Path) -> None:
    with served("pty") as (url, robot):
        with Hil(tmp_path, "coach", url, "--period", "1.0", "--budget", "100", "--log", "run.mcap") as coach:
            robot.until(robot.moving)
            coach.send(signal.SIGKILL)
            assert coach.end() == -signal.SIGKILL
        killed = robot.now()
        robot.until(lambda: robot.now() > killed + 0.5)
        assert not robot.moving()
        robot.until(lambda: CUT in watch(tmp_path / "run.mcap")[0].metadata)  # by the process that writes the log
    assert len(list(LogReader(tmp_path / "run.mcap").raw_entries())) > 10
