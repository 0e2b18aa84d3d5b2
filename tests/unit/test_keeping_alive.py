"""An armed robot hears ROBOT_ALIVE as often as the protocol's page says, whatever our own constant is."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest
from scripted_robot import PERIOD, ScriptedRobot

from firmware_protocol.events import Received
from firmware_protocol.generate.outputs import ROOT
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import RobotAlive
from firmware_protocol.wire.mavlink import MavlinkCodec
from hil.bridge.bridge import Bridge
from hil.conformance.probe import Probe
from hil.sumo.junior import Junior

if TYPE_CHECKING:
    from collections.abc import Callable

EVERY = 0.040
"""The protocol's longest time between two ROBOT_ALIVE, in s."""


class Listening(ScriptedRobot):
    """A robot that notes when it is told that its host is there."""

    def __init__(self) -> None:
        super().__init__()
        self.alive: list[float] = []
        self._ears = MavlinkCodec(system=1, component=1)

    def step(self, inbound: bytes) -> bytes:
        out = super().step(inbound)
        events = self._ears.receive(inbound, self.now())
        self.alive += [e.time for e in events if isinstance(e, Received) and isinstance(e.message, RobotAlive)]
        return out


def test_the_page_says_so() -> None:
    page = (ROOT / "docs" / "protocol.md").read_text(encoding="utf-8")
    assert set(re.findall(r"(?:ROBOT_ALIVE|of a network,) every (\d+) ms", page)) == {f"{EVERY * 1000:.0f}"}


def by_bridge(robot: Listening) -> Callable[[float], None]:
    junior = Junior(Bridge(MemoryLink(robot), robot, session=lambda: 77))
    junior.find()
    junior.arm()
    return junior.wait


def by_probe(robot: Listening) -> Callable[[float], None]:
    probe = Probe(MemoryLink(robot), robot, host=77)
    probe.spend(0.1)
    return probe.spend


@pytest.mark.parametrize("begin", [by_bridge, by_probe])
def test_an_armed_robot_hears_it_no_later(begin: Callable[[Listening], Callable[[float], None]]) -> None:
    robot = Listening()
    spend = begin(robot)
    start = robot.now()
    spend(3.0)
    times = [time for time in robot.alive if time > start]
    gaps = [later - earlier for earlier, later in pairwise([start, *times, robot.now()])]
    assert max(gaps) <= EVERY + PERIOD + 1e-9, "a host may be late by a control period"
    assert len(times) <= 3.0 / (EVERY - PERIOD) + 1, "nor does it flood the line"
