"""Several robots on one link: who gets a session, whose input was bad, and how often they hear us."""

from __future__ import annotations

from itertools import pairwise

import pytest
from fastcrc.crc16 import mcrf4xx
from quiet_tap import QuietTap
from scripted_crowd import ScriptedCrowd
from scripted_robot import ScriptedRobot, sensors

from firmware_protocol.errors import NoRobotError, VersionError
from firmware_protocol.events import PeerFound, PeerLost, Received, Rejected, RejectReason
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import Heartbeat, Ping, RobotAck, RobotAlive, RobotSession
from firmware_protocol.peer.timing import KEEP_ALIVE
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.mavlink_layout import crc_extra, offsets
from hil.bridge.bridge import Bridge
from hil.sumo.junior import Junior

ALL = range(1, 6)


def sessions(crowd: ScriptedCrowd) -> set[int]:
    """Who was asked to open a session."""
    return {
        system for system, robot in crowd.robots.items() if any(isinstance(message, RobotSession) for message in robot.heard)
    }


def handle(crowd: ScriptedCrowd, robots: list[int] | None = None) -> Junior:
    bridge = Bridge(MemoryLink(crowd), crowd, robots=robots, open_sessions=False, session=lambda: 77)
    return Junior(bridge)


def test_connecting_opens_a_session_with_the_robot_taken_and_with_no_other() -> None:
    crowd = ScriptedCrowd.of(ALL)
    with handle(crowd) as junior:
        junior.find()
        junior.wait(3.0)
        assert sessions(crowd) == {junior.peer.system}
        assert junior.bridge.strangers == set(ALL) - {junior.peer.system}
        junior.arm()
    assert not any(robot.armed for robot in crowd.robots.values())


def test_the_neighbours_stay_armed() -> None:
    crowd = ScriptedCrowd.of(ALL)
    for robot in crowd.robots.values():
        robot.armed = True
    with handle(crowd, [3]) as junior:
        junior.find(3)
        junior.wait(1.0)
    assert sessions(crowd) == {3}
    assert {system for system, robot in crowd.robots.items() if robot.armed} == set(ALL) - {3}


def test_nothing_but_the_heartbeat_is_said_to_strangers() -> None:
    crowd = ScriptedCrowd.of(ALL)
    with handle(crowd, [3]) as junior:
        junior.find(3)
        junior.wait(5.0)
    said = {type(message) for system, robot in crowd.robots.items() if system != 3 for message in robot.heard}
    assert said == {Heartbeat}


def test_an_armed_robot_that_is_only_watched_is_not_kept_alive() -> None:
    crowd = ScriptedCrowd.of([1])
    crowd.robots[1].armed = True
    bridge = Bridge(MemoryLink(crowd), crowd, open_sessions=False)
    while crowd.now() < 10.0:
        bridge.step(0.05)
    beats = [message for message in crowd.robots[1].heard if isinstance(message, Heartbeat)]
    assert 9 <= len(beats) <= 11


def test_a_robot_that_cannot_be_spoken_to_is_passed_over() -> None:
    crowd = ScriptedCrowd({1: ScriptedRobot(system=1, version=(9, 0)), 2: ScriptedRobot(system=2)})
    with handle(crowd) as junior:
        junior.find()
        assert junior.peer.system == 2
    for robots, timeout in (([1], 5.0), (None, 5.0)):
        only = ScriptedCrowd({1: ScriptedRobot(system=1, version=(9, 0))})
        with handle(only, robots) as junior, pytest.raises(VersionError):
            junior.find(timeout=timeout)
        assert only.now() < 2.5


def test_who_is_not_there_is_missed_and_who_is_gets_named() -> None:
    crowd = ScriptedCrowd.of(ALL)
    with handle(crowd, [9]) as junior, pytest.raises(NoRobotError, match=r"no robot with system id 9 .* 1, 2, 3, 4, 5"):
        junior.find(9, timeout=1.0)
    assert sessions(crowd) == set()


