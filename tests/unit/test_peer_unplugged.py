"""A robot whose link goes away and comes back: who it is, whether it has restarted, and what became of the questions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from peer_bench import Bench, failed

from firmware_protocol.errors import LinkClosedError, PeerLostError, WrongRobotError
from firmware_protocol.events import PeerBack, PeerFound, PeerLost
from firmware_protocol.messages import (
    AutopilotVersion,
    CommandLong,
    Heartbeat,
    JuniorWheels,
    Ping,
    Reason,
    RobotSession,
    RobotStatus,
)
from firmware_protocol.peer.connection import PeerState
from firmware_protocol.peer.timing import SILENCE
from firmware_protocol.roles.junior import drive, perform
from firmware_protocol.vocabulary import Action, Maneuver

if TYPE_CHECKING:
    from firmware_protocol.peer.exchanges.exchange import Ticket

GONE = LinkClosedError("serial:///dev/ttyACM0", "the port is gone")
UID = 0x1122334455667788


@pytest.fixture
def ready() -> Bench:
    bench = Bench()
    bench.connect(UID)
    bench.events.clear()
    return bench


def unplug(bench: Bench) -> None:
    bench.events += bench.peer.unplugged(GONE, bench.clock.now())


def plug_in(bench: Bench, after: float = 2.0) -> None:
    """The plug goes in again after a while; the robot's frames may be counted anew."""
    bench.wait(after)
    bench.sent.clear()
    bench.events += bench.peer.plugged_in(bench.clock.now())
    bench.wait(0.005)


def test_everything_open_fails_at_once_and_so_does_what_is_asked_meanwhile(ready: Bench) -> None:
    open_tickets: list[Ticket[Any]] = [
        ready.peer.ping(),
        perform(ready.peer, Maneuver((Action.F,))),
        ready.peer.list_parameters(),
    ]
    ready.wait(0.005)
    unplug(ready)
    assert ready.events == [PeerLost(1, ready.clock.now(), str(GONE))]
    later: list[Ticket[Any]] = [ready.peer.ping(), drive(ready.peer, 0, 0, 0.1), ready.peer.arm()]
    for ticket in open_tickets + later:
        assert isinstance(ticket.error, PeerLostError)
        assert "nobody knows whether" in failed(ticket)
    assert ready.state() is PeerState.UNPLUGGED
    assert ready.peer.session is None


def test_nothing_is_sent_while_there_is_no_link(ready: Bench) -> None:
    ready.peer.arm()
    ready.wait(0.005)
    unplug(ready)
    ready.sent.clear()
    ready.wait(3 * SILENCE)
    assert ready.sent == []
    assert ready.peer.next_due() == float("inf")
    assert len(ready.events) == 1


def test_the_robot_is_recognised_compared_and_gets_a_new_session(ready: Bench) -> None:
    before = ready.peer.session
    unplug(ready)
    plug_in(ready)
    assert ready.state() is PeerState.RECOGNISING
    assert {type(message) for message in ready.sent} == {CommandLong, Heartbeat}
    assert ready.requests() == [AutopilotVersion.ID]
    ready.version(uid=UID)
    assert ready.state() is PeerState.COMPARING
    assert ready.requests() == [RobotStatus.ID]
    ready.status()
    assert ready.state() is PeerState.REOPENING
    assert ready.last(RobotSession).session != before
    ready.ack()
    assert ready.events[1:] == [PeerBack(1, ready.clock.now(), rebooted=False)]
    assert ready.peer.ready
    assert not ready.peer.armed
    ticket = drive(ready.peer, 0, 0, 0.1)
    ready.wait(0.005)
    assert not ticket.done


def test_one_that_has_restarted_is_back_and_it_is_said(ready: Bench) -> None:
    unplug(ready)
    plug_in(ready)
    ready.version(uid=UID)
    ready.status(boots=2, time=0.5)
    assert ready.state() is PeerState.IDENTIFYING
    ready.version(uid=UID)
    ready.ack()
    assert ready.events[1:] == [PeerBack(1, ready.clock.now(), rebooted=True)]


