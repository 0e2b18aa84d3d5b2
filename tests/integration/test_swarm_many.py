"""Many robots: all are found, armed and moved in a few seconds, and a slow line carries what all of them observe."""

from __future__ import annotations

import numpy as np
import pytest
from served_swarm import served_swarm

from firmware_protocol.vocabulary import MoveOption, SwarmOutcome
from hil.swarm.connecting import connect_swarm
from hil.swarm.rounds import SwarmMoves
from simdevice.swarm.settings import SwarmSettings

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


def test_what_33_robots_observe_comes_over_a_slow_line_and_nobody_is_asked_twice() -> None:
    with (
        served_swarm(SwarmSettings(rangers=25, wilds=8), "pty:115200") as robots,
        connect_swarm(*robots.urls, expect=33, timeout=15.0) as swarm,
    ):
        assert not swarm.arm().errors
        for _ in range(3):
            assert swarm.observe().there.all()
        assert robots.asked == [(1, 0)] * 3
