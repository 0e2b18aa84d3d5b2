"""Maneuvers as the host asks for them: their results, retries and refusals, and that none is performed or delivered twice."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from peer_bench import QUICK, Bench, failed
from scripted_robot import result

from firmware_protocol.messages import (
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorWheels,
    Reason,
    RobotResultAck,
    State,
)
from firmware_protocol.roles.junior import drive, perform
from firmware_protocol.vocabulary import Action, Maneuver, Outcome

if TYPE_CHECKING:
    from firmware_protocol.peer.exchanges.exchange import Ticket


@pytest.fixture
def bench() -> Bench:
    return Bench.connected()


def begin(bench: Bench) -> Ticket[JuniorManeuverResult]:
    ticket = perform(bench.peer, QUICK)
    bench.wait(0.005)
    return ticket


def test_a_maneuver_is_over_when_its_result_comes(bench: Bench) -> None:
    ticket = begin(bench)
    assert bench.last(JuniorManeuver).count == 2
    bench.ack(JuniorManeuver, 1)
    assert not ticket.done
    bench.wait(0.2)
    bench.heard(result(701, 1))
    assert ticket.value().done == 1
    assert bench.take(RobotResultAck) == [RobotResultAck(701, 1, 1, 1)]


def test_a_result_counts_as_acknowledgement(bench: Bench) -> None:
    ticket = begin(bench)
    bench.heard(result(701, 1))
    assert ticket.done
    bench.sent.clear()
    bench.wait(1.0)
    assert bench.take(JuniorManeuver) == []


def test_a_result_is_delivered_once_and_acknowledged_every_time(bench: Bench) -> None:
    begin(bench)
    bench.ack(JuniorManeuver, 1)
    bench.take(JuniorManeuver)
    for _ in range(3):
        bench.heard(result(701, 1))
        bench.wait(0.1)
    assert len(bench.take(RobotResultAck)) == 3
    assert [type(message) for message in bench.shown].count(JuniorManeuverResult) == 1


def test_the_result_of_an_earlier_host_is_acknowledged_and_not_shown(bench: Bench) -> None:
    bench.heard(result(333, 9))
    assert bench.take(RobotResultAck) == [RobotResultAck(333, 9, 1, 1)]
    assert not [m for m in bench.shown if isinstance(m, JuniorManeuverResult)]


def test_a_missing_result_is_asked_for_by_the_same_message(bench: Bench) -> None:
    ticket = begin(bench)
    first = bench.take(JuniorManeuver)
    bench.ack(JuniorManeuver, 1)
    bench.wait(0.49)
    assert bench.take(JuniorManeuver) == []
    bench.wait(0.05)
    assert bench.take(JuniorManeuver) == first
    bench.ack(JuniorManeuver, 1)
    bench.heard(result(701, 1))
    assert ticket.done


def test_a_status_that_says_it_is_over_has_the_result_asked_for_at_once(bench: Bench) -> None:
    begin(bench)
    bench.ack(JuniorManeuver, 1)
    bench.take(JuniorManeuver)
    bench.wait(0.25)
    bench.status(state=State.PERFORMING, sequence=1)
    assert bench.take(JuniorManeuver) == []
    bench.status(state=State.READY, sequence=1)
    assert len(bench.take(JuniorManeuver)) == 1


def test_a_result_that_never_comes_is_given_up(bench: Bench) -> None:
    ticket = begin(bench)
    bench.ack(JuniorManeuver, 1)
    for _ in range(10):
        bench.wait(0.5)
        bench.heartbeat()
    assert "never sent the result of the maneuver" in failed(ticket)


def test_a_result_that_never_comes_is_given_up_though_every_repetition_is_acknowledged(bench: Bench) -> None:
    ticket = begin(bench)
    for _ in range(100):
        bench.ack(JuniorManeuver, 1)
        bench.wait(0.5)
        bench.heartbeat()
    assert "never sent the result of the maneuver" in failed(ticket)


def test_a_maneuver_that_is_performed_does_not_hold_up_the_next_message(bench: Bench) -> None:
    begin(bench)
    bench.ack(JuniorManeuver, 1)
    stop = drive(bench.peer, 0.0, 0.0, 0.0)
    bench.wait(0.005)
    bench.ack(JuniorWheels, 2)
    assert stop.done


def test_a_refused_maneuver_says_why_however_it_is_told(bench: Bench) -> None:
    first = begin(bench)
    bench.ack(JuniorManeuver, 1, 1, Reason.DISARMED)
    assert "it is not armed" in failed(first)
    second = begin(bench)
    told = result(701, 2)
    bench.heard(JuniorManeuverResult(**{**vars(told), "outcome": Outcome.REFUSED, "reason": Reason.EMERGENCY_STOP}))
    assert "emergency stop" in failed(second)


def test_the_floor_reflex_may_prolong_a_maneuver(bench: Bench) -> None:
    perform(bench.peer, Maneuver((Action.F,), period=0.1))
    bench.wait(0.005)
    bench.ack(JuniorManeuver, 1)
    bench.take(JuniorManeuver)
    bench.heartbeat()
    bench.wait(2.9)
    bench.heartbeat()
    bench.wait(1.4)
    assert bench.take(JuniorManeuver) == []
