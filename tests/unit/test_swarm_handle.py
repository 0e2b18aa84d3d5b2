"""The swarm handle against scripted robots: rounds, losses, who is missing, who comes back."""

from __future__ import annotations

import numpy as np
import pytest
from held_swarm import connect
from scripted_swarm import swarm_of

from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.messages import Reason, RobotAck, RobotSession, SwarmMove, SwarmObservation
from firmware_protocol.vocabulary import Move, MoveOption, RobotClass, SwarmOutcome
from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.bridge.fleet_bridge import FleetBridge
from hil.bridge.networks import Networks, RobotAddress
from hil.swarm.connecting import open_fleet
from hil.swarm.errors import DoubleIdError, QuorumError
from hil.swarm.handle import Swarm
from hil.swarm.rounds import SwarmMoves


@pytest.mark.parametrize("wire", [MAVLINK, CAN])
def test_a_round_of_moves_brings_what_every_robot_observed(wire: str) -> None:
    world = swarm_of(25, 8, wire=wire)
    with connect(world) as swarm:
        assert [address.system for address in swarm.addresses_by_row] == list(range(1, 34))
        assert swarm.kinds.tolist() == [RobotClass.RANGER] * 25 + [RobotClass.WILD] * 8
        swarm.arm()
        swarm.sense(radius=0.3, increment=0.05)
        seen = swarm.observe()
        assert seen.there.all()
        assert not seen.missing
        assert seen.near[0].tolist() == [0, 0x81]
        done = swarm.move({1: Move(0.08, heading=0.0), 30: Move(0.04, sector=1, sectors=8)})
        assert done.outcome[[0, 29]].tolist() == [SwarmOutcome.ARRIVED] * 2
        assert done.there.sum() == done.asked.sum() == 2
        assert done.position[0].tolist() == [0.08, 0.0]
        assert done.radius_before[0] == pytest.approx(0.3)
        assert np.isnan(done.heading[5])
        assert [len(robot.performed) for robot in world.robots] == [1] + [0] * 28 + [1] + [0] * 3
    assert not any(robot.armed for robot in world.robots)


def test_nobody_is_asked_twice_on_a_good_line() -> None:
    world = swarm_of(33)
    with connect(world) as swarm:
        swarm.arm()
        swarm.observe()
        swarm.move(SwarmMoves(np.ones(33, bool), 0.08, heading=1.0))
        for robot in world.robots:
            assert sum(isinstance(one, SwarmMove) for one in robot.heard) == 1
            asked = [one for one in robot.heard if getattr(one, "param1", 0) == SwarmObservation.ID]
            assert len(asked) == 1


def test_who_is_silent_is_missing_and_takes_part_again_from_the_round_after_it_was_heard() -> None:
    world = swarm_of(4)
    with connect(world, quorum=0.25) as swarm:
        swarm.arm()
        swarm.sense(radius=0.4)
        world.robots[2].silent = True
        first = swarm.observe()
        assert [address.system for address in first.missing] == [3]
        assert first.there.tolist() == [True, True, False, True]
        second = swarm.move(SwarmMoves(np.ones(4, bool), 0.02, heading=0.0))
        assert second.asked.tolist() == [True, True, False, True]
        assert not second.missing
        world.robots[2].silent = False
        world.robots[2].reboot()
        world.robots[2].radius = 0.2
        swarm.wait(3.0)
        assert swarm.there.all()
        assert world.robots[2].armed
        assert world.robots[2].radius == pytest.approx(0.4)
        third = swarm.move(SwarmMoves(np.ones(4, bool), 0.02, heading=0.0))
        assert third.there.all()


def test_a_move_is_performed_once_on_a_line_that_loses_frames() -> None:
    world = swarm_of(6, 2)
    chance = np.random.default_rng(1)
    with connect(world, quorum=0.0) as swarm:
        swarm.arm()
        world.lose = lambda _: bool(chance.random() < 0.1)
        accepted = np.zeros(8, np.int64)
        for _ in range(20):
            swarm.observe()
            done = swarm.move(SwarmMoves(np.ones(8, bool), 0.02, heading=0.0))
            accepted += done.there
        assert accepted.sum() > 150
        assert [len(robot.performed) for robot in world.robots] >= accepted.tolist()
        for robot in world.robots:
            assert len(set(robot.performed)) == len(robot.performed)


def test_a_refused_move_names_its_reason_and_the_robot_is_not_missing() -> None:
    world = swarm_of(2)
    with connect(world) as swarm:
        swarm.arm()
        world.robots[1].refuse[SwarmMove] = Reason.BAD_VALUE
        done = swarm.move(SwarmMoves(np.ones(2, bool), 0.02, heading=0.0))
        (address,) = done.refused
        assert (address.system, done.refused[address]) == (2, Reason.BAD_VALUE)
        assert done.reason.tolist() == [0, Reason.BAD_VALUE]
        assert not done.missing
        assert swarm.there.all()


def test_an_observation_whose_acknowledgement_was_lost_ends_the_move() -> None:
    world = swarm_of(1)
    with connect(world) as swarm:
        swarm.arm()
        world.robots[0].mute = lambda message: isinstance(message, RobotAck)
        done = swarm.move({1: Move(0.02, heading=0.0)})
        assert done.there.all()
        assert len(world.robots[0].performed) == 1


