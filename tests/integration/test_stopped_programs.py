"""Programs that are stopped, debugged or stuck while they drive a robot: real processes, real ptys, and what the wheels do.

The robot is served by this process, and says by its own clock when it was told something last and when its wheels turned last.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Final

import pytest
from at_night import all_by_day_but
from observed import Observed, served
from processes import Hil, Program
from shell import Shell

from firmware_protocol.messages import State

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "waitid"), reason="this system does not tell of processes that are stopped"),
]

PERIOD: Final = 0.005
"""Control period, in s."""
WATCHDOG: Final = 0.25
"""Longest silence of the host, in s."""
SAYS_ITS_STATE: Final = 1.5
"""It has said what it does now within this time, in s."""
UNDER_WAY: Final = 0.05
"""What a program has said last is on its way to the robot for no longer than this, in s."""


def assert_the_watchdog_stopped(robot: Observed, since: float) -> None:
    """Nobody has kept the robot awake since then, and its wheels stood still when its watchdog had run out."""
    robot.until(lambda: robot.now - robot.moved > 2 * WATCHDOG and robot.now - robot.listened > 4 * WATCHDOG)
    assert robot.listened <= since + UNDER_WAY
    assert 0.0 < robot.moved <= robot.listened + WATCHDOG + PERIOD + 1e-9


# --- A program of one's own ----------------------------------------------------------------------------------------------

PROGRAM: Final = """
import sys, threading, time
import hil

def stuck(*_):
    print("stuck", flush=True)
    threading.Event().wait()

class Tap:
    def __getattr__(self, name):
        return stuck if name == "wire_rx" and begun else lambda *_: None

begun = False
limits = hil.Limits(duration=5.0, maneuver=60.0)
with {connection} as robots:
    junior = next(iter(robots)) if isinstance(robots, hil.Robots) else robots
    junior.arm()
    junior.drive(0.3, -0.3, 5.0)
    junior.wait(0.3)
    begun = True
    {then}
