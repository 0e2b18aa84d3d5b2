"""`hil coach --runs`: the same for any number of workers, logs that are replayed, stopped and gone on with."""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from processes import Program

import hil
from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.runs import load_run
from hil.sumo.advice_file import load_advice

pytestmark = pytest.mark.slow  # processes are started
ASKED = ("coach", "--runs", "2", "--budget", "70s", "--held-out", "10", "--no-report", "--json", "--quiet")

TELLING = """
from hil.cli import main
from hil.sumo import coaching

saved = coaching.Coaching.save

def save(self):
    saved(self)
    if self.pal.used >= 40:
        print("saved", flush=True)

coaching.Coaching.save = save
if __name__ == "__main__":
    main()
"""
"""The command `hil` whose workers say on a line of their own that they have saved something."""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def found(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """What it says as JSON, without the places."""
    assert run([*ASKED, *arguments]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return {key: value for key, value in document.items() if key not in {"run", "log", "logs", "advice", "report"}}


def entries(log: Path) -> list[tuple[str, int, bytes]]:
    return [(entry.topic, entry.log_time, entry.data) for entry in LogReader(log).raw_entries()]


def test_the_number_of_workers_changes_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    one, two = (found(capsys, "--workers", str(workers), "--out", f"with-{workers}") for workers in (1, 2))
    assert one == two
    assert (one["runs"], one["held_out"]["trials"]) == (2, 10)
    assert Path("with-1/advice.toml").read_bytes() == Path("with-2/advice.toml").read_bytes()
    for name in ("log.mcap", "run-1.mcap", "run-2.mcap"):
        assert entries(Path("with-1", name)) == entries(Path("with-2", name))
    assert Path("with-1/run-2.mcap").stat().st_size < Path("with-1/run-1.mcap").stat().st_size


def test_the_decisions_and_each_run_are_replayed(capsys: pytest.CaptureFixture[str]) -> None:
    found(capsys, "--out", "run")
    for name in ("log.mcap", "run-1.mcap", "run-2.mcap"):
        report = hil.replay(Path("run", name))
        assert report.same, str(report)
    topics = [entry.topic for entry in LogReader(Path("run/log.mcap")).raw_entries()]
    assert topics.count("/pal/run") == 2
    assert topics.count("/pal/bouts") >= 12 + 1 + 1
    assert topics.count("/pal/verdict") >= 2
    assert load_advice(Path("run/advice.toml")).seed == 1


def test_a_run_is_what_it_is_alone(capsys: pytest.CaptureFixture[str]) -> None:
    found(capsys, "--out", "together", "--seed", "7")
    asked = ["--budget", "70s", "--end-on-change", "--seed", "7", "--held-out", "0"]
    assert run(["coach", *asked, "--no-report", "--quiet", "--out", "alone"]) == 0
    alone, together = (json.loads(Path(place).read_text()) for place in ("alone/checkpoint.json", "together/run-1.json"))
    assert alone == together


def test_stopped_and_gone_on_with_it_comes_to_the_same(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = found(capsys, "--out", "whole", "--workers", "1")
    script = folder / "hil_telling.py"
    script.write_text(TELLING)
    with Program(folder, sys.executable, str(script), *ASKED, "--out", "cut", "--workers", "1") as program:
        program.until("saved")
        program.send(signal.SIGINT)
        assert program.end() == 130
    assert load_run(Path("cut")).record.state == "interrupted"
    assert not Path("cut/advice.toml").exists()
    assert run(["coach", "--resume-from", "cut", "--seed", "2"]) == 2
    assert "go on as they were begun: leave out --seed" in capsys.readouterr().err
    assert run(["coach", "--resume-from", "cut", "--out", "on", "--no-report", "--json", "--quiet"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert {key: document[key] for key in whole} == whole
    assert Path("on/advice.toml").read_bytes() == Path("whole/advice.toml").read_bytes()
    assert hil.replay(Path("on/log.mcap")).same


def test_a_robot_that_is_there_is_coached_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coach", "tcp://127.0.0.1:1", "--runs", "2"]) == 2
    assert "there is one at tcp://127.0.0.1:1" in capsys.readouterr().err
