"""`hil swarm surround --workers`: the same for any number of processes, one log, and no process left behind."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from as_json import as_json
from processes import Program

from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.mcaplog.records import SurroundStateRecord
from hil.runs import load_run
from hil.swarm.missions.surround_checkpoint import load_checkpoint

if TYPE_CHECKING:
    from collections.abc import Iterable

pytestmark = pytest.mark.slow  # processes are started
ASKED = ("swarm", "surround", "--case", "R6W2", "--steps", "3", "--no-report")
MEASURED = ("case", "seed", "distance", "share_surrounded", "stimuli", "behaviours", "path", "missing", "robot_seconds")

TELLING = """
import sys
from hil.cli import main
from hil.jobs.swarm import seeds

class Telling(seeds.SurroundCheckpoint):
    def to_bytes(self):
        print("finished", len(self.finished), flush=True)
        return super().to_bytes()

seeds.SurroundCheckpoint = Telling
if __name__ == "__main__":
    main()
"""
"""The command `hil` that says on a line of its own how many runs are over."""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outcome(*arguments: str) -> dict[str, Any]:
    """What a run says as JSON."""
    return as_json(*ASKED, *arguments)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Two runs that two workers have made, with a report: where, which nobody changes, and what was said of them."""
    folder = tmp_path_factory.mktemp("both")
    with contextlib.chdir(folder):
        return folder, outcome("--seeds", "2", "--workers", "2", "--out", "two", "--report")


def runs_of(found: dict[str, Any]) -> list[dict[str, Any]]:
    """What was measured of each run."""
    each = found.get("runs", [found])
    return [{name: one[name] for name in MEASURED} for one in each]


def states(log: str | Path) -> list[tuple[float, SurroundStateRecord]]:
    """What a log says of the steps, and when."""
    found = []
    for entry in LogReader(Path(log)).entries(["/surround/state"]):
        assert isinstance(entry.value, SurroundStateRecord)
        found.append((entry.time, entry.value))
    return found


def files(folder: Path, names: Iterable[str]) -> list[bytes]:
    return [(folder / name).read_bytes() for name in names]


def test_the_number_of_workers_changes_nothing_and_each_run_is_one_of_its_own(both: tuple[Path, dict[str, Any]]) -> None:
    folder, two = both
    one = outcome("--seeds", "2", "--workers", "1", "--out", "one")
    alone = outcome("--seed", "2", "--out", "alone")
    assert runs_of(one) == runs_of(two)
    assert runs_of(two)[1:] == runs_of(alone)
    made = ("tables-1.toml", "tables-2.toml", "checkpoint.json")
    assert files(Path("one"), made) == files(folder / "two", made)
    assert run(["log", "diff", "one", str(folder / "two")]) == 0
    told = states(folder / two["log"])
    assert [(state.seed, state.step) for _, state in told] == [(seed, step) for seed in (1, 2) for step in range(4)]
    times = [time for time, _ in told]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(sum(each["robot_seconds"] for each in two["runs"]))
    assert [state.digest for _, state in told[4:]] == [state.digest for _, state in states(alone["log"])]


def test_its_log_makes_a_report_and_is_not_replayed(
    both: tuple[Path, dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, found = both
    page = (folder / found["report"]).read_text()
    assert "seed" in page
    assert run(["replay", str(folder / found["log"])]) == 2
    assert "is of 'swarm surround --workers': only" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["tcp://127.0.0.1:5760", "--workers", "2"], "the robots at tcp://127.0.0.1:5760 are there once"),
        (["sim://swarm?rangers=6&wilds=2", "--workers", "2"], "leave the option out, or the links"),
        (["--workers", "2", "--place", "drive"], "--place drive is for robots that are there"),
        (["--workers", "2", "--poses", "udpin://127.0.0.1:14600"], "--poses is for a link"),
        (["--workers", "2", "--scheduler", "tcp://127.0.0.1:8786"], "leave one of them out"),
        (["--scheduler", "127.0.0.1:8786"], "a scheduler has the address tcp://HOST:PORT"),
        (["--scheduler", "tcp://127.0.0.1"], "a scheduler has the address tcp://HOST:PORT"),
        (["--scheduler", "tcp://127.0.0.1:99999"], "a scheduler has the address tcp://HOST:PORT"),
        (["--scheduler", "tcp://127.0.0.1:8786/x"], "Write it as tcp://127.0.0.1:8786"),
    ],
)
def test_what_cannot_be_had_several_times_is_refused(
    capsys: pytest.CaptureFixture[str], folder: Path, arguments: list[str], named: str
) -> None:
    assert run([*ASKED, *arguments]) == 2
    assert named in capsys.readouterr().err
    assert not list(folder.iterdir())


def test_what_ends_a_run_is_told_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["swarm", "surround", "--case", "R250W250D4", "--steps", "1", "--workers", "1", "--out", "run"]) == 2
    assert "there is no room for 500 robots on this table" in capsys.readouterr().err
    assert not Path("run").exists()


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.nightly)])
def test_an_interrupt_leaves_no_process_and_what_is_resumed_equals_the_run_not_cut(
    folder: Path, number: signal.Signals
) -> None:
    (folder / "telling.py").write_text(TELLING)
    asked = (*ASKED, "--quiet", "--seeds", "99", "--workers", "2", "--out", "run")
    with Program(folder, sys.executable, "telling.py", *asked) as program:
        program.until("finished 3")
        program.send(number)
        assert program.end() == 130  # and nobody else holds its output
    assert "Traceback" not in program.text
    assert load_run(Path("run")).record.state == "interrupted"
    saved = load_checkpoint(Path("run/checkpoint.json"))
    done = len(saved.finished)
    assert 3 <= done < 99
    assert len(states("run/log.mcap")) == 4 * done
    document = json.loads(Path("run/checkpoint.json").read_text())
    assert document["seeds"] == 99
    document["seeds"] = done + 2  # that is enough
    Path("cut.json").write_text(json.dumps(document))
    resumed = outcome("--resume-from", "cut.json", "--workers", "2")
    assert runs_of(resumed) == runs_of(outcome("--seeds", str(done + 2), "--workers", "1"))


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_workers_end_when_the_first_process_is_killed(folder: Path) -> None:
    (folder / "telling.py").write_text(TELLING)
    asked = (*ASKED, "--quiet", "--seeds", "999", "--workers", "2", "--no-log")
    with Program(folder, sys.executable, "telling.py", *asked) as program:
        program.until("finished 2")
        program.send(signal.SIGKILL)
        assert program.end() == -signal.SIGKILL  # and nobody else holds its output
