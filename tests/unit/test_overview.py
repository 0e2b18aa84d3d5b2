"""Several robots in `hil monitor`: what is shown, and whom a key acts on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from rich.console import Console
from scripted_crowd import ScriptedCrowd
from scripted_robot import ScriptedRobot

from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import Reason, RobotSession
from hil.bridge.bridge import Bridge
from hil.bridge.networks import Networks
from hil.jobs.overview import Overview
from hil.sumo.robots import Robots

if TYPE_CHECKING:
    from hil.sumo.junior import Junior


def obey(junior: Junior, key: str) -> str:
    if key == "a":
        junior.arm()
    elif key == "d":
        junior.disarm()
    elif key == "^":
        junior.drive(0.1, 0.1)
    return ""


@pytest.fixture
def crowd() -> ScriptedCrowd:
    return ScriptedCrowd.of([1, 2, 7])


@pytest.fixture
def overview(crowd: ScriptedCrowd) -> Overview:
    networks = Networks()
    networks.add("line", Bridge(MemoryLink(crowd), crowd, open_sessions=False, session=lambda: 5))
    robots = Robots(networks)
    robots.find(expect=3)
    robots.wait(1.0)
    return Overview(robots, obey)


def taken(crowd: ScriptedCrowd) -> set[int]:
    return {system for system, robot in crowd.robots.items() if any(isinstance(m, RobotSession) for m in robot.heard)}


def test_every_robot_has_a_line(overview: Overview, crowd: ScriptedCrowd) -> None:
    lines = overview.lines()
    assert [line.split()[:3] for line in lines] == [["robot", system, "disarmed"] for system in "127"]
    assert all("7.40 V" in line and "lost 0" in line and "answers in" in line for line in lines)
    assert taken(crowd) == set()


def test_keys_act_on_the_chosen_one_and_the_first_that_moves_it_takes_it(overview: Overview, crowd: ScriptedCrowd) -> None:
    crowd.robots[1].armed = True
    overview.press("n")
    assert overview.chosen.peer.system == 2
    overview.press("a")
    overview.press("^")
    assert taken(crowd) == {2}
    assert crowd.robots[2].armed
    assert crowd.robots[1].armed
    overview.press("n")
    overview.press("n")
    assert overview.chosen.peer.system == 1
    overview.press("p")
    assert overview.chosen.peer.system == 7
    assert overview.refusal == ""
    assert "ready (armed)" in overview.lines()[1]


def test_what_is_refused_is_shown(overview: Overview, crowd: ScriptedCrowd) -> None:
    crowd.robots[1].refuse[RobotSession] = Reason.BAD_VALUE
    overview.press("a")
    assert "refused" in overview.refusal
    console = Console(width=160)
    with console.capture() as shown:
        console.print(overview.view())
    assert "3 robots on line" in shown.get()
    assert overview.refusal in shown.get()


def test_the_emergency_stop_of_all_needs_no_session(overview: Overview, crowd: ScriptedCrowd) -> None:
    overview.press("E")
    assert overview.refusal == ""
    assert taken(crowd) == set()


def test_one_that_is_gone_is_said_to_be(overview: Overview, crowd: ScriptedCrowd) -> None:
    crowd.robots[2].silent = True
    overview.chosen.wait(4.0)
    assert "NOT HEARD" in overview.lines()[1]
    overview.press("n")
    overview.press("d")
    assert "silent" in overview.refusal or "did not answer" in overview.refusal


def test_the_chosen_one_stays_chosen_when_another_joins(overview: Overview, crowd: ScriptedCrowd) -> None:
    overview.press("n")
    assert overview.chosen.peer.system == 2
    crowd.robots = {0x10: ScriptedRobot(system=0x10), **crowd.robots}
    del crowd.robots[1]
    overview.chosen.wait(1.5)
    assert [junior.peer.system for junior in overview.members] == [1, 2, 7, 16]
    assert overview.chosen.peer.system == 2
    overview.press("p")
    assert overview.chosen.peer.system == 1


def test_a_robot_with_a_lower_id_that_joins_does_not_get_the_keys() -> None:
    crowd = ScriptedCrowd.of([2, 7])
    networks = Networks()
    networks.add("line", Bridge(MemoryLink(crowd), crowd, open_sessions=False, session=lambda: 5))
    robots = Robots(networks)
    robots.find(expect=2)
    shown = Overview(robots, obey)
    shown.press("a")
    crowd.robots[1] = ScriptedRobot(system=1)
    robots.wait(1.5)
    assert [junior.peer.system for junior in shown.members] == [1, 2, 7]
    shown.press("d")
    assert shown.chosen.peer.system == 2
    assert not crowd.robots[2].armed
    assert taken(crowd) == {2}


def test_a_key_for_a_robot_that_is_not_heard_is_refused_at_once_and_forgotten(overview: Overview, crowd: ScriptedCrowd) -> None:
    robot = crowd.robots[1]
    robot.silent = True
    overview.chosen.wait(4.0)
    began = crowd.now()
    overview.press("a")
    assert "silent" in overview.refusal
    assert crowd.now() - began < 0.1
    robot.silent = False
    robot.armed = True  # by somebody else
    overview.chosen.wait(3.0)
    assert overview.chosen.peer.ready
    assert taken(crowd) == set()
    assert robot.armed
