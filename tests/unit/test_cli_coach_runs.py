"""How many robots `hil coach` coaches, and how it says so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from firmware_protocol.address import parse_address
from hil.cli import common
from hil.cli.app import run
from hil.jobs.team import TEAM_SETTINGS, USUAL_RUNS

if TYPE_CHECKING:
    from pathlib import Path

    from hil.jobs.team import TeamJob


@pytest.fixture(autouse=True)
def coached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[TeamJob | None]:
    """What is coached, several robots or one (None), where nothing is."""
    found: list[TeamJob | None] = []

    def several(job: TeamJob, **_: object) -> int:
        found.append(job)
        return 0

    def one(*_: object, **__: object) -> None:
        found.append(None)
        raise common.UsageError("one")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr("hil.cli.coach.coach_team", several)
    monkeypatch.setattr("hil.cli.coach.running", one)
    return found


def test_emulated_robots_are_several(coached: list[TeamJob | None]) -> None:
    for asked in ([], ["--json"], ["--budget", "100"], ["sim://junior"], ["sim://junior?wire=can", "--no-log"]):
        assert run(["coach", *asked]) == 0
    assert [job and len(job.urls) for job in coached] == [USUAL_RUNS] * 5
    assert [job and job.periods for job in coached] == [(0.18, 0.11, 0.08) * 2] * 5
    settings = [job.settings for job in coached if job]
    assert settings[0] == TEAM_SETTINGS
    assert (settings[2].robot_time, settings[2].budget) == (0.0, 100)


def test_robots_are_as_the_address_says_and_each_has_its_own_noise(coached: list[TeamJob | None]) -> None:
    assert run(["coach", "sim://junior?opponent=flat-heavy&wire=can", "--runs", "3"]) == 0
    assert run(["coach", "sim://junior?seed=7", "--opponent", "point-light"]) == 0
    one, other = coached
    assert one is not None
    assert other is not None
    assert (one.opponent, other.opponent) == ("flat-heavy", "point-light")
    options = [parse_address(url).options for url in one.urls]
    assert {(each["opponent"], each["wire"]) for each in options} == {("flat-heavy", "can")}
    assert len({each["seed"] for each in options}) == 3
    assert {(parse_address(url).options["seed"], parse_address(url).options["opponent"]) for url in other.urls} == {
        ("7", "point-light")
    }


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--live", "--no-open"], "One robot is coached, since --live shows one robot"),
        (["--checkpoint", "c.json"], "--checkpoint names the checkpoint of one run"),
        (["sim://junior?faults=drop:0.1"], "faults in the address is of one robot"),
        (["sim://junior?referee=0"], "referee in the address is of one robot"),
        (["--runs", "1"], ""),
        (["tcp://127.0.0.1:1"], ""),
        (["--live", "--no-open", "--quiet"], ""),
    ],
)
def test_one_robot_where_one_is_meant(
    coached: list[TeamJob | None], capsys: pytest.CaptureFixture[str], asked: list[str], said: str
) -> None:
    assert run(["coach", *asked]) == 2
    assert coached == [None]
    printed = capsys.readouterr().out
    assert said in printed
    assert ("One robot" in printed) is bool(said)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["tcp://127.0.0.1:1"], "there is one at tcp://127.0.0.1:1"),
        (["--live"], "--live shows one robot, and --runs makes several"),
        (["--checkpoint", "c.json"], "--checkpoint names the checkpoint of one run, and --runs"),
        (["--resume"], "leave --runs out"),
        (["--resume-from", "c.json"], "leave --runs out"),
    ],
)
def test_several_are_not_had_where_one_is_meant(
    coached: list[TeamJob | None], capsys: pytest.CaptureFixture[str], asked: list[str], said: str
) -> None:
    assert run(["coach", "--runs", "2", *asked]) == 2
    assert not coached
    assert said in capsys.readouterr().err


def test_a_run_that_is_gone_on_with_is_one(coached: list[TeamJob | None], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["coach", "--resume"]) == 2
    assert "did not finish: begin one without --resume" in capsys.readouterr().err
    assert not coached


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--runs", "1", "--scheduler", "tcp://127.0.0.1:8786"], "--scheduler is for several runs"),
        (["tcp://127.0.0.1:1", "--scheduler", "tcp://127.0.0.1:8786"], "--scheduler is for several runs"),
        (["--workers", "2", "--scheduler", "tcp://127.0.0.1:8786"], "leave one of them out"),
        (["--scheduler", "here"], "a scheduler has the address tcp://HOST:PORT"),
    ],
)
def test_a_cluster_is_for_several_and_brings_its_workers(
    coached: list[TeamJob | None], capsys: pytest.CaptureFixture[str], asked: list[str], said: str
) -> None:
    assert run(["coach", *asked]) == 2
    assert not coached
    assert said in capsys.readouterr().err
