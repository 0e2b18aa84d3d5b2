"""The worked second implementation of the protocol: `hil check` finds nothing wrong with it, and a host can use it."""

from __future__ import annotations

import os
import sys
from itertools import count
from pathlib import Path

import pytest
from own_robot.__main__ import DIALECT
from own_robot.hardware import Hardware, Store
from own_robot.robot import Robot
from own_robot.tables import PARAMETERS, TICK
from own_robot.wire import load_dialect
from processes import Program

from firmware_protocol import parameters
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.wire.fields import MAVLINK
from hil.bridge.bridge import Bridge
from hil.cli.app import run
from hil.conformance import CHECKS, LAST, CheckOutcome, Subject, for_role, on_wire, perform
from hil.sumo.junior import Junior

EXAMPLES = Path(__file__).parents[2] / "examples"
NEEDS_PTY = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
MESSAGES = load_dialect(DIALECT)


class World:
    """Steps the robot, and nothing else."""

    def __init__(self, store: Store | None = None) -> None:
        self.robot = Robot(MESSAGES, Hardware(), store or Store())
        self.periods = 0

    def now(self) -> float:
        return self.periods * TICK

    def step(self, inbound: bytes) -> bytes:
        self.periods += 1
        return self.robot.tick(self.now(), inbound)


def test_it_keeps_the_protocol() -> None:
    world = World()
    numbers = count(4711)
    subject = Subject(MemoryLink(world), world, session=lambda: next(numbers))
    subject.greet()
    checks = [check for check in for_role(on_wire(CHECKS, MAVLINK), subject.role) if not check.keyed]
    verdicts = perform(subject, checks, LAST, moving=True)
    assert [(verdict.check.name, verdict.detail) for verdict in verdicts if verdict.outcome is not CheckOutcome.PASSED] == []
    assert len(verdicts) == len(checks) + 1


def test_its_parameters_are_the_protocol_s() -> None:
    ours = {one.name: (one.default, one.minimum, one.maximum, one.whole) for one in parameters.JUNIOR_PARAMETERS}
    assert ours == PARAMETERS


def test_a_host_has_a_maneuver_performed_and_finds_memory_and_parameters_after_power_off(tmp_path: Path) -> None:
    path = tmp_path / "store.json"
    world = World(Store(path))
    with Junior(Bridge(MemoryLink(world), world)) as junior:
        junior.find()
        junior.arm()
        report = junior.perform("FF S LBRF", period=0.1)
        assert [tally.samples for tally in report.tallies] == [20, 20, 20]
        assert junior.sensors.travel[0] < junior.sensors.travel[1] == pytest.approx(0.054, abs=0.003)
        junior.set_parameter("SPD_FAST", 0.5)
    again = World(Store(path))
    with Junior(Bridge(MemoryLink(again), again)) as junior:
        junior.find()
        assert junior.parameter("SPD_FAST") == 0.5
        assert junior.status().boot_count == 2


@pytest.mark.slow
@NEEDS_PTY
def test_it_is_checked_on_a_pty(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Program(EXAMPLES, sys.executable, "-m", "own_robot", "--store", str(tmp_path / "store.json")) as robot:
        url = robot.until("robot at").split()[-1]
        names = ("frame-in-pieces", "parameters-listed", "watchdog-stops", "maneuver-completes", "memory-written-and-read")
        assert run(["check", url, *(word for name in names for word in ("--only", name))]) == 0, capsys.readouterr().out
    assert "6 passed" in capsys.readouterr().out
