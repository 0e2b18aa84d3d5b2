"""Emulated micro-robots with their firmware: they are told apart, moved, switched off, and the same seed does the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from swarm_bench import BOOTED, HOST, SwarmBench

import hil
from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    AutopilotVersion,
    Command,
    CommandLong,
    Heartbeat,
    ParamRequestRead,
    ParamValue,
    RobotStatus,
    SwarmObservation,
)
from firmware_protocol.vocabulary import SwarmOutcome
from firmware_protocol.wire.fields import CAN, MAVLINK

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

ALL_NETWORKS = pytest.mark.parametrize("networks", [1, 3])
BOTH_WIRES = pytest.mark.parametrize("wire", [MAVLINK, CAN])


def asked(message: type[Message], system: int = 0, count: int = 0) -> CommandLong:
    """A request for a message."""
    return CommandLong(
        system,
        ROBOT_COMPONENT,
        Command.REQUEST_MESSAGE,
        param1=float(message.ID),
        param2=float(count),
        param3=float(HOST) if count else 0.0,
    )


@BOTH_WIRES
@ALL_NETWORKS
def test_each_robot_has_its_id_its_class_and_a_board_of_its_own(networks: int, wire: str) -> None:
    bench = SwarmBench(rangers=4, wilds=2, networks=networks, wire=wire)
    bench.live(BOOTED)
    per = bench.world.settings.per
    uids, classes = set(), []
    for row in range(6):
        network, number = divmod(row, per)
        bench.say(
            asked(AutopilotVersion, number + 1),
            ParamRequestRead(number + 1, ROBOT_COMPONENT, "CLASS", -1),
            network=network,
            seconds=0.05,
        )
        (version,), (group,) = bench.of(AutopilotVersion), bench.of(ParamValue)
        assert {event.system for _, event in bench.heard if isinstance(event.message, ParamValue)} == {number + 1}
        assert version.product_id == 2
        uids.add(version.uid)
        classes.append(group.param_value)
    assert len(uids) == 6
    assert classes == [0, 0, 0, 0, 1, 1]


def test_robots_are_switched_on_one_after_the_other_within_a_second() -> None:
    bench = SwarmBench(rangers=30, wilds=0)
    bench.live(BOOTED)
    first = {event.system: event.time for _, event in reversed(bench.heard) if isinstance(event.message, Heartbeat)}
    assert set(first) == {*range(1, 31), bench.table}
    assert len({first[system] for system in range(1, 31)}) == 30


@BOTH_WIRES
def test_a_move_arrives_where_it_was_told_to_and_sees_who_is_there(wire: str) -> None:
    bench = SwarmBench(rangers=2, wilds=1, wire=wire)
    bench.live(BOOTED)
    bench.say(bench.place(1, 1, 0.0, 0.0), bench.place(2, 2, 0.15, 0.0), bench.place(3, 3, 0.0, 0.3))
    bench.open()
    bench.keep(0.1)
    bench.heard.clear()
    bench.live(0.02, bench.encode(bench.move(1, 1, np.pi / 2, 0.08)))
    bench.keep(1.2)
    seen = bench.of(SwarmObservation, 1)[0]
    assert (seen.outcome, seen.sequence) == (SwarmOutcome.ARRIVED, 1)
    assert seen.position == pytest.approx((0.0, 0.08), abs=0.01)
    assert bench.world.table.arrays.y[0] == pytest.approx(0.08, abs=0.01)
    assert seen.count == (1, 1)
    assert seen.radius == pytest.approx(0.25), "the WILD is 0.22 m away"
    assert seen.seen[0] == 0b00000100, "robot 2 stands 118 degrees to the right: in the sixth sector"


def test_all_answer_who_are_asked_at_once_and_what_they_see_is_exact() -> None:
    bench = SwarmBench(rangers=3, wilds=3, networks=2)
    bench.live(BOOTED)
    bench.open()
    bench.heard.clear()
    bench.live(0.05, {network: bench.encode(asked(SwarmObservation, count=9), network=network) for network in range(2)})
    table = bench.world.table.arrays
    for row in range(6):
        network, number = divmod(row, 3)
        (seen,) = bench.of(SwarmObservation, number + 1, network)
        assert seen.sequence == 9
        distance = np.hypot(table.x - table.x[row], table.y - table.y[row])
        inside = (distance < seen.radius) & (np.arange(6) != row)
        assert seen.count == (int(np.count_nonzero(inside[:3])), int(np.count_nonzero(inside[3:])))


def drive(bench: SwarmBench, seed: int = 5) -> list[list[SwarmObservation]]:
    """Have every robot move three times; what it observed."""
    bench.live(BOOTED)
    settings = bench.world.settings
    bench.say(bench.reset(1, seed=seed))
    for row in range(settings.count):
        network, number = divmod(row, settings.per)
        bench.say(bench.place(2 + row, number + 1, 0.06 * row - 0.2, 0.05 * (row % 2)), network=network, seconds=0.005)
    bench.open()
    bench.live(4.0 - bench.world.now())
    bench.heard.clear()
    for step in range(3):
        moves = dict.fromkeys(range(settings.networks), b"")
        for row in range(settings.count):
            network, number = divmod(row, settings.per)
            moves[network] += bench.encode(bench.move(step + 1, number + 1, 0.5 * row - step, 0.05), network=network)
        bench.live(0.01, moves)
        bench.keep(1.0)
    return [bench.of(SwarmObservation, row % settings.per + 1, row // settings.per) for row in range(settings.count)]


def test_the_same_seed_says_the_same_bytes() -> None:
    said = []
    for seed in (5, 5, 6):
        bench = SwarmBench(rangers=4, wilds=2, seed=seed)
        drive(bench, seed)
        said.append(bench.said)
    assert said[0] == said[1]
    assert said[0] != said[2]


def test_neither_networks_nor_wire_change_what_a_robot_does() -> None:
    one = SwarmBench(rangers=4, wilds=2)
    alone = drive(one)
    assert all(len(observations) >= 3 for observations in alone)
    for kind in ({"networks": 3}, {"networks": 2}):
        other = SwarmBench(rangers=4, wilds=2, **kind)
        assert drive(other) == alone
        assert other.world.table.arrays.x.tolist() == one.world.table.arrays.x.tolist()


def test_who_is_unplugged_lives_on_and_is_not_heard() -> None:
    bench = SwarmBench(rangers=2, wilds=0)
    bench.live(BOOTED)
    bench.world.unplug(0)
    bench.heard.clear()
    bench.live(2.0)
    assert not bench.of(Heartbeat, 1)
    assert bench.of(Heartbeat, 2)
    bench.world.plug(0)
    bench.live(1.1)
    status = bench.of(RobotStatus, 1)[-1]
    assert status.time > 3.0
    assert status.boot_count == 2


def test_who_has_no_power_stands_still_is_silent_and_boots_again() -> None:
    bench = SwarmBench(rangers=2, wilds=0)
    bench.live(BOOTED)
    bench.open()
    bench.live(0.02, bench.encode(bench.move(1, 1, 0.0, 1.0)))
    bench.keep(0.5)
    bench.world.switch_off(0)
    bench.keep(0.3)
    bench.heard.clear()
    x = bench.world.table.arrays.x[0]
    bench.keep(1.2)
    assert bench.world.table.arrays.x[0] == pytest.approx(x, abs=1e-4)
    assert {event.system for _, event in bench.heard} == {2, bench.table}
    bench.world.switch_on(0)
    bench.live(1.2)
    status = bench.of(RobotStatus, 1)[-1]
    assert status.boot_count == 3
    assert status.time < 1.3
    assert bench.world.table.arrays.x[0] == pytest.approx(x, abs=1e-4), "it has forgotten the move"


def test_a_dead_wheel_and_a_brownout_befall_the_first_robot() -> None:
    bench = SwarmBench(rangers=2, wilds=0, faults=FaultSpec.parse("wheel:left,brownout:4+0.5"))
    bench.live(BOOTED)
    bench.open()
    bench.live(0.02, bench.encode(bench.move(1, 1, 0.0, 0.2), bench.move(1, 2, 0.0, 0.2)))
    bench.keep(2.0)
    travel = bench.world.table.arrays.travel.reshape(2, 2)
    assert travel[0, 0] == 0.0
    assert travel[0, 1] != 0.0
    assert travel[1] == pytest.approx([0.2, 0.2], abs=0.03)
    bench.heard.clear()
    bench.live(3.0)
    assert [status.boot_count for status in bench.of(RobotStatus, 1)][-1] == 3
    assert [status.boot_count for status in bench.of(RobotStatus, 2)][-1] == 2


def test_without_a_fix_of_its_own_a_robot_waits_for_one() -> None:
    bench = SwarmBench(rangers=1, wilds=0, fixes=False)
    bench.live(BOOTED, b"")
    bench.say(asked(SwarmObservation, 1, 3), seconds=0.05)
    assert bench.of(SwarmObservation)[0].fix_age is None
    bench = SwarmBench(rangers=1, wilds=0)
    bench.live(BOOTED)
    bench.say(asked(SwarmObservation, 1, 3), seconds=0.05)
    age = bench.of(SwarmObservation)[0].fix_age
    assert age is not None
    assert age <= 0.055


@pytest.mark.parametrize("aside", [-0.2, 0.0, 0.010, 0.015, 0.021, 0.023])
def test_a_ring_that_grows_counts_all_within_the_radius_that_it_grew_to(aside: float) -> None:
    with hil.connect_swarm("sim://swarm?rangers=1&wilds=2&noise=none") as swarm:
        first, second, third = swarm.robots
        swarm.reset_table(1, (2.0, 2.0))
        nearest = (0.1, 0.2) if aside < 0 else (0.25, aside)
        swarm.place({first: (0.0, 0.0, 0.0), second: (*nearest, 0.0), third: (0.0, -0.29, 0.0)})
        swarm.sense(radius=0.25, increment=0.05)
        seen = swarm.observe()
        assert seen.radius[0] == pytest.approx(0.25 if aside < 0 else 0.3)
        assert seen.count[0].tolist() == [0, 1 if aside < 0 else 2]
