"""One folder a run: made exclusively, found again by what it was, and removed without what others have put there."""

from __future__ import annotations

import json
import os
import sys
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import pytest

from hil import runs
from hil.going_on import can_go_on, successor
from hil.processes import process_identity
from hil.runs import Run, RunError, RunRecord, all_runs, file_of, load_run, make_run, newest

if TYPE_CHECKING:
    from pathlib import Path

WHEN = datetime(2026, 11, 28, 13, 5, 1, tzinfo=UTC)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def record(verb: str = "coach", what: str = "flat-light", started: str = "2026-11-28T13:05:01+00:00") -> RunRecord:
    return RunRecord(verb, what, started, pid=os.getpid(), opponent=what)


def test_a_folder_is_nobody_else_s() -> None:
    made = [make_run(record(), WHEN).folder.name for _ in range(3)]
    assert made == [
        "20261128-130501-coach-flat-light",
        "20261128-130501-coach-flat-light-2",
        "20261128-130501-coach-flat-light-3",
    ]


def test_another_place_can_be_named_and_is_not_used_twice(folder: Path) -> None:
    run = make_run(record(), WHEN, out=folder / "here" / "mine")
    assert load_run(run.folder).record == record()
    (run.folder / "log.mcap").write_bytes(b"old")
    with pytest.raises(RunError, match="choose another name for --out"):
        make_run(record(), WHEN, out=run.folder)
    assert (run.folder / "log.mcap").read_bytes() == b"old"


def test_what_it_says_is_read_back_and_a_process_that_is_gone_was_killed() -> None:
    run = make_run(record(), WHEN)
    run.record.settings = {"budget": 5}
    run.save()
    again = load_run(run.folder)
    assert again.record.settings == {"budget": 5}
    assert again.state == runs.RUNNING
    again.record.pid = 2**22 + 1  # more than there are
    assert again.state == "killed"
    again.record.state = "interrupted"
    assert again.state == "interrupted"


@pytest.mark.skipif(sys.platform != "linux", reason="Linux tells which process has an id")
def test_a_process_of_the_same_id_is_another() -> None:
    run = make_run(record(), WHEN)
    run.record.process = process_identity(os.getpid())
    assert run.state == runs.RUNNING
    run.record.process = "another start of the computer 17"
    assert run.state == "killed"


def test_runs_are_in_order_across_time_zones_and_in_the_same_second() -> None:
    finished("a", "bout", "x", "2026-10-25T02:30:00+02:00")
    finished("b", "bout", "x", "2026-10-25T02:10:00+01:00")
    for number in (2, 10, 9):
        finished(f"c-{number}", "bout", "x", "2026-10-25T05:00:00+00:00")
    assert [run.folder.name for run in all_runs()] == ["c-10", "c-9", "c-2", "b", "a"]


def test_what_is_no_number_is_null_in_the_record() -> None:
    run = make_run(record(), WHEN)
    run.record.result = {"fitness": float("nan"), "best": [float("-inf"), 1.0]}
    run.save()
    text = (run.folder / "run.json").read_text()
    assert json.loads(text, parse_constant=pytest.fail)["result"] == {"fitness": None, "best": [None, 1.0]}


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"version": 2}', '{"version": 1, "verb": "coach"}', "[" * 100_000, '{"version": ' + "1" * 5000 + "}",
     '{"version": 1, "verb": 5, "what": "x", "started": "y"}',
     '{"version": 1, "verb": "coach", "what": "x", "started": "yesterday"}', "\ud800"],
)  # fmt: skip
def test_what_is_no_record_is_told_with_its_file_and_passed_over(folder: Path, text: str) -> None:
    bad = folder / "runs" / "bad"
    bad.mkdir(parents=True)
    (bad / "run.json").write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(RunError, match=r"run\.json"):
        load_run(bad)
    good = make_run(record(), WHEN)
    assert [run.folder for run in all_runs()] == [good.folder]


def test_a_record_may_be_huge_by_mistake(folder: Path) -> None:
    (folder / "run.json").write_bytes(b" " * 2_000_000)
    with pytest.raises(RunError, match="larger than"):
        load_run(folder)


def test_a_newer_program_s_fields_are_passed_over() -> None:
    run = make_run(record(), WHEN)
    path = run.folder / "run.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"weather": "fine"}))
    assert load_run(run.folder).record == record()


def finished(name: str, verb: str, what: str, started: str, *files: str) -> Run:
    run = make_run(record(verb, what, started), WHEN, out=runs.RUNS / name)
    for file in files:
        (run.folder / file).write_bytes(b"x")
    return run


def test_the_newest_that_fits_is_found() -> None:
    finished("a", "coach", "flat-light", "2026-11-28T10", "advice.toml")
    heavy = finished("b", "coach", "flat-heavy", "2026-11-28T11", "advice.toml")
    light = finished("c", "coach", "flat-light", "2026-11-28T12", "advice.toml")
    finished("d", "coach", "flat-light", "2026-11-28T13")  # has learnt nothing
    bout = finished("e", "bout", "flat-light", "2026-11-28T14", "log.mcap")
    assert newest() == bout
    assert newest(("coach",), has="advice.toml") == light
    assert newest(("coach",), has="advice.toml", opponent="flat-heavy") == heavy
    assert newest(("coach",), opponent="point-light") is None
    assert newest(robot="0000000000000001") is None


def test_a_file_is_named_by_itself_by_its_run_or_not_at_all(folder: Path) -> None:
    run = finished("a", "coach", "flat-light", "2026-11-28T10", "advice.toml")
    assert file_of(folder / "x.toml", runs.ADVICE) == folder / "x.toml"
    assert file_of(run.folder, runs.ADVICE) == run.advice
    assert file_of(None, runs.ADVICE, verbs=("coach",)) == run.advice
    with pytest.raises(RunError, match=r"there is no log\.mcap in"):
        file_of(run.folder, runs.LOG)
    with pytest.raises(RunError, match=r"no run of hil coach against point-light with advice\.toml"):
        file_of(None, runs.ADVICE, verbs=("coach",), opponent="point-light")


def test_removing_a_run_leaves_what_others_have_put_there() -> None:
    plain = finished("a", "coach", "flat-light", "2026-11-28T10", "advice.toml", "checkpoint.json", "log.mcap")
    (plain.report).mkdir()
    (plain.report / "report.html").write_text("x")
    plain.remove()
    assert not plain.folder.exists()
    shared = finished("b", "coach", "flat-light", "2026-11-28T10", "advice.toml", "notes.txt")
    shared.remove()
    assert [path.name for path in shared.folder.iterdir()] == ["notes.txt"]


def test_several_coachings_that_were_cut_stay_until_others_go_on_from_them() -> None:
    cut = finished("a", "coach", "flat-light", "2026-11-28T10:00:00+00:00", "team.json", "run-1.json", "run-1.mcap")
    cut.record.state = "interrupted"
    assert can_go_on(cut)
    later = finished("b", "coach", "flat-light", "2026-11-28T11:00:00+00:00", "team.json")
    later.record.resumed_from, later.record.state = str(cut.folder / "team.json"), "interrupted"
    assert successor(cut, [later, cut]) is None, "it has saved nothing"
    (later.folder / "run-1.json").write_bytes(b"x")
    assert successor(cut, [later, cut]) is later
    later.record.state = runs.DONE
    assert not can_go_on(later)
    cut.remove()
    assert not cut.folder.exists()
