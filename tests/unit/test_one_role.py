"""Robots of several roles on one line, in `hil monitor`: those that are heard first are held, unless others are asked for."""

from __future__ import annotations

import pytest
from scripted_crowd import ScriptedCrowd

from firmware_protocol.errors import WrongRoleError
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import RobotSession
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.roles.swarm import MICRO_ROBOT
from hil.bridge.bridge import Bridge
from hil.bridge.networks import Networks
from hil.jobs.watched.one_role import OfOneRole
from hil.safety import Limits
from hil.sumo.junior import Junior
from hil.swarm.robot import MicroRobot

MICRO, NOBODYS = 2, 99
"""Products: of a micro-robot, and one that no role names."""


def found(products: dict[int, int], only: object = None) -> OfOneRole:
    """What is held of robots with these products, by system id."""
    crowd = ScriptedCrowd.of(products)
    for system, product in products.items():
        crowd.robots[system].product = product
    networks = Networks()
    networks.add("line", Bridge(MemoryLink(crowd), crowd, open_sessions=False, session=lambda: 5))
    robots = OfOneRole(networks, Limits(), only)  # type: ignore[arg-type]
    robots.find(settle=1.5, timeout=4.0)
    assert not any(isinstance(message, RobotSession) for robot in crowd.robots.values() for message in robot.heard)
    return robots


def test_juniors_are_juniors_and_micro_robots_micro_robots() -> None:
    assert {type(robot) for robot in found({1: 0, 2: 0})} == {Junior}
    micro = found({1: MICRO, 2: MICRO})
    assert {type(robot) for robot in micro} == {MicroRobot}
    assert micro.role is MICRO_ROBOT


def test_of_both_those_are_held_that_are_heard_first_and_the_others_are_named() -> None:
    robots = found({1: 0, 2: MICRO, 3: 0})
    held = {robot.peer.system for robot in robots}
    assert held == ({1, 3} if robots.role is JUNIOR else {2})
    assert {address.system for address in robots.refused} == {1, 2, 3} - held
    assert all("is needed here" in str(error) for error in robots.refused.values())


def test_those_that_are_asked_for_are_held_whoever_is_heard_first() -> None:
    assert {robot.peer.system for robot in found({1: 0, 2: MICRO, 3: 0}, MICRO_ROBOT)} == {2}


def test_a_robot_that_nobody_knows_is_not_held() -> None:
    assert {robot.peer.system for robot in found({1: NOBODYS, 2: 0})} == {2}
    with pytest.raises(WrongRoleError, match="robot 1 is a robot of product 99"):
        found({1: NOBODYS})
