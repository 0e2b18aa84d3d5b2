"""`hil monitor` of micro-robots: what is seen of them, and what keys do to the chosen one."""

from __future__ import annotations

import json
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

from firmware_protocol.errors import NoRobotError
from hil.cli.app import run
from hil.connecting.connecting_all import connect_all_as
from hil.connecting.handles import RobotHandles
from hil.jobs.watched.micro_robots import STEP, TURN, MicroRobotsWatch
from hil.swarm.robot import MicroRobot

if TYPE_CHECKING:
    from collections.abc import Iterator

    Micros = RobotHandles[MicroRobot]


@pytest.fixture
def robots() -> Iterator[Micros]:
    url = "sim://swarm?rangers=3&wilds=1&networks=2&noise=none"
    with connect_all_as(partial(RobotHandles, MicroRobot), url, watch=True) as robots:
        yield robots


def live(robots: Micros, overview: MicroRobotsWatch, seconds: float) -> None:
    end = robots.now() + seconds
    while robots.now() < end:
        robots.step()
        overview.step()


def test_each_robot_has_a_line_and_is_only_watched(robots: Micros) -> None:
    overview = MicroRobotsWatch(robots)
    assert [overview.name(robot) for robot in overview.members] == ["1.1", "1.2", "2.1", "2.2"]
    live(robots, overview, 1.0)
    lines = overview.lines()
    assert [line.split()[:3] for line in lines[-2:]] == [["2.1", "RANGER", "disarmed"], ["2.2", "WILD", "disarmed"]]
    assert all("RANGERs 3" in line or "RANGERs 2" in line for line in lines)
    assert not any(robot.peer.taken for robot in overview.members)


def test_keys_move_the_chosen_robot_and_no_other(robots: Micros) -> None:
    told: list[str] = []
    overview = MicroRobotsWatch(robots, "2.2", tell=told.append)
    live(robots, overview, 1.0)
    before: Any = overview.document()
    for key, seconds in (("a", 0.2), ("^", 1.2), ("<", 1.2), (" ", 1.0)):
        overview.press(key)
        live(robots, overview, seconds)
    assert told == ["robot 2.2 is armed"]
    after: Any = overview.document()
    assert after["armed"] is True
    assert after["position"] == pytest.approx([before["position"][0] + STEP, before["position"][1]], abs=0.004)
    assert after["heading"] == pytest.approx(before["heading"] + TURN, abs=0.05)
    assert [robot.peer.taken for robot in overview.members] == [False, False, False, True]
    overview.press("d")
    live(robots, overview, 0.2)
    after = overview.document()
    assert after["armed"] is False


def test_another_is_chosen_by_keys(robots: Micros) -> None:
    overview = MicroRobotsWatch(robots)
    assert overview.aim("anaE") == ["1", "2", "2", ""]
    overview.press("p")
    assert overview.aim("a") == ["2"]
    assert [robot.address.system for robot in overview.members if overview.aim("a") == [str(robot.address.system)]]


def test_one_that_is_not_there_is_named(robots: Micros) -> None:
    with pytest.raises(NoRobotError, match=r"there is no robot 3.1: there are 1.1, 1.2, 2.1, 2.2"):
        MicroRobotsWatch(robots, "3.1")


def test_the_command_shows_one_in_full_or_all(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["monitor", "--no-log", "--json", "--duration", "1"]
    assert run([*command, "sim://swarm?rangers=1&wilds=0"]) == 0
    one = json.loads(capsys.readouterr().out)
    assert (one["robot"], one["class"], one["count"]) == ("1", "RANGER", [0, 0])
    assert run([*command, "sim://swarm?rangers=2&wilds=1"]) == 0
    assert [robot["robot"] for robot in json.loads(capsys.readouterr().out)] == ["1", "2", "3"]
