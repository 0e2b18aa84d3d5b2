"""Strengths from bouts: what is put in comes out, and the intervals are as wide as they say."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from firmware_protocol.messages import BoutOutcome
from hil.sumo.tournament.rating import ELO, Rating, Ratings, rate
from hil.sumo.tournament.schedule import TournamentBout

OUTCOMES = (BoutOutcome.WIN, BoutOutcome.DRAW, BoutOutcome.LOSS)


def bout(home: int, away: int, outcome: BoutOutcome) -> TournamentBout:
    return TournamentBout(1, home, away, outcome, 1.0, (1, 1))


def played(truth: Ratings, each: int, seed: int) -> list[TournamentBout]:
    """So many bouts of each pairing in each seat, as chance has them end by these ratings."""
    chance = np.random.default_rng(seed)
    return [
        bout(home, away, OUTCOMES[ending])
        for home, away in permutations(range(len(truth.strengths)), 2)
        for ending in chance.choice(3, size=each, p=truth.expected(home, away))
    ]


def true_ratings(strengths: list[float], seat: float = -40.0, draw: float = -0.5) -> Ratings:
    return Ratings(tuple(Rating(one, 0.0) for one in strengths), Rating(seat, 0.0), Rating(draw, 0.0))


def test_many_bouts_tell_the_strengths_the_seat_and_the_draws() -> None:
    truth = true_ratings([300.0, 100.0, -50.0, -350.0])
    found = rate(4, played(truth, 4000, 1))
    assert [one.value for one in found.strengths] == pytest.approx([300, 100, -50, -350], abs=12)
    assert found.seat.value == pytest.approx(-40, abs=6)
    assert found.draw.value == pytest.approx(-0.5, abs=0.05)


def test_the_intervals_hold_the_truth_as_often_as_they_say() -> None:
    truth = true_ratings([250.0, 80.0, 0.0, -80.0, -250.0])
    held = np.zeros(6)
    trials = 150
    for seed in range(trials):
        found = rate(5, played(truth, 10, seed))
        known = zip((*found.strengths, found.seat), (*truth.strengths, truth.seat), strict=True)
        held += [one.ci95[0] <= real.value <= one.ci95[1] for one, real in known]
    assert (held >= 0.89 * trials).all()
    assert held.mean() <= 0.985 * trials  # and they are no wider than they need be


def test_the_mean_is_nought_whoever_wins() -> None:
    found = rate(3, [bout(0, 1, BoutOutcome.WIN), bout(1, 2, BoutOutcome.WIN), bout(2, 1, BoutOutcome.DRAW)])
    assert sum(one.value for one in found.strengths) == pytest.approx(0.0, abs=1e-6)


def test_who_wins_everything_is_strong_and_nobody_knows_how_strong() -> None:
    found = rate(2, [bout(0, 1, BoutOutcome.WIN), bout(1, 0, BoutOutcome.LOSS)] * 10)
    best = found.strengths[0]
    assert 200 < best.value < 2000
    assert best.ci95[0] > 0
    assert best.error > 100


def test_without_a_bout_nothing_is_known() -> None:
    found = rate(3, [])
    assert [one.value for one in found.strengths] == [0.0, 0.0, 0.0]
    assert found.strengths[0].error == pytest.approx(3.0 * ELO * (2 / 3) ** 0.5)


def test_seats_that_are_swapped_change_the_sign_of_what_the_seat_is_worth() -> None:
    bouts = played(true_ratings([50.0, 0.0, -50.0], seat=90.0), 50, 3)
    swapped = [bout(one.away, one.home, OUTCOMES[2 - OUTCOMES.index(one.outcome)]) for one in bouts]
    one, other = rate(3, bouts), rate(3, swapped)
    assert one.seat.value == pytest.approx(-other.seat.value)
    assert [x.value for x in one.strengths] == pytest.approx([x.value for x in other.strengths])


def test_four_hundred_points_are_ten_wins_to_one() -> None:
    truth = true_ratings([200.0, -200.0], seat=0.0)
    win, draw, loss = truth.expected(0, 1)
    assert win / loss == pytest.approx(10.0)
    assert win + draw + loss == pytest.approx(1.0)
    assert true_ratings([0.0, 0.0], seat=400.0).expected(0, 1, seated=False)[0] == pytest.approx(
        true_ratings([0.0, 0.0], seat=0.0).expected(0, 1)[0]
    )
