"""The bridge: one step does everything, whatever the link."""

from __future__ import annotations

import itertools
import os
import select
import threading
from typing import TYPE_CHECKING, TypeVar

import pytest
from quiet_tap import QuietTap
from scripted_robot import ScriptedRobot

from firmware_protocol.clock import ManualClock
from firmware_protocol.errors import EncodeError, LinkClosedError, LinkTimeoutError, VersionError
from firmware_protocol.events import Event, PeerBack, PeerFound, PeerLost, Received, Rejected
from firmware_protocol.links import FaultSpec, FaultyLink, MemoryLink
from firmware_protocol.links.opening import open_link
from firmware_protocol.messages import (
    CommandAck,
    CommandLong,
    Heartbeat,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorSensors,
    JuniorWheels,
    ParamRequestList,
    ParamValue,
    Ping,
    RefereeReset,
    RefereeState,
    RobotAck,
    RobotResultAck,
    RobotSession,
    RobotStatus,
)
from firmware_protocol.peer.connection import PeerState
from firmware_protocol.peer.timing import KEEP_ALIVE
from firmware_protocol.roles.junior import drive, perform
from firmware_protocol.roles.referee import reset_bout
from firmware_protocol.vocabulary import Action, Maneuver
from firmware_protocol.wire.mavlink import MavlinkCodec, split_frames
from hil.bridge.bridge import Bridge
from hil.bridge.clock import MonotonicClock
from hil.bridge.sessions import random_session

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.link import Link
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.wire.fields import Message
    from hil.bridge.taps import Circumstances

T = TypeVar("T")
QUICK = Maneuver((Action.F, Action.R), period=0.05, floor_reflex=False)


class Log(QuietTap):
    """A tap that writes everything down."""

    def __init__(self) -> None:
        self.steps: list[tuple[float, int]] = []
        self.rx: list[tuple[float, bytes]] = []
        self.tx: list[tuple[float, bytes]] = []
        self.decoded: list[Received | Rejected] = []
        self.said: list[Message] = []
        self.events: list[Event] = []

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        del met
        self.steps.append((time, len(chunks)))

    def wire_rx(self, time: float, data: bytes) -> None:
        self.rx.append((time, data))

    def wire_tx(self, time: float, data: bytes) -> None:
        self.tx.append((time, data))

    def received(self, event: Received | Rejected) -> None:
        self.decoded.append(event)

    def sent(self, time: float, message: Message) -> None:
        assert time >= 0
        self.said.append(message)

    def event(self, event: Event) -> None:
        self.events.append(event)


class Rig:
    """A bridge in lock-step with a scripted robot."""

    def __init__(self, robot: ScriptedRobot | None = None, faults: str = "", **options: object) -> None:
        self.robot = robot or ScriptedRobot()
        self.log = Log()
        self.link: Link = MemoryLink(self.robot)
        if faults:
            spec = FaultSpec.parse(faults)
            self.link = FaultyLink(self.link, spec, seed=5, clock=self.robot, split=split_frames)
        self.bridge = Bridge(self.link, self.robot, taps=[self.log], session=lambda: 77, **options)  # type: ignore[arg-type]
        self.events: list[Event] = []

    def until(self, done: Callable[[], bool], patience: float = 20.0) -> None:
        """Step until something is so."""
        end = self.robot.now() + patience
        while not done() and self.robot.now() < end:
            self.events += self.bridge.step(0.1)
        assert done()

    def run(self, time: float) -> None:
        """Step for so long."""
        end = self.robot.now() + time - 1e-9
        while self.robot.now() < end:
            self.events += self.bridge.step(end - self.robot.now())

    def connect(self) -> Rig:
        self.until(lambda: 1 in self.bridge.peers and self.bridge.peers[1].ready)
        return self

    def ask(self, ticket: Ticket[T]) -> T:
        self.until(lambda: ticket.done)
        return ticket.value()


def once(kind: type[Message]) -> Callable[[Message], bool]:
    """True for the first message of a kind, and for no other."""
    seen: list[Message] = []

    def first(message: Message) -> bool:
        if not isinstance(message, kind) or seen:
            return False
        seen.append(message)
        return True

    return first


def test_the_handshake_takes_three_control_periods() -> None:
    rig = Rig().connect()
    assert rig.robot.now() == pytest.approx(0.015)
    assert [event for event in rig.events if isinstance(event, PeerFound)] == [PeerFound(1, 0.015)]
    assert rig.bridge.peers[1].session == 77


