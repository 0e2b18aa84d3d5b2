"""`hil monitor` on a real terminal, with a real robot's timing: what keys do, and what a terminal that hangs can't do."""

from __future__ import annotations

import os
import re
import sys
from typing import TYPE_CHECKING, Final

import pytest
from logged import inputs_of
from observed import Observed, served
from processes import Hil
from serving import in_thread
from shell import Shell

import hil
from firmware_protocol.messages import State
from simdevice.serving.endpoints import PtyEndpoint
from simdevice.swarm.settings import SwarmSettings
from simdevice.swarm.world import SwarmWorld

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="needs a terminal as POSIX has it")]

HIL: Final = f"{sys.executable} -c 'from hil.cli import main; main()'"
UP: Final = "\x1b[A"
SHOWN: Final = "emergency stop"
"""Is on the screen as soon as a robot is."""
LEFT: Final = "\x1b[?1049l"
"""The screen is given back."""
REPEATED: Final = 0.033
"""A key that is held down comes so often, in s."""
HOLD: Final = 0.25
SLACK: Final = 0.15
"""Two cores that others use as well: so late may something be, in s."""


def monitor(shell: Shell, arguments: str) -> None:
    shell.until("ready> ")
    shell.types(f"{HIL} monitor {arguments}\n")
    shell.until(SHOWN)


def armed(shell: Shell, robot: Observed) -> None:
    for _ in range(20):
        shell.types("a")
        if robot.becomes(State.READY, within=0.5):
            return
    pytest.fail("it is not armed")


def test_a_key_that_is_held_down_drives_and_the_robot_stands_when_it_is_let_go(tmp_path: Path) -> None:
    with served() as (robot, url), Shell(tmp_path) as shell:
        monitor(shell, f"{url} --no-log")
        armed(shell, robot)
        began = robot.now
        last = began
        while robot.now < began + 1.0:
            last = robot.now
            shell.types(UP)
            robot.let_pass(REPEATED)
        assert robot.turning
        robot.until(lambda: not robot.turning)
        robot.let_pass(1.0)
        assert last + HOLD / 2 < robot.moved <= last + HOLD + SLACK
        shell.types("q")
        shell.until(LEFT)
        shell.until("ready> ")
        assert robot.becomes(State.DISARMED, within=1.5)


@pytest.mark.parametrize(
    ("key", "state"),
    [
        ("e", State.STOPPED),
        pytest.param(" ", State.READY, marks=pytest.mark.nightly),
        pytest.param("d", State.DISARMED, marks=pytest.mark.nightly),
        pytest.param("\x03", State.DISARMED, marks=pytest.mark.nightly),
    ],
)
def test_a_terminal_that_takes_nothing_stops_neither_keep_alive_nor_a_stop(key: str, state: State, tmp_path: Path) -> None:
    with served() as (robot, url), Shell(tmp_path) as shell:
        monitor(shell, f"{url} --no-log")
        armed(shell, robot)
        shell.takes.clear()
        robot.let_pass(4.0)  # so much does no terminal hold
        assert robot.now - robot.listened < 0.2
        for _ in range(3):
            shell.types(UP)
            robot.let_pass(REPEATED)
        robot.until(lambda: robot.turning)
        pressed = robot.now
        shell.types(key)
        robot.until(lambda: not robot.turning)
        assert robot.moved <= pressed + SLACK
        assert robot.becomes(state, within=1.5)
        shell.takes.set()
        if key != "\x03":
            shell.types("q")
        shell.until("ready> ")


def test_without_a_link_an_emulated_robot_is_driven_in_real_time_and_the_log_replays(tmp_path: Path) -> None:
    log = tmp_path / "driven.mcap"
    with Shell(tmp_path) as shell:
        monitor(shell, f"--log {log}")
        shell.types("a")
        shell.until("is armed")
        shell.types(UP)
        shell.types("b")
        shell.until("bout 2")
        shell.types("?")
        shell.until("PageUp")
        shell.types("?e")
        shell.until("has stopped, and says so")
        shell.types("q")
        shell.until(LEFT)
        shell.until("ready> ")
    assert inputs_of(log) == ["key a", "key ^", "key b", "key e", "key q"]
    report = hil.replay(log, strict=True)
    assert report.same, str(report)
    assert report.duration < 60.0


def test_who_is_there_is_found_out_by_listening(tmp_path: Path) -> None:
    endpoint = PtyEndpoint()
    with in_thread(SwarmWorld(SwarmSettings(rangers=2, wilds=1)), endpoint):
        with Hil(tmp_path, "monitor", endpoint.url, "--no-log", "--duration", "1.5") as program:
            assert program.end() == 0
        assert re.search(r"^1  RANGER  disarmed", program.text, re.MULTILINE)
        assert re.search(r"^3  WILD  disarmed", program.text, re.MULTILINE)
        with Shell(tmp_path) as shell:
            monitor(shell, f"{endpoint.url} --no-log")
            shell.types("q")
            shell.until("ready> ")


def test_a_pipe_gets_lines_and_loads_no_textual(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom hil.cli.app import run\n"
        "assert run(['monitor', '--no-log', '--duration', '1']) == 0\nassert 'textual' not in sys.modules, 'loaded'\n"
    )
    with Shell(tmp_path) as shell:
        (tmp_path / "program.py").write_text(code, encoding="utf-8")
        shell.until("ready> ")
        shell.types(f"{sys.executable} program.py | cat; echo over\n")
        shell.until("disarmed")
        assert "loaded" not in shell.until("over\r\n")
