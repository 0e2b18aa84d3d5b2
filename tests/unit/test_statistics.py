"""Wilson's interval against values worked out elsewhere."""

from __future__ import annotations

import pytest

from hil.statistics import Rate


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        # Newcombe 1998, Statistics in Medicine 17, table I (method 3, score).
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
        # Its mirror image.
        (20, 20, 0.8389, 1.0),
        (182, 263, 0.6338, 0.7447),
    ],
)
def test_known_values(successes: int, trials: int, low: float, high: float) -> None:
    rate = Rate(successes, trials)
    assert rate.ci95 == pytest.approx((low, high), abs=5e-5)


def test_nothing_tried_says_nothing() -> None:
    assert Rate(0, 0).value == 0.0
    assert Rate(0, 0).ci95 == (0.0, 1.0)


def test_the_interval_holds_the_share_and_narrows() -> None:
    widths = []
    for trials in (1, 10, 100, 1000):
        for successes in (0, trials // 3, trials):
            low, high = Rate(successes, trials).ci95
            assert 0.0 <= low <= successes / trials <= high <= 1.0
        low, high = Rate(trials // 2, trials).ci95
        widths.append(high - low)
    assert widths == sorted(widths, reverse=True)


def test_170_of_200_is_not_yet_85_percent_for_sure() -> None:
    assert Rate(170, 200).ci95[0] < 0.85 < Rate(182, 200).ci95[0]


def test_in_words() -> None:
    assert str(Rate(1, 2)) == "0.500 (95 % interval 0.095 to 0.905)"
