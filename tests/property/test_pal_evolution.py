"""What holds for the genetic operators whatever they are given."""

from __future__ import annotations

from functools import partial

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pal_advisor.evolution import breed, flip, mutate, one_point_crossover, roulette, tournament
from pal_advisor.maneuvers.population import BASIC, FINE, FINE_KIN

seeds = st.integers(0, 2**32 - 1)
genes = st.lists(st.sampled_from([int(gene) for gene in FINE]), min_size=1, max_size=8)


@given(seeds, st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30), st.integers(1, 5))
def test_a_tournament_over_all_is_won_by_one_of_them(seed: int, scores: list[float], size: int) -> None:
    assert 0 <= tournament(np.array(scores), np.random.default_rng(seed), size) < len(scores)


def test_a_large_tournament_is_won_by_the_best() -> None:
    assert tournament(np.array([1.0, 3.0, 2.0]), np.random.default_rng(1), 100) == 1


@given(seeds, genes)
def test_a_child_has_a_head_and_a_tail(seed: int, head: list[int]) -> None:
    mother, father = np.array(head), -np.array(head) - 1
    child = one_point_crossover(mother, father, np.random.default_rng(seed))
    from_mother = child == mother
    assert len(child) == len(mother)
    assert from_mother[0]
    if len(head) > 1:
        cut = int(np.argmin(from_mother))
        assert 0 < cut < len(head)
        assert not from_mother[cut:].any()
        assert from_mother[:cut].all()


@given(seeds, genes, st.floats(0, 1), st.floats(0, 1))
def test_mutation_keeps_the_alphabet(seed: int, genome: list[int], rate: float, in_family: float) -> None:
    mutant = mutate(
        np.array(genome), np.random.default_rng(seed), rate=rate, alphabet=FINE, families=FINE_KIN, in_family=in_family
    )
    assert set(mutant.tolist()) <= set(FINE.tolist())
    assert len(mutant) == len(genome)


@given(seeds, genes)
def test_mutation_can_stay_in_the_family(seed: int, genome: list[int]) -> None:
    mutant = mutate(np.array(genome), np.random.default_rng(seed), rate=1.0, alphabet=FINE, families=FINE_KIN, in_family=1.0)
    assert all(int(new) in FINE_KIN[old] for old, new in zip(genome, mutant, strict=True))


@given(seeds, st.integers(2, 12), st.integers(1, 6), st.integers(0, 2), st.integers(1, 4))
def test_the_elite_survives_and_the_rest_keeps_the_alphabet(
    seed: int, size: int, length: int, elite: int, contest: int
) -> None:
    rng = np.random.default_rng(seed)
    population = rng.choice(BASIC, size=(size, length))
    scores = rng.normal(size=size)
    children, parents = breed(
        population,
        scores,
        rng,
        elite=elite,
        select=partial(tournament, size=contest),
        crossover=0.9,
        vary=partial(mutate, rate=0.2, alphabet=BASIC),
    )
    best = np.argsort(-scores, kind="stable")[:elite]
    assert children.shape == population.shape
    assert (children[:elite] == population[best]).all()
    assert (parents[:elite, 0] == best).all()
    assert set(children.ravel().tolist()) <= set(BASIC.tolist())
    assert parents.shape == (size, 2)
    assert ((parents >= 0) & (parents < size)).all()


@given(seeds, st.lists(st.floats(0, 1e6), min_size=1, max_size=30))
def test_roulette_selects_nobody_without_fitness_but_where_nobody_has_any(seed: int, scores: list[float]) -> None:
    selected = roulette(np.array(scores), np.random.default_rng(seed))
    assert 0 <= selected < len(scores)
    assert scores[selected] > 0 or not any(scores)


def test_roulette_selects_in_proportion() -> None:
    rng = np.random.default_rng(4)
    counts = np.bincount([roulette(np.array([1.0, 0.0, 3.0]), rng) for _ in range(4000)], minlength=3)
    assert counts[1] == 0
    assert abs(counts[2] / 4000 - 0.75) < 0.03  # four standard deviations


def test_roulette_bears_a_population_of_no_fitness_at_all() -> None:
    rng = np.random.default_rng(5)
    counts = np.bincount([roulette(np.zeros(4), rng) for _ in range(4000)], minlength=4)
    assert (np.abs(counts / 4000 - 0.25) < 0.03).all()


@given(seeds, st.lists(st.integers(0, 1), min_size=1, max_size=20))
def test_flipping_turns_all_bits_or_none(seed: int, genome: list[int]) -> None:
    rng = np.random.default_rng(seed)
    assert flip(np.array(genome), rng, 0.0).tolist() == genome
    assert flip(np.array(genome), rng, 1.0).tolist() == [1 - bit for bit in genome]


def test_flipping_turns_bits_as_often_as_told() -> None:
    assert abs(flip(np.zeros(20_000, dtype=np.int64), np.random.default_rng(6), 0.06).mean() - 0.06) < 0.007
