"""Whole control periods of micro-robots on a table: firmware, senses, wheels, and what they say."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    Command,
    CommandLong,
    ParamSet,
    RobotAck,
    RobotAlive,
    RobotSession,
    SwarmMove,
    SwarmObservation,
    SwarmRanges,
    SwarmSense,
)
from firmware_protocol.vocabulary import MoveOption, SwarmOutcome
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.boards import board_host
from simdevice.kernel.swarm_loop import FULL, MOST_SAID, REBOOTED, SAID, SPARE_PERIODS, SwarmLoop
from simdevice.swarm.profile import PROFILES
from simdevice.swarm.table import SwarmTable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.fields import Message

HOST = 77
SENSE = int(MoveOption.SENSE)


class Party:
    """Robots on a table, and their host."""

    def __init__(self, groups: Sequence[int], *, noise: str = "none", ring: bool = True, period: float = 0.005) -> None:
        self.table = SwarmTable(groups, profile=PROFILES[noise], period=period)
        self.loop = SwarmLoop(board_host(), self.table, ring=ring)
        for row, group in enumerate(groups):
            self.loop.store(row, SYS_ID=row + 1, CLASS=group)
        self._hosts = [MavlinkCodec(system=255, component=190) for _ in groups]
        self._ears = [MavlinkCodec(system=255, component=190) for _ in groups]
        self.raw: list[tuple[int, int, bytes]] = []
        self.heard: list[tuple[int, Message]] = []
        self.rows = range(len(groups))

    def say(self, row: int, *messages: Message) -> None:
        """Let one hear this in the next period."""
        self.loop.hear(row, b"".join(self._hosts[row].encode(message) for message in messages))

    def live(self, periods: int) -> None:
        """Live for so many periods, heard every 40 ms."""
        while periods > 0:
            for row in self.rows:
                self.say(row, RobotAlive(HOST))
            done = self.loop.run(min(periods, 8))
            periods -= done
            self.listen()

    def listen(self) -> None:
        """Take what has been said."""
        for row, period, data in self.loop.words():
            self.raw.append((row, period, data))
            self.heard += [(row, e.message) for e in self._ears[row].receive(data, 0.0) if isinstance(e, Received)]

    def armed(self) -> Party:
        """Switch on, open sessions, arm."""
        self.loop.power_on()
        self.live(2)
        for row in self.rows:
            arm = CommandLong(row + 1, 1, command=int(Command.ARM_DISARM), param1=1.0, param3=HOST)
            self.say(row, RobotSession(1, 0, HOST, row + 1, 1, 2, 1), arm)
        self.live(2)
        self.heard.clear()
        return self

    def move(self, row: int, heading: float, distance: float, options: int = SENSE, sequence: int = 1) -> None:
        """Send one somewhere."""
        self.say(row, SwarmMove(1, sequence, heading, distance, None, 0.0, row + 1, 1, 0, 0, 0, options))

    def got(self, row: int, kind: type[Message]) -> list[Message]:
        """What one has said of a kind."""
        return [message for who, message in self.heard if who == row and type(message) is kind]


def test_robots_move_and_tell_where_they_are() -> None:
    party = Party([0, 0, 1]).armed()
    places = [(0.0, 0.0), (0.5, 0.5), (-0.5, 0.5)]
    for row, place in enumerate(places):
        party.table.place(row, *place, 0.0)
        party.move(row, 1.0 + row, 0.1)
    party.live(300)
    for row, (x, y) in enumerate(places):
        heading = 1.0 + row
        observation = party.got(row, SwarmObservation)[0]
        assert isinstance(observation, SwarmObservation)
        assert observation.outcome == SwarmOutcome.ARRIVED
        there = (x + 0.1 * math.cos(heading), y + 0.1 * math.sin(heading))
        assert math.dist((party.table.arrays.x[row], party.table.arrays.y[row]), there) < 0.005
        assert observation.position == pytest.approx(there, abs=0.005)


def test_the_ring_finds_the_others_where_they_stand() -> None:
    party = Party([0, 1, 0]).armed()
    party.table.place(0, 0.0, 0.0, 0.0)
    party.table.place(1, 0.0, 0.3, 0.0)
    party.table.place(2, -0.1, 0.0, 0.0)
    party.move(0, 0.0, 0.0)
    party.live(10)
    (observation,) = party.got(0, SwarmObservation)
    assert isinstance(observation, SwarmObservation)
    assert observation.radius == 0.35
    assert observation.count == (1, 1)
    assert observation.near == (0b0000_1000, 0)
    assert observation.seen[1] in {0b0010_0000, 0b0100_0000}


def test_ranges_box_and_goal() -> None:
    party = Party([0])
    party.table.reset(1, box="cylinder", wall=True)
    party.table.place_goal(0.0, 0.5)
    party.armed()
    party.table.place(0, 0.5, 0.0, 0.0)
    party.say(0, SwarmSense(1, 1, 0.2, 0.0, 65.535, 1, 1, 8, 4))
    party.move(0, 0.0, 0.0, SENSE | MoveOption.RANGES, sequence=2)
    party.live(10)
    (observation,), (ranges,) = party.got(0, SwarmObservation), party.got(0, SwarmRanges)
    assert isinstance(observation, SwarmObservation)
    assert isinstance(ranges, SwarmRanges)
    assert abs(observation.box_bearing or 0.0) == pytest.approx(math.pi, abs=0.001)
    assert observation.box_distance == pytest.approx(0.42)
    assert observation.goal_bearing == pytest.approx(3 * math.pi / 4, abs=0.001)
    assert ranges.ranges[:4] == pytest.approx((0.5, 1.0, 0.42, 1.0))
    assert ranges.robots == 0


def test_contact_effort_and_class_are_the_firmwares() -> None:
    party = Party([0, 0]).armed()
    party.table.place(0, 0.0, 0.0, 0.0)
    party.table.place(1, 0.0605, 0.0, 0.0)
    party.say(0, ParamSet(1, 1, "CONTACT_GAP", 0.015), ParamSet(1, 1, "CLASS", 1))
    party.live(2)
    assert (party.table.arrays.gap[0], party.table.arrays.gap[1]) == (0.015, 0.002)
    assert list(party.table.arrays.group) == [1, 0]
    party.say(0, SwarmMove(1, 1, 0.0, 0.3, None, 0.0, 1, 1, 0, 0, 40, int(MoveOption.STOP_ON_CONTACT)))
    party.live(2)
    assert party.table.arrays.effort[0] == 0.4
    party.live(100)
    (observation,) = party.got(0, SwarmObservation)[:1]
    assert isinstance(observation, SwarmObservation)
    assert observation.outcome == SwarmOutcome.BLOCKED
    assert 0.003 < party.table.arrays.x[0] < 0.012


def test_one_that_is_switched_off_stands_and_says_nothing() -> None:
    party = Party([0, 0]).armed()
    party.move(0, 0.0, 1.0)
    party.move(1, 0.0, 1.0)
    party.live(200)
    party.loop.power_off(1)
    party.raw.clear()
    party.live(400)
    assert {row for row, _, _ in party.raw} == {0}
    assert party.table.arrays.vx[1] == pytest.approx(0.0, abs=1e-6)


def test_it_stops_where_somebody_has_said_something_or_booted_again() -> None:
    party = Party([0]).armed()
    party.live(100)
    assert party.loop.run(1000, SAID) < 300
    assert party.loop.stop == SAID
    party.say(0, CommandLong(1, 1, command=int(Command.PREFLIGHT_REBOOT), param1=1.0))
    assert party.loop.run(1000, REBOOTED) < 10
    assert (party.loop.stop, party.loop.rebooted[0]) == (REBOOTED, 1)
    assert party.loop.run(3) == 3
    assert party.loop.stop == 0


def test_words_never_find_no_room() -> None:
    party = Party([0])
    party.loop.power_on()
    party.loop.struct.said_size = MOST_SAID + 10
    assert party.loop.run(1000) < 1000
    assert party.loop.stop == FULL
    assert SPARE_PERIODS > 1


def test_the_same_seed_says_the_same() -> None:
    def run() -> tuple[list[tuple[int, int, bytes]], list[float]]:
        party = Party([0, 1] * 4, noise="default")
        party.table.reset(5)
        party.armed()
        for row in party.rows:
            party.move(row, row * 0.4, 0.2)
        party.live(400)
        return party.raw, party.table.arrays.x.tolist()

    assert run() == run()


def test_a_robot_without_a_ring_reads_none() -> None:
    party = Party([0, 1], ring=False, period=0.01).armed()
    party.move(0, 0.0, 0.0)
    party.live(5)
    (observation,) = party.got(0, SwarmObservation)
    assert isinstance(observation, SwarmObservation)
    assert observation.count == (0, 0)
    assert np.all(party.table.arrays.effort == 1.0)
    assert party.loop.nvm(0) != b"\xff" * 1024
    assert not party.got(1, RobotAck)