def test_a_whole_conversation() -> None:
    rig = Rig().connect()
    peer = rig.bridge.peers[1]
    rig.ask(peer.arm())
    assert rig.ask(peer.list_parameters())["SPD_FAST"] == 1.0
    assert rig.ask(peer.set_parameter("SPD_SLOW", 0.5)) == 0.5
    for k in range(5):
        assert rig.ask(perform(peer, QUICK)).sequence == 1 + 2 * k
        rig.ask(reset_bout(peer, k))
    assert len(rig.robot.performed) == 5
    assert rig.ask(peer.request(RefereeState, 25)).bout == 1
    assert peer.counters.lost == 0
    assert peer.counters.retries == 0


def test_nothing_is_sent_but_a_heartbeat_a_second_while_nobody_answers() -> None:
    rig = Rig(ScriptedRobot(silent=True))
    rig.run(2.5)
    assert [type(message) for message in rig.log.said] == [Heartbeat] * 3
    assert rig.bridge.peers == {}


@pytest.mark.parametrize(
    "kind",
    [
        CommandLong,
        RobotSession,
        JuniorManeuver,
        RobotResultAck,
        ParamRequestList,
        RefereeReset,
        JuniorWheels,
        Heartbeat,
        Ping,
    ],
)
def test_any_message_down_may_be_lost_once(kind: type[Message]) -> None:
    _everything_works(ScriptedRobot(deaf=once(kind)))


@pytest.mark.parametrize(
    "kind",
    [CommandAck, RobotAck, JuniorManeuverResult, ParamValue, RobotStatus, Heartbeat, JuniorSensors, RefereeState, Ping],
)
def test_any_message_up_may_be_lost_once(kind: type[Message]) -> None:
    _everything_works(ScriptedRobot(mute=once(kind)))


def _everything_works(robot: ScriptedRobot) -> None:
    rig = Rig(robot).connect()
    peer = rig.bridge.peers[1]
    rig.ask(peer.arm())
    rig.ask(peer.ping())
    assert len(rig.ask(peer.list_parameters())) == 3
    for k in range(3):
        rig.ask(reset_bout(peer, k))
        rig.ask(peer.request(JuniorSensors))
        rig.ask(perform(peer, QUICK))
        rig.ask(drive(peer, 0.1, 0.1, 0.05))
    assert len(robot.performed) == len(set(robot.performed)) == 3
    results = [e for e in rig.events if isinstance(e, Received) and isinstance(e.message, JuniorManeuverResult)]
    assert len(results) == 3


def test_under_heavy_faults_every_maneuver_is_performed_exactly_once() -> None:
    rig = Rig(faults="drop:0.2,corrupt:0.05,duplicate:0.1,jitter:0.02,reorder").connect()
    peer = rig.bridge.peers[1]
    rig.ask(peer.arm())
    for _ in range(60):
        rig.ask(perform(peer, QUICK))
    assert len(rig.robot.performed) == len(set(rig.robot.performed)) == 60
    assert peer.counters.retries > 10
    assert peer.counters.lost > 50
    assert peer.counters.rejected == sum(rig.bridge.rejected.values()) > 10


def test_the_same_seed_gives_the_same_bytes_both_ways() -> None:
    def bytes_of() -> tuple[list[tuple[float, bytes]], list[tuple[float, bytes]]]:
        rig = Rig(faults="drop:0.05,corrupt:0.01,jitter:0.02").connect()
        rig.ask(rig.bridge.peers[1].arm())
        for _ in range(5):
            rig.ask(perform(rig.bridge.peers[1], QUICK))
        return rig.log.rx, rig.log.tx

    assert bytes_of() == bytes_of()


def test_taps_see_everything() -> None:
    rig = Rig().connect()
    rig.ask(rig.bridge.peers[1].arm())
    log = rig.log
    codec = MavlinkCodec(system=255, component=190)
    decoded = [event for time, data in log.rx for event in codec.receive(data, time)]
    assert decoded == log.decoded
    codec = MavlinkCodec(system=1, component=1)
    said = [event for time, data in log.tx for event in codec.receive(data, time)]
    assert [event.message for event in said if isinstance(event, Received)] == log.said
    assert log.events == [PeerFound(1, 0.015)]
    assert sum(count for _, count in log.steps) == len(log.rx)
    assert [time for time, _ in log.steps] == sorted(time for time, _ in log.steps)
    assert rig.bridge.now == log.steps[-1][0]


