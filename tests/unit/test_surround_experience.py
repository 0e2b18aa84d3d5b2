"""The table of experience: Eq. 6.12 to 6.16 by examples computed by hand, and selection by 6.18 and 6.19."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from pal_advisor.surround.experience import Experience, bounds, function1, function2, proportional, updated
from pal_advisor.surround.selection import at_random, by_maximum, by_probability

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

UNIFORM = [0.125] * 8
ALL = np.ones(8, dtype=np.bool_)


@pytest.mark.parametrize(("weight", "shaped"), [(-0.5, 0.0), (0.0, 0.0), (0.4, 0.4), (1.0, 1.0), (1.7, 1.0)])
def test_function1_clips(weight: float, shaped: float) -> None:
    """Eq. 6.13."""
    assert function1(weight) == shaped


@pytest.mark.parametrize(("weight", "shaped"), [(0.0, 0.05), (0.125, 0.1717166), (0.5, 0.5275914), (1.0, 0.9511285)])
def test_function2_is_the_inverted_sigmoid(weight: float, shaped: float) -> None:
    """Eq. 6.14 with alpha 3.9, psi 1.9."""
    assert function2(weight) == pytest.approx(shaped, abs=5e-8)


def test_the_increment_is_proportional_and_bounded() -> None:
    """C1, Eq. 6.15."""
    assert proportional(np.array([-3, -2, -1, 0, 1, 2, 3]), 0.5).tolist() == [-1, -1, -0.5, 0, 0.5, 1, 1]


@pytest.mark.parametrize(
    ("before", "behaviour", "delta", "after"),
    [
        ([0.5, 0.5], 0, 0.5, [2 / 3, 1 / 3]),  # (1, 0.5) / 1.5
        ([0.5, 0.5], 0, 1.0, [2 / 3, 1 / 3]),  # (1.5 -> 1, 0.5) / 1.5
        ([0.5, 0.5], 1, -0.5, [1.0, 0.0]),
        ([0.25, 0.75], 1, -0.5, [0.5, 0.5]),  # (0.25, 0.25) / 0.5
        ([0.25, 0.75], 0, -1.0, [0.0, 1.0]),  # (-0.75 -> 0, 0.75) / 0.75
        ([1.0, 0.0], 0, -1.0, [0.5, 0.5]),  # all 0: starts again
        (UNIFORM, 2, 0.5, [1 / 12, 1 / 12, 5 / 12, *[1 / 12] * 5]),  # 0.625 of 1.5
    ],
)
def test_original_weights_by_hand(before: list[float], behaviour: int, delta: float, after: list[float]) -> None:
    assert updated(before, behaviour, delta, smoothing=False) == pytest.approx(after)


def test_smoothed_weights_by_hand() -> None:
    """f(1) = 0.951128, f(0.5) = 0.527591: 0.951128 / 1.478720; and twice in a row with 8 behaviours."""
    assert updated([0.5, 0.5], 0, 1.0, smoothing=True) == pytest.approx([0.6432107, 0.3567893], abs=5e-8)
    first = updated(UNIFORM, 0, 0.5, smoothing=True)
    assert first == pytest.approx([0.3475460, *[0.0932077] * 7], abs=5e-8)
    second = updated(first, 0, -1.0, smoothing=True)
    assert second == pytest.approx([0.0482773, *[0.1359604] * 7], abs=5e-8)


def test_the_bounds_of_smoothed_weights() -> None:
    assert bounds(8) == pytest.approx((0.0074, 0.7311), abs=1e-4)


def test_weights_are_uniform_at_first() -> None:
    """Eq. 6.16."""
    assert (Experience(ALL, smoothing=True).weights == 0.125).all()
    assert Experience(ALL, smoothing=True).weights.shape == (30, 8)


def test_what_is_not_feasible_takes_no_part() -> None:
    """Eq. 6.9: the weight stays -1, and the rest is a distribution."""
    mask = np.array([True, False, True, True, False, True, False, False])
    table = Experience(mask, smoothing=False)
    assert table.weights[1].tolist() == [0.25, -1, 0.25, 0.25, -1, 0.25, -1, -1]
    table.learn(np.array([2]), np.array([4]), np.array([0.25]))
    assert table.weights[1].tolist() == pytest.approx([0.2, -1, 0.2, 0.4, -1, 0.2, -1, -1])


def test_one_feasible_behaviour_keeps_all_the_weight() -> None:
    for smoothing in (True, False):
        table = Experience(np.array([False, True, False, False]), smoothing=smoothing)
        changed = table.learn(np.array([1, 1, 1]), np.array([2, 2, 2]), np.array([0.5, -1.0, 1.0]))
        assert table.weights[0].tolist() == [-1, 1, -1, -1]
        assert changed.tolist() == []


def test_nothing_feasible_has_no_weights() -> None:
    table = Experience(np.zeros(4, dtype=np.bool_), smoothing=True)
    assert (table.weights == -1).all()
    assert table.learn(np.array([], dtype=np.int64), np.array([], dtype=np.int64), np.array([])).tolist() == []


def test_one_robot_after_the_other_each_the_whole_equation() -> None:
    """Not the sum of the increments, shaped once."""
    table = Experience(ALL, smoothing=True)
    changed = table.learn(np.array([2, 3, 2, 2]), np.array([8, 1, 8, 1]), np.array([0.5, 0.0, 0.5, -0.5]))
    expected = UNIFORM
    for behaviour, delta in ((7, 0.5), (7, 0.5), (0, -0.5)):
        expected = updated(expected, behaviour, delta, smoothing=True)
    assert table.weights[1].tolist() == expected
    assert changed.tolist() == [2]
    assert table.weights[2].tolist() == UNIFORM, "an increment of 0 changes nothing, not even by smoothing"


def test_the_order_of_robots_counts() -> None:
    there, back = Experience(ALL, smoothing=True), Experience(ALL, smoothing=True)
    there.learn(np.array([2, 2]), np.array([1, 2]), np.array([1.0, -1.0]))
    back.learn(np.array([2, 2]), np.array([2, 1]), np.array([-1.0, 1.0]))
    assert there.weights[1].tolist() != back.weights[1].tolist()


WEIGHTS = np.array([[0.1, -1.0, 0.6, 0.3]])


@pytest.mark.parametrize(("draw", "behaviour"), [(0.0, 1), (0.0999, 1), (0.1, 3), (0.6999, 3), (0.7001, 4), (1 - 2**-53, 4)])
def test_selection_by_probability(draw: float, behaviour: int) -> None:
    """Eq. 6.18: edges at 0.1, 0.7, 1."""
    assert by_probability(WEIGHTS, np.array([draw])).tolist() == [behaviour]


def test_a_draw_next_to_1_selects_no_weight_of_0() -> None:
    weights = np.array([[0.7, 0.1, 0.2, 0.0], [1 / 3, 1 / 3, 1 / 3, -1.0]])
    assert by_probability(weights, np.full(2, 1 - 2**-53)).tolist() == [3, 3]


@pytest.mark.parametrize(("draw", "behaviour"), [(0.0, 2), (0.49, 2), (0.51, 4), (0.99, 4)])
def test_selection_by_maximum(draw: float, behaviour: int) -> None:
    """Eq. 6.19: of equals any."""
    assert by_maximum(np.array([[0.2, 0.4, -1.0, 0.4]]), np.array([draw])).tolist() == [behaviour]


@pytest.mark.parametrize(("draw", "behaviour"), [(0.0, 1), (0.34, 3), (0.99, 4)])
def test_selection_at_random_minds_no_weights(draw: float, behaviour: int) -> None:
    assert at_random(WEIGHTS, np.array([draw])).tolist() == [behaviour]


def test_weights_of_0_alone_are_as_good_as_each_other() -> None:
    assert by_probability(np.array([[0.0, -1.0, 0.0, -1.0]] * 2), np.array([0.2, 0.8])).tolist() == [1, 3]


@pytest.mark.parametrize("select", [by_probability, by_maximum, at_random])
def test_nothing_feasible_selects_nothing(select: Callable[..., NDArray[np.int64]]) -> None:
    assert select(np.full((2, 3), -1.0), np.array([0.1, 0.9])).tolist() == [0, 0]
    assert select(np.empty((0, 3)), np.empty(0)).tolist() == []
