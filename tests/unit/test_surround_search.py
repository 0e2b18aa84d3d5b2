"""Chromosomes, and the searches among the conditions."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from pal_advisor.fields import SettingsError
from pal_advisor.surround import Case
from pal_advisor.surround.measures import Fitness
from pal_advisor.surround.search import (
    BOOK_WINNERS,
    CONDITIONS,
    Condition,
    Search,
    SearchName,
    SearchSettings,
    condition_of,
    mutation_rate,
    new_search,
    random_chromosome,
    repaired,
)

if TYPE_CHECKING:
    from collections.abc import Callable


def begun(settings: SearchSettings, seed: int = 1) -> Search:
    return new_search(settings, np.random.default_rng(seed), seed)


def played(search: Search, fitness: Callable[[Condition, int], float]) -> list[tuple[Condition, int]]:
    """Run a search to its end; what it asked for."""
    asked: list[tuple[Condition, int]] = []
    while wanted := search.ask():
        asked += wanted
        search.tell([fitness(*evaluation) for evaluation in wanted])
    return asked


def good_contact(condition: Condition, seed: int) -> float:
    """A stationary WILD and a short range are good, and single runs are noisy."""
    noise = np.random.default_rng(seed).normal(0.0, 0.1)
    return max(0.0, (condition.motion == 2) + (condition.sensor_range == 1) + 0.2 * condition.learning + float(noise))


def test_the_bits_are_b_d_l_s_and_the_code_is_the_number_minus_one() -> None:
    assert str(condition_of(np.array([0, 1, 0, 1, 0, 0, 0]))) == "B2D2L1S1"
    assert str(condition_of(np.array([1, 0, 1, 1, 1, 0, 1]))) == "B3D4L3S2"


def test_there_are_96_conditions_and_every_one_is_a_case() -> None:
    assert len(set(CONDITIONS)) == 96
    for condition in CONDITIONS:
        case = Case.parse(str(condition))
        assert (case.wild_motion, case.distribution, case.learning, case.sensor_range) == condition
    assert set(BOOK_WINNERS) == set(Fitness)
    assert set(BOOK_WINNERS.values()) <= set(CONDITIONS)


def test_the_fourth_b_stands_for_nothing_and_both_its_bits_are_drawn_again() -> None:
    illegal = np.array([1, 1, 1, 0, 1, 0, 1])
    with pytest.raises(ValueError, match="stand for none"):
        condition_of(illegal)
    rng = np.random.default_rng(3)
    drawn = [repaired(illegal, rng) for _ in range(3000)]
    assert illegal.tolist() == [1, 1, 1, 0, 1, 0, 1]
    assert all(each[2:].tolist() == [1, 0, 1, 0, 1] for each in drawn)
    shares = np.bincount([2 * each[0] + each[1] for each in drawn], minlength=4) / len(drawn)
    assert shares[3] == 0
    assert (np.abs(shares[:3] - 1 / 3) < 0.04).all()
    legal = np.array([1, 0, 1, 0, 1, 0, 1])
    assert repaired(legal, rng).tolist() == legal.tolist()


def test_chromosomes_drawn_at_random_reach_every_condition() -> None:
    rng = np.random.default_rng(2)
    assert {condition_of(random_chromosome(rng)) for _ in range(3000)} == set(CONDITIONS)


@pytest.mark.parametrize(
    ("generation", "rate"), [(1, 0.2), (9, 0.2), (10, 0.06), (19, 0.06), (20, 0.005), (29, 0.005), (30, 0.001), (40, 0.001)]
)
def test_bits_are_turned_over_as_the_generation_has_it(generation: int, rate: float) -> None:
    assert mutation_rate(generation) == rate  # Eq. 9.9


def test_the_genetic_search_makes_seven_times_forty_evaluations_and_finds_a_top_condition() -> None:
    search = begun(SearchSettings())
    asked = played(search, good_contact)
    assert search.settings.evaluations == 280
    finalists = {generation.elite for generation in search.generations}
    again = finalists | {BOOK_WINNERS[Fitness.CONTACT]}
    assert len(asked) == 280 + 10 * len(again)
    assert set(search.means) == again
    best = search.best
    assert best is not None
    assert best.n == 10
    assert (best.condition.motion, best.condition.sensor_range) == (2, 1)
    assert search.book is not None
    assert search.finished


def test_the_elite_is_run_anew_in_the_next_generation() -> None:
    search = begun(SearchSettings(generations=12))
    played(search, good_contact)
    for before, after in zip(search.generations, search.generations[1:], strict=False):
        assert after.conditions[0] == before.elite
    seeds = [search.ask() for _ in range(2)]
    assert seeds == [(), ()]


def test_what_is_run_again_has_the_same_seeds() -> None:
    search = begun(SearchSettings(generations=3, repeats=4))
    asked = played(search, good_contact)[3 * 7 :]
    by_condition: dict[Condition, list[int]] = {}
    for condition, seed in asked:
        by_condition.setdefault(condition, []).append(seed)
    assert len({tuple(seeds) for seeds in by_condition.values()}) == 1
    assert all(len(seeds) == 4 for seeds in by_condition.values())


def test_a_search_in_which_nothing_is_any_good_comes_to_its_end() -> None:
    search = begun(SearchSettings(fitness=Fitness.FOCUS))
    played(search, lambda _condition, _seed: 0.0)
    assert len(search.generations) == 40
    assert search.best is not None
    assert search.best.mean == 0.0


def test_told_the_same_it_asks_for_the_same() -> None:
    whole = begun(SearchSettings(generations=8))
    asked = played(whole, good_contact)
    again = begun(SearchSettings(generations=8))
    assert played(again, good_contact) == asked
    assert again.best == whole.best
    assert played(begun(SearchSettings(generations=8), seed=2), good_contact) != asked


def test_what_is_asked_for_stays_until_it_is_told_of() -> None:
    search = begun(SearchSettings(generations=2))
    assert search.ask() == search.ask()
    with pytest.raises(ValueError, match="7 evaluations were asked for, and 2 told of"):
        search.tell([1.0, 2.0])
    with pytest.raises(ValueError, match="not negative"):
        search.tell([-1.0] * 7)


def test_the_exhaustive_search_runs_each_condition_with_the_same_seeds() -> None:
    search = begun(SearchSettings(search=SearchName.EXHAUSTIVE, repeats=3), seed=5)
    asked = played(search, good_contact)
    assert asked == [(condition, seed) for condition in CONDITIONS for seed in (5, 6, 7)]
    assert len(search.means) == 96
    result = search.means[CONDITIONS[0]]
    scores = [good_contact(CONDITIONS[0], seed) for seed in (5, 6, 7)]
    assert result.mean == pytest.approx(np.mean(scores))
    assert result.sd == pytest.approx(np.std(scores, ddof=1))
    assert result.error == pytest.approx(result.sd / 3**0.5)


def test_the_random_search_is_as_large_as_the_genetic_one_unless_told_otherwise() -> None:
    search = begun(SearchSettings(search=SearchName.RANDOM, repeats=2))
    asked = played(search, good_contact)
    assert len(asked) - 280 in {14, 16}  # seven conditions again, and the book's where it is none of them
    assert search.best is not None
    assert search.best.condition.motion == 2
    small = begun(SearchSettings(search=SearchName.RANDOM, budget=5, repeats=1))
    assert small.settings.evaluations == 5
    assert len(small.ask()) == 5


@pytest.mark.parametrize(("name", "value"), [("population", 1), ("generations", 0), ("repeats", 0), ("budget", -1)])
def test_settings_that_make_no_sense_are_named(name: str, value: int) -> None:
    wrong: dict[str, Any] = {name: value}
    with pytest.raises(SettingsError, match=name):
        replace(SearchSettings(), **wrong)
