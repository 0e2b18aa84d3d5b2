"""`hil bout --workers`: the same for any number of processes, logs that can be replayed, and no process left behind."""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from processes import Program

from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.runs import Run, RunError, file_of, load_run

pytestmark = pytest.mark.slow  # processes are started

TELLING = """
from contextlib import contextmanager
from hil.cli import main, workers

@contextmanager
def counting(*_, **__):
    yield lambda bout: print("played", bout.number, flush=True)

workers.counting = counting
main()
"""
"""The command `hil` that says on a line of its own when a bout was played."""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def played(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The JSON of bouts, whose run is forgotten."""
    assert run(["bout", "--json", "--out", "run", *arguments]) == 0
    Run(Path("run"), load_run(Path("run")).record).remove()
    assert not Path("run").exists()
    return capsys.readouterr().out


def test_the_number_of_workers_changes_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ("--controller", "chase", "--trials", "23", "--opponent", "curved-light")
    one, three = (played(capsys, *asked, "--workers", str(workers)) for workers in (1, 3))
    assert one == three
    found = json.loads(one)
    assert found["trials"] == found["wins"] + found["losses"] + found["draws"] == 23
    assert found["log"] is None
    assert found["logs"] == ["run/bouts-01-10.mcap", "run/bouts-11-20.mcap", "run/bouts-21-23.mcap"]


def test_bouts_without_memory_end_on_one_robot_as_they_do_on_several(capsys: pytest.CaptureFixture[str]) -> None:
    def counted(*more: str) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(played(capsys, "--controller", "chase", "--trials", "21", *more))
        return {key: value for key, value in found.items() if key not in {"log", "logs"}}

    assert counted("--workers", "2") == counted()


def test_each_log_is_replayed_by_itself(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["bout", "--controller", "random", "--trials", "12", "--workers", "2", "--opponent", "flat-heavy", "--out", "run"]
    assert run(asked) == 0
    assert "Logs: run/bouts-01-10.mcap to run/bouts-11-12.mcap" in capsys.readouterr().out
    for log in ("run/bouts-01-10.mcap", "run/bouts-11-12.mcap"):
        assert run(["replay", log]) == 0
    bouts = [json.loads(entry.value.fields) for entry in LogReader(Path("run/bouts-11-12.mcap")).entries(["/events"])
             if entry.value.kind == "bout"]  # fmt: skip
    assert [bout["number"] for bout in bouts] == [11, 12]
    with pytest.raises(RunError, match=r"several logs: name one of them, as run/bouts-01-10\.mcap"):
        file_of(Path("run"), "log.mcap")


def test_without_a_log_nothing_is_left(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    assert run(["bout", "--controller", "chase", "--trials", "11", "--workers", "2", "--no-log", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["run"], found["logs"]) == (None, [])
    assert not list(folder.iterdir())


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["tcp://127.0.0.1:5760"], "--workers plays on several robots at once, and there is one at tcp://127.0.0.1:5760"),
        (["serial:///dev/ttyACM0:115200"], "there is one at serial:///dev/ttyACM0:115200: leave out --workers, or the link"),
        (["--log", "one.mcap"], "--log names one log"),
    ],
)
def test_what_cannot_be_had_several_times_is_refused(
    capsys: pytest.CaptureFixture[str], folder: Path, arguments: list[str], named: str
) -> None:
    assert run(["bout", *arguments, "--controller", "chase", "--workers", "2"]) == 2
    assert named in capsys.readouterr().err
    assert not list(folder.iterdir())


def test_what_ends_a_part_is_told_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    url = "sim://junior?referee=0"
    assert run(["bout", url, "--controller", "chase", "--trials", "11", "--workers", "2", "--no-log"]) == 2
    assert "a bout needs a referee who says how it ends" in capsys.readouterr().err


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.nightly)])
def test_an_interrupt_leaves_no_process_and_closes_the_logs(folder: Path, number: signal.Signals) -> None:
    asked = ("bout", "--controller", "chase", "--trials", "100000", "--workers", "2", "--out", "run")
    with Program(folder, sys.executable, "-c", TELLING, *asked) as program:
        program.until("played 10")
        program.send(number)
        assert program.end() == 130  # and nobody else holds its output
    assert "Interrupted." in program.text
    assert "Traceback" not in program.text
    assert load_run(Path("run")).record.state == "interrupted"
    for log in Path("run").glob("bouts-*.mcap"):
        reader = LogReader(log)
        list(reader.raw_entries())
        assert reader.whole, reader.health()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_workers_end_when_the_first_process_is_killed(folder: Path) -> None:
    asked = ("bout", "--controller", "chase", "--trials", "100000", "--workers", "2", "--no-log")
    with Program(folder, sys.executable, "-c", TELLING, *asked) as program:
        program.until("played 10")
        program.send(signal.SIGKILL)
        assert program.end() == -signal.SIGKILL  # and nobody else holds its output
