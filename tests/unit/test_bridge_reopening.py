"""The bridge and a link that goes away: told at once, opened again, and the right robot at its end. In lock-step."""

from __future__ import annotations

import itertools
import sys
from typing import TYPE_CHECKING, Any

import pytest
from scripted_robot import ScriptedRobot

from firmware_protocol.errors import LinkClosedError, LinkOpenError, PeerLostError
from firmware_protocol.events import Event, LinkNews, PeerBack, PeerFound, PeerLost, Received, Rejected, RejectReason
from firmware_protocol.links import MemoryLink
from firmware_protocol.messages import Heartbeat, Ping, RobotSession
from firmware_protocol.roles.junior import perform
from firmware_protocol.vocabulary import Action, Maneuver
from firmware_protocol.wire.mavlink import MavlinkCodec, split_frames
from hil.bridge.bridge import Bridge
from hil.bridge.reopening import Reopening

if TYPE_CHECKING:
    from collections.abc import Callable

PATIENCE = 10.0


class Cable:
    """What is plugged in where: opens a link to whichever robot is there now. Time is the first robot's.

    Attributes:
        plugged: Who is at the other end; None for nobody.
        url: Name under which the port is found.
        links: Every link opened so far.
        tries: When it was tried to open one, in s.
    """

    def __init__(self, *robots: ScriptedRobot) -> None:
        self.robots = robots
        self.plugged: Any = robots[0]
        self.url = "cable:/dev/ttyACM0"
        self.links: list[Plug] = []
        self.tries: list[float] = []

    def now(self) -> float:
        return self.robots[0].now()

    def step(self, inbound: bytes) -> bytes:
        out = b""
        for robot in self.robots:
            said = robot.step(inbound if robot is self.plugged else b"")
            out += said if robot is self.plugged else b""
        return out

    def open(self) -> Plug:
        self.tries.append(self.now())
        if self.plugged is None:
            raise LinkOpenError(self.url, "there is no port")
        self.links.append(Plug(self, self.url))
        return self.links[-1]

    def let_pass(self, duration: float) -> None:
        end = self.now() + duration - 1e-9
        while self.now() < end:
            self.step(b"")

    def swap(self, robot: ScriptedRobot | None) -> None:
        """Pull the plug, and perhaps put another robot's in."""
        self.plugged = robot
        for link in self.links:
            link.pulled = True


class Plug(MemoryLink):
    """A link that can be pulled.

    Attributes:
        pulled: It is gone.
        closed: It was given back.
        writes_fail: Only writing finds that it is gone.
    """

    pulled = False
    closed = False
    writes_fail = False

    def write(self, data: bytes) -> None:
        if self.pulled or self.writes_fail:
            raise LinkClosedError(self.url, "pulled")
        super().write(data)

    def read(self, timeout: float) -> bytes:
        if self.pulled:
            raise LinkClosedError(self.url, "pulled")
        return super().read(timeout)

    def close(self) -> None:
        self.closed = True
        super().close()


class Rig:
    """A bridge on a cable.

    Attributes:
        events: What it has told, but for messages.
    """

    def __init__(self, *robots: ScriptedRobot, patience: float = PATIENCE, **options: Any) -> None:  # noqa: ANN401
        self.cable = Cable(*(robots or (ScriptedRobot(uid=1),)))
        self.robot = self.cable.robots[0]
        self.events: list[Event] = []
        sessions = iter(range(100, 200))
        reopening = Reopening(self.cable, patience) if patience else None
        self.bridge = Bridge(self.cable.open(), self.cable, session=lambda: next(sessions), reopening=reopening, **options)

    def until(self, done: Callable[[], bool], patience: float = 20.0) -> Rig:
        end = self.cable.now() + patience
        while not done() and self.cable.now() < end:
            self.once()
        assert done()
        return self

    def once(self, wait: float = 0.1) -> None:
        self.events += [event for event in self.bridge.step(wait) if not isinstance(event, Received)]

    def run(self, time: float) -> None:
        end = self.cable.now() + time - 1e-9
        while self.cable.now() < end:
            self.once(end - self.cable.now())

    @property
    def ready(self) -> bool:
        return bool(self.bridge.peers) and all(peer.ready for peer in self.bridge.peers.values())

    def kinds(self) -> list[type[Event]]:
        return [type(event) for event in self.events]

    def news(self) -> list[str]:
        return [event.text for event in self.events if isinstance(event, LinkNews)]


