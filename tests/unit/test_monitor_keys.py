"""Keys that pile up over a bad line do not drive a robot on after they were let go."""

from __future__ import annotations

import pytest
from scripted_robot import ScriptedRobot

from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import CommandLong
from hil.bridge.bridge import Bridge
from hil.jobs.monitor import obey, worth_obeying
from hil.jobs.session import Session
from hil.sumo.junior import Junior


@pytest.mark.parametrize(
    ("pressed", "obeyed"),
    [
        ("", ""),
        ("a", "a"),
        ("^^^^^^^^", "^"),
        ("a^^>>^", "a^>^"),
        ("^^^ ", " "),
        ("^^ ^", " ^"),
        ("^^e", "e"),
        ("e^", "e^"),
        ("eda", "eda"),
        ("^^q", "^q"),
        ("e ", "e"),
        ("E ", "E"),
        (" Ee ", "E"),
        ("e  ^^", "e^"),
        ("e da", "eda"),
        ("q ", " q"),
        ("^q e^", "eq"),
    ],
)
def test_what_is_worth_obeying(pressed: str, obeyed: str) -> None:
    assert worth_obeying(pressed) == obeyed


@pytest.mark.parametrize("key", ["a", "d", "e", "E"])
def test_a_robot_that_does_not_answer_a_key_does_not_end_the_view(key: str) -> None:
    robot = ScriptedRobot()
    with Junior(Bridge(MemoryLink(robot), robot)) as junior:
        junior.find()
        robot.deaf = lambda message: isinstance(message, CommandLong)
        assert "robot 1 did not answer" in obey(Session(junior, None), key)
