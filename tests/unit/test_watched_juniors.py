"""Several Juniors in `hil monitor`: what is shown, and whom a key acts on."""

from __future__ import annotations

import pytest
from scripted_crowd import ScriptedCrowd
from scripted_robot import ScriptedRobot

from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import CommandLong, JuniorWheels, Reason, RobotSession
from hil.bridge.bridge import Bridge
from hil.bridge.networks import Networks
from hil.cockpit.snapshot import Tone
from hil.jobs.watched.juniors import JuniorsWatch
from hil.sumo.robots import Robots

PATIENCE = 5.0
"""Everything is answered, or given up, within this time, in s."""


class Watched:
    """Scripted Juniors on one line, and a watch of them.

    Args:
        *systems: Their system ids.

    Attributes:
        crowd: The robots.
        robots: The same as they are held.
        watch: The watch.
        told: What it has said.
    """

    def __init__(self, *systems: int) -> None:
        self.crowd = ScriptedCrowd.of(systems)
        networks = Networks()
        networks.add("line", Bridge(MemoryLink(self.crowd), self.crowd, open_sessions=False, session=lambda: 5))
        self.robots = Robots(networks)
        self.robots.find(expect=len(systems))
        self.robots.wait(1.0)
        self.told: list[str] = []
        self.watch = JuniorsWatch(self.robots, tell=self.told.append)

    def press(self, keys: str) -> None:
        """Press keys, each when what the one before asked for has been answered."""
        for key in keys:
            self.watch.press(key)
            end = self.crowd.now() + PATIENCE
            while self.watch.busy and self.crowd.now() < end:
                self.live(0.0)

    def live(self, duration: float) -> None:
        """Serve the link for a while, and see to what was asked for; for one step at least."""
        end = self.crowd.now() + duration
        while True:
            self.robots.step()
            self.watch.step()
            if self.crowd.now() >= end:
                return

    @property
    def taken(self) -> set[int]:
        """The robots that a session was opened with."""
        return {s for s, robot in self.crowd.robots.items() if any(isinstance(m, RobotSession) for m in robot.heard)}

    def wheels(self, system: int) -> list[tuple[float, ...]]:
        """How one was told to turn its wheels."""
        return [message.speed for message in self.crowd.robots[system].heard if isinstance(message, JuniorWheels)]


@pytest.fixture
def three() -> Watched:
    return Watched(1, 2, 7)


def test_every_robot_has_a_line(three: Watched) -> None:
    lines = three.watch.lines()
    assert [line.split()[:3] for line in lines] == [["robot", system, "disarmed"] for system in "127"]
    assert all("7.40 V" in line and "lost 0" in line and "answers in" in line for line in lines)
    assert three.taken == set()


def test_a_picture_has_all_and_the_chosen_one_in_full(three: Watched) -> None:
    three.press("n")
    picture = three.watch.picture()
    assert picture.title == "3 Juniors on line"
    assert [row.cells[0] for row in picture.rows] == ["1", "2", "7"]
    assert (picture.chosen, picture.state) == (1, "robot 2: disarmed, only watched")
    assert {fact.name: fact.value for fact in picture.facts}["battery"] == "7.40 V"
    assert ("n p", "choose") in picture.keys


def test_keys_act_on_the_chosen_one_and_the_first_that_moves_it_takes_it(three: Watched) -> None:
    three.crowd.robots[1].armed = True
    three.press("na^")
    assert three.watch.chosen.peer.system == 2
    assert three.taken == {2}
    assert three.crowd.robots[2].armed
    assert three.crowd.robots[1].armed
    assert len(three.wheels(2)) == 1
    three.press("nn")
    assert three.watch.chosen.peer.system == 1
    three.press("p")
    assert three.watch.chosen.peer.system == 7
    assert three.told == ["robot 2 is armed"]
    assert "ready (armed)" in three.watch.lines()[1]
    assert three.watch.picture().rows[1].tone is Tone.WARNING


def test_keys_say_for_which_robot_they_are(three: Watched) -> None:
    assert three.watch.aim("anaEnp") == ["1", "2", "2", "", "7", "2"]


def test_what_is_refused_is_said(three: Watched) -> None:
    three.crowd.robots[1].refuse[RobotSession] = Reason.BAD_VALUE
    three.press("a")
    assert len(three.told) == 1
    assert "refused" in three.told[0]


