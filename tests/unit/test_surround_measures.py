"""What is measured of a run of the surround task, on examples whose figures are known."""

from __future__ import annotations

from math import cos, nan, radians, sin

import numpy as np
import pytest

from pal_advisor.surround.measures import (
    behaviour_frequency,
    dominance,
    macro_stable,
    mean_distance,
    periodic,
    pushed,
    ranger_distance,
    settle_step,
    share_outside,
    share_surrounded,
    stimuli_met,
    stimulus_frequency,
    turns,
    way,
)

NOBODY = np.empty((0, 2))
CORNERS = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]])


def test_frequencies_count_robots_step_by_step() -> None:
    """Eq. 7.2 and 7.4; 0 is nobody there, or a robot that stays."""
    stimuli = np.array([[1, 2, 2], [0, 30, 1]])
    counts = stimulus_frequency(stimuli, 8)
    assert counts.shape == (2, 30)
    assert counts[0, :3].tolist() == [1, 2, 0]
    assert (counts[1, 0], counts[1, 29], counts[1].sum()) == (1, 1, 2)
    assert behaviour_frequency(np.array([8, 8, 0, 1]), 8).tolist() == [1, 0, 0, 0, 0, 0, 0, 2]
    assert stimuli_met(stimuli) == 3


def test_frequencies_of_nobody_are_0() -> None:
    assert behaviour_frequency(np.empty((3, 0), dtype=np.int64), 4).tolist() == [[0] * 4] * 3
    assert behaviour_frequency(np.empty(0, dtype=np.int64), 2).tolist() == [0, 0]
    assert stimulus_frequency(np.empty((0, 5), dtype=np.int64), 8).shape == (0, 30)
    assert stimuli_met(np.zeros((2, 2), dtype=np.int64)) == 0


def test_distances() -> None:
    wilds = np.array([[0.0, 1.0], [3.0, 2.0]])
    assert mean_distance(CORNERS, wilds) == pytest.approx((1 + 2 + 3) / 3)
    assert ranger_distance(CORNERS) == pytest.approx((3 + 4 + 5) / 3)


def test_who_is_nowhere_is_left_out() -> None:
    lost = np.array([[nan, nan], [0.0, 1.0]])
    assert mean_distance(CORNERS[:1], lost) == 1.0
    assert mean_distance(lost, CORNERS[:1]) == 1.0
    assert ranger_distance(np.concatenate((lost[:1], CORNERS))) == pytest.approx(4.0)
    assert share_outside(lost, (1.0, 4.0)) == 0.0


def test_nothing_is_measured_of_nobody() -> None:
    assert mean_distance(NOBODY, CORNERS) is None
    assert mean_distance(CORNERS, NOBODY) is None
    assert share_surrounded(NOBODY, CORNERS, 1.0) is None
    assert share_surrounded(CORNERS, NOBODY, 1.0) is None
    assert ranger_distance(CORNERS[:1]) is None
    assert share_outside(NOBODY, (1.0, 1.0)) is None


def test_three_rangers_within_the_radius_surround() -> None:
    wilds = np.array([[1.0, 1.0], [20.0, 0.0]])
    assert share_surrounded(CORNERS, wilds, 3.5) == 0.5
    assert share_surrounded(CORNERS, wilds, np.hypot(1.0, 3.0)) == 0.0, "strictly nearer"


def test_who_is_past_a_side_is_outside() -> None:
    assert share_outside(CORNERS, (6.0, 8.0)) == 0.0
    assert share_outside(CORNERS, (5.9, 8.0)) == pytest.approx(1 / 3)


def test_the_way_is_the_sum_of_steps() -> None:
    steps = np.array([[[0.0, 0.0], [0.0, 0.0]], [[3.0, 4.0], [nan, nan]], [[3.0, 3.0], [1.0, 0.0]]])
    assert way(steps).tolist() == [6.0, 0.0]


def test_dominance_is_the_share_of_the_two_largest() -> None:
    assert dominance(np.full(8, 0.125)) == 0.25
    assert dominance(np.array([0.1, 0.5, -1.0, 0.4])) == pytest.approx(0.9)
    assert dominance(np.array([1.0, -1.0])) is None


def test_d_settles_where_it_stays_near_its_end() -> None:
    assert settle_step(np.array([3.0, 2.0, 1.1, 1.4, 1.1, 1.0])) == 4
    assert settle_step(np.array([1.0, 1.0])) == 0


def directions(*degrees: float | None, length: float = 0.1) -> np.ndarray:
    return np.array([[0.0, 0.0] if d is None else [length * cos(radians(d)), length * sin(radians(d))] for d in degrees])


@pytest.mark.parametrize(
    ("ranger_ways", "wild_way", "together"),
    [
        ((0, 10), 5, True),
        ((-22, 22), 0, True),
        ((-24, 24), 0, False),  # 48 degrees apart
        ((-24, 24, 5), 0, True),  # two of three
        ((0, 46), 0, False),
        ((0, None), 0, False),
        ((0,), 0, False),
        ((0, 10), None, False),
        ((180, 190), 0, False),
        ((170, -170), 180, True),
    ],
)
def test_pushing_together(ranger_ways: tuple[float | None, ...], wild_way: float | None, together: bool) -> None:  # noqa: FBT001
    rangers = np.array([[-0.2, 0.01 * row] for row in range(len(ranger_ways))])
    found = pushed(rangers, directions(*ranger_ways), np.array([[0.0, 0.0]]), directions(wild_way), 0.21)
    assert found.tolist() == [together]


def test_who_is_not_in_contact_does_not_push() -> None:
    rangers, wilds = np.array([[-0.2, 0.0], [-0.4, 0.0]]), np.array([[0.0, 0.0]])
    assert pushed(rangers, directions(0, 0), wilds, directions(0), 0.21).tolist() == [False]
    assert pushed(rangers, directions(0, 0), wilds, directions(0), 0.41).tolist() == [True]
    assert pushed(NOBODY, NOBODY, wilds, directions(0), 0.21).tolist() == [False]
    assert pushed(rangers, directions(0, 0), NOBODY, NOBODY, 0.21).tolist() == []


def test_periodic_motion_comes_back_three_times() -> None:
    to_and_fro = [0.0, 1.0] * 5
    positions = np.zeros((8, 4, 2))
    positions[:, 0, 0] = to_and_fro[:8]
    positions[:, 1, 0] = [0, 1, 0, 1, 0, 1, 5, 6]  # but two periods
    positions[:, 2, 0] = np.arange(8)
    assert periodic(positions).tolist() == [True, False, False, False], "who stands still has no period"
    assert periodic(positions, periods=2).tolist() == [True, True, False, False]
    assert periodic(positions[:6]).tolist() == [False] * 4
    assert periodic(positions[:7]).tolist() == [True, False, False, False]


def test_stable_in_the_large_while_weights_turn() -> None:
    distance = np.concatenate((np.linspace(3, 1, 10), np.full(25, 1.0)))
    weights = np.zeros((35, 30, 8))
    weights[:, :, 0] = 1.0
    assert macro_stable(distance, turns(weights)).tolist() == []
    weights[31:, 1, 3] = 2.0
    assert macro_stable(distance, turns(weights)).tolist() == [11, 12, 13, 14]
    assert macro_stable(distance[:20], turns(weights[:20])).tolist() == []
    assert macro_stable(distance * np.linspace(1, 1.3, 35), turns(weights)).tolist() == []