def test_the_clock_is_read_once_a_step() -> None:
    class Counting(ManualClock):
        readings = 0

        def now(self) -> float:
            self.readings += 1
            return super().now()

    clock, robot = Counting(), ScriptedRobot()
    bridge = Bridge(MemoryLink(robot), clock)
    clock.readings = 0
    bridge.step(0)
    assert clock.readings == 1


def test_a_question_just_asked_does_not_wait() -> None:
    rig = Rig().connect()
    rig.run(0.05)
    before = rig.robot.now()
    rig.bridge.peers[1].ping()
    rig.bridge.step(1.0)
    assert rig.robot.now() == before
    assert isinstance(rig.log.said[-1], Ping)


def test_an_armed_robot_is_never_left_without_a_message() -> None:
    rig = Rig().connect()
    rig.ask(rig.bridge.peers[1].arm())
    first = len(rig.log.tx)
    rig.run(3.0)
    times = [time for time, _ in rig.log.tx[first:]]
    assert max(b - a for a, b in itertools.pairwise(times)) <= KEEP_ALIVE + 0.0051


def test_a_robot_that_falls_silent_is_lost_and_comes_back() -> None:
    rig = Rig().connect()
    rig.run(0.5)
    rig.robot.silent = True
    rig.run(4.0)
    rig.robot.silent = False
    rig.run(2.0)
    assert [type(event) for event in rig.log.events] == [PeerFound, PeerLost, PeerBack]
    assert [event for event in rig.events if not isinstance(event, Received)] == rig.log.events
    assert rig.bridge.peers[1].session == 77


def test_a_robot_that_restarts_gets_a_new_session() -> None:
    rig = Rig().connect()
    rig.run(2.0)
    rig.robot.reboot()
    rig.run(1.5)
    back = rig.log.events[-1]
    assert isinstance(back, PeerBack)
    assert back.rebooted
    rig.ask(perform(rig.bridge.peers[1], QUICK))


def test_a_robot_of_another_version_is_met_but_not_used() -> None:
    rig = Rig(ScriptedRobot(version=(1, 0)))
    rig.run(1.0)
    assert rig.bridge.peers[1].state is PeerState.REFUSED
    assert isinstance(rig.bridge.peers[1].failure, VersionError)
    assert rig.log.events == []


def test_only_the_robots_asked_for_are_spoken_with() -> None:
    rig = Rig(ScriptedRobot(system=7), robots={3})
    rig.run(0.5)
    assert rig.bridge.peers == {}
    assert any(isinstance(event, Received) for event in rig.events)
    assert {type(message) for message in rig.log.said} == {Heartbeat}


def test_watching_stops_nobody() -> None:
    rig = Rig(open_sessions=False)
    rig.robot.armed = True
    rig.connect().run(1.0)
    assert rig.robot.armed
    assert RobotSession not in {type(message) for message in rig.log.said}


class Pair:
    """Two robots on one line."""

    def __init__(self) -> None:
        self.robots = ScriptedRobot(system=1), ScriptedRobot(system=9)

    def now(self) -> float:
        return self.robots[0].now()

    def step(self, inbound: bytes) -> bytes:
        return b"".join(robot.step(inbound) for robot in self.robots)


def test_two_robots_on_one_link_share_the_heartbeat() -> None:
    pair, log = Pair(), Log()
    bridge = Bridge(MemoryLink(pair), pair, taps=[log], session=lambda: 5)
    while pair.now() < 4:
        bridge.step(0.1)
    assert sorted(bridge.peers) == [1, 9]
    assert all(peer.ready for peer in bridge.peers.values())
    beats = [message for message in log.said if isinstance(message, Heartbeat)]
    assert len(beats) <= 8
    codec = MavlinkCodec(system=255, component=190)
    noise = [event for event in codec.receive(b"\x55" * 40, 0.0) + codec.flush(1.0) if isinstance(event, Rejected)]
    assert noise


def test_a_ground_station_is_no_robot() -> None:
    station = MavlinkCodec(system=250, component=1)

    class Station(ScriptedRobot):
        def step(self, inbound: bytes) -> bytes:
            super().step(inbound)
            return station.encode(Heartbeat(6, 8, 0, 0, 4))

    rig = Rig(Station())
    rig.run(0.2)
    assert rig.bridge.peers == {}