def test_ranges_come_with_the_observation() -> None:
    world = swarm_of(2)
    with connect(world) as swarm:
        swarm.arm()
        options = MoveOption.SENSE | MoveOption.RANGES
        done = swarm.move({1: Move(0.02, heading=0.0, options=options)})
        assert done.ranges[0].tolist() == [0.5] * 32
        assert np.isnan(done.ranges[1]).all()


def test_too_few_of_a_class_end_the_mission() -> None:
    world = swarm_of(4, 2)
    with connect(world) as swarm:
        for robot in world.robots[4:]:
            robot.silent = True
        assert len(swarm.observe().missing) == 2
        with pytest.raises(QuorumError, match="0 WILDs are there, and at least 1 must be"):
            swarm.observe()


def test_a_robot_with_a_flat_battery_is_missing_until_it_is_charged() -> None:
    world = swarm_of(3)
    with connect(world) as swarm:
        world.robots[0].flat = True
        swarm.wait(1.1)
        swarm.observe()
        assert swarm.there.tolist() == [False, True, True]
        world.robots[0].flat = False
        swarm.wait(1.1)
        swarm.observe()
        assert swarm.there.all()


def test_several_networks_have_their_rows_in_the_order_of_the_links() -> None:
    worlds = [swarm_of(2, 1), swarm_of(1), swarm_of(0, 2)]
    with connect(*worlds) as swarm:
        assert swarm.addresses_by_row == tuple(
            RobotAddress(f"memory:{network}", system) for network, system in [(1, 1), (1, 2), (1, 3), (2, 1), (3, 1), (3, 2)]
        )
        assert swarm.kinds.tolist() == [0, 0, 1, 0, 1, 1]
        swarm.arm()
        assert swarm.observe().there.all()
        done = swarm.move(SwarmMoves(np.ones(6, bool), 0.04, heading=0.5))
        assert done.there.all()
        assert [robot.performed != [] for world in worlds for robot in world.robots] == [True] * 6


def test_two_robots_with_one_id_are_noticed() -> None:
    world = swarm_of(2)
    world.robots.append(type(world.robots[0])(2, uid=999))
    with pytest.raises(DoubleIdError, match="two robots answer as robot 2"):
        connect(world, expect=2)


def test_an_emergency_stop_reaches_all_and_is_confirmed() -> None:
    world = swarm_of(5)
    with connect(world) as swarm:
        swarm.arm()
        world.robots[3].mute = lambda _: True
        answers = swarm.stop()
        assert all(robot.stopped for robot in world.robots)
        assert [address.system for address in answers.errors] == [4]


def test_a_table_places_robots_and_is_set_up_anew() -> None:
    worlds = [swarm_of(3), swarm_of(2)]
    with connect(*worlds) as swarm:
        assert swarm.has_table
        swarm.reset_table(7, (2.0, 2.0))
        addresses = swarm.addresses_by_row
        assert not swarm.place({address: (0.1 * row, 0.5, 1.0) for row, address in enumerate(addresses)})
        assert swarm.observe().position.tolist() == [[0.0, 0.5], [0.1, 0.5], [0.2, 0.5], [0.3, 0.5], [0.4, 0.5]]
    assert [len(world.resets) for world in worlds] == [1, 0]


def test_who_watches_opens_no_session_and_is_answered() -> None:
    world = swarm_of(2)
    networks = Networks()
    link = MemoryLink(world, "memory:1")
    networks.add("memory:1", FleetBridge(link, world, fleet=open_fleet(None), open_sessions=False))
    with Swarm(networks) as swarm:
        swarm.find(expect=2)
        assert swarm.observe().there.all()
    assert not any(isinstance(message, RobotSession) for robot in world.robots for message in robot.heard)
    assert world.robots[0].before == world.robots[0].radius


def test_a_robot_that_restarts_in_a_round_takes_part_in_the_next() -> None:
    world = swarm_of(3)
    with connect(world) as swarm:
        swarm.arm()
        world.robots[1].deaf = lambda message: isinstance(message, SwarmMove)
        world.robots[1].reboot()
        done = swarm.move(SwarmMoves(np.ones(3, bool), 0.3, heading=0.0))
        assert [address.system for address in done.missing] == [2]
        world.robots[1].deaf = lambda _: False
        assert swarm.move(SwarmMoves(np.ones(3, bool), 0.02, heading=0.0)).there.all()


def test_the_same_round_takes_as_long_on_one_network_as_on_three() -> None:
    seconds = []
    for worlds in ([swarm_of(6)], [swarm_of(2), swarm_of(2), swarm_of(2)]):
        with connect(*worlds) as swarm:
            swarm.arm()
            swarm.wait(2.0 - swarm.now())
            seconds.append(
                [
                    one.seconds
                    for _ in range(3)
                    for one in (swarm.observe(), swarm.move(SwarmMoves(np.ones(6, bool), 0.0375, heading=0.0)))
                ]
            )
    assert seconds[0] == pytest.approx(seconds[1])


def test_the_deadline_ends_a_round() -> None:
    world = swarm_of(2)
    with connect(world) as swarm:
        swarm.arm()
        world.robots[1].mute = lambda message: isinstance(message, SwarmObservation)
        done = swarm.move(SwarmMoves(np.ones(2, bool), 0.02, heading=0.0), deadline=0.7)
        assert done.seconds == pytest.approx(0.7, abs=0.006)
        assert [address.system for address in done.missing] == [2]
