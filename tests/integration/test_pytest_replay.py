"""Replays of logs as tests of somebody's repository."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

# Loaded before the inner runs, which forget what they have loaded themselves.
import simdevice.sumo.world  # noqa: F401
from firmware_protocol.vocabulary import Action, Maneuver
from hil.cli.app import run as run_hil
from hil.sumo.controllers import ChaseController

if TYPE_CHECKING:
    from collections.abc import Iterator

pytest_plugins = ["pytester"]

STRICT = ("-W", "error", "--strict-markers", "-p", "no:cacheprovider", "-p", "no:hypothesispytest")
OLD = Path(__file__).parents[1] / "golden" / "small.mcap"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a bout, slimmed."""
    folder = tmp_path_factory.mktemp("recorded")
    whole, small = str(folder / "whole.mcap"), str(folder / "bout.mcap")
    assert run_hil(["bout", "--controller", "chase", "--trials", "1", "--quiet", "--log", whole]) == 0
    assert run_hil(["log", "slim", whole, "-o", small, "--quiet"]) == 0
    return Path(small)


@pytest.fixture
def logs(pytester: pytest.Pytester, recorded: Path) -> Path:
    """A repository's folder of logs: two that are in order."""
    folder = pytester.path / "tests" / "logs"
    folder.mkdir(parents=True)
    for name in ("first.mcap", "second.mcap"):
        shutil.copyfile(recorded, folder / name)
    return folder


@pytest.fixture
def another_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """A program that chases otherwise than the recorded one did."""
    monkeypatch.setattr(ChaseController, "choose", lambda *_, **__: Maneuver((Action.R,), 0.2))


def test_each_log_is_a_test(pytester: pytest.Pytester, logs: Path) -> None:
    pytester.makepyfile("def test_own(): pass")
    run = pytester.runpytest_inprocess(*STRICT, "-v", "--hil-replay", "tests/logs/*.mcap")
    run.assert_outcomes(passed=3)
    run.stdout.fnmatch_lines(["tests/logs/first.mcap::replay PASSED*", "tests/logs/second.mcap::replay PASSED*"])
    assert sorted(path.name for path in logs.iterdir()) == ["first.mcap", "second.mcap"]


@pytest.mark.usefixtures("logs")
@pytest.mark.parametrize(
    ("arguments", "passed"),
    [
        (("--hil-replay", "tests/logs/f*.mcap", "--hil-replay", "tests/logs/*.mcap"), {"passed": 2}),
        (("--hil-replay", "tests/**/*.mcap", "-k", "second"), {"passed": 1, "deselected": 1}),
        (("--hil-replay", "tests/logs/*.mcap", "tests"), {"passed": 2}),
        (("--hil-replay", "tests/logs/*.mcap", "elsewhere"), {"passed": 2}),
        (("--hil-replay", "tests/logs/*.mcap", "tests/logs/first.mcap"), {"passed": 1}),
        (("--hil-replay", "tests/logs/*.mcap", "tests/logs/first.mcap::replay"), {"passed": 1}),
    ],
)
def test_logs_are_chosen_as_other_tests_are(
    pytester: pytest.Pytester, arguments: tuple[str, ...], passed: dict[str, int]
) -> None:
    pytester.mkdir("elsewhere")
    pytester.runpytest_inprocess(*STRICT, *arguments).assert_outcomes(**passed)


def test_an_absolute_pattern_leads_elsewhere(pytester: pytest.Pytester, recorded: Path) -> None:
    pytester.runpytest_inprocess(*STRICT, "--hil-replay", str(recorded.parent / "b*.mcap")).assert_outcomes(passed=1)


@pytest.mark.usefixtures("logs")
def test_logs_are_left_alone_unless_asked_for(pytester: pytest.Pytester) -> None:
    assert pytester.runpytest_inprocess(*STRICT).ret == pytest.ExitCode.NO_TESTS_COLLECTED


@pytest.mark.usefixtures("logs")
def test_a_pattern_that_matches_nothing_is_wrong_usage(pytester: pytest.Pytester) -> None:
    run = pytester.runpytest_inprocess(*STRICT, "--hil-replay", "tests/logs/*.mcap", "--hil-replay", "logs/*.mcap")
    assert run.ret == pytest.ExitCode.USAGE_ERROR
    run.stderr.fnmatch_lines([f"*--hil-replay logs/*.mcap: no file matches this, seen from {pytester.path}*"])
    run = pytester.runpytest_inprocess(*STRICT, "--hil-replay", "tests/logs")
    assert run.ret == pytest.ExitCode.USAGE_ERROR
    run.stderr.fnmatch_lines(["*it is a folder: name its logs, 'tests/logs/[*].mcap'"])


def test_a_log_that_pytest_would_pass_over_is_told_of(pytester: pytest.Pytester, recorded: Path) -> None:
    pytester.mkdir(".hidden")
    shutil.copyfile(recorded, pytester.path / ".hidden" / "bout.mcap")
    run = pytester.runpytest_inprocess(*STRICT, "--hil-replay", ".hidden/*.mcap")
    assert run.ret == pytest.ExitCode.USAGE_ERROR
    run.stderr.fnmatch_lines([f"*pytest passes over {pytester.path}/.hidden/bout.mcap, by norecursedirs*"])
    pytester.runpytest_inprocess(*STRICT, "--hil-replay", ".hidden/*.mcap", ".hidden").assert_outcomes(passed=1)


