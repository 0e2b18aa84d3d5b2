"""The table on the wire: TABLE_RESET and TABLE_PLACE are done once, refused where they can't be, and TABLE_STATE tells."""

from __future__ import annotations

import pytest
from swarm_bench import BOOTED, SwarmBench

from firmware_protocol.messages import (
    TABLE_COMPONENT,
    AckResult,
    BoxShape,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    Reason,
    RobotAck,
    TableKind,
    TablePlace,
    TableReset,
    TableState,
)
from firmware_protocol.wire.fields import CAN, MAVLINK


@pytest.fixture
def bench() -> SwarmBench:
    bench = SwarmBench(rangers=3, wilds=1, networks=2)
    bench.live(BOOTED)
    return bench


def answer(bench: SwarmBench, *messages: TableReset | TablePlace, network: int = 0) -> tuple[AckResult, Reason]:
    """What the table says to the last of some messages."""
    bench.say(*messages, network=network)
    acks = bench.of(RobotAck, bench.table, network)
    assert len(acks) == len(messages)
    assert acks[-1].message == messages[-1].ID
    assert acks[-1].sequence == messages[-1].sequence
    return AckResult(acks[-1].result), Reason(acks[-1].reason)


DONE = (AckResult.ACCEPTED, Reason.NONE)
BAD = (AckResult.REFUSED, Reason.BAD_VALUE)
OLD = (AckResult.REFUSED, Reason.OLD_SEQUENCE)


@pytest.mark.parametrize("wire", [MAVLINK, CAN])
def test_it_says_five_times_a_second_what_is_to_be_seen_on_every_network(wire: str) -> None:
    bench = SwarmBench(rangers=3, wilds=1, networks=2, wire=wire)
    bench.live(2.0)
    for network in range(2):
        assert len(bench.of(TableState, bench.table, network)) == 10
        assert len(bench.of(Heartbeat, bench.table, network)) == 2


def test_a_robot_is_picked_up_and_put_there_by_its_own_network(bench: SwarmBench) -> None:
    assert answer(bench, bench.place(1, 2, 0.5, -0.25, 1.0), network=1) == DONE
    arrays = bench.world.table.arrays
    assert (arrays.x[3], arrays.y[3], arrays.angle[3]) == pytest.approx((0.5, -0.25, 1.0))
    assert answer(bench, bench.place(2, 2, 0.4, -0.3)) == DONE
    assert (arrays.x[1], arrays.y[1]) == pytest.approx((0.4, -0.3))


def test_nobody_is_put_who_is_not_there(bench: SwarmBench) -> None:
    assert answer(bench, bench.place(1, 3, 0.0, 0.0)) == BAD
    assert answer(bench, bench.place(2, 0, 0.0, 0.0)) == BAD, "there is no box"


def test_box_and_goal_are_the_first_network_s(bench: SwarmBench) -> None:
    boxed = bench.reset(1, kind=TableKind.BOX, box=BoxShape.CUBE)
    assert answer(bench, boxed, network=1) == BAD
    assert answer(bench, boxed) == DONE
    assert answer(bench, bench.place(2, 0, 0.3, 0.4, 0.5), network=1) == BAD
    assert answer(bench, bench.place(2, 255, 0.3, 0.4), network=1) == BAD
    assert answer(bench, bench.place(2, 0, 0.3, 0.4, 0.5)) == DONE
    assert answer(bench, bench.place(3, 255, -0.3, 0.1)) == DONE
    for network in range(2):
        state = bench.of(TableState, network=network)[-1]
        assert state.box == pytest.approx((0.3, 0.4))
        assert state.box_heading == pytest.approx(0.5, abs=1e-3)
        assert state.goal == pytest.approx((-0.3, 0.1))
        assert state.resets == 1


@pytest.mark.parametrize(
    "wanted",
    [
        {"kind": TableKind.BOX},
        {"box": BoxShape.CUBE},
        {"kind": TableKind.OBSTACLES},
        {"kind": TableKind.OBSTACLES, "map": 4},
        {"map": 1},
        {"size": (0.0, 2.0)},
        {"size": (0.0, 0.0)},
        {"size": (0.1, 0.1), "wall": 1},
    ],
)
def test_what_can_t_be_set_up_is_refused_and_changes_nothing(bench: SwarmBench, wanted: dict[str, object]) -> None:
    bench.say(bench.place(1, 1, 0.7, 0.7))
    assert answer(bench, bench.reset(2, **wanted)) == BAD
    bench.live(0.25)
    assert bench.of(TableState)[-1].resets == 0
    assert bench.world.table.arrays.x[0] == pytest.approx(0.7)