def test_garbage_is_an_event_and_nothing_else() -> None:
    class Noisy(ScriptedRobot):
        def step(self, inbound: bytes) -> bytes:
            return super().step(inbound) + (b"\x00garbage\xfd\xff" if self._ticks % 7 == 0 else b"")

    rig = Rig(Noisy()).connect()
    rig.ask(rig.bridge.peers[1].arm())
    rig.run(1.0)
    assert any(isinstance(event, Rejected) for event in rig.events)
    assert sum(rig.bridge.rejected.values()) > 0


def test_a_message_of_ones_own_can_be_sent() -> None:
    rig = Rig().connect()
    rig.bridge.send(Ping(1, 99))
    rig.run(0.01)
    assert Ping(1, 99) in rig.robot.heard
    with pytest.raises(EncodeError):
        rig.bridge.send(Ping(-1, 99))


# --- The link ends ---------------------------------------------------------------------------------------------------


def test_an_unplugged_robot_is_told_first_and_then_raised() -> None:
    rig = Rig(faults="unplug:0.5").connect()
    ticket = perform(rig.bridge.peers[1], Maneuver((Action.F,), period=5.0))
    rig.until(lambda: ticket.done)
    lost = rig.log.events[-1]
    assert isinstance(lost, PeerLost)
    assert "unplugged" in lost.cause
    assert lost in rig.events
    with pytest.raises(LinkClosedError, match="unplugged"):
        ticket.value()
    for _ in range(2):
        with pytest.raises(LinkClosedError, match="unplugged"):
            rig.bridge.step(0.1)
        with pytest.raises(LinkClosedError, match="unplugged"):
            rig.bridge.send(Ping(1, 1))
    rig.bridge.close()
    rig.bridge.close()
    assert rig.log.events.count(lost) == 1


class Odd(MemoryLink):
    """A link that fails to write."""

    error: LinkClosedError | LinkTimeoutError | None = None

    def write(self, data: bytes) -> None:
        if self.error:
            raise self.error
        super().write(data)


def test_a_write_that_finds_the_link_gone_ends_it() -> None:
    rig = Rig().connect()
    rig.bridge.link = link = Odd(rig.robot)
    link.error = LinkClosedError("odd:", "broken")
    with pytest.raises(LinkClosedError, match="broken"):
        rig.bridge.send(Ping(1, 1))
    assert any(isinstance(event, PeerLost) for event in rig.bridge.step(0))
    with pytest.raises(LinkClosedError, match="broken"):
        rig.bridge.step(0)


def test_a_write_that_is_not_taken_is_repeated_like_any_lost_message() -> None:
    rig = Rig().connect()
    rig.bridge.link = link = Odd(rig.robot)
    link.error = LinkTimeoutError("odd:", "busy")
    ticket = rig.bridge.peers[1].ping()
    rig.bridge.step(0)
    assert rig.bridge.unsent == 1
    rig.bridge.link = rig.link
    rig.ask(ticket)


def test_a_closed_bridge_says_so() -> None:
    rig = Rig().connect()
    with rig.bridge as bridge:
        bridge.step(0)
    with pytest.raises(LinkClosedError, match="the bridge is closed"):
        rig.bridge.step(0)
    with pytest.raises(LinkClosedError, match="closed"):
        rig.bridge.send(Ping(1, 1))
    with pytest.raises(LinkClosedError):
        rig.link.read(0)


# --- In real time ----------------------------------------------------------------------------------------------------


def test_the_same_code_runs_in_real_time_over_a_pseudo_terminal() -> None:
    master, slave = os.openpty()
    robot, stop = ScriptedRobot(stream=False), threading.Event()

    def serve() -> None:
        while not stop.is_set():
            ready = select.select([master], [], [], 0.002)[0]
            os.write(master, robot.step(os.read(master, 4096) if ready else b""))

    link = open_link(f"serial://{os.ttyname(slave)}:115200")
    os.close(slave)
    clock = MonotonicClock()
    server = threading.Thread(target=serve)
    server.start()
    try:
        with Bridge(link, clock) as bridge:
            while clock.now() < 10 and not (1 in bridge.peers and bridge.peers[1].ready):
                bridge.step(0.1)
            ticket = perform(bridge.peers[1], QUICK)
            while not ticket.done:
                bridge.step(0.1)
            assert ticket.value().session == bridge.peers[1].session
            stop.set()
            server.join()  # before the link is closed, which it would notice
    finally:
        stop.set()
        server.join()
        os.close(master)
    assert len(robot.performed) == 1
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("pump")]


def test_sessions_are_random_and_never_zero() -> None:
    drawn = {random_session() for _ in range(200)}
    assert len(drawn) > 150
    assert all(1 <= session <= 0xFFFF for session in drawn)
