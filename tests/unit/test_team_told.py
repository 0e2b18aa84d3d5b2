"""What a report and a page tell of several coachings, and an advice of them that no file takes."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from report_logs import coaching_log, open_recorder
from rich.console import Console

from firmware_protocol.vocabulary import ANY_STIMULUS
from hil.cli.coach_files import TeamFiles
from hil.cli.coach_worker import make_small
from hil.cli.running import ActiveRun
from hil.look.reading import read_scene
from hil.mcaplog.errors import LogError
from hil.mcaplog.making.slimming import slim
from hil.report.gather import gather
from hil.report.learnt import read_learnt
from hil.report.team.figures import wins_of_runs
from hil.report.words import summary, title_of
from hil.report.write import write_report
from hil.sumo.advice_file import load_advice
from hil.sumo.team import LATELY, CoachedRun, shares_won
from pal_advisor.maneuvers import TeamScore, TeamVerdict

if TYPE_CHECKING:
    from hil.report.run_data import RunData

ADVICE = Path(__file__).parents[1] / "golden" / "protocol1" / "advice.toml"
WON = (2,) * 10 + (1,) * 30
"""Outcomes of a run that won after ten bouts lost."""


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log of three runs: the second did best, and took something of the first; the third told of no bouts."""
    path = tmp_path / "log.mcap"
    with open_recorder(path) as recorder:
        for number, outcomes in ((1, WON), (2, WON[5:]), (3, ())):
            told = CoachedRun(number, 1600, 41, 30, 10, 900.0, "{}", "0" * 16, outcomes)
            recorder.coached_run(number, told)
        for run, category, wins, kept in ((1, None, 50, False), (2, None, 55, True), (1, (ANY_STIMULUS, 3), 58, True)):
            recorder.team_verdict(TeamVerdict(run, category, TeamScore(wins, 60, 120.0), kept))
        recorder.note("team", "Team exam, 1 tried: run 1 does better")
    return path


def told(data: RunData) -> str:
    return " ".join(summary(data))


def test_a_report_tells_of_the_runs_and_what_was_taken_of_which(log: Path, tmp_path: Path) -> None:
    data = gather(log)
    assert title_of(data) == "Pal coached Junior"
    assert "Pal coached 3 robots, apart: 4,800 maneuvers in 123 bouts, 45.0 minutes of robot time." in told(data)
    assert "run 2 did best. Its advice became better with what run 1 does when it is “both”." in told(data)
    page = write_report(log, tmp_path / "report").page.read_text("utf-8")
    for text in ("The runs", "Won while it learnt", "55 of 60", "2.00 s", "Maneuvers of other runs", "58 of 60", "by 3 robots"):
        assert text in page


def test_runs_that_tell_of_bouts_are_drawn(log: Path) -> None:
    pytest.importorskip("matplotlib")
    data = gather(log)
    drawn = wins_of_runs(data)
    assert drawn is not None
    (axes,) = drawn.axes
    assert [line.get_label() for line in axes.lines] == ["run 1", "run 2"]
    data.coached.clear()
    assert wins_of_runs(data) is None


def test_a_page_shows_how_often_each_run_won(log: Path) -> None:
    scene = read_scene(log)
    (curves,) = scene.curves
    assert curves.labels == ("run 1", "run 2")
    assert (curves.y[0][0], curves.y[0][-1]) == (0.5, 1.0)
    assert "Pal coached 3 robots, apart, which performed 4,800 maneuvers in 123 bouts" in scene.said[0]
    assert ("4,800", "maneuvers performed by 3 robots") in scene.facts
    assert any(mark.text.startswith("Team exam") for mark in scene.marks)


def test_bouts_of_a_run_that_was_gone_on_with_are_counted_from_its_beginning() -> None:
    bouts, share = shares_won(101, WON)
    assert (bouts[0], bouts[-1], len(share)) == (60 + LATELY, 100, 21)
    assert not len(shares_won(50, WON[: LATELY - 1])[0])


def test_an_advice_that_no_file_takes_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    if not Path("/dev/full").is_char_device():
        pytest.skip("this system has no /dev/full")
    run = ActiveRun(None, None, overwrite=True)
    files = TeamFiles(run, Path("/dev/full"), Console(file=StringIO()), report=False)
    files.save_advice(load_advice(ADVICE))
    said = capsys.readouterr().err
    assert "what was learnt, for no file to hold" in said
    assert "[[entries]]" in said
    assert files.document(2)["advice"] is None
    assert len(run.failures) == 1


def test_a_log_that_was_made_small_and_a_budget_of_time_are_told_of_as_what_they_are(tmp_path: Path) -> None:
    coaching_log(tmp_path / "log.mcap", budget=60).close()
    slim(tmp_path / "log.mcap", tmp_path / "slim.mcap")
    said = told(gather(tmp_path / "slim.mcap"))
    assert "This log was made small" in said
    assert "Nothing was received" not in said
    timed, _ = read_learnt('{"settings": {"budget": 10000000, "robot_time": 960.0}}')
    assert timed is not None
    assert timed.budget is None


def test_where_a_log_can_t_be_made_small_it_stays_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(log: Path, small: Path, *, level: int, overwrite: bool) -> None:
        small.write_bytes(log.read_bytes()[:level])
        raise LogError(f"cannot write the log {small}: No space left on device, {overwrite}")

    log = tmp_path / "run-1.mcap"
    coaching_log(log, budget=4)
    whole = log.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr("hil.mcaplog.making.slimming.pack", full)
        make_small(log, slim_too=False)
    assert (log.read_bytes(), list(tmp_path.iterdir())) == (whole, [log])
    make_small(log, slim_too=False)
    assert len(log.read_bytes()) < len(whole)
