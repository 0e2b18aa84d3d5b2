"""What the commands leave: a folder a run, nobody's file replaced, nothing left where nothing has happened."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from hil.cli.app import run
from hil.jobs.progress import CoachingDisplay
from hil.mcaplog import LogReader
from hil.runs import RunRecord, load_run, make_run

CHASE = ["bout", "--controller", "chase", "--trials", "1", "--quiet"]
COACH = ["coach", "--runs", "1", "--budget", "8", "--held-out", "0", "--quiet", "--no-report"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for every test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def made() -> list[str]:
    return sorted(path.name.split("-", 2)[2] for path in Path("runs").glob("*"))


@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        ([], 2),
        (["--opponent", "flat-lihgt"], 2),
        (["serial:///dev/no-such-port:115200"], 2),
        (["sim://junior?opponent=flat-lihgt"], 2),
        (["--signing-key", "none.key"], 4),
    ],
)
def test_a_log_that_is_there_stays_whatever_goes_wrong(folder: Path, arguments: list[str], status: int) -> None:
    (folder / "target.mcap").write_bytes(b"old")
    (folder / "link.mcap").symlink_to("target.mcap")
    for name in ("target.mcap", "link.mcap"):
        assert run([*CHASE, *arguments, "--log", name]) == status
        assert (folder / "target.mcap").read_bytes() == b"old"
    assert not Path("runs").exists()


@pytest.mark.parametrize("arguments", [["serial:///dev/no-such-port:115200"], ["sim://junior?opponent=flat-lihgt"]])
def test_what_may_be_replaced_stays_where_nothing_could_be_opened(folder: Path, arguments: list[str]) -> None:
    (folder / "old.mcap").write_bytes(b"old")
    assert run([*CHASE, *arguments, "--log", "old.mcap", "--overwrite"]) in {2, 3}
    assert (folder / "old.mcap").read_bytes() == b"old"
    assert run([*CHASE, "--log", "old.mcap", "--overwrite"]) == 0
    assert not LogReader(folder / "old.mcap").path.read_bytes().startswith(b"old")
    assert [path.name for path in folder.iterdir()] == ["old.mcap"]


@pytest.mark.slow
def test_runs_that_begin_in_the_same_second_have_folders_of_their_own(folder: Path) -> None:
    command = [sys.executable, "-c", "from hil.cli import main; main()", *CHASE]
    programs = [subprocess.Popen(command, stdout=subprocess.DEVNULL, cwd=folder) for _ in range(4)]  # noqa: S603
    assert [program.wait() for program in programs] == [0] * 4
    logs = list(Path("runs").glob("*-bout-flat-light*/log.mcap"))
    assert len(logs) == 4
    for log in logs:
        reader = LogReader(log)
        assert sum(1 for _ in reader.entries({"/events"}))
        assert reader.health().startswith("whole")
        assert load_run(log.parent).state == "done"


def test_a_try_does_not_replace_what_a_long_run_has_learnt() -> None:
    assert run([*COACH, "--out", "long"]) == 0
    before = {path: path.read_bytes() for path in Path("long").iterdir()}
    assert run([*COACH, "--seed", "2"]) == 0
    assert run(["coach", "sim://junior", *COACH[1:]]) == 0
    assert {path: path.read_bytes() for path in Path("long").iterdir()} == before
    assert made() == ["coach-flat-light", "coach-robot"]
    assert run([*COACH, "--out", "long"]) == 2
    assert run([*COACH, "--no-log", "--advice-out", "long/advice.toml"]) == 2


def test_no_folder_where_nothing_would_be_in_it() -> None:
    assert run([*CHASE, "--no-log"]) == 0
    assert run([*CHASE, "--log", "a.mcap"]) == 0
    assert run(["check", "--quiet", "--only", "heartbeat-rate"]) in {0, 2}
    assert run([*COACH, "--no-log", "--advice-out", "a.toml", "--checkpoint", "a.json"]) == 0
    assert not Path("runs").exists()
    assert run([*COACH, "--no-log"]) == 0
    assert {path.name for path in next(Path("runs").iterdir()).iterdir()} == {"advice.toml", "checkpoint.json", "run.json"}
    assert run([*CHASE, "--no-log", "--out", "x"]) == 2
    assert not Path("x").exists()


def test_what_a_run_says_of_itself() -> None:
    assert run([*COACH, "--seed", "5", "--out", "r"]) == 0
    record = load_run(Path("r")).record
    assert (record.verb, record.what, record.opponent, record.seed, record.state, record.status) == (
        "coach", "flat-light", "flat-light", 5, "done", 0,
    )  # fmt: skip
    assert record.settings["budget"] == "8"
    assert record.settings["reconnect"] == 30.0
    assert {"junior-hil", "protocol", "numpy", "protobuf", "python"} <= record.versions.keys()
    assert record.result["maneuvers"] == 8
    assert record.ended >= record.started
    assert (record.link, record.robot) == ("", ""), "an emulated robot's id says nothing"


@pytest.mark.slow
def test_bout_and_report_take_a_run_a_file_or_the_newest_and_say_which(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*COACH, "--out", "runs/a"]) == 0
    assert run([*COACH, "--opponent", "flat-heavy", "--out", "runs/b"]) == 0
    for given, used in (([], "runs/b"), (["--opponent", "flat-light"], "runs/a"), (["--advice", "runs/a"], "runs/a")):
        capsys.readouterr()
        assert run(["bout", "--trials", "1", "--no-log", *given]) == 0
        assert f"Advice: {used}/advice.toml" in capsys.readouterr().out
    assert run(["report", "--quiet"]) == 0
    assert Path("runs/b/report/report.html").is_file()
    capsys.readouterr()
    assert run(["report"]) == 0, "it is there, and is of this log"
    assert "runs/b/report/report.html is there already" in capsys.readouterr().out
    log = Path("runs/b/log.mcap").stat().st_mtime_ns
    os.utime("runs/b/report/report.html", ns=(log - 10**9, log - 10**9))
    assert run(["report", "runs/b"]) == 2, "it is of another log"
    assert "--overwrite" in capsys.readouterr().err
    assert run(["report", "runs/b", "--overwrite", "--quiet"]) == 0
    assert run(["report", "runs/a/log.mcap", "--quiet"]) == 0
    assert Path("runs/a/report/report.html").is_file()


def test_an_empty_page_is_no_report() -> None:
    assert run([*COACH, "--out", "r"]) == 0
    Path("r/report").mkdir(exist_ok=True)
    Path("r/report/report.html").write_bytes(b"")
    assert run(["report", "r", "--quiet"]) == 0
    assert Path("r/report/report.html").stat().st_size


def test_runs_are_listed_and_thinned(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["runs"]) == 0
    assert "There are no runs" in capsys.readouterr().out
    for _ in range(3):
        assert run([*CHASE]) == 0
    assert run([*COACH]) == 0
    Path("runs/notes").mkdir()
    capsys.readouterr()
    assert run(["runs"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["when", "verb", "what", "state", "size", "result", "folder"]
    assert len(lines) == 5
    assert run(["runs", "--prune", "--keep", "1", "--yes", "--json"]) == 0
    assert [gone["verb"] for gone in json.loads(capsys.readouterr().out)] == ["bout", "bout"]
    assert len(list(Path("runs").glob("*-bout-*"))) == 1
    assert Path("runs/notes").is_dir()


def cut(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> None:
    """A coaching that Ctrl-C ends when it has saved something."""
    with monkeypatch.context() as patched:
        trial = CoachingDisplay.trial

        def interrupted(display: CoachingDisplay, *told: Any) -> None:  # noqa: ANN401 - passed on
            trial(display, *told)
            raise KeyboardInterrupt

        patched.setattr(CoachingDisplay, "trial", interrupted)
        assert run([*COACH, "--no-log", *arguments]) == 130


def states(capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    capsys.readouterr()
    assert run(["runs", "--json"]) == 0
    return {Path(one["folder"]).name: one["state"] for one in json.loads(capsys.readouterr().out)}


def test_a_run_that_another_has_gone_on_from_is_continued_and_can_go(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cut(monkeypatch, "--out", "runs/first")
    assert run(["runs", "--prune", "--keep", "0", "--yes"]) == 0
    assert states(capsys) == {"first": "interrupted"}, "it can be gone on with, and stays"
    assert run([*COACH, "--no-log", "--resume", "--out", "runs/second"]) == 0
    assert states(capsys) == {"second": "done", "first": "continued"}
    assert run(["runs", "--prune", "--keep", "1", "--yes"]) == 0
    assert states(capsys) == {"second": "done"}


def test_a_run_whose_successor_saved_nothing_can_still_be_gone_on_with(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cut(monkeypatch, "--out", "runs/first")
    cut(monkeypatch, "--resume", "--out", "runs/second")
    (Path("runs/second") / "checkpoint.json").unlink()
    assert states(capsys) == {"second": "interrupted", "first": "interrupted"}
    assert run([*COACH, "--no-log", "--resume", "--out", "runs/third"]) == 0
    assert load_run(Path("runs/third")).record.resumed_from == "runs/first/checkpoint.json"


def test_a_run_that_goes_on_is_not_gone_on_with_twice(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cut(monkeypatch, "--out", "runs/first")
    record = RunRecord("coach", "flat-light", "2099-01-01T00:00:00+00:00", pid=os.getpid(), opponent="flat-light")
    record.resumed_from = "runs/first/checkpoint.json"
    make_run(record, datetime.now(UTC), out=Path("runs/second"))
    capsys.readouterr()
    assert run([*COACH, "--no-log", "--resume", "--out", "runs/third"]) == 2
    assert f"runs/second goes on already, in process {os.getpid()}" in capsys.readouterr().err


def test_a_checkpoint_kept_elsewhere_is_found_and_no_other_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("b.json").write_bytes(b"somebody's")
    cut(monkeypatch, "--checkpoint", "a.json", "--out", "runs/first")
    assert run([*COACH, "--no-log", "--resume-from", "a.json", "--checkpoint", "b.json"]) == 2
    assert Path("b.json").read_bytes() == b"somebody's"
    assert run([*COACH, "--no-log", "--resume", "--out", "runs/second"]) == 0
    assert load_run(Path("runs/second")).record.resumed_from == "a.json"


@pytest.mark.parametrize("verb", ["coach", "bout", "monitor", "check", "deploy", "param"])
def test_an_empty_address_is_no_emulated_robot(capsys: pytest.CaptureFixture[str], verb: str) -> None:
    assert run([verb, ""]) == 2, "a variable that a script has not set"
    assert capsys.readouterr().err
    assert not Path("runs").exists()


def test_parameters_are_not_saved_over_another_file(folder: Path) -> None:
    (folder / "old.toml").write_text("old")
    assert run(["param", "sim://junior", "--save", "old.toml", "--quiet"]) == 2
    assert (folder / "old.toml").read_text() == "old"
    assert run(["param", "sim://junior", "--save", "old.toml", "--overwrite", "--quiet"]) == 0
    assert "SPD_FAST" in (folder / "old.toml").read_text()