def test_a_message_that_comes_twice_is_answered_twice_and_done_once(bench: SwarmBench) -> None:
    reset = bench.reset(1)
    assert answer(bench, reset, reset) == DONE
    bench.live(0.25)
    assert bench.of(TableState)[-1].resets == 1
    assert answer(bench, bench.reset(2, size=(0.0, 1.0)), bench.reset(2, size=(0.0, 1.0))) == BAD


def test_messages_about_different_things_may_pass_each_other(bench: SwarmBench) -> None:
    assert answer(bench, bench.place(9, 1, 0.5, 0.5)) == DONE
    assert answer(bench, bench.place(8, 2, 0.6, 0.5)) == DONE
    assert answer(bench, bench.place(7, 1, 0.0, 0.0)) == OLD
    assert answer(bench, bench.reset(6)) == OLD
    assert answer(bench, bench.reset(10)) == DONE
    assert answer(bench, bench.place(5, 2, 0.0, 0.0)) == OLD
    assert answer(bench, bench.place(65535, 2, 0.0, 0.0)) == OLD, "half of all numbers are behind"


def test_who_is_picked_up_turns_no_wheel(bench: SwarmBench) -> None:
    arrays = bench.world.table.arrays
    arrays.travel[:] = 1.5
    bench.say(bench.reset(1), bench.place(2, 1, 0.3, 0.3))
    assert arrays.counted.tolist() == [1_500_000] * 8
    assert arrays.travel.tolist() == [0.0] * 8, "what encoders count goes on from a whole count, whatever was before"
    arrays.travel[:] = -0.5
    bench.say(bench.reset(3))
    assert arrays.counted.tolist() == [1_000_000] * 8


@pytest.mark.parametrize(
    ("command", "message", "result"),
    [
        (Command.REQUEST_MESSAGE, TableState.ID, CommandResult.ACCEPTED),
        (Command.REQUEST_MESSAGE, Heartbeat.ID, CommandResult.DENIED),
        (Command.ARM_DISARM, 1, CommandResult.UNSUPPORTED),
    ],
)
def test_standard_commands(bench: SwarmBench, command: Command, message: int, result: CommandResult) -> None:
    bench.live(0.2 - bench.world.now() % 0.2 + 0.03)  # not when one is due
    bench.say(CommandLong(bench.table, TABLE_COMPONENT, command, param1=float(message)))
    (ack,) = bench.of(CommandAck, bench.table)
    assert (ack.command, ack.result) == (command, result)
    assert len(bench.of(TableState, network=0)) == (result is CommandResult.ACCEPTED)


def test_its_state_can_be_had_more_often(bench: SwarmBench) -> None:
    bench.say(
        CommandLong(bench.table, TABLE_COMPONENT, Command.SET_MESSAGE_INTERVAL, param1=float(TableState.ID), param2=50_000.0),
        seconds=0.3,
    )
    bench.heard.clear()
    bench.live(1.0)
    assert len(bench.of(TableState, network=0)) == 20
    assert len(bench.of(TableState, network=1)) == 5


def test_a_touch_is_told_at_once() -> None:
    bench = SwarmBench(rangers=2, wilds=0)
    bench.live(BOOTED)
    bench.say(bench.reset(1, kind=TableKind.BOX, box=BoxShape.CYLINDER), bench.place(2, 2, -0.2, 0.0), seconds=0.21)
    begun = bench.world.now()
    bench.say(bench.place(3, 2, -0.101, 0.0), seconds=0.005)
    bench.live(0.02)
    told = [event.time for _, event in bench.heard if isinstance(event.message, TableState) and event.message.contacts == 2]
    assert told
    assert told[0] - begun <= 0.0101


def test_who_has_not_been_placed_since_the_reset_is_in_nobody_s_way() -> None:
    bench = SwarmBench(rangers=3, wilds=0)
    bench.live(BOOTED)
    arrays = bench.world.table.arrays
    bench.say(bench.reset(1))
    x, y = arrays.x[2], arrays.y[2]
    bench.say(bench.place(2, 1, x + 0.01, y), seconds=0.5)
    assert (arrays.x[0], arrays.y[0]) == pytest.approx((x + 0.01, y), abs=1e-4)
    bench.say(bench.place(3, 3, x + 0.015, y), seconds=0.3)
    assert arrays.x[2] - arrays.x[0] > 0.02, "both have been placed: they push each other away"
    bench.say(bench.place(4, 2, arrays.x[0], arrays.y[0] + 0.2), bench.reset(5))
    x, y = arrays.x[2], arrays.y[2]
    bench.say(bench.place(6, 1, x + 0.01, y), seconds=1.5)
    assert arrays.x[0] - x > 0.02, "after a second all are solid"