def test_the_emergency_stop_of_all_needs_no_session(three: Watched) -> None:
    three.press("E")
    assert three.told == [f"robot {system} has stopped, and says so: emergency stop" for system in (1, 2, 7)]
    assert three.taken == set()
    stops = [m for robot in three.crowd.robots.values() for m in robot.heard if isinstance(m, CommandLong) and m.command == 185]
    assert len(stops) >= 6


def test_one_that_is_gone_is_said_to_be(three: Watched) -> None:
    three.crowd.robots[2].silent = True
    three.live(4.0)
    assert "NOT HEARD" in three.watch.lines()[1]
    three.press("n")
    assert (three.watch.picture().state, three.watch.picture().tone) == ("robot 2: NOT HEARD", Tone.ALARM)
    three.press("d")
    assert "silent" in three.told[-1] or "did not answer" in three.told[-1]


def test_the_chosen_one_stays_chosen_when_another_joins(three: Watched) -> None:
    three.press("n")
    three.crowd.robots = {0x10: ScriptedRobot(system=0x10), **three.crowd.robots}
    del three.crowd.robots[1]
    three.live(1.5)
    assert [junior.peer.system for junior in three.watch.members] == [1, 2, 7, 16]
    assert three.watch.chosen.peer.system == 2
    three.press("p")
    assert three.watch.chosen.peer.system == 1


def test_a_robot_with_a_lower_id_that_joins_does_not_get_the_keys() -> None:
    two = Watched(2, 7)
    two.press("a")
    two.crowd.robots[1] = ScriptedRobot(system=1)
    two.live(1.5)
    assert [junior.peer.system for junior in two.watch.members] == [1, 2, 7]
    two.press("d")
    assert two.watch.chosen.peer.system == 2
    assert not two.crowd.robots[2].armed
    assert two.taken == {2}


def test_a_key_for_a_robot_that_is_not_heard_is_refused_at_once_and_forgotten(three: Watched) -> None:
    robot = three.crowd.robots[1]
    robot.silent = True
    three.live(4.0)
    began = three.crowd.now()
    three.press("a")
    assert "silent" in three.told[0]
    assert three.crowd.now() - began < 0.1
    robot.silent = False
    robot.armed = True  # by somebody else
    three.live(3.0)
    assert three.watch.chosen.peer.ready
    assert three.taken == set()
    assert robot.armed


def test_space_stops_all_that_are_ours_and_nobody_elses(three: Watched) -> None:
    three.press("ana")
    assert three.taken == {1, 2}
    three.press(" ")
    assert three.wheels(1)[-1:] == three.wheels(2)[-1:] == [(0.0, 0.0)]
    assert three.wheels(7) == []


@pytest.mark.parametrize("key", ["a", "d", "e", "E", "b", "^"])
def test_a_robot_that_does_not_answer_a_key_does_not_end_the_view(key: str) -> None:
    one = Watched(1)
    one.press("a")
    one.crowd.robots[1].deaf = lambda message: isinstance(message, CommandLong | JuniorWheels)
    one.press(key)
    assert key in "b^" or "robot 1 did not answer" in one.told[-1]


@pytest.mark.parametrize(("stop", "told"), [("e", 185), ("d", 400), (" ", None)])
def test_a_stop_waits_for_nothing_that_was_asked_for_before(stop: str, told: int | None) -> None:
    one = Watched(1)
    robot = one.crowd.robots[1]
    one.press("a")
    robot.deaf = lambda message: isinstance(message, CommandLong) and message.command == 400 and message.param1 == 1.0
    one.watch.press("a")
    one.live(0.5)
    assert one.watch.busy
    before = len(robot.heard)
    one.watch.press(stop)
    one.live(0.05)
    after = robot.heard[before:]
    if told is None:
        assert [message.speed for message in after if isinstance(message, JuniorWheels)] == [(0.0, 0.0)]
    else:
        assert told in {message.command for message in after if isinstance(message, CommandLong)}


def test_where_another_program_drives_keys_stop_and_do_nothing_else(three: Watched) -> None:
    for bridge in three.robots.networks.bridges.values():
        bridge.acquaintances.shared = "watching, coach drives"
    three.press("a^ nb")
    assert three.taken == set()
    assert three.wheels(1) == three.wheels(2) == []
    assert "robot 1 is another program's (watching, coach drives)" in three.told
    picture = three.watch.picture()
    assert picture.state == "robot 2: disarmed, watching, coach drives"
    assert {word for _, word in picture.keys} == {"choose", "emergency stop", "emergency stop of all"}
    three.press("e")
    assert three.told[-1] == "robot 2 has stopped, and says so: emergency stop"
    assert three.watch.picture().state == "robot 2: EMERGENCY STOP, watching, coach drives"
