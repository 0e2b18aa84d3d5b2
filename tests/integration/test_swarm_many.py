"""Many robots: all are found, armed and moved in a few seconds, and a slow line carries what all of them observe."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

import numpy as np
import pytest
from quiet_tap import QuietTap
from served_swarm import served_swarm

from firmware_protocol.events import Received, Rejected
from firmware_protocol.messages import CommandLong, SwarmObservation
from firmware_protocol.peer.exchanges.exchange import Retry
from firmware_protocol.vocabulary import MoveOption, SwarmOutcome
from hil.swarm.connecting import connect_swarm
from hil.swarm.rounds import SwarmMoves
from simdevice.swarm.settings import SwarmSettings

if TYPE_CHECKING:
    from firmware_protocol.wire.batch import Arrivals
    from firmware_protocol.wire.fields import Message

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(("count", "networks"), [(253, 1), (1000, 4)])
def test_as_many_as_networks_take_are_found_armed_and_moved_within_five_seconds(count: int, networks: int) -> None:
    with connect_swarm(f"sim://swarm?rangers={count}&wilds=0&networks={networks}") as swarm:
        assert len(swarm.addresses_by_row) == count
        assert swarm.there.all()
        assert not swarm.arm().errors
        done = swarm.move(SwarmMoves(np.ones(count, bool), 0.04, heading=0.0, options=int(MoveOption.BODY)))
        assert swarm.now() <= 5.0
        assert done.there.all()
        assert (done.outcome == SwarmOutcome.ARRIVED).all()
        assert done.travelled == pytest.approx(np.full(count, 0.04), abs=0.01)


class AskedAgain(QuietTap):
    """Takes down who was asked again, one by one, although an answer had come within the time after which one asks again."""

    def __init__(self) -> None:
        self.answered = -inf
        self.asked_all = 0
        self.too_soon: list[int] = []

    def received(self, event: Received | Rejected) -> None:
        if isinstance(event, Received) and isinstance(event.message, SwarmObservation):
            self.answered = max(self.answered, event.time)

    def arrived(self, came: Arrivals) -> None:
        for event in came.objects():
            self.received(event)

    def sent(self, time: float, message: Message) -> None:
        if isinstance(message, CommandLong) and message.param1 == SwarmObservation.ID:
            if not message.target_system:
                self.asked_all += 1
            elif time < self.answered + Retry().first:
                self.too_soon.append(message.target_system)


def test_what_33_robots_observe_comes_over_a_slow_line_and_nobody_is_asked_again_while_it_carries_answers() -> None:
    """A machine that stops for a while may have somebody asked again, and rightly."""
    tap = AskedAgain()
    with (
        served_swarm(SwarmSettings(rangers=25, wilds=8), "pty:115200") as robots,
        connect_swarm(*robots.urls, expect=33, timeout=15.0, taps=[tap]) as swarm,
    ):
        assert not swarm.arm().errors
        for _ in range(3):
            assert swarm.observe().there.all()
    assert tap.asked_all == 3
    assert not tap.too_soon
