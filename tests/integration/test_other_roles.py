"""A robot that is no Junior: every verb says which role it needs, and what any robot can do is done with it."""

from __future__ import annotations

import json
from functools import partial
from typing import TYPE_CHECKING

import pytest
from scripted_crowd import ScriptedCrowd
from scripted_robot import ScriptedRobot
from serving import in_thread

from firmware_protocol.errors import WrongRoleError
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import CommandLong, RobotSession
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from hil.bridge.bridge import Bridge
from hil.bridge.networks import Networks
from hil.cli.app import run
from hil.connecting.connecting import connect_as
from hil.connecting.connecting_all import connect_all_as
from hil.connecting.handle import RobotHandle
from hil.sumo.advice_file import save_advice
from hil.sumo.junior import Junior
from hil.sumo.robots import Robots
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings
from simdevice.serving.endpoints import TcpEndpoint

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

OTHER = 2
"""The product of a micro-robot."""
NOBODYS = 99
"""One that no role names."""
WAIT = 2.5
"""How long every command waits for a robot here, in s."""
NEEDS = {
    "monitor": ["monitor", "{url}", "--no-log"],
    "bout": ["bout", "{url}", "--no-log", "--controller", "random"],
    "coach": ["coach", "{url}", "--no-log", "--budget", "2"],
    "deploy": ["deploy", "advice.toml", "{url}", "--no-log"],
    "check": ["check", "{url}", "--no-log", f"--timeout={WAIT}"],
}


@pytest.fixture
def other(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[str, ScriptedRobot]]:
    """A robot of another role at a TCP port, in a folder with an advice; no command waits for long."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")
    entry = AdviceEntry(ANY_STIMULUS, 0, (Action.FF,), 1.0, 10)
    save_advice(Advice(PalSettings(), (entry,), "flat-light"), tmp_path / "advice.toml")
    for where in ("hil.jobs.session", "hil.cli.keygen"):
        monkeypatch.setattr(f"{where}.connect_as", partial(connect_as, timeout=WAIT))
    monkeypatch.setattr("hil.jobs.session.connect_all_as", partial(connect_all_as, timeout=WAIT))
    robot, endpoint = ScriptedRobot(product=getattr(request, "param", OTHER), stream=False), TcpEndpoint("127.0.0.1", 0)
    with in_thread(robot, endpoint):
        yield endpoint.url, robot


@pytest.mark.slow
@pytest.mark.parametrize(
    ("other", "who"),
    [(OTHER, "micro-robot"), (NOBODYS, "robot of product 99, which this program does not know")],
    indirect=["other"],
    ids=["another", "unknown"],
)
@pytest.mark.parametrize("verb", NEEDS)
def test_a_verb_says_which_role_it_needs(
    verb: str, who: str, other: tuple[str, ScriptedRobot], capsys: pytest.CaptureFixture[str]
) -> None:
    url, robot = other
    if verb in {"check", "monitor"} and robot.product == OTHER:
        pytest.skip("this is for a micro-robot, too")
    assert run([word.format(url=url) for word in NEEDS[verb]]) == 3
    said = capsys.readouterr().err
    assert f"hil: {url}: robot 1 is a {who}" in said
    assert "Junior" in said
    assert "Traceback" not in said
    assert not any(isinstance(message, RobotSession) for message in robot.heard)


@pytest.mark.slow
def test_what_any_robot_has_can_be_asked_of_it(other: tuple[str, ScriptedRobot], capsys: pytest.CaptureFixture[str]) -> None:
    url, robot = other
    assert run(["param", url, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == robot.parameters


def on(crowd: ScriptedCrowd) -> Bridge:
    """A bridge to several robots."""
    return Bridge(MemoryLink(crowd), crowd, open_sessions=False, session=lambda: 77)


def mixed() -> ScriptedCrowd:
    """Two robots of another role, and a Junior."""
    crowd = ScriptedCrowd.of((1, 2, 3))
    for system in (1, 3):
        crowd.robots[system].product = OTHER
        crowd.robots[system].armed = True
    return crowd


def test_connecting_takes_the_junior_and_leaves_the_others_alone() -> None:
    crowd = mixed()
    with Junior(on(crowd)) as junior:
        junior.find()
        assert junior.peer.system == 2
        junior.wait(1.0)
    for system in (1, 3):
        assert crowd.robots[system].armed
        assert not any(isinstance(message, RobotSession) for message in crowd.robots[system].heard)


def test_one_that_is_named_and_has_another_role_is_refused_at_once() -> None:
    crowd = mixed()
    with Junior(on(crowd)) as junior:
        with pytest.raises(WrongRoleError, match=r"robot 3 is a micro-robot.*a Junior is needed"):
            junior.find(3)
        assert crowd.now() < 1.5


def test_a_general_handle_takes_any_role() -> None:
    crowd = mixed()
    with RobotHandle(on(crowd)) as robot:
        robot.find(3)
        robot.arm()
        assert crowd.robots[3].armed
        assert robot.parameter("SPD_FAST") == 1.0
        assert robot.description.startswith("micro-robot 3 on ")
    assert any(isinstance(message, CommandLong) and message.param1 == 0 for message in crowd.robots[3].heard)
    assert not crowd.robots[3].armed


def test_of_several_only_the_juniors_are_members() -> None:
    crowd = mixed()
    networks = Networks()
    networks.add("a", on(crowd))
    with Robots(networks) as robots:
        robots.find(settle=0.5)
        assert [address.system for address in robots.addresses] == [2]
        assert {address.system for address, why in robots.refused.items() if isinstance(why, WrongRoleError)} == {1, 3}


def test_where_there_is_no_junior_that_is_said() -> None:
    crowd = mixed()
    del crowd.robots[2]
    networks = Networks()
    networks.add("a", on(crowd))
    with Robots(networks) as robots, pytest.raises(WrongRoleError, match="a Junior is needed"):
        robots.find(settle=0.5, timeout=3.0)
