"""What the commands leave: a folder a run, nobody's file replaced, nothing left where nothing has happened."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.runs import load_run

CHASE = ["bout", "--controller", "chase", "--trials", "1", "--quiet"]
COACH = ["coach", "--budget", "8", "--held-out", "0", "--quiet", "--no-report"]


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
    assert record.settings["budget"] == 8
    assert record.settings["reconnect"] == 30.0
    assert {"junior-hil", "protocol", "numpy", "protobuf", "python"} <= record.versions.keys()
    assert record.result["maneuvers"] == 8
    assert record.ended >= record.started
    assert (record.link, record.robot) == ("", ""), "an emulated robot's id says nothing"


def test_bout_and_report_take_a_run_a_file_or_the_newest_and_say_which(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*COACH, "--out", "runs/a"]) == 0
    assert run([*COACH, "--opponent", "flat-heavy", "--out", "runs/b"]) == 0
    for given, used in (([], "runs/b"), (["--opponent", "flat-light"], "runs/a"), (["--advice", "runs/a"], "runs/a")):
        capsys.readouterr()
        assert run(["bout", "--trials", "1", "--no-log", *given]) == 0
        assert f"Advice: {used}/advice.toml" in capsys.readouterr().out
    assert run(["report", "--quiet"]) == 0
    assert Path("runs/b/report/report.html").is_file()
    assert run(["report", "runs/b"]) == 2
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


def test_parameters_are_not_saved_over_another_file(folder: Path) -> None:
    (folder / "old.toml").write_text("old")
    assert run(["param", "sim://junior", "--save", "old.toml", "--quiet"]) == 2
    assert (folder / "old.toml").read_text() == "old"
    assert run(["param", "sim://junior", "--save", "old.toml", "--overwrite", "--quiet"]) == 0
    assert "SPD_FAST" in (folder / "old.toml").read_text()
