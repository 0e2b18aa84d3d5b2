"""A reading that is old does not look fresh: its age is at hand, and nobody acts on a stale one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from scripted_robot import ScriptedRobot

from firmware_protocol.errors import PeerError
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import CommandLong
from hil.bridge.bridge import Bridge
from hil.sumo.junior import Junior

if TYPE_CHECKING:
    from firmware_protocol.events import Event


def handle(robot: ScriptedRobot) -> Junior:
    junior = Junior(Bridge(MemoryLink(robot), robot, session=lambda: 77))
    junior.find()
    return junior


def test_a_reading_ages_from_when_it_came() -> None:
    robot = ScriptedRobot()
    junior = handle(robot)
    junior.wait(1.0)
    assert junior.age <= 0.02 + 1e-9
    robot.stream = False
    junior.wait(0.2)
    assert junior.age == pytest.approx(0.2, abs=0.021)
    assert not bool(junior.stale)
    junior.wait(0.1)
    assert bool(junior.stale)


def test_a_stale_reading_is_not_handed_out_but_a_fresh_one_is_asked_for() -> None:
    robot = ScriptedRobot()
    junior = handle(robot)
    junior.wait(1.0)
    robot.stream = False
    junior.wait(5.0)
    old = junior.latest
    assert old is not None
    assert junior.age > 4.5
    assert junior.sensors.time == pytest.approx(robot.now(), abs=0.02)
    assert old.time < robot.now() - 4.5
    assert junior.age < 0.02


def test_where_none_can_be_had_it_is_an_error_and_no_old_reading() -> None:
    robot = ScriptedRobot()
    junior = handle(robot)
    junior.wait(1.0)
    robot.stream = False
    robot.deaf = lambda message: isinstance(message, CommandLong)
    junior.wait(1.0)
    with pytest.raises(PeerError, match="JUNIOR_SENSORS"):
        _ = junior.stimulus


def test_before_the_first_reading_it_is_infinitely_old() -> None:
    robot = ScriptedRobot(stream=False)
    junior = handle(robot)
    assert junior.latest is None
    assert junior.age == float("inf")
    assert junior.stale


def test_who_is_told_of_a_step_does_not_begin_another_by_looking(monkeypatch: pytest.MonkeyPatch) -> None:
    junior = handle(ScriptedRobot())
    junior.wait(0.1)
    asked, step = list[float](), junior.bridge.step

    def counted(wait: float) -> list[Event]:
        asked.append(wait)
        return step(wait)

    monkeypatch.setattr(junior.bridge, "step", counted)
    seen = []
    junior.listen(lambda _: seen.append(junior.sensors.time))
    while not seen:
        junior.step(0.02)
    assert 0.0 not in asked
    assert junior.sensors.time == seen[-1]
    assert asked[-1] == 0.0