@pytest.fixture
def rig() -> Rig:
    rig = Rig()
    rig.until(lambda: rig.ready).run(1.0)
    rig.events.clear()
    return rig


def test_a_loss_is_told_at_once_and_everything_open_fails(rig: Rig) -> None:
    peer = rig.bridge.peers[1]
    ticket = perform(peer, Maneuver((Action.F,), period=1.0))
    rig.run(0.3)
    rig.cable.swap(None)
    lost_at = rig.cable.now()
    rig.once()
    assert rig.events == [
        LinkNews("cable:/dev/ttyACM0: pulled; trying for 10 s to open it again", lost_at),
        PeerLost(1, lost_at, "cable:/dev/ttyACM0: pulled"),
    ]
    assert isinstance(ticket.error, PeerLostError)
    assert isinstance(rig.bridge.lost, LinkClosedError)
    assert rig.cable.links[0].closed
    with pytest.raises(LinkClosedError, match="for the moment"):
        rig.bridge.send(Ping(1, 1))


def test_the_robot_is_back_with_a_new_session_and_works(rig: Rig) -> None:
    peer = rig.bridge.peers[1]
    before = peer.session
    rig.cable.swap(None)
    rig.run(2.0)
    rig.cable.plugged = rig.robot
    rig.until(lambda: rig.ready)
    assert rig.kinds() == [LinkNews, PeerLost, LinkNews, PeerBack]
    assert rig.news()[1].startswith("the link is back after 2.")
    assert rig.bridge.lost is None
    assert rig.bridge.link is rig.cable.links[1]
    assert peer is rig.bridge.peers[1]
    assert peer.session not in {before, None}
    ticket = perform(peer, Maneuver((Action.F,), period=0.05))
    rig.until(lambda: ticket.done)
    assert ticket.value().session == peer.session
    assert peer.counters.lost == 0


def test_tries_grow_apart_to_half_a_second_and_time_passes_for_the_robot_meanwhile(rig: Rig) -> None:
    rig.cable.swap(None)
    began = rig.cable.now()
    rig.run(5.0)
    assert rig.cable.now() == pytest.approx(began + 5.0)
    tries = [time - began for time in rig.cable.tries[1:]]
    assert tries[:4] == pytest.approx([0.1, 0.25, 0.475, 0.815], abs=0.02)
    assert all(b - a == pytest.approx(0.5, abs=0.006) for a, b in itertools.pairwise(tries[5:]))


def test_when_the_patience_is_over_the_link_has_ended(rig: Rig) -> None:
    rig.cable.swap(None)
    began = rig.cable.now()
    rig.until(lambda: rig.bridge.peers[1].ping().error.__class__ is LinkClosedError)
    assert rig.cable.now() - began == pytest.approx(PATIENCE, abs=0.01)
    for _ in range(2):
        with pytest.raises(LinkClosedError, match=r"pulled; it did not come back within 10 s \(there is no port\)"):
            rig.bridge.step(0.1)
        with pytest.raises(LinkClosedError, match="did not come back"):
            rig.bridge.send(Ping(1, 1))
    assert rig.kinds() == [LinkNews, PeerLost]
    rig.bridge.close()


def test_without_patience_it_has_ended_at_once() -> None:
    rig = Rig(patience=0.0)
    rig.until(lambda: rig.ready)
    rig.cable.swap(None)
    rig.once()
    assert rig.kinds() == [PeerFound, PeerLost]
    with pytest.raises(LinkClosedError, match="pulled"):
        rig.bridge.step(0.1)
    assert rig.cable.tries == [0.0]


