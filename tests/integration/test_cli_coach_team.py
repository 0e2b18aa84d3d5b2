"""`hil coach --runs`: the same for any number of workers, logs that are replayed, stopped and gone on with."""

from __future__ import annotations

import contextlib
import json
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from as_json import as_json
from logged import entries_of
from processes import Program

import hil
from hil.cli.app import run
from hil.cli.coach_worker import RunTask, coach_run
from hil.jobs.team import RunOrder, TeamJob
from hil.mcaplog import LogReader
from hil.mcaplog.making.slimming import SLIM
from hil.mcaplog.reading.overview import overview
from hil.mcaplog.writing.writer import UNINDEXED
from hil.runs import load_run
from hil.seeds import run_seed
from hil.sumo.advice_file import load_advice
from pal_advisor.fields import Fields

pytestmark = pytest.mark.slow  # processes are started
ASKED = ("coach", "--runs", "2", "--budget", "70s", "--held-out", "2", "--no-report")

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


def found(*arguments: str) -> dict[str, Any]:
    """What it says as JSON, without the places."""
    document = as_json(*ASKED, *arguments)
    return {key: value for key, value in document.items() if key not in {"run", "log", "logs", "advice", "report"}}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Two runs that one worker has made: their folder, and what it said."""
    folder = tmp_path_factory.mktemp("whole")
    with contextlib.chdir(folder):
        return folder / "run", found("--workers", "1", "--out", "run")


def test_the_number_of_workers_changes_nothing(whole: tuple[Path, dict[str, Any]]) -> None:
    with_1, one = whole
    assert found("--workers", "2", "--out", "with-2") == one
    assert (one["runs"], one["held_out"]["trials"]) == (2, 2)
    assert (with_1 / "advice.toml").read_bytes() == Path("with-2/advice.toml").read_bytes()
    for name in ("log.mcap", "run-1.mcap", "run-2.mcap"):
        assert entries_of(with_1 / name) == entries_of(Path("with-2", name))
    assert [overview(with_1 / f"run-{number}.mcap").metadata.keys() & {SLIM, UNINDEXED} for number in (1, 2)] == [
        {UNINDEXED},
        {SLIM},
    ]
    assert not list(with_1.glob("*.small"))


def test_the_decisions_and_each_run_are_replayed(whole: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = whole
    for name in ("log.mcap", "run-1.mcap", "run-2.mcap"):
        report = hil.replay(folder / name)
        assert report.same, str(report)
    topics = [topic for topic, *_ in entries_of(folder / "log.mcap")]
    assert topics.count("/pal/run") == 2
    assert topics.count("/pal/bouts") >= 12
    assert {"/pal/advice", "/referee/state", "/junior/sensors"} <= set(topics), "the bouts of the advice can be looked at"
    assert topics.count("/pal/verdict") >= 2
    assert load_advice(folder / "advice.toml").seed in {run_seed(1, 1), run_seed(1, 2)}, "that of the run it is of"


def test_a_run_is_what_it_is_alone(whole: tuple[Path, dict[str, Any]], folder: Path) -> None:
    together, _ = whole
    job = TeamJob.of_log(Fields(json.loads((together / "team.json").read_text())), {})
    order = RunOrder(2, run_seed(1, 2), job.urls[1], job.settings_of_run(2), job.opponent)
    alone = coach_run(RunTask(order, folder, logged=False))
    assert (folder / "run-2.json").read_bytes() == (together / "run-2.json").read_bytes()
    assert not (folder / "run-2.mcap").exists()
    told = [entry.value for entry in LogReader(together / "log.mcap").entries({"/pal/run"})]
    assert (told[1].digest, told[1].outcomes) == (alone.digest, alone.outcomes)


def test_what_is_put_together_challenges_the_advice_that_it_began_from(whole: tuple[Path, dict[str, Any]]) -> None:
    given, _ = whole
    document = as_json(*ASKED, "--seed", "2", "--from", str(given), "--out", "on")
    challenge = document["challenge"]
    assert 10 <= challenge["bouts"] <= 40
    stays = challenge["winner"] == "champion"
    assert ((given / "advice.toml").read_bytes() == Path("on/advice.toml").read_bytes()) is stays
    assert Path("on/learnt-advice.toml").exists() is stays
    assert hil.replay(Path("on/log.mcap")).same


def test_stopped_and_gone_on_with_it_comes_to_the_same(
    whole: tuple[Path, dict[str, Any]], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    uncut, told = whole
    script = folder / "hil_telling.py"
    script.write_text(TELLING)
    with Program(folder, sys.executable, str(script), *ASKED, "--quiet", "--out", "cut", "--workers", "1") as program:
        program.until("saved")
        program.send(signal.SIGINT)
        assert program.end() == 130
    assert load_run(Path("cut")).record.state == "interrupted"
    assert not Path("cut/advice.toml").exists()
    assert run(["coach", "--resume-from", "cut", "--seed", "2"]) == 2
    assert "go on as they were begun: leave out --seed" in capsys.readouterr().err
    document = as_json("coach", "--resume-from", "cut", "--out", "on", "--no-report")
    assert {key: document[key] for key in told} == told
    assert Path("on/advice.toml").read_bytes() == (uncut / "advice.toml").read_bytes()
    assert hil.replay(Path("on/log.mcap")).same
