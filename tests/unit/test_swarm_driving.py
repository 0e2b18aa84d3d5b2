"""Who is dealt which place: the longest way is as short as it can be."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from hil.swarm.driving import deal


@pytest.mark.parametrize("seed", range(20))
def test_the_longest_way_is_the_shortest_of_all_ways_to_deal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    at, places = rng.uniform(-1, 1, (5, 2)), rng.uniform(-1, 1, (5, 2))
    ways = np.linalg.norm(at[:, None, :] - places[None, :, :], axis=2)
    dealt = deal(at, places)
    assert sorted(dealt.tolist()) == list(range(5))
    assert ways[range(5), dealt].max() == min(
        max(ways[row, place] for row, place in enumerate(one)) for one in permutations(range(5))
    )


def test_a_robot_that_nobody_knows_the_place_of_gets_what_is_left() -> None:
    at = np.array([[np.nan, np.nan], [0.0, 0.0]])
    assert deal(at, np.array([[0.1, 0.0], [5.0, 0.0]])).tolist() == [1, 0]
    assert deal(np.zeros((0, 2)), np.zeros((0, 2))).tolist() == []