def test_a_watched_robot_can_be_taken_later_and_is_found_once() -> None:
    crowd = ScriptedCrowd.of(ALL)
    bridge = Bridge(MemoryLink(crowd), crowd, open_sessions=False, session=lambda: 77)
    events = [event for _ in range(40) for event in bridge.step(0.05)]
    assert {event.system for event in events if isinstance(event, PeerFound)} == set(ALL)
    bridge.peers[2].take(crowd.now())
    bridge.peers[2].take(crowd.now())
    events += [event for _ in range(40) for event in bridge.step(0.05)]
    assert sessions(crowd) == {2}
    assert bridge.peers[2].session == 77
    told = [event for event in events if not isinstance(event, Received | Rejected)]
    assert len(told) == len(ALL)


def test_one_taken_while_it_was_silent_gets_its_session_when_it_is_back() -> None:
    crowd = ScriptedCrowd.of([1])
    bridge = Bridge(MemoryLink(crowd), crowd, open_sessions=False, session=lambda: 77)
    while not (1 in bridge.peers and bridge.peers[1].ready and bridge.peers[1].status):
        bridge.step(0.05)
    watched, crowd.robots[1].silent = bridge.peers[1].unavailable, True
    while bridge.peers[1].unavailable is watched:
        bridge.step(0.05)
    bridge.peers[1].take(crowd.now())
    crowd.robots[1].silent = False
    while bridge.peers[1].session is None:
        bridge.step(0.05)
    assert bridge.peers[1].session == 77
    assert sessions(crowd) == {1}


def test_one_that_falls_silent_while_it_is_being_taken_is_told_lost_once() -> None:
    crowd = ScriptedCrowd.of([1])
    bridge = Bridge(MemoryLink(crowd), crowd, open_sessions=False, session=lambda: 77)
    while not (1 in bridge.peers and bridge.peers[1].ready):
        bridge.step(0.05)
    crowd.robots[1].silent = True
    bridge.peers[1].take(crowd.now())
    events = [event for _ in range(200) for event in bridge.step(0.05)]
    assert [type(event) for event in events] == [PeerLost]


def test_ten_armed_robots_are_kept_by_one_message_for_all() -> None:
    crowd = ScriptedCrowd.of(range(1, 11))
    bridge = Bridge(MemoryLink(crowd), crowd, session=lambda: 77)
    while len([peer for peer in bridge.peers.values() if peer.ready]) < 10:
        bridge.step(0.05)
    tickets = [peer.arm() for peer in bridge.peers.values()]
    while not all(ticket.done for ticket in tickets):
        bridge.step(0.05)
    heard: list[float] = []
    link, write = bridge.link, bridge.link.write
    codec = MavlinkCodec(system=1, component=1)

    def counting(data: bytes) -> None:
        events = codec.receive(data, crowd.now())
        heard.extend(e.time for e in events if isinstance(e, Received) and isinstance(e.message, RobotAlive))
        write(data)

    link.write = counting  # type: ignore[method-assign]
    before = {system: len(robot.heard) for system, robot in crowd.robots.items()}
    begin = crowd.now()
    while crowd.now() < 20.0:
        bridge.step(0.05)
    time = crowd.now() - begin
    gaps = [later - earlier for earlier, later in pairwise(heard)]
    assert max(gaps) <= KEEP_ALIVE + 0.005
    assert len(heard) <= time / KEEP_ALIVE + 1
    for system, robot in crowd.robots.items():
        said = robot.heard[before[system] :]
        alive = [message for message in said if isinstance(message, RobotAlive)]
        assert {message.host for message in alive} == {bridge.host}
        assert abs(len(alive) - len(heard)) <= 1
        assert sum(isinstance(message, Heartbeat) for message in said) <= time + 1
        assert len(said) - len(alive) <= 3.2 * time  # a heartbeat and the comparison of clocks, each second