@pytest.mark.usefixtures("logs", "another_program")
def test_the_failure_is_the_first_difference(pytester: pytest.Pytester) -> None:
    run = pytester.runpytest_inprocess(*STRICT, "-x", "--hil-replay", "tests/logs/*.mcap")
    run.assert_outcomes(failed=1)
    run.stdout.fnmatch_lines(
        [
            "*replay of tests/logs/first.mcap*",
            "/wire/tx differs at step * (* s) of tests/logs/first.mcap, field data: JuniorManeuver.*",
            "*decisions and steps before were the same",
            "*recorded: *",
            "*now: *",
            "*decisions before*",
            "*received since*",
            "What to do: docs/replay.md, When it is not the same",
            "If the change was meant, *: hil replay tests/logs/first.mcap --rerecord new.mcap",
            "To see it again: hil replay tests/logs/first.mcap",
            "FAILED tests/logs/first.mcap::replay - Failed: /wire/tx differs *",
        ]
    )
    assert "Traceback" not in run.stdout.str()
    assert "pytest_replay.py" not in run.stdout.str()


def test_a_log_that_cannot_be_replayed_fails_with_why(pytester: pytest.Pytester, logs: Path) -> None:
    shutil.copyfile(OLD, logs / "old.mcap")
    (logs / "text.mcap").write_text("no log")
    run = pytester.runpytest_inprocess(*STRICT, "--hil-replay", "tests/logs/*.mcap")
    run.assert_outcomes(passed=2, failed=2)
    run.stdout.fnmatch_lines(["*old.mcap does not say *", "The log can't be replayed*", "*text.mcap is not a log: *"])


@pytest.mark.usefixtures("logs")
def test_the_fixture_replays(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        def test_same(hil_replay):
            report = hil_replay("tests/logs/first.mcap")
            assert report.same and report.verb == "bout" and not report.strict

        def test_every_entry_and_elsewhere(hil_replay, tmp_path, monkeypatch):
            monkeypatch.chdir(tmp_path)
            assert hil_replay("tests/logs/first.mcap", strict=True).strict
            assert not list(tmp_path.iterdir())

        def test_none(hil_replay):
            hil_replay("tests/logs/third.mcap")
        """
    )
    run = pytester.runpytest_inprocess(*STRICT)
    run.assert_outcomes(passed=2, failed=1)
    run.stdout.fnmatch_lines(["there is no log tests/logs/third.mcap, seen from *"])


def test_a_run_s_folder_will_do(pytester: pytest.Pytester, recorded: Path) -> None:
    run = pytester.path / "runs" / "one"
    run.mkdir(parents=True)
    shutil.copyfile(recorded, run / "log.mcap")
    pytester.mkdir("empty")
    pytester.makepyfile("""
        def test_run(hil_replay):
            assert hil_replay("runs/one").path.name == "log.mcap"

        def test_none(hil_replay):
            hil_replay("empty")
    """)
    outcome = pytester.runpytest_inprocess(*STRICT)
    outcome.assert_outcomes(passed=1, failed=1)
    outcome.stdout.fnmatch_lines(["there is no log.mcap in empty"])


@pytest.mark.usefixtures("logs", "another_program")
def test_the_fixture_fails_with_the_first_difference(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_same(hil_replay): hil_replay('tests/logs/first.mcap', strict=True)")
    run = pytester.runpytest_inprocess(*STRICT)
    run.assert_outcomes(failed=1)
    run.stdout.fnmatch_lines(
        ["/wire/tx differs at step * of tests/logs/first.mcap*", "To see it again: hil replay tests/logs/first.mcap --strict"]
    )


@pytest.fixture
def key(pytester: pytest.Pytester) -> Iterator[Path]:
    path = pytester.path / "our.key"
    path.touch(0o600)
    path.write_text(bytes(range(1, 33)).hex())
    yield path
    assert path.read_text() == bytes(range(1, 33)).hex()


@pytest.mark.slow
def test_a_signed_run_needs_the_key(pytester: pytest.Pytester, key: Path) -> None:
    signed = str(pytester.path / "signed.mcap")
    bout = ["bout", "--controller", "chase", "--trials", "1", "--quiet", "--log", signed, "--signing-key", str(key)]
    assert run_hil(bout) == 0
    without = pytester.runpytest_inprocess(*STRICT, "--hil-replay", "*.mcap")
    without.assert_outcomes(failed=1)
    without.stdout.fnmatch_lines(["*signed.mcap is of a run whose frames were signed: its replay needs the key*"])
    pytester.runpytest_inprocess(*STRICT, "--hil-replay", "*.mcap", "--hil-signing-key", str(key)).assert_outcomes(passed=1)
    pytester.makepyfile(f"def test_signed(hil_replay): hil_replay('signed.mcap', signing_key={str(key)!r})")
    pytester.runpytest_inprocess(*STRICT).assert_outcomes(passed=1)
