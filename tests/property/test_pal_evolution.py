"""What holds for the genetic operators whatever they are given."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pal_advisor.evolution import breed, mutate, one_point_crossover, tournament
from pal_advisor.maneuvers.population import BASIC, FINE, FINE_KIN

seeds = st.integers(0, 2**32 - 1)
genes = st.lists(st.sampled_from([int(gene) for gene in FINE]), min_size=1, max_size=8)


@given(seeds, st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30), st.integers(1, 5))
def test_a_tournament_over_all_is_won_by_one_of_them(seed: int, scores: list[float], size: int) -> None:
    assert 0 <= tournament(np.array(scores), size, np.random.default_rng(seed)) < len(scores)


def test_a_large_tournament_is_won_by_the_best() -> None:
    assert tournament(np.array([1.0, 3.0, 2.0]), 100, np.random.default_rng(1)) == 1


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
    mutant = mutate(np.array(genome), rate, FINE, np.random.default_rng(seed), families=FINE_KIN, in_family=in_family)
    assert set(mutant.tolist()) <= set(FINE.tolist())
    assert len(mutant) == len(genome)


@given(seeds, genes)
def test_mutation_can_stay_in_the_family(seed: int, genome: list[int]) -> None:
    mutant = mutate(np.array(genome), 1.0, FINE, np.random.default_rng(seed), families=FINE_KIN, in_family=1.0)
    assert all(int(new) in FINE_KIN[old] for old, new in zip(genome, mutant, strict=True))


@given(seeds, st.integers(2, 12), st.integers(1, 6), st.integers(0, 2), st.integers(1, 4))
def test_the_elite_survives_and_the_rest_keeps_the_alphabet(
    seed: int, size: int, length: int, elite: int, contest: int
) -> None:
    rng = np.random.default_rng(seed)
    population = rng.choice(BASIC, size=(size, length))
    scores = rng.normal(size=size)
    children, parents = breed(
        population, scores, rng, elite=elite, tournament_size=contest, crossover=0.9, mutation=0.2, alphabet=BASIC
    )
    best = np.argsort(-scores, kind="stable")[:elite]
    assert children.shape == population.shape
    assert (children[:elite] == population[best]).all()
    assert (parents[:elite, 0] == best).all()
    assert set(children.ravel().tolist()) <= set(BASIC.tolist())
    assert parents.shape == (size, 2)
    assert ((parents >= 0) & (parents < size)).all()
