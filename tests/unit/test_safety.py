"""Limits on motion: what passes, what is cut, what is refused."""

from __future__ import annotations

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.vocabulary import Action, Maneuver
from hil.safety import Limits

finite = st.floats(-1e9, 1e9)


@pytest.mark.parametrize(
    "bounds",
    [
        {"speed": 0.0},
        {"speed": -1.0},
        {"speed": 1.01},
        {"speed": nan},
        {"duration": 0.0},
        {"maneuver": -1.0},
        {"duration": nan},
    ],
)
def test_limits_that_limit_nothing_are_refused(bounds: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="limit"):
        Limits(**bounds)


@given(finite, finite, st.floats(0, 1e9), st.floats(0.01, 1.0), st.floats(0.01, 10.0))
def test_what_is_sent_is_within_the_limits_and_keeps_its_curve(
    left: float, right: float, duration: float, speed: float, longest: float
) -> None:
    sent_left, sent_right, time = Limits(speed=speed, duration=longest).wheels(left, right, duration)
    assert max(abs(sent_left), abs(sent_right)) <= speed * (1 + 1e-12)
    assert 0 <= time <= min(duration, longest)
    assert sent_left * right == pytest.approx(sent_right * left, rel=1e-9, abs=1e-300)
    if max(abs(left), abs(right)) <= speed:
        assert (sent_left, sent_right) == (left, right)


@pytest.mark.parametrize(
    "command",
    [(nan, 0.0, 0.1), (0.0, nan, 0.1), (nan, nan, nan), (0.1, 0.1, nan), (inf, 0.0, 0.1), (0.0, -inf, 0.1), (0.1, 0.1, inf)],
)
def test_what_is_no_number_is_refused_in_every_place(command: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="finite"):
        Limits().wheels(*command)


def test_time_does_not_run_backwards() -> None:
    with pytest.raises(ValueError, match="not negative"):
        Limits().wheels(0.1, 0.1, -0.1)


def test_maneuvers_are_shortened_by_their_period_alone() -> None:
    maneuver = Maneuver((Action.FF, Action.L), period=1.0, floor_reflex=False, end_on_change=True)
    assert Limits().bounded(maneuver) is maneuver
    bounded = Limits(maneuver=0.5).bounded(maneuver)
    assert bounded.period == 0.25
    assert (bounded.actions, bounded.floor_reflex, bounded.end_on_change) == (maneuver.actions, False, True)
    assert Limits(maneuver=0.001).bounded(maneuver).period == 0.02  # the shortest the robot knows
