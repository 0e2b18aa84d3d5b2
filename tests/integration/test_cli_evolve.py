"""`hil swarm surround --evolve`: the same for any number of workers, what it leaves, how it goes on, and how it ends."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from as_json import as_json
from deadly import die_at_the_last
from logged import entries_of
from processes import Program

from hil.cli.app import run
from hil.jobs.swarm import evolve
from hil.mcaplog import LogReader
from hil.runs import load_run
from hil.swarm.missions.evolving.checkpoint import load_evolution
from hil.swarm.missions.evolving.evaluation import EvaluationTask, evaluate
from hil.swarm.missions.surround_settings import SurroundSettings
from pal_advisor.surround import Case

pytestmark = pytest.mark.slow  # processes are started
ASKED = ("swarm", "surround", "--evolve", "contact", "--generations", "2", "--repeats", "1", "--case", "R6W2", "--steps", "4")

TELLING = """
import sys
from hil.cli import main
from hil.jobs.swarm import evolve

evolve.SAVE_EVERY = 1
told = evolve.EvolutionCheckpoint.to_bytes

def to_bytes(self):
    print("evaluated", self.evaluations, flush=True)
    return told(self)

evolve.EvolutionCheckpoint.to_bytes = to_bytes
if __name__ == "__main__":
    main()
"""
"""The command `hil` that says on a line of its own how many evaluations were made, and saves each."""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    return tmp_path


def found(*arguments: str, status: int = 0) -> dict[str, Any]:
    """What a search says as JSON, without what differs between equal searches."""
    document = as_json(*ASKED, "--no-report", *arguments, status=status)
    return {key: value for key, value in document.items() if key not in {"wall_seconds", "run", "log", "checkpoint", "report"}}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """A search that one worker has made from its beginning to its end: its folder, which nobody changes, and what it said."""
    folder = tmp_path_factory.mktemp("whole")
    with contextlib.chdir(folder):
        return folder / "one", found("--workers", "1", "--out", "one")


def test_one_worker_and_two_find_the_same_and_leave_one_log_each(
    whole: tuple[Path, dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    by_one, one = whole
    by_two = Path("two")
    assert found("--workers", "2", "--out", "two") == one
    assert [len(generation["cases"]) for generation in one["generations"]] == [7, 7]
    for made in (by_one, by_two):
        assert sorted(path.name for path in made.iterdir()) == ["checkpoint.json", "log.mcap", "run.json"]
        assert load_run(made).state == "done"
    one_log, two_log = (entries_of(made / "log.mcap") for made in (by_one, by_two))
    assert len(one_log) > 14
    assert one_log == two_log
    assert (by_one / "checkpoint.json").read_bytes() == (by_two / "checkpoint.json").read_bytes()
    assert run(["replay", "two"]) == 0
    assert "the same" in capsys.readouterr().out


def test_an_evaluation_is_the_run_that_anybody_can_make_again(
    whole: tuple[Path, dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    """The seed and case that the log tells are those of a run of `hil swarm surround`, with workers, of the same fitness."""
    entry = next(LogReader(whole[0] / "log.mcap").entries(["/surround/evaluation"])).value
    asked = ["swarm", "surround", "--case", entry.case, "--steps", "4", "--seed", str(entry.seed), "--workers", "1"]
    assert run([*asked, "--no-report", "--json", "--quiet"]) == 0
    fitness = json.loads(capsys.readouterr().out)["fitness"]
    assert fitness == {
        name: pytest.approx(getattr(entry, name), abs=1e-6) for name in ("contact", "surround", "chase", "focus")
    }


def test_an_evaluation_depends_on_its_task_alone() -> None:
    task = EvaluationTask(SurroundSettings(steps=3, case="R6W2"), Case.parse("B3D1L2R6W2"), 4)
    first = evaluate(task)
    evaluate(EvaluationTask(task.settings, task.case, 5))
    assert evaluate(task) == first


@pytest.mark.parametrize("search", ["random", "exhaustive"])
def test_other_searches_tell_the_same_facts(search: str) -> None:
    document = found("--search", search, "--budget", "3", "--workers", "2", "--steps", "1")
    assert document["search"] == search
    assert document["finished"]
    assert document["generations"] == []
    assert document["book"]["case"] == "B2C1D2L1R6S1W2"
    assert ("table" in document) is (search == "exhaustive")


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_search_that_is_cut_goes_on_to_the_same_end_and_leaves_no_process(
    whole: tuple[Path, dict[str, Any]], folder: Path, capsys: pytest.CaptureFixture[str], number: signal.Signals
) -> None:
    uncut, expected = whole
    with Program(folder, sys.executable, "-c", TELLING, *ASKED, "--no-report", "--workers", "2", "--out", "cut") as program:
        program.until("evaluated 9")  # in the middle of the second generation
        program.send(number)
        assert program.end() == (130 if number == signal.SIGINT else -number)  # and nobody else holds its output
    assert "Traceback" not in program.text
    if number == signal.SIGINT:
        assert "Interrupted." in program.text
        assert "To go on: hil swarm surround --evolve contact --workers 2 --resume-from cut" in program.text
        assert load_run(Path("cut")).record.state == "interrupted"
        assert run(["replay", "cut"]) == 0
        assert "interrupted" in capsys.readouterr().out
    reached = load_evolution(Path("cut/checkpoint.json")).evaluations
    assert 8 <= reached < len(load_evolution(uncut / "checkpoint.json").begun[0].done)
    assert found("--resume-from", "cut", "--workers", "2") == expected


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_worker_that_dies_again_and_again_ends_it_with_what_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evolve, "evaluate", die_at_the_last)
    document = found("--out", "run", status=1)
    assert not document["finished"]
    assert document["best"]["case"]
    assert load_run(Path("run")).record.state == "fell short"
    assert "worker processes have ended again and again" in load_run(Path("run")).record.error


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--case", "B2R6"], "--case names B, which --evolve looks for: leave it out"),
        (["sim://swarm"], "a LINK is of one run: with --evolve every run has an emulated table of its own"),
        (["--require", "0.5"], "--require is of one run"),
        (["--live"], "--live is of one run"),
        (["--table-out", "x.toml"], "--table-out is of one run"),
        (["--population", "1"], "--population"),
        (["--resume"], "there is no run of hil swarm surround --evolve of an emulated table in runs that did not finish"),
    ],
)
def test_what_makes_no_sense_with_a_search_is_refused(
    capsys: pytest.CaptureFixture[str], folder: Path, arguments: list[str], named: str
) -> None:
    assert run([*ASKED, *arguments]) == 2
    assert named in " ".join(capsys.readouterr().err.split())
    assert not list(folder.iterdir())


def test_what_is_of_a_search_needs_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["swarm", "surround", "--generations", "3"]) == 2
    assert "--generations is of a search among conditions: it goes with --evolve FITNESS" in capsys.readouterr().err


def test_a_resumed_search_is_asked_nothing_else(whole: tuple[Path, dict[str, Any]], capsys: pytest.CaptureFixture[str]) -> None:
    made = str(whole[0])
    assert run(["swarm", "surround", "--evolve", "focus", "--resume-from", made]) == 2
    assert "begun with evolve contact, not focus" in capsys.readouterr().err
    assert run(["swarm", "surround", "--resume-from", made]) == 2
    assert "is the checkpoint of a search among conditions: go on with --evolve" in capsys.readouterr().err
