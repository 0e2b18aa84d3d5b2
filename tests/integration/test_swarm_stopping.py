"""All wheels of a swarm stop: when its host dies, when it is interrupted, when what chooses the moves fails."""

from __future__ import annotations

import signal
import sys
from typing import TYPE_CHECKING, Final

import numpy as np
import pytest
from processes import Hil, Program
from served_swarm import ServedSwarm, served_swarm

from firmware_protocol.vocabulary import Move
from hil.swarm.connecting import connect_swarm
from simdevice.swarm.settings import SwarmSettings

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow
WATCHDOG: Final = 0.25
"""Longest silence of the host, in s."""
MISSION: Final = ("swarm", "surround", "--yes", "--no-report")
FAILS: Final = """
from pal_advisor.surround import Surround
from hil.cli import main

ask, asked = Surround.ask, 0

def fail(self, kind, sights):
    global asked
    asked += 1
    if asked == 3:
        print("the adviser fails", flush=True)
        raise RuntimeError("an error in the adviser")
    return ask(self, kind, sights)

Surround.ask = fail
main()
"""


def most_drive(robots: ServedSwarm) -> bool:
    """Most RANGERs are under way."""
    return int(np.count_nonzero(robots.table.arrays.command)) > 25


def stand(robots: ServedSwarm) -> float:
    """Wait until all wheels have stood for more than a second. Returns when the last one was let go, in s of robot time."""
    begun = robots.now()
    robots.until(lambda: robots.now() > max(robots.rolled, begun) + 1.2)
    return robots.rolled


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.nightly)])
def test_all_wheels_stop_when_the_host_is_killed_or_interrupted(number: signal.Signals, tmp_path: Path) -> None:
    settings = SwarmSettings(rangers=25, wilds=8)
    with served_swarm(settings, "tcp://127.0.0.1:0") as robots, Hil(tmp_path, *MISSION, *robots.urls, own_group=True) as host:
        robots.until(lambda: most_drive(robots))
        assert len(robots.armed) > 25
        host.send(number)
        sent = robots.now()
        assert sent < robots.rolled + robots.period * 20
        assert stand(robots) <= sent + WATCHDOG + robots.period
        if number == signal.SIGKILL:
            assert host.end() == -number
        else:
            assert host.end() == 130
            assert not robots.armed


def test_all_wheels_stop_when_the_adviser_fails(tmp_path: Path) -> None:
    settings = SwarmSettings(rangers=6, wilds=2)
    command = (sys.executable, "-c", FAILS, *MISSION)
    with served_swarm(settings, "tcp://127.0.0.1:0", speed=2.0) as robots, Program(tmp_path, *command, *robots.urls) as host:
        host.until("the adviser fails")
        assert stand(robots) <= robots.heard
        assert host.end() == 1
        assert sum(robots.begun.values()) >= 8, "all have moved before"
        assert not robots.armed


def drive_and_fail(robots: ServedSwarm) -> None:
    """Have robots drive far, and fail while they do."""
    failing = iter([RuntimeError("an error in mid-move")])

    def fail() -> None:
        if np.count_nonzero(robots.table.arrays.command) > 6:
            for error in failing:
                raise error

    with connect_swarm(*robots.urls, expect=6) as swarm:
        swarm.arm()
        swarm.between = fail
        swarm.move({robot: Move(0.5, heading=0.0) for robot in range(1, 7)})


def test_all_wheels_stop_when_a_program_fails_in_mid_move() -> None:
    with served_swarm(SwarmSettings(rangers=6, wilds=0), "tcp://127.0.0.1:0") as robots:
        with pytest.raises(RuntimeError, match="mid-move"):
            drive_and_fail(robots)
        ended = robots.now()
        assert stand(robots) <= ended
        assert not robots.armed
