"""What a bridge takes down as long as no robot can be used, and what is made of it."""

from __future__ import annotations

import pytest
from scripted_robot import ScriptedRobot

from firmware_protocol.errors import NoRobotError, VersionError
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.wire.fields import MAVLINK
from hil.bridge.bridge import Bridge
from hil.connecting.diagnosis import Kind, judge, lost, seen_by
from hil.sumo.junior import Junior


class Line:
    """A robot, and what becomes of its line.

    Attributes:
        robot: The robot.
        noise: Comes instead of what it says.
        echo: What is sent comes back, and nothing else.
    """

    wire = MAVLINK

    def __init__(self, robot: ScriptedRobot) -> None:
        self.robot = robot
        self.noise = b""
        self.echo = False

    def now(self) -> float:
        """Time in s."""
        return self.robot.now()

    def step(self, inbound: bytes) -> bytes:
        """One control period."""
        out = self.robot.step(b"" if self.echo else inbound)
        return inbound if self.echo else self.noise or out


def connected(line: Line) -> Junior:
    """A handle of the robot on this line, not yet found."""
    return Junior(Bridge(MemoryLink(line), line, open_sessions=False))


def test_nothing_is_taken_down_while_a_robot_can_be_used() -> None:
    line = Line(ScriptedRobot())
    with connected(line) as junior:
        junior.find()
        witness = junior.bridge.witness
        assert witness.vehicles == witness.robots == {1}
        before = witness.received
        junior.wait(1.0)
        assert junior.bridge.witness is witness
        assert witness.received == before


def test_what_comes_after_a_loss_is_judged_for_itself() -> None:
    line = Line(ScriptedRobot())
    with connected(line) as junior:
        junior.find()
        line.robot.silent = True
        junior.wait(4.0)
        assert not junior.peer.ready
        assert lost(seen_by(junior.bridge), "it is gone").endswith("is its battery charged?")
        line.noise = b"\x81" * 20
        junior.wait(1.0)
        assert judge(seen_by(junior.bridge)).kind is Kind.NOISE
        assert "; since then: bytes come (" in lost(seen_by(junior.bridge), "it is gone")


def test_a_robot_that_comes_back_ends_it() -> None:
    line = Line(ScriptedRobot())
    with connected(line) as junior:
        junior.find()
        line.robot.silent = True
        junior.wait(4.0)
        line.robot.silent = False
        junior.wait(2.0)
        assert junior.peer.ready
        before = junior.bridge.witness.received
        junior.wait(1.0)
        assert junior.bridge.witness.received == before


def test_our_own_words_are_known_again() -> None:
    line = Line(ScriptedRobot())
    line.echo = True
    with connected(line) as junior, pytest.raises(NoRobotError, match="it sends back what is sent to it"):
        junior.find(timeout=2.5)


def test_a_robot_that_was_asked_for_by_the_bridge_alone_is_named() -> None:
    line = Line(ScriptedRobot(system=2))
    bridge = Bridge(MemoryLink(line), line, robots=[3])
    with Junior(bridge) as junior, pytest.raises(NoRobotError, match="others are there: 2"):
        junior.find(timeout=2.0)


@pytest.mark.parametrize(("version", "words"), [((0, 0), r"is no Junior.*docs/protocol\.md"), ((9, 0), r"protocol 9\.0")])
def test_who_cannot_be_spoken_with_is_told_with_the_address(version: tuple[int, int], words: str) -> None:
    line = Line(ScriptedRobot(version=version))
    with connected(line) as junior, pytest.raises(VersionError, match=rf"^{junior.bridge.link.url}: .*{words}"):
        junior.find(timeout=3.0)
