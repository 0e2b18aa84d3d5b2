"""Robots on serial lines that are slower than what they say: the commands work all the same, in real time."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from serving import served

import hil
from firmware_protocol.events import PeerLost
from firmware_protocol.messages import JuniorSensors, State
from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.sumo.advice_file import load_advice

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firmware_protocol.events import Event

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no ptys on Windows"),
]

COACH = ("--budget", "8", "--period", "0.05", "--held-out", "0", "--no-report")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")
    return tmp_path


AT_NIGHT = [pytest.param(baud, marks=pytest.mark.nightly) for baud in (19200, 38400)]
"""Rates between the slowest and one that carries all: what follows of each is tried by `test_line_pace.py`."""


@pytest.fixture(params=[9600, *AT_NIGHT])
def line(request: pytest.FixtureRequest) -> Iterator[tuple[str, int]]:
    """A robot on a slow line: its address, and the interval of its readings in ms."""
    baud: int = request.param
    with served(f"pty:{baud}") as url:
        yield url, {9600: 160, 19200: 55, 38400: 25}[baud]


def test_coaching_works(line: tuple[str, int], capsys: pytest.CaptureFixture[str]) -> None:
    url, interval = line
    assert run(["coach", url, *COACH, "--log", "run.mcap", "--advice-out", "learnt.toml"]) == 0
    said = capsys.readouterr().out
    assert f"it is asked for sensor readings every {interval} ms, not 20, and for SYS_STATUS every 10 s" in said
    assert "8 maneuvers in" in said
    assert load_advice(Path("learnt.toml")).entries
    reader = LogReader(Path("run.mcap"))
    notes = [str(entry.value) for entry in reader.entries({"/events"})]
    assert sum("it is asked for sensor readings every" in note for note in notes) == 1


def test_looking_and_setting_up_work(line: tuple[str, int], capsys: pytest.CaptureFixture[str]) -> None:
    url, interval = line
    assert run(["monitor", url, "--duration", "1", "--no-log", "--json"]) == 0
    shown = capsys.readouterr()
    assert json.loads(shown.out)["state"] == "disarmed"
    assert f"every {interval} ms" in shown.err
    assert run(["param", url, "EYE_L_ON", "300"]) == 0
    set_up = capsys.readouterr()
    assert set_up.out == "300\n"
    assert f"every {interval} ms" in set_up.err
    assert run(["ports", url]) == 0
    assert "Junior, system 1, disarmed" in capsys.readouterr().out


def test_a_robot_is_kept_moving_and_obeys_at_once(line: tuple[str, int]) -> None:
    url, _ = line
    lost: list[Event] = []
    with hil.connect(url) as junior:
        junior.listen(lambda event: lost.append(event) if isinstance(event, PeerLost) else None)
        junior.arm()
        for _ in range(3):
            assert junior.perform(["L", "R", "L", "R"]).done == 4
        asked = junior.now()
        junior.emergency_stop()
        assert junior.now() - asked < 0.5
        assert junior.state is State.STOPPED
        assert not junior.peer.streams.stale(JuniorSensors, junior.age)
    assert not lost


@pytest.mark.parametrize("baud", [300, 1200, 4800])
def test_below_that_it_is_refused_with_the_figure(baud: int, capsys: pytest.CaptureFixture[str]) -> None:
    with served(f"pty:{baud}") as url:
        assert run(["coach", url, *COACH, "--no-log"]) == 3
        assert f"a line of {baud:,} baud is too slow: driving a robot takes 9,100 baud" in capsys.readouterr().err


def test_the_list_of_ports_shows_a_robot_that_is_too_slow_to_drive(capsys: pytest.CaptureFixture[str]) -> None:
    with served("pty:4800") as url:
        assert run(["ports", url]) == 0
    said = capsys.readouterr().out
    assert "Junior, system 1, disarmed" in said
    assert "a line of 4,800 baud is too slow: driving a robot takes 9,100 baud" in said
