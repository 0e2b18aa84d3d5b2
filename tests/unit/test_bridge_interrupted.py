"""The bridge when its program was stopped for a while, and when the other end says why it ends the link."""

from __future__ import annotations

import itertools

import pytest
from scripted_robot import ScriptedRobot

from firmware_protocol.errors import LinkClosedError, PeerLostError
from firmware_protocol.events import PeerBack, PeerLost
from firmware_protocol.links import FaultSpec, FaultyLink, MemoryLink
from firmware_protocol.messages import JuniorManeuver, RobotSession, Statustext
from firmware_protocol.roles.junior import perform
from firmware_protocol.vocabulary import Action, Maneuver
from firmware_protocol.wire.mavlink import split_frames
from hil.bridge.bridge import Bridge

QUICK = Maneuver((Action.F, Action.R), period=0.05, floor_reflex=False)


def until_the_end(bridge: Bridge) -> None:
    while True:
        bridge.step(0.1)


def test_beginning_anew_ends_what_was_open_and_leaves_a_robot_disarmed_in_a_new_session() -> None:
    robot = ScriptedRobot()
    sessions = itertools.count(6)  # the first is the host's own number
    with Bridge(MemoryLink(robot), robot, session=sessions.__next__) as bridge:
        while not (bridge.peers and bridge.peers[1].ready):
            bridge.step(0.1)
        peer = bridge.peers[1]
        ticket = peer.arm()
        while not ticket.done:
            bridge.step(0.1)
        under_way = perform(peer, QUICK)
        bridge.begin_anew("this program was stopped")
        assert not bool(under_way.done)  # it acts with the next step
        heard = len(robot.heard)
        events = bridge.step(0.0)
        assert under_way.done
        with pytest.raises(PeerLostError, match=r"this program was stopped"):
            under_way.value()
        assert not any(isinstance(message, JuniorManeuver) for message in robot.heard[heard:])
        assert any(isinstance(event, PeerLost) for event in events)
        while not peer.ready:
            events += bridge.step(0.1)
        assert sum(isinstance(event, PeerBack) for event in events) == 1
        assert peer.session == 8
        assert not robot.armed
        again = peer.arm()
        while not again.done:
            bridge.step(0.1)
        assert robot.armed


def test_beginning_anew_leaves_robots_alone_that_are_only_watched() -> None:
    robot = ScriptedRobot()
    with Bridge(MemoryLink(robot), robot, open_sessions=False) as bridge:
        while not (bridge.peers and bridge.peers[1].ready):
            bridge.step(0.1)
        bridge.begin_anew("this program was stopped")
        assert bridge.peers[1].ready
        bridge.step(0.1)
        assert not any(isinstance(message, RobotSession) for message in robot.heard)


def test_what_was_told_just_before_a_link_ended_is_why() -> None:
    robot = ScriptedRobot()
    link = FaultyLink(MemoryLink(robot), FaultSpec.parse("unplug:1.0"), seed=1, clock=robot, split=split_frames)
    with Bridge(link, robot) as bridge:
        while robot.now() < 0.9:
            bridge.step(0.1)
        robot._say(Statustext(3, "another client holds the robot"))
        with pytest.raises(LinkClosedError, match="unplugged; it said: another client holds the robot"):
            until_the_end(bridge)
        assert bridge.farewell == "another client holds the robot"


@pytest.mark.parametrize(("severity", "at"), [(4, 0.9), (3, 0.1)])
def test_a_warning_or_what_was_told_long_before_is_not_why(severity: int, at: float) -> None:
    robot = ScriptedRobot()
    link = FaultyLink(MemoryLink(robot), FaultSpec.parse("unplug:2.0"), seed=1, clock=robot, split=split_frames)
    with Bridge(link, robot) as bridge:
        while robot.now() < at:
            bridge.step(0.05)
        robot._say(Statustext(severity, "hot"))
        with pytest.raises(LinkClosedError) as caught:
            until_the_end(bridge)
        assert "hot" not in str(caught.value)
        assert bridge.farewell == ""