def test_everybody_answers_a_ping_and_only_the_one_that_was_asked_counts() -> None:
    crowd = ScriptedCrowd.of([1, 2])
    bridge = Bridge(MemoryLink(crowd), crowd, session=lambda: 77)
    while len([peer for peer in bridge.peers.values() if peer.ready]) < 2:
        bridge.step(0.05)
    crowd.robots[2].mute = lambda message: isinstance(message, Ping)
    first, second = bridge.peers[1].ping(), bridge.peers[2].ping()
    end = crowd.now() + 0.5
    while crowd.now() < end:
        bridge.step(0.05)
    assert first.done
    assert not second.done


class Injecting(ScriptedCrowd):
    """A line on which something odd comes once, in a period of its own."""

    odd = b""

    def step(self, inbound: bytes) -> bytes:
        out = super().step(inbound)
        odd, self.odd = self.odd, b""
        return out + odd


def test_bad_input_counts_on_its_robot_where_that_is_certain_and_else_on_the_link() -> None:
    crowd = Injecting.of([1, 2])
    bridge = Bridge(MemoryLink(crowd), crowd, session=lambda: 77)
    while len([peer for peer in bridge.peers.values() if peer.ready]) < 2:
        bridge.step(0.05)
    frame = bytearray(MavlinkCodec(system=2, component=1).encode(sensors(1.0)))
    frame[-1] ^= 255
    assert isinstance(crowd, Injecting)
    crowd.odd = bytes(frame)  # its checksum is bad: the system id may be what was damaged
    end = crowd.now() + 0.2
    while crowd.now() < end:
        bridge.step(0.05)
    assert (bridge.peers[1].counters.rejected, bridge.peers[2].counters.rejected, bridge.unclaimed) == (0, 0, 1)
    bridge.keep([1])
    crowd.odd = bytes(frame)  # there is one peer left, and a stranger that it may have come from
    end = crowd.now() + 0.2
    while crowd.now() < end:
        bridge.step(0.05)
    assert (bridge.peers[1].counters.rejected, bridge.unclaimed) == (0, 2)


def test_a_can_frame_tells_its_sender_even_where_it_is_rejected() -> None:
    host, robot = CanCodec(system=255, component=190), CanCodec(system=5, component=1)
    frames = robot.encode_frames(sensors(1.0))
    (event,) = host.receive_frames(frames[1:2], 0.0)
    assert isinstance(event, Rejected)
    assert (event.reason, event.system) == (RejectReason.INCOMPLETE, 5)
    (event,) = host.receive(b"\xff" * 16, 0.0)
    assert isinstance(event, Rejected)
    assert event.system is None


class Listening(QuietTap):
    """Notes what was decoded, and what was rejected."""

    def __init__(self) -> None:
        self.heard: list[Received | Rejected] = []

    def received(self, event: Received | Rejected) -> None:
        self.heard.append(event)


def test_of_a_robot_that_is_not_spoken_with_only_what_was_bad_is_told() -> None:
    crowd, tap = ScriptedCrowd.of([1]), Listening()
    bridge = Bridge(MemoryLink(crowd), crowd, robots=[1], taps=[tap], session=lambda: 77)
    neighbour = MavlinkCodec(system=2, component=1)
    good = neighbour.encode(Heartbeat(10, 0, 0, 0, 3))
    bad = bytearray(neighbour.encode(RobotAck(RobotSession.ID, 1, 1, 255, 190, 1, 1)))
    bad[10 + offsets(RobotAck)["result"]] = 200
    bad[-2:] = mcrf4xx(bytes(bad[1:-2]) + bytes((crc_extra(RobotAck),))).to_bytes(2, "little")
    events: list[object] = []
    bridge._take_in([(0.0, good), (0.0, good), (0.0, bytes(bad))], 0.0, events)  # type: ignore[arg-type]
    met, rejected = tap.heard
    assert isinstance(met, Received)
    assert isinstance(rejected, Rejected)
    assert (rejected.reason, rejected.system) == (RejectReason.BAD_VALUE, 2)
    assert bridge.strangers == {2}