def test_a_write_that_finds_it_gone_is_a_loss_too(rig: Rig) -> None:
    rig.cable.links[0].writes_fail = True
    ticket = rig.bridge.peers[1].ping()
    rig.once()
    rig.once()
    assert isinstance(ticket.error, PeerLostError)
    assert rig.kinds() == [LinkNews, PeerLost]
    rig.until(lambda: rig.ready)
    rig.bridge.send(Ping(1, 1))


def test_another_name_is_told(rig: Rig) -> None:
    rig.cable.swap(None)
    rig.run(1.0)
    rig.cable.plugged, rig.cable.url = rig.robot, "cable:/dev/ttyACM1"
    rig.until(lambda: rig.ready)
    assert rig.news()[1].endswith(", as cable:/dev/ttyACM1")
    assert rig.bridge.link.url == "cable:/dev/ttyACM1"


def test_one_that_has_restarted_is_told_to_have(rig: Rig) -> None:
    rig.cable.swap(None)
    rig.run(1.0)
    rig.robot.reboot()
    rig.cable.plugged = rig.robot
    rig.until(lambda: rig.ready)
    back = rig.events[-1]
    assert isinstance(back, PeerBack)
    assert back.rebooted


def test_another_robot_is_left_alone_and_the_right_one_waited_for() -> None:
    right, wrong = ScriptedRobot(uid=1), ScriptedRobot(uid=2)
    rig = Rig(right, wrong)
    rig.until(lambda: rig.ready)
    rig.events.clear()
    wrong.armed = True
    rig.cable.swap(wrong)
    rig.run(3.0)
    assert wrong.armed
    assert not any(isinstance(message, RobotSession) for message in wrong.heard)
    assert any(isinstance(message, Heartbeat) for message in wrong.heard)
    assert len(rig.cable.links) > 3
    assert all(link.closed for link in rig.cable.links[:-1])
    rig.cable.swap(right)
    rig.until(lambda: rig.ready)
    assert rig.kinds() == [LinkNews, PeerLost, LinkNews, LinkNews, PeerBack]
    assert "another robot answers as system 1" in rig.news()[2]


def test_another_robot_alone_uses_the_patience_up() -> None:
    rig = Rig(ScriptedRobot(uid=1), ScriptedRobot(uid=2))
    rig.until(lambda: rig.ready)
    rig.cable.swap(rig.cable.robots[1])
    began = rig.cable.now()
    with pytest.raises(LinkClosedError, match=r"another robot answers .* it did not come back within 10 s"):
        rig.run(30.0)
    assert rig.cable.now() - began == pytest.approx(PATIENCE, abs=1.0)


def test_a_link_that_flickers_gets_no_new_patience(rig: Rig) -> None:
    rig.robot.silent = True
    began = rig.cable.now()

    def flicker() -> None:
        for _ in range(10_000):
            rig.cable.swap(rig.robot)
            rig.once()

    with pytest.raises(LinkClosedError, match="did not come back within 10 s"):
        flicker()
    assert rig.cable.now() - began == pytest.approx(PATIENCE, abs=0.6)
    assert len(rig.news()) == 2  # it would say the same again and again


def test_a_second_loss_gets_all_the_patience(rig: Rig) -> None:
    for _ in range(2):
        rig.cable.swap(None)
        rig.run(PATIENCE - 1.0)
        rig.cable.plugged = rig.robot
        rig.until(lambda: rig.ready)
        rig.run(1.0)
    assert rig.kinds() == [LinkNews, PeerLost, LinkNews, PeerBack] * 2


def test_a_loss_before_any_robot_was_found_is_overcome_too() -> None:
    rig = Rig(ScriptedRobot(silent=True))
    rig.run(0.5)
    rig.cable.swap(None)
    rig.run(1.0)
    rig.robot.silent = False
    rig.cable.plugged = rig.robot
    rig.until(lambda: rig.ready)
    assert rig.kinds() == [LinkNews, LinkNews, PeerFound]