"""
ONE: Final = "hil.connect(sys.argv[1], limits=limits)"
TAPPED: Final = "hil.connect(sys.argv[1], limits=limits, taps=[Tap()])"
SEVERAL: Final = "hil.connect_all(sys.argv[1], limits=limits)"
PLACES: Final = {
    "in a breakpoint": (ONE, "print('stuck', flush=True); breakpoint()"),
    "in an endless loop": (ONE, "print('stuck', flush=True)\n    while True: pass"),
    "asleep": (ONE, "print('stuck', flush=True); time.sleep(1000)"),
    "with several robots": (SEVERAL, "stuck()"),
    "in a listener": (ONE, "junior.listen(stuck); junior.wait(1000)"),
    "in the condition of a maneuver": (ONE, "junior.perform(['L'] * 8, period=2.0, until=stuck)"),
    "in a tap": (TAPPED, "junior.wait(1000)"),
    "with waiting in another thread": (ONE, "threading.Thread(target=time.sleep, args=[1000], daemon=True).start(); stuck()"),
}


@pytest.mark.parametrize("place", all_by_day_but({"asleep"}, PLACES))
def test_a_program_that_is_stuck_keeps_no_robot_driving(place: str, tmp_path: Path) -> None:
    connection, then = PLACES[place]
    code = PROGRAM.format(connection=connection, then=then)
    with served() as (robot, url), Program(tmp_path, sys.executable, "-c", code, url, stdin=subprocess.PIPE) as program:
        program.until("stuck")
        assert_the_watchdog_stopped(robot, robot.now)


@pytest.mark.parametrize(
    ("name", "connection"),
    [
        ("SIGSTOP", ONE),
        ("SIGTSTP", ONE),
        ("SIGKILL", ONE),
        ("SIGSTOP", SEVERAL),
        pytest.param("SIGTSTP", SEVERAL, marks=pytest.mark.nightly),
        pytest.param("SIGKILL", SEVERAL, marks=pytest.mark.nightly),
    ],
)
def test_a_program_that_is_stopped_or_killed_keeps_no_robot_driving(name: str, connection: str, tmp_path: Path) -> None:
    code = PROGRAM.format(connection=connection, then="print('driving', flush=True); robots.wait(1000)")
    with served() as (robot, url), Program(tmp_path, sys.executable, "-c", code, url, own_group=True) as program:
        program.until("driving")
        assert robot.turning
        program.send(signal.Signals[name])
        if name == "SIGKILL":
            assert program.end() == -signal.SIGKILL
        else:
            robot.until(lambda: program.is_stopped)
        assert_the_watchdog_stopped(robot, robot.now)


# --- The commands --------------------------------------------------------------------------------------------------------


RIGHT: Final = "\x1b[C"


def drive(shell: Shell, robot: Observed) -> None:
    """Hold a key down until the wheels turn."""
    for _ in range(100):
        shell.types(RIGHT)
        end = robot.now + 0.2
        robot.until(lambda end=end: robot.turning or robot.now >= end)  # type: ignore[misc]
        if robot.turning:
            return
    pytest.fail("the wheels do not turn")


def press(shell: Shell, key: str, robot: Observed, state: State) -> None:
    """Press a key until the robot is in a state."""
    for _ in range(20):
        shell.types(key)
        if robot.becomes(state, within=0.5):
            return
    pytest.fail(f"{key} does not bring it into {state!r}")


def test_after_ctrl_z_and_fg_the_monitor_has_its_keys_and_the_robot_was_disarmed_meanwhile(tmp_path: Path) -> None:
    with served() as (robot, url), Shell(tmp_path) as shell:
        shell.until("ready> ")
        shell.types(f"{sys.executable} -c 'from hil.cli import main; main()' monitor {url} --no-log\n")
        shell.until("emergency stop")
        for _ in range(2):
            press(shell, "a", robot, State.READY)
            drive(shell, robot)
            shell.types("\x1a")
            assert robot.becomes(State.DISARMED, within=SAYS_ITS_STATE)
            shell.until("Stopped", "Suspended")
            assert robot.moved <= robot.listened  # it was told; by its watchdog it would have stopped later
            shell.types("stty -a\n")
            modes = shell.until("echoke").split()
            assert {"icanon", "echo"} <= {mode.strip(";") for mode in modes}
            silent = robot.now
            robot.let_pass(1.0)
            assert robot.listened <= silent + UNDER_WAY
            assert robot.state is State.DISARMED
            shell.types("fg\n")
            shell.until("emergency stop")
            assert robot.state is State.DISARMED
        press(shell, "a", robot, State.READY)
        drive(shell, robot)
        press(shell, "e", robot, State.STOPPED)
        shell.types("q")
        shell.until("ready> ")


@pytest.mark.parametrize("name", ["SIGSTOP", "SIGTSTP"])
@pytest.mark.parametrize(
    ("verb", "figure"),
    [
        (["coach", "--budget", "6", "--held-out", "0", "--no-report"], "maneuvers"),
        pytest.param(["bout", "--controller", "chase"], "trials", marks=pytest.mark.nightly),
    ],
)
def test_coaching_and_bouts_go_on_after_they_were_stopped(verb: list[str], figure: str, name: str, tmp_path: Path) -> None:
    options = [*verb[1:], "--no-log", "--json"] + (["--trials", "1"] if verb[0] == "bout" else [])
    with served() as (robot, url), Hil(tmp_path, verb[0], url, *options, own_group=True) as program:
        robot.until(lambda: robot.turning)
        program.send(signal.Signals[name])
        robot.until(lambda: program.is_stopped)
        if name == "SIGSTOP":
            assert_the_watchdog_stopped(robot, robot.now)
        robot.let_pass(SAYS_ITS_STATE)
        assert not robot.turning
        if name == "SIGTSTP":
            assert robot.moved <= robot.listened  # it was told; by its watchdog it would have stopped later
            assert robot.state is State.DISARMED
        program.send(signal.SIGCONT)
        assert program.end() == 0
        assert json.loads(program.text[program.text.index("{") :])[figure] == {"maneuvers": 6, "trials": 1}[figure]
        assert robot.becomes(State.DISARMED, within=SAYS_ITS_STATE)


def test_a_command_that_is_stuck_is_stopped_all_the_same(tmp_path: Path) -> None:
    then = """
    from hil.terminal.suspending import Suspension
    suspension = Suspension(
        junior.bridge.operator, lambda: [junior], lambda: [junior.bridge], junior.step, junior.now
    )
    with suspension:
        junior.between = suspension.attend
        stuck = print("stuck", flush=True)
        while True: pass
    """
    code = PROGRAM.format(connection=ONE, then=then)
    with served() as (robot, url), Program(tmp_path, sys.executable, "-c", code, url, own_group=True) as program:
        program.until("stuck")
        program.send(signal.SIGTSTP)
        asked = robot.now
        robot.until(lambda: program.is_stopped)
        assert_the_watchdog_stopped(robot, asked)


def test_a_contest_goes_on_while_its_command_is_stopped(tmp_path: Path) -> None:
    with served() as (robot, url):
        with Hil(tmp_path, "coach", url, "--budget", "2", "--held-out", "0", "--no-log", "--no-report", "--quiet") as coach:
            assert coach.end() == 0
        advice = next((tmp_path / "runs").glob("*/advice.toml"))
        options = ["--contest", "--countdown", "1", "--no-log"]
        with Hil(tmp_path, "deploy", str(advice), url, *options, own_group=True) as program:
            robot.until(lambda: robot.state is State.CONTEST)
            program.send(signal.SIGTSTP)
            robot.until(lambda: program.is_stopped)
            robot.let_pass(SAYS_ITS_STATE)
            assert robot.state is State.CONTEST
            program.send(signal.SIGCONT)
