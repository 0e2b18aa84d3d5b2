"""Failing tests of somebody's repository leave the logs of their robots, and say where."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

# Loaded before the inner runs, which forget what they have loaded themselves.
import hil.look.writing
import hil.recording.line_log
import hil.report.write
import hil.sumo.ring
import simdevice.serving.server
from firmware_protocol.messages import Command, CommandLong, SetupSigning
from hil.bridge.clock import MonotonicClock
from hil.mcaplog import LogReader
from hil.mcaplog.errors import UnreadableLogError
from hil.mcaplog.schemas import topic_of
from hil.report.style import can_draw
from simdevice.serving.endpoints import TcpEndpoint
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

if can_draw():
    import matplotlib.pyplot  # noqa: F401, ICN001

pytest_plugins = ["pytester"]

STRICT: Final = ("-W", "error", "--strict-markers", "-p", "no:cacheprovider", "-p", "no:hypothesispytest")
KEEP: Final = (*STRICT, "--hil-logs", "kept")
PICTURE: Final = "picture: kept/*/bouts.png" if can_draw() else "There are no pictures: pip install*"

ONE_FAILS: Final = """
    def test_it_turns(junior):
        junior.arm()
        junior.perform(["L", "R"], period=0.1)
        assert junior.armed is False

    def test_it_arms(junior):
        junior.arm()

    def test_without_a_robot():
        assert not "a robot"