def test_closing_while_there_is_no_link(rig: Rig) -> None:
    rig.cable.swap(None)
    rig.run(1.0)
    rig.bridge.close()
    rig.bridge.close()
    with pytest.raises(LinkClosedError, match="the bridge is closed"):
        rig.bridge.step(0.1)


def test_of_two_robots_one_in_anothers_place_does_not_close_the_link_for_the_other() -> None:
    class Pair:
        """Two robots on one line."""

        armed = silent = False

        def __init__(self) -> None:
            self.robots = [ScriptedRobot(system=1, uid=1), ScriptedRobot(system=9, uid=9)]

        def now(self) -> float:
            return self.robots[1].now()

        def step(self, inbound: bytes) -> bytes:
            return b"".join(robot.step(inbound) for robot in self.robots)

    pair: Any = Pair()
    rig = Rig(pair)
    rig.until(lambda: len(rig.bridge.peers) == 2 and rig.ready)
    rig.cable.swap(None)
    rig.run(1.0)
    pair.robots[0] = ScriptedRobot(system=1, uid=3)
    rig.cable.plugged = pair
    rig.until(lambda: rig.bridge.peers[9].ready and rig.bridge.peers[1].failure is not None)
    rig.run(3.0)
    assert rig.bridge.peers[9].ready
    assert len(rig.cable.links) == 2


class Cut(Plug):
    """A link on which the last frame before the plug is pulled comes in part, and the rest of it never."""

    part = b""

    def read(self, timeout: float) -> bytes:
        if self.part:
            part, self.part = self.part, b""
            return part
        return super().read(timeout)


def cut_rig(part: bytes, monkeypatch: pytest.MonkeyPatch) -> Rig:
    """A rig that is ready, in which part of a frame has come when the plug is pulled."""
    monkeypatch.setattr(sys.modules[__name__], "Plug", Cut)
    rig = Rig()
    rig.until(lambda: rig.ready).run(1.0)
    rig.events.clear()
    rig.cable.links[0].part = part  # type: ignore[attr-defined]
    rig.once(0.005)
    rig.cable.swap(None)
    rig.once()
    return rig


def test_what_had_come_in_part_is_given_up_when_the_link_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    frame = MavlinkCodec(system=1, component=1).encode(Ping(5, 5, 255, 190))
    rig = cut_rig(frame[:12], monkeypatch)
    (rejected,) = [event for event in rig.events if isinstance(event, Rejected)]
    assert (rejected.reason, rejected.raw) == (RejectReason.INCOMPLETE, frame[:12])
    assert rig.kinds().index(Rejected) < rig.kinds().index(PeerLost)


def test_the_rest_of_a_frame_on_the_link_that_is_back_is_no_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    frame = MavlinkCodec(system=1, component=1).encode(Ping(5, 5, 255, 190))
    rig = cut_rig(frame[:12], monkeypatch)
    rig.cable.plugged = rig.robot
    good = rig.bridge._codec.good
    events = rig.bridge._codec.receive(frame[12:], rig.cable.now())
    assert events == []
    assert rig.bridge._codec.good == good


def test_frames_are_counted_from_0_on_the_link_that_is_back(rig: Rig) -> None:
    rig.cable.swap(None)
    rig.run(1.0)
    rig.cable.plugged = rig.robot
    heard: list[bytes] = []
    opened = rig.cable.open

    def listening() -> Plug:
        link = opened()
        write = link.write

        def noting(data: bytes) -> None:
            heard.append(data)
            write(data)

        link.write = noting  # type: ignore[method-assign]
        return link

    rig.cable.open = listening  # type: ignore[method-assign]
    rig.until(lambda: rig.ready)
    frames = split_frames(b"".join(heard))
    assert [frame[4] for frame in frames[:4]] == [0, 1, 2, 3]