def test_another_robot_is_refused_without_a_session(ready: Bench) -> None:
    unplug(ready)
    plug_in(ready)
    ready.version(uid=UID + 1)
    assert ready.state() is PeerState.UNUSABLE
    assert isinstance(ready.peer.failure, WrongRobotError)
    assert f"{UID:016x}" in str(ready.peer.failure)
    assert f"{UID + 1:016x}" in str(ready.peer.failure)
    assert ready.take(RobotSession) == []
    assert isinstance(drive(ready.peer, 0, 0, 0.1).error, WrongRobotError)
    unplug(ready)
    plug_in(ready)
    ready.version(uid=UID)
    ready.status()
    ready.ack()
    assert ready.peer.ready
    assert ready.peer.failure is None


def test_another_robot_on_the_same_link_is_refused_too(ready: Bench) -> None:
    ready.status(boots=9, time=0.1)
    ready.version(uid=UID + 1)
    assert isinstance(ready.peer.failure, WrongRobotError)


def test_a_robot_that_names_no_id_is_taken_for_the_same(ready: Bench) -> None:
    unplug(ready)
    plug_in(ready)
    ready.version(uid=0)
    assert ready.state() is PeerState.COMPARING


def test_one_that_fell_silent_before_its_session_was_open_is_compared_again(ready: Bench) -> None:
    unplug(ready)
    plug_in(ready)
    ready.version(uid=UID)
    ready.status()
    assert ready.state() is PeerState.REOPENING
    ready.wait(4.0)
    assert ready.state() is PeerState.AWAITED
    ready.heartbeat()
    ready.version(uid=UID)
    assert ready.state() is PeerState.COMPARING
    ready.status(boots=2)
    ready.version(uid=UID)
    ready.ack()
    assert ready.events[1:] == [PeerBack(1, ready.clock.now(), rebooted=True)]


@pytest.mark.parametrize("answers", [0, 1])
def test_a_link_that_is_back_without_the_robot_waits_for_its_heartbeat(ready: Bench, answers: int) -> None:
    unplug(ready)
    plug_in(ready)
    if answers:
        ready.version(uid=UID)
    ready.wait(4.0)
    assert ready.state() is PeerState.AWAITED
    ready.heartbeat()
    ready.version(uid=UID)
    ready.status()
    ready.ack()
    assert [type(event) for event in ready.events] == [PeerLost, PeerBack]


def test_frames_are_counted_anew(ready: Bench) -> None:
    for _ in range(100):
        ready.heard(Ping(0, 1))
    unplug(ready)
    plug_in(ready)
    ready.heard(Ping(0, 1), step=77)
    assert (ready.peer.counters.lost, ready.peer.counters.duplicates) == (0, 0)


def test_a_link_lost_during_the_first_handshake_is_no_loss_and_the_handshake_begins_anew() -> None:
    bench = Bench()
    bench.heartbeat()
    unplug(bench)
    plug_in(bench)
    bench.version(uid=UID)
    bench.ack()
    assert bench.events == [PeerFound(1, bench.clock.now())]


def test_watching_opens_no_session_afterwards_either() -> None:
    bench = Bench(open_session=False)
    bench.heartbeat()
    bench.version(uid=UID)
    bench.status()
    unplug(bench)
    plug_in(bench)
    bench.version(uid=UID)
    bench.status()
    assert bench.peer.ready
    assert bench.take(RobotSession) == []


def test_the_end_of_patience_fails_what_is_asked_with_the_links_error(ready: Bench) -> None:
    unplug(ready)
    over = LinkClosedError("serial:///dev/ttyACM0", "it did not come back")
    assert ready.peer.closed(over, 40.0) == []
    assert ready.peer.ping().error is over


def test_a_robot_that_does_not_know_the_session_and_has_restarted_is_lost_and_has_not_refused(ready: Bench) -> None:
    ticket = drive(ready.peer, 1.0, 1.0, 0.1)
    ready.wait(0.005)
    ready.ack(JuniorWheels, 1, 1, Reason.WRONG_SESSION)
    ready.ack(JuniorWheels, 1, 1, Reason.WRONG_SESSION)
    assert not ticket.done
    ready.status(boots=2, time=0.01)
    assert isinstance(ticket.error, PeerLostError)
    assert ready.events == [PeerLost(1, ready.clock.now(), "it has restarted")]


def test_a_robot_heard_again_that_has_no_session_has_restarted(ready: Bench) -> None:
    ready.wait(SILENCE + 0.1)
    ready.heartbeat()
    assert ready.state() is PeerState.CHECKING
    ready.heard(RobotStatus(ready.clock.now(), 0, 0, 0, 0, 0, 1, 0, 0, 1))
    assert ready.state() is PeerState.IDENTIFYING
