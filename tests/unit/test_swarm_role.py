"""What is asked of a micro-robot and of its table: moves that end in one observation, askings, fixes, placing."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import TYPE_CHECKING

import pytest
from peer_bench import HOST_NUMBER, Bench, failed

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.events import Received
from firmware_protocol.messages import (
    Command,
    CommandLong,
    CommandResult,
    Reason,
    RobotAck,
    RobotResultAck,
    State,
    SwarmFix,
    SwarmMove,
    SwarmObservation,
    SwarmRanges,
    SwarmSense,
    TablePlace,
    TableReset,
)
from firmware_protocol.messages.swarm import LONG_RANGE
from firmware_protocol.peer.companion import Companion
from firmware_protocol.peer.exchanges.performing import RESULT_MARGIN
from firmware_protocol.roles.junior import drive
from firmware_protocol.roles.swarm import (
    MICRO_ROBOT,
    ask_everybody,
    fix,
    longest_time,
    measure_ranges,
    move,
    observe,
    sense,
)
from firmware_protocol.roles.swarm_table import TABLE, place, reset_table, table_system
from firmware_protocol.vocabulary import Move, MoveOption, SwarmOutcome

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

SESSION = 701
FORWARD = Move(0.08, heading=0.5)
SEEN = SwarmObservation(
    1.0, SESSION, 1, (0.1, 0.2), 0.5, 0.08, 0.2, 0.2, (1, 2), (1, 2), None, None, None, 0.05, (1, 1), (0, 1), 0, 1, 0
)


def met(*, taken: bool = True) -> Bench:
    """A micro-robot whose handshake is done."""
    bench = Bench(open_session=taken)
    bench.heartbeat()
    bench.version(2, 1, product=2)
    if taken:
        bench.ack()
    bench.status()
    bench.command_ack(Command.SET_MESSAGE_INTERVAL)
    bench.sent.clear()
    return bench


def test_product_2_is_a_micro_robot() -> None:
    bench = met()
    assert bench.peer.role is MICRO_ROBOT
    assert failed(drive(bench.peer, 0, 0, 0.1)) == "driving takes a Junior, and robot 1 is a micro-robot"


def test_a_move_is_accepted_and_ends_in_an_observation_which_is_acknowledged() -> None:
    bench = met()
    ticket = move(bench.peer, FORWARD, 3.0)
    (sent,) = bench.take(SwarmMove)
    assert sent == SwarmMove(SESSION, 1, 0.5, 0.08, None, 0.0, 1, 1, 0, 0, 0, int(FORWARD.options))
    bench.ack(SwarmMove, 1)
    assert not ticket.done
    bench.heard(SEEN)
    assert ticket.value() == SEEN
    assert bench.take(RobotResultAck) == [RobotResultAck(SESSION, 1, 1, 1)]
    shown = len(bench.shown)
    bench.heard(SEEN)
    assert bench.take(RobotResultAck) == [RobotResultAck(SESSION, 1, 1, 1)], "it had not heard that"
    assert len(bench.shown) == shown


@pytest.mark.parametrize("outcome", [SwarmOutcome.BLOCKED, SwarmOutcome.REFUSED, SwarmOutcome.REPLACED])
def test_however_a_move_ends_the_observation_is_the_answer(outcome: SwarmOutcome) -> None:
    bench = met()
    ticket = move(bench.peer, FORWARD, 3.0)
    assert bench.take(SwarmMove)
    bench.ack(SwarmMove, 1)
    ended = replace(SEEN, outcome=int(outcome), reason=int(Reason.BAD_VALUE))
    bench.heard(ended)
    assert ticket.value() == ended


def test_a_move_that_is_refused_at_once_fails() -> None:
    bench = met()
    ticket = move(bench.peer, FORWARD, 3.0)
    assert bench.take(SwarmMove)
    bench.ack(SwarmMove, 1, 1, Reason.BAD_VALUE)
    assert failed(ticket).endswith("a value is out of range")


def test_an_observation_that_does_not_come_is_asked_for_by_the_same_move() -> None:
    bench = met()
    ticket = move(bench.peer, FORWARD, 0.5)
    bench.take(SwarmMove)
    bench.ack(SwarmMove, 1)
    bench.wait(0.5 + RESULT_MARGIN - 0.02)
    assert not bench.take(SwarmMove)
    bench.wait(0.04)
    assert [again.sequence for again in bench.take(SwarmMove)] == [1]
    bench.heard(SEEN)
    assert ticket.value() == SEEN


def test_a_status_that_says_that_it_is_over_has_the_observation_asked_for() -> None:
    bench = met()
    move(bench.peer, FORWARD, 60.0)
    bench.take(SwarmMove)
    bench.ack(SwarmMove, 1)
    bench.status(state=State.PERFORMING, sequence=1)
    assert not bench.take(SwarmMove)
    bench.status(state=State.READY, sequence=1)
    assert [again.sequence for again in bench.take(SwarmMove)] == [1]


def test_an_observation_that_was_asked_for_ends_no_move_and_is_not_acknowledged() -> None:
    bench = met()
    ticket = move(bench.peer, FORWARD, 3.0)
    assert bench.take(SwarmMove)
    bench.ack(SwarmMove, 1)
    asked = replace(SEEN, outcome=0)
    bench.heard(asked)
    assert not ticket.done
    assert not bench.take(RobotResultAck)
    assert asked in bench.shown


def test_the_result_of_another_hosts_move_is_not_acknowledged() -> None:
    bench = met()
    bench.heard(replace(SEEN, session=99))
    assert not bench.take(RobotResultAck)
    watching = met(taken=False)
    watching.heard(SEEN)
    assert not watching.take(RobotResultAck)
    assert SEEN in watching.shown


@pytest.mark.parametrize(("taken", "host"), [(True, HOST_NUMBER), (False, 0)])
def test_an_asking_has_a_count_and_the_host_and_only_its_own_answer_counts(*, taken: bool, host: int) -> None:
    bench = met(taken=taken)
    ticket = observe(bench.peer)
    (sent,) = bench.take(CommandLong)
    assert (sent.command, sent.param1, sent.param3) == (Command.REQUEST_MESSAGE, SwarmObservation.ID, host)
    bench.heard(replace(SEEN, sequence=int(sent.param2) - 1, outcome=0))
    bench.heard(replace(SEEN, sequence=int(sent.param2), outcome=1))
    assert not ticket.done
    bench.wait(0.1)
    (again,) = bench.take(CommandLong)
    assert again == replace(sent, confirmation=1)
    answer = replace(SEEN, sequence=int(sent.param2), outcome=0)
    bench.heard(answer)
    assert ticket.value() == answer
    bench.wait(0.2)
    ranges = measure_ranges(bench.peer)
    (sent,) = bench.take(CommandLong)
    assert sent.param1 == SwarmRanges.ID
    found = SwarmRanges(1.0, 3, SESSION, int(sent.param2), (0.0, 0.0), 0.0, (1.0, None) + (0.0,) * 30, 2)
    bench.heard(found)
    assert ranges.value() == found


def test_an_asking_may_be_refused() -> None:
    bench = met()
    ticket = observe(bench.peer)
    bench.command_ack(Command.REQUEST_MESSAGE, CommandResult.DENIED)
    assert "not allowed" in failed(ticket)


def test_counts_of_askings_are_never_0() -> None:
    numbering = met().peer.numbering
    numbering.asking = 0xFFFE
    assert [numbering.take_asking() for _ in range(3)] == [0xFFFF, 1, 2]


def test_everybody_is_asked_at_once() -> None:
    asked = ask_everybody(SwarmObservation, 7, HOST_NUMBER)
    assert (asked.target_system, asked.param1, asked.param2, asked.param3) == (0, 47202, 7, HOST_NUMBER)


def test_sense_and_fix() -> None:
    bench = met()
    ticket = sense(bench.peer, 0.2, 0.05, sectors=16)
    assert bench.take(SwarmSense) == [SwarmSense(SESSION, 1, 0.2, 0.05, LONG_RANGE, 1, 1, 16, 0)]
    bench.ack(SwarmSense, 1)
    assert ticket.value().result == 0
    assert fix(bench.peer, (0.5, -0.25), 1.0, 0.02)
    assert bench.take(SwarmFix) == [SwarmFix(SESSION, (0.5, -0.25), 1.0, 0.02, 1, 1)]
    assert not fix(met(taken=False).peer, (0.0, 0.0), 0.0, 0.0)


@pytest.mark.parametrize(
    ("what", "longest"),
    [
        (Move(0.2, heading=0.0), 2 * (pi / 6.28 + 1.0) + 1.0),
        (Move(0.2, heading=0.0, face=0.0), 2 * (2 * pi / 6.28 + 1.0) + 1.0),
        (Move(0.2, heading=0.0, speed=0.1), 2 * (pi / 6.28 + 2.0) + 1.0),
        (Move(0.2, heading=0.0, options=MoveOption.PUSH), 3 * (pi / 6.28 + 1.0) + 1.0),
    ],
)
def test_longest_time(what: Move, longest: float) -> None:
    assert longest_time(what, 0.2, 6.28) == pytest.approx(longest)


class Beside:
    """A table played by the test."""

    def __init__(self) -> None:
        self.table = Companion(254, 25, role=TABLE, session=55, host=HOST_NUMBER)
        self.now = 1.0

    def sent(self) -> list[Message]:
        return list(self.table.due(self.now))

    def heard(self, message: Message, component: int = 25) -> None:
        self.table.handle(Received(message, 254, component, 0, self.now, b""))


def test_a_table_is_set_up_and_robots_are_placed_without_a_handshake() -> None:
    beside = Beside()
    reset = reset_table(beside.table, 9, (2.0, 2.0), wall=True)
    first = place(beside.table, 3, (0.1, -0.2), 0.5)
    assert beside.sent() == [TableReset(9, 55, 1, (2.0, 2.0), 254, 25, 1, 0, 0, 0)]
    beside.heard(RobotAck(TableReset.ID, 55, 1, 255, 191, 0, 0))
    beside.heard(RobotAck(TableReset.ID, 55, 1, 255, 190, 0, 0), component=1)
    assert not reset.done
    beside.heard(RobotAck(TableReset.ID, 55, 1, 255, 190, 0, 0))
    assert reset.value().result == 0
    assert beside.table.next_due() <= beside.now
    assert beside.sent() == [TablePlace(55, 2, (0.1, -0.2), 0.5, 254, 25, 3)]
    beside.now += 0.1
    assert beside.sent() == [TablePlace(55, 2, (0.1, -0.2), 0.5, 254, 25, 3)], "asked again"
    beside.heard(RobotAck(TablePlace.ID, 55, 2, 255, 190, 1, Reason.BAD_VALUE))
    assert failed(first).endswith("a value is out of range")


def test_a_table_that_is_gone_answers_nothing_any_more() -> None:
    beside = Beside()
    waiting = place(beside.table, 3, (0.1, -0.2))
    beside.table.gone(LinkClosedError("sim://swarm", "unplugged"))
    assert "unplugged" in failed(waiting)
    assert "unplugged" in failed(place(beside.table, 3, (0.1, -0.2)))


def test_where_a_table_is() -> None:
    assert (table_system("mavlink"), table_system("can")) == (254, 127)