"""


def kept(pytester: pytest.Pytester) -> list[str]:
    """Folders that are kept."""
    folder = pytester.path / "kept"
    return sorted(one.name for one in folder.iterdir()) if folder.exists() else []


def told(log: Path) -> list[int]:
    """Commands that a program has given, by its log."""
    return [entry.value.command for entry in LogReader(log).entries({topic_of(CommandLong)})]


@pytest.mark.slow
def test_a_failing_test_leaves_log_page_and_picture_and_names_them(pytester: pytest.Pytester) -> None:
    path = pytester.makepyfile(ONE_FAILS)
    run = pytester.runpytest_inprocess(*KEEP)
    run.assert_outcomes(failed=2, passed=1)
    name = f"{path.name}-test_it_turns"
    run.stdout.fnmatch_lines([
        "*_ test_it_turns _*",
        "*- robot's log (closed at teardown) -*",
        f"junior: kept/{name}/log.mcap",
        f"page: kept/{name}/view.html",
        PICTURE,
        "*_ test_without_a_robot _*",
    ])  # fmt: skip
    assert kept(pytester) == [name]
    folder = pytester.path / "kept" / name
    assert Command.ARM_DISARM in told(folder / "log.mcap")
    assert (folder / "bouts.png").exists() == can_draw()
    assert "test_it_turns" in (folder / "view.html").read_text()
    reader = LogReader(folder / "log.mcap")
    assert not list(reader.entries(set()))
    assert reader.metadata["config"]["seed"] == "1"


@pytest.mark.slow
def test_what_is_there_is_left_alone(pytester: pytest.Pytester) -> None:
    path = pytester.makepyfile(ONE_FAILS)
    for _ in range(2):
        pytester.runpytest_inprocess(*KEEP, "-k", "turns").assert_outcomes(failed=1, deselected=2)
    assert kept(pytester) == [f"{path.name}-test_it_turns", f"{path.name}-test_it_turns-2"]


def test_without_a_failure_there_is_nothing(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(ONE_FAILS)
    pytester.runpytest_inprocess(*KEEP, "-k", "arms").assert_outcomes(passed=1, deselected=2)
    assert not (pytester.path / "kept").exists()


def test_where_logs_can_t_go_is_told_before_the_first_test(pytester: pytest.Pytester) -> None:
    (pytester.path / "kept").write_text("a file")
    run = pytester.runpytest_inprocess(*KEEP)
    assert run.ret == pytest.ExitCode.USAGE_ERROR
    run.stderr.fnmatch_lines(["*--hil-logs kept: this is no folder: name one, which need not exist*"])


@pytest.mark.slow
def test_errors_before_and_after_a_test_leave_logs_too(pytester: pytest.Pytester) -> None:
    path = pytester.makepyfile("""
        import pytest

        @pytest.fixture
        def broken(junior):
            raise ValueError("broken")

        @pytest.fixture
        def untidy(junior):
            yield junior
            raise ValueError("untidy")

        def test_before(broken):
            pass

        def test_after(untidy):
            untidy.arm()
    """)
    run = pytester.runpytest_inprocess(*KEEP)
    run.assert_outcomes(passed=1, errors=2)
    run.stdout.fnmatch_lines([
        "*- robot's log -*",
        f"junior: kept/{path.name}-test_before/log.mcap",
        "*ValueError: untidy*",
        "*- robot's log (closed at teardown) -*",
        f"junior: kept/{path.name}-test_after/log.mcap",
    ])  # fmt: skip
    assert kept(pytester) == [f"{path.name}-test_after", f"{path.name}-test_before"]
    assert Command.ARM_DISARM in told(pytester.path / "kept" / f"{path.name}-test_after" / "log.mcap")


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
def test_what_a_program_says_on_a_port_is_kept(pytester: pytest.Pytester) -> None:
    path = pytester.makepyfile("""
        import hil

        def test_program(junior_pty):
            with hil.connect(junior_pty.url) as robot:
                robot.arm()
            assert not "done"
    """)
    run = pytester.runpytest_inprocess(*KEEP)
    run.assert_outcomes(failed=1)
    run.stdout.fnmatch_lines([f"junior_pty: kept/{path.name}-test_program/log.mcap"])
    assert Command.ARM_DISARM in told(pytester.path / "kept" / f"{path.name}-test_program" / "log.mcap")


def test_a_page_that_can_t_be_made_is_told_and_the_tests_go_on(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **_options: object) -> None:
        raise ZeroDivisionError("of all things")

    monkeypatch.setattr(hil.report.write, "write_report", fails)
    path = pytester.makepyfile(ONE_FAILS)
    run = pytester.runpytest_inprocess(*KEEP)
    run.assert_outcomes(failed=2, passed=1)
    run.stdout.fnmatch_lines([f"junior: kept/{path.name}-test_it_turns/log.mcap", "There is no page of it: of all things"])
    assert (pytester.path / "kept" / f"{path.name}-test_it_turns" / "log.mcap").exists()


@pytest.mark.slow
def test_where_there_is_nothing_to_play_the_report_is_the_page(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(*_: object) -> None:
        raise UnreadableLogError("nothing that hil can show")

    monkeypatch.setattr(hil.look.writing, "write_view", nothing)
    pytester.makepyfile(ONE_FAILS)
    run = pytester.runpytest_inprocess(*KEEP)
    run.stdout.fnmatch_lines(["page: kept/*-test_it_turns/report.html"])


@pytest.fixture
def served() -> Iterator[str]:
    """A robot on a TCP port."""
    endpoint, stop = TcpEndpoint(port=0), threading.Event()
    arguments = (junior_world(WorldSettings()), endpoint, MonotonicClock(), stop.is_set)
    thread = threading.Thread(target=simdevice.serving.server.serve, args=arguments)
    thread.start()
    yield endpoint.url
    stop.set()
    thread.join(10)


@pytest.mark.slow
def test_the_robot_at_a_link_has_one_log_that_tells_of_the_tests(pytester: pytest.Pytester, served: str) -> None:
    path = pytester.makepyfile(ONE_FAILS)
    pytester.runpytest_inprocess(*KEEP, "--hil-link", served, "-k", "arms").assert_outcomes(passed=1, deselected=2)
    assert not (pytester.path / "kept").exists()
    run = pytester.runpytest_inprocess(*KEEP, "--hil-link", served)
    run.assert_outcomes(failed=2, passed=1)
    run.stdout.fnmatch_lines(["junior: kept/robot-at-link/log.mcap, from * s to * s; a page of it is made when*"])
    assert kept(pytester) == ["robot-at-link"]
    folder = pytester.path / "kept" / "robot-at-link"
    notes = [entry.value.text for entry in LogReader(folder / "log.mcap").entries({"/events"}) if entry.value.kind == "test"]
    assert notes == [f"{path.name}::{name}" for name in ("test_it_turns", "test_it_arms")]
    assert (folder / "view.html").exists()


@pytest.mark.slow
def test_a_log_that_comes_out_otherwise_is_kept_too(pytester: pytest.Pytester) -> None:
    (pytester.path / "logs").mkdir()
    (pytester.path / "logs" / "old.mcap").write_bytes((Path(__file__).parents[1] / "golden" / "small.mcap").read_bytes())
    run = pytester.runpytest_inprocess(*KEEP, "--hil-replay", "logs/*.mcap")
    run.assert_outcomes(failed=1)
    run.stdout.fnmatch_lines(["*can't be replayed*", "copy of logs/old.mcap: kept/logs-old.mcap-replay/old.mcap"])
    assert {"old.mcap", "report.html"} <= {one.name for one in (pytester.path / "kept" / "logs-old.mcap-replay").iterdir()}


# --- side by side ------------------------------------------------------------------------------------------------------


MANY: Final = """
    import pytest

    @pytest.mark.parametrize("number", range(6))
    @pytest.mark.parametrize("sign", "+-")
    def test_it_turns(junior, sign, number):
        junior.arm()
        assert number % 2

    def test_program(junior_pty):
        import hil

        with hil.connect(junior_pty.url) as robot:
            robot.arm()

    def test_again(junior_pty):
        test_program(junior_pty)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there are no ptys on Windows")
