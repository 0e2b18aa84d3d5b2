"""The challenge: who plays when, what decides, and how often it errs, by enumerating all that can happen."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pal_advisor.maneuvers import Challenge, Contender
from pal_advisor.maneuvers.challenge import FEWEST_PAIRS, MOST_PAIRS, chance, decided

CHALLENGER, CHAMPION = Contender.CHALLENGER, Contender.CHAMPION


Array = NDArray[np.float64]


def played(ahead: Array, behind: Array) -> tuple[Array, Array]:
    """What challenges come to, exactly.

    Args:
        ahead: Probabilities that of a pair only the challenger's bout is won, one for each challenge.
        behind: That only the champion's is.

    Returns:
        Probabilities that the challenger takes the place, and expected numbers of bouts.
    """
    one, other = ahead[:, None, None], behind[:, None, None]
    standing = np.zeros((len(ahead), MOST_PAIRS + 1, MOST_PAIRS + 1))
    standing[:, 0, 0] = 1.0
    taken, bouts = np.zeros(len(ahead)), np.zeros(len(ahead))
    for pair in range(1, MOST_PAIRS + 1):
        after = (1.0 - one - other) * standing
        after[:, 1:] += one * standing[:, :-1]
        after[:, :, 1:] += other * standing[:, :, :-1]
        for at in np.argwhere(after.any(axis=0)):
            wins, losses = int(at[0]), int(at[1])
            winner = decided(pair, wins, losses)
            if winner is not None:
                taken += after[:, wins, losses] * (winner is CHALLENGER)
                bouts += after[:, wins, losses] * 2 * pair
                after[:, wins, losses] = 0.0
        standing = after
    assert not standing.any(), "it is always decided"
    return taken, bouts


def apart(challenger: Array, champion: Array) -> tuple[Array, Array]:
    """The same of two that win bouts with these probabilities, whatever the pose."""
    return played(challenger * (1 - champion), champion * (1 - challenger))


def test_an_equal_challenger_takes_the_place_in_less_than_one_of_twenty_challenges_however_often_a_pair_tells() -> None:
    tells = np.linspace(0.0, 1.0, 201)
    assert played(tells / 2, tells / 2)[0].max() == pytest.approx(0.0467, abs=1e-4)
    rates = np.array([0.5, 0.8, 0.95])
    assert apart(rates, rates)[0] == pytest.approx([0.0358, 0.0205, 0.0009], abs=1e-4)


def test_how_often_a_challenger_takes_the_place_and_after_how_many_bouts() -> None:
    rates = np.array([(0.8, 0.6), (0.9, 0.6), (0.9, 0.5), (0.95, 0.4), (0.8, 0.8), (1.0, 1.0), (0.6, 0.8), (0.5, 0.9)])
    taken, bouts = apart(*rates.T)
    assert taken == pytest.approx([0.291, 0.590, 0.818, 0.983, 0.020, 0.0, 0.001, 0.000], abs=6e-4)
    assert bouts == pytest.approx([27.3, 30.1, 28.6, 22.7, 19.2, 18.0, 13.6, 11.1], abs=0.06)


def test_a_better_challenger_never_has_less_of_a_chance() -> None:
    rates = np.linspace(0.0, 1.0, 11)
    for champion in rates:
        assert (np.diff(apart(rates, np.full_like(rates, champion))[0]) >= -1e-12).all()


def test_the_two_play_in_turn_and_every_pair_has_a_verdict() -> None:
    challenge, order = Challenge(), []
    while not challenge.finished:
        order.append((challenge.pair, challenge.turn))
        verdict = challenge.tell(won=challenge.turn is CHALLENGER)
        assert (verdict is None) == (challenge.bouts % 2 == 1)
    assert order[:4] == [(1, CHALLENGER), (1, CHAMPION), (2, CHALLENGER), (2, CHAMPION)]
    assert (challenge.bouts, challenge.winner) == (12, CHALLENGER), "six of six: 1/64"
    assert [(one.pair, one.ahead, one.behind, one.chance) for one in challenge.verdicts] == [
        (number, number, 0, 0.5**number) for number in range(1, 7)
    ]
    assert [challenge.wins(one) for one in (CHALLENGER, CHAMPION)] == [6, 0]
    with pytest.raises(ValueError, match="decided after 12 bouts"):
        challenge.tell(won=True)


def test_it_goes_on_from_bouts_that_were_played_before() -> None:
    won = [True, False, True, True, False, False, True]
    challenge = Challenge(won)
    assert (challenge.bouts, challenge.pair, challenge.turn) == (7, 4, CHAMPION)
    assert (challenge.played(CHALLENGER), challenge.played(CHAMPION)) == (4, 3)
    assert (challenge.wins(CHALLENGER), challenge.wins(CHAMPION)) == (3, 1)
    assert (challenge.verdicts[-1].ahead, challenge.verdicts[-1].behind) == (1, 0)
    with pytest.raises(ValueError, match="decided after 12 bouts"):
        Challenge([True, False] * 7)


def test_the_champion_stays_where_nothing_is_clear() -> None:
    assert decided(FEWEST_PAIRS - 1, 4, 0) is None
    assert decided(FEWEST_PAIRS, 5, 0) is None, "five of five: 1/32"
    assert decided(FEWEST_PAIRS, 0, 2) is CHAMPION
    assert decided(FEWEST_PAIRS, 0, 1) is None
    assert decided(9, 0, 0) is CHAMPION, "all alike"
    assert decided(9, 1, 0) is None
    assert decided(MOST_PAIRS, 7, 2) is CHAMPION
    assert decided(MOST_PAIRS, 8, 2) is CHALLENGER
    assert decided(MOST_PAIRS - 1, 8, 2) is None
    assert decided(18, 6, 1) is None, "7 to 1 is clear at the end"
    assert decided(19, 5, 1) is CHAMPION, "and 6 to 1 is not"


def test_the_chance_is_the_tail_of_the_binomial_distribution() -> None:
    assert chance(0, 0) == 1.0
    assert chance(6, 0) == 1 / 64
    assert chance(8, 2) == 56 / 1024
    assert chance(3, 3) == 42 / 64
