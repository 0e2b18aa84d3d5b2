"""The four fitness functions of chapter 9, by examples computed by hand."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from pal_advisor.fields import FieldError, Fields
from pal_advisor.surround.measures import Fitness, FitnessSums, nearest_distance

NOBODY = np.zeros(36, dtype=np.int64)
UNIFORM = np.full((36, 8), 1 / 8)


def met(*stimuli: int) -> np.ndarray:
    counts = NOBODY.copy()
    for stimulus in stimuli:
        counts[stimulus - 1] += 1
    return counts


def two_steps() -> FitnessSums:
    """RANGERs at a distance of 3 and 4 from a WILD at the origin, then at 1 and 2."""
    sums = FitnessSums(8)
    wild = np.array([[0.0, 0.0]])
    weights = UNIFORM.copy()
    weights[1] = [0.3, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]
    sums.take(np.array([[3.0, 0.0], [0.0, 4.0]]), wild, 0.8, met(2, 2, 3), weights)
    weights[2] = [0.1, 0.3, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]
    sums.take(np.array([[1.0, 0.0], [0.0, 2.0]]), wild, 0.45, met(3), weights)
    return sums


def test_contact_is_as_printed_with_one_term_less_above() -> None:
    # D is (3 + 4) / 2 and (1 + 2) / 2; T1 - T0 is 1 for two terms (Eqs. 9.3 and 9.4)
    assert two_steps().value(Fitness.CONTACT) == pytest.approx(1 / (3.5 + 1.5))


def test_surround_takes_the_three_nearest_of_each_wild() -> None:
    # with two RANGERs these are the nearest there are: 3.5 and 1.5, squared (Eqs. 9.5 and 9.6)
    assert two_steps().value(Fitness.SURROUND) == pytest.approx(1 / (3.5**2 + 1.5**2))
    rangers = np.array([[1.0, 0], [2.0, 0], [0, 3.0], [0, 50.0]])
    wilds = np.array([[0.0, 0.0], [0.0, 52.0]])
    far = sorted(np.linalg.norm(rangers - wilds[1], axis=1))[:3]
    assert nearest_distance(rangers, wilds) == pytest.approx((2.0 + sum(far) / 3) / 2)


def test_chase_takes_the_way_of_all_rangers() -> None:
    assert two_steps().value(Fitness.CHASE) == pytest.approx(1 / sqrt(1.25))  # Eq. 9.7


def test_focus_takes_the_weights_of_what_most_have_met() -> None:
    # STIMULUS2, then STIMULUS3: the sum is .4, .4, and six times .2; its standard deviation is sqrt(3) / 20 (Eq. 9.8)
    total = np.array([0.4, 0.4, *[0.2] * 6])
    assert total.std() == pytest.approx(sqrt(3) / 20)
    assert two_steps().value(Fitness.FOCUS) == pytest.approx(sqrt(3) / 20 / 5.0)


def test_focus_leaves_out_what_nobody_can_do() -> None:
    sums = FitnessSums(8)
    weights = UNIFORM.copy()
    weights[1] = [0.5, 0.5, -1, -1, -1, -1, -1, -1]
    sums.take(np.array([[2.0, 0.0]]), np.zeros((1, 2)), 0.4, met(2), weights)
    sums.take(np.array([[2.0, 0.0]]), np.zeros((1, 2)), 0.4, met(2), weights)
    assert sums.value(Fitness.FOCUS) == 0.0


def test_focus_is_nothing_where_nothing_is_learnt() -> None:
    sums = FitnessSums(8)
    for _ in range(20):
        sums.take(np.array([[2.0, 0.0]]), np.zeros((1, 2)), 0.4, met(4), UNIFORM)
    assert sums.value(Fitness.FOCUS) == 0.0
    assert sums.value(Fitness.CONTACT) == pytest.approx(19 / 40)


def test_who_does_not_move_does_not_chase() -> None:
    sums = FitnessSums(8)
    for _ in range(20):
        sums.take(np.array([[2.0, 0.0]]), np.zeros((1, 2)), 0.0, met(1), UNIFORM)
    assert sums.value(Fitness.CHASE) == 0.0


def test_without_a_step_or_a_position_there_is_no_fitness() -> None:
    sums = FitnessSums(8)
    assert set(sums.values.values()) == {None}
    sums.take(np.array([[np.nan, np.nan]]), np.zeros((1, 2)), 0.0, NOBODY, UNIFORM)
    sums.take(np.array([[1.0, 0.0]]), np.zeros((1, 2)), 0.0, NOBODY, UNIFORM)
    assert set(sums.values.values()) == {None}


def test_sums_go_on_where_they_stood() -> None:
    sums = two_steps()
    again = FitnessSums.from_fields(Fields(sums.to_dict()), 8)
    assert again.values == sums.values
    with pytest.raises(FieldError, match="weights: expected 6 numbers, not 8"):
        FitnessSums.from_fields(Fields(sums.to_dict()), 6)
