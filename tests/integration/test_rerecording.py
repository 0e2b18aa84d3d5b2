"""`hil replay --rerecord` and replays of what could be saved of a log, as a person meets them."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

import hil
from hil.cli.app import run
from hil.mcaplog import LogReader
from hil.sumo.controllers import ChaseController

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recorded") / "bout.mcap"
    assert run(["bout", "--controller", "chase", "--trials", "1", "--quiet", "--log", str(path)]) == 0
    return path


@pytest.fixture
def log(recorded: Path, tmp_path: Path) -> Path:
    """The log of a bout, in a folder of its own."""
    path = tmp_path / "bout.mcap"
    shutil.copyfile(recorded, path)
    return path


def test_the_log_itself_is_never_replaced(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = log.read_bytes()
    link = tmp_path / "link.mcap"
    link.symlink_to(log)
    for out in (log, link, tmp_path / "." / "x" / ".." / "bout.mcap"):
        (tmp_path / "x").mkdir(exist_ok=True)
        assert run(["replay", str(log), "--rerecord", str(out), "--overwrite"]) == 2
        assert "is the log itself" in capsys.readouterr().err
        assert log.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bout.mcap", "link.mcap", "x"]


def test_the_same_again_has_no_difference(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["replay", str(log), "--rerecord", str(tmp_path / "new.mcap")]) == 0
    assert f"No difference in {len(list(LogReader(log).raw_entries())):,} entries" in capsys.readouterr().out


def test_a_log_that_was_cut_off_is_compared_up_to_there(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small, cut = tmp_path / "small.mcap", tmp_path / "cut.mcap"
    assert run(["log", "slim", str(log), "-o", str(small), "--quiet"]) == 0
    for whole in (log, small):
        data = whole.read_bytes()
        cut.write_bytes(data[: 2 * len(data) // 3])
        capsys.readouterr()
        entries = len(list(LogReader(cut).raw_entries()))
        if not entries:
            continue
        assert run(["replay", str(cut), "--rerecord", str(tmp_path / "new.mcap"), "--overwrite"]) == 0
        printed = capsys.readouterr().out
        assert "A is cut off" in printed
        assert f"No difference in {entries:,} entries" in printed


def test_where_nothing_can_be_read_nothing_is_compared(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small, cut = tmp_path / "small.mcap", tmp_path / "cut.mcap"
    assert run(["log", "slim", str(log), "-o", str(small), "--quiet"]) == 0
    cut.write_bytes(small.read_bytes()[:15000])
    capsys.readouterr()
    for arguments in ([], ["--rerecord", str(tmp_path / "new.mcap")]):
        assert run(["replay", str(cut), *arguments]) == 2
        said = capsys.readouterr().err
        assert "It is cut off" in said
        assert "hil log recover" in said
    assert not (tmp_path / "new.mcap").exists()
    saved = tmp_path / "saved.mcap"
    assert run(["log", "recover", str(cut), "-o", str(saved), "--quiet"]) == 0
    assert hil.replay(saved).steps > 0


def test_what_was_saved_of_a_log_is_replayed_to_its_end(log: Path, tmp_path: Path) -> None:
    cut, saved = tmp_path / "cut.mcap", tmp_path / "saved.mcap"
    cut.write_bytes(log.read_bytes()[: 2 * log.stat().st_size // 3])
    for verb in ("recover", "slim"):
        assert run(["log", verb, str(cut), "-o", str(saved), "--quiet", "--overwrite"]) == 0
        report = hil.replay(saved)
        assert report.same
        assert report.cut_off
        assert "The log was cut off; it was replayed to its end." in str(report)
        assert "cut off" in report.recovered
    whole = tmp_path / "whole.mcap"
    assert run(["log", "recover", str(log), "-o", str(whole), "--quiet"]) == 0
    report = hil.replay(whole)
    assert (report.cut_off, report.recovered) == (False, "")


def test_a_difference_before_the_cut_is_found(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cut, saved = tmp_path / "cut.mcap", tmp_path / "saved.mcap"
    cut.write_bytes(log.read_bytes()[: 2 * log.stat().st_size // 3])
    assert run(["log", "recover", str(cut), "-o", str(saved), "--quiet"]) == 0
    monkeypatch.setattr(ChaseController, "choose", lambda *_, **__: hil.Maneuver((hil.Action.R,), 0.2))
    report = hil.replay(saved)
    assert not report.same
    assert "The log was recovered from one that was cut off" in str(report)
    assert not report.again  # of a log that was recovered nobody knows how its run went on


def test_a_run_is_named_once(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "runs" / "one"
    folder.mkdir(parents=True)
    shutil.move(log, folder / "log.mcap")
    assert run(["replay", str(folder)]) == 0
    assert capsys.readouterr().out.count("log.mcap") == 1
    assert run(["replay", str(tmp_path / "runs")]) == 2
    assert "name one of its runs (hil runs lists them)" in capsys.readouterr().err
