"""What comes in lock-step comes at multiples of a span; and what is counted of the frames of many robots."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.links.gathering import GatheringLink
from firmware_protocol.links.memory import MemoryLink, SharedLink, SharedTime
from firmware_protocol.messages import Heartbeat, RobotStatus
from firmware_protocol.peer.fleets.steady import SteadyMessages
from firmware_protocol.wire.rows import rows_of_messages

if TYPE_CHECKING:
    from collections.abc import Sequence


class Ticker:
    """Says one byte at chosen control periods of 5 ms."""

    def __init__(self, *ticks: int) -> None:
        self.ticks = 0
        self._says = ticks

    def now(self) -> float:
        return self.ticks * 0.005

    def step(self, inbound: bytes) -> bytes:
        del inbound
        self.ticks += 1
        return bytes([self.ticks]) if self.ticks in self._says else b""


def test_what_comes_within_a_span_comes_together_at_its_end() -> None:
    world = Ticker(2, 3, 4, 5)
    link = GatheringLink(MemoryLink(world), world, 0.02)
    assert link.read(1.0) == bytes([2, 3, 4])
    assert world.now() == pytest.approx(0.02)
    assert link.read(1.0) == bytes([5])
    assert world.now() == pytest.approx(0.04)


def test_a_read_that_ends_before_the_span_does_gives_nothing_and_loses_nothing() -> None:
    world = Ticker(1)
    link = GatheringLink(MemoryLink(world), world, 0.02)
    assert link.read(0.01) == b""
    assert world.now() == pytest.approx(0.01)
    assert link.read(0.0) == b""
    assert link.read(0.5) == bytes([1])
    assert world.now() == pytest.approx(0.02)


def test_time_passes_in_every_read_that_is_given_any() -> None:
    world = Ticker()
    link = GatheringLink(MemoryLink(world), world, 0.02)
    assert link.read(1e-12) == b""
    assert world.ticks == 1


class TwoNetworks(Ticker):
    """Says on the second of two networks."""

    networks = 2
    period = 0.005

    def run_networks(self, inbound: Sequence[bytes], periods: int) -> list[bytes]:
        del inbound
        for _ in range(periods):
            if said := self.step(b""):
                return [b"", said]
        return []


def test_a_network_that_lags_behind_gives_at_the_end_of_the_span_what_came_in_it() -> None:
    world = TwoNetworks(3, 4)
    time = SharedTime(world)
    one, two = (GatheringLink(SharedLink(time, network, "memory:"), time.clocks[network], 0.02) for network in range(2))
    assert one.read(0.02) == b""
    assert world.now() == pytest.approx(0.02)
    assert two.read(0.02) == bytes([3, 4]), "it came within the span that has just ended"
    assert [clock.now() for clock in time.clocks] == pytest.approx([0.02, 0.02])
    assert world.now() == pytest.approx(0.02), "time that has passed for one passes for none again"


def test_bytes_that_came_before_the_link_ended_are_given_first() -> None:
    world = Ticker(1)
    inner = MemoryLink(world)
    link = GatheringLink(inner, world, 0.02)
    assert link.read(0.01) == b""
    inner.close()
    assert link.read(1.0) == bytes([1])
    with pytest.raises(LinkClosedError):
        link.read(1.0)


def test_frames_that_are_missing_late_or_come_twice_are_counted() -> None:
    steady = SteadyMessages()
    for frame in (250, 251, 254, 253, 255, 0, 0, 4):
        steady.count(7, frame, 1.0)
    assert (steady.good[7], steady.lost[7], steady.late[7]) == (8, 4, 2)
    assert steady.heard[7] == 1.0
    assert steady.good[8] == 0


def test_a_heartbeat_is_news_where_it_is_not_as_the_one_before() -> None:
    steady = SteadyMessages()
    disarmed, armed = Heartbeat(10, 0, 0, 0, 3), Heartbeat(10, 0, 128, 1, 3)
    assert [steady.note(Heartbeat, 3, said) for said in (disarmed, disarmed, armed, armed, disarmed)] == [
        True, False, True, False, True,
    ]  # fmt: skip
    rows = rows_of_messages(Heartbeat, [disarmed, armed, armed])
    assert steady.note_rows(Heartbeat, [3, 3, 4], rows) == [False, True, True]


def test_a_status_is_news_where_it_says_that_the_robot_has_restarted() -> None:
    steady = SteadyMessages()

    def status(time: float, boots: int) -> RobotStatus:
        return RobotStatus(time, 0, 0, 0, 0, 0, boots, 1, 0, 1)

    said = [status(10.0, 1), status(11.0, 1), status(10.5, 1), status(3.0, 1), status(4.0, 2), status(5.0, 2)]
    assert [steady.note(RobotStatus, 1, one) for one in said] == [True, False, False, True, True, False]
    rows = rows_of_messages(RobotStatus, said)
    assert np.flatnonzero(SteadyMessages().note_rows(RobotStatus, [1] * 6, rows)).tolist() == [0, 3, 4]