def test_workers_side_by_side_keep_folders_of_their_own(pytester: pytest.Pytester) -> None:
    pytest.importorskip("xdist")
    path = pytester.makepyfile(MANY)
    run = pytester.runpytest_subprocess(*KEEP, "-n", "2", "--dist", "load")
    run.assert_outcomes(passed=8, failed=6)
    named = {line.split()[1] for line in run.outlines if line.startswith("junior: ")}
    assert len(named) == 6
    assert {(pytester.path / name).parent.name for name in named} == set(kept(pytester))
    assert kept(pytester)[0].startswith(path.name)
    for name in named:
        assert Command.ARM_DISARM in told(pytester.path / name)


def test_one_robot_is_for_one_worker(pytester: pytest.Pytester) -> None:
    pytest.importorskip("xdist")
    run = pytester.runpytest_subprocess(*STRICT, "--hil-link", "tcp://127.0.0.1:1", "-n", "2")
    assert run.ret == pytest.ExitCode.USAGE_ERROR
    run.stderr.fnmatch_lines(["*--hil-link is one robot, and several pytest-xdist workers can't share it: say -n 1*"])


@pytest.mark.slow
def test_logs_are_replayed_side_by_side(pytester: pytest.Pytester) -> None:
    pytest.importorskip("xdist")
    (pytester.path / "logs").mkdir()
    pytester.mkdir("tests")
    for name in ("pty", "lost"):
        log = Path(__file__).parents[1] / "replay_logs" / f"{name}.mcap"
        (pytester.path / "logs" / log.name).write_bytes(log.read_bytes())
    run = pytester.runpytest_subprocess(*KEEP, "--hil-replay", "logs/*.mcap", "-n", "2", "tests")
    run.assert_outcomes(passed=2)


# --- taken down beside the robot ---------------------------------------------------------------------------------------


def test_a_key_is_not_written_down(pytester: pytest.Pytester) -> None:
    path = pytester.makepyfile("""
        from firmware_protocol.messages import SetupSigning
        from firmware_protocol.wire.mavlink import MavlinkCodec

        def test_key(junior_world):
            frame = MavlinkCodec(system=255, component=190).encode(SetupSigning(1, 1, tuple(range(1, 33)), 7))
            junior_world.step(frame[:20])
            junior_world.step(frame[20:])
            assert not "done"
    """)
    pytester.runpytest_inprocess(*KEEP).assert_outcomes(failed=1)
    reader = LogReader(pytester.path / "kept" / f"{path.name}-test_key" / "log.mcap")
    sent = b"".join(entry.value.data for entry in reader.entries({"/wire/tx"}))
    assert len(sent) > 32
    assert sent[10:] == bytes(len(sent) - 10)
    assert not list(reader.entries({topic_of(SetupSigning)}))
