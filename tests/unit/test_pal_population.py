"""The first generation of a phase: where it comes from."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from firmware_protocol.vocabulary import BASIC_ACTIONS, FINE_ACTIONS, Action
from pal_advisor.maneuvers import PalSettings
from pal_advisor.maneuvers.model import RENEW_LATEST
from pal_advisor.maneuvers.population import Population

ANCESTORS = [
    (int(Action.F),) * 4,
    (int(Action.L),) * 4,
    (int(Action.B), int(Action.R), int(Action.B), int(Action.R)),
]


@pytest.mark.parametrize(("population", "shares"), [(8, [3, 3, 2]), (12, [4, 4, 4]), (4, [2, 1, 1])])
def test_the_winners_of_phase_1_take_turns_in_being_refined(population: int, shares: list[int]) -> None:
    tried = Population(PalSettings(budget=300, population=population))
    tried.begin(2, ANCESTORS, np.random.default_rng(1))
    assert len(tried.members) == population
    families = [tuple(Action(gene).family for gene in ancestor) for ancestor in ANCESTORS]
    found = Counter(families.index(tuple(Action(gene).family for gene in member)) for member in tried.members)
    assert [found[index] for index in range(3)] == shares
    for number, member in enumerate(tried.members):
        assert ANCESTORS[number % 3] in tried.archive[member].parents
        assert {Action(gene) for gene in member} <= set(FINE_ACTIONS)


def test_without_winners_it_is_drawn_at_random() -> None:
    settings = PalSettings(budget=300, population=40)
    for phase, alphabet in ((1, BASIC_ACTIONS), (2, FINE_ACTIONS)):
        tried = Population(settings)
        tried.begin(phase, [], np.random.default_rng(1))
        assert len(set(tried.members)) > 30
        assert {Action(gene) for member in tried.members for gene in member} == set(alphabet)
        assert all(candidate.parents == () for candidate in tried.archive.values())


def grown(brood: int, curiosity: float = 0.0, mutation: float = 0.3) -> Population:
    """The second generation of what is worth as much as it has fast forwards, all of the first being known well."""
    settings = PalSettings(budget=300, population=20, brood=brood, curiosity=curiosity, mutation=mutation)
    population = Population(settings)
    population.begin(2, [], np.random.default_rng(1))
    for number, genome in enumerate(population.members * RENEW_LATEST):
        population.rate(genome, 4, 5.0 * genome.count(int(Action.FF)) + number // 20 % 2)
    population.step(np.random.default_rng(2))
    return population


def test_of_each_brood_the_most_promising_becomes_a_member() -> None:
    def forwards(population: Population) -> float:
        return float(np.mean([genome.count(int(Action.FF)) for genome in population.members]))

    assert forwards(grown(4)) > forwards(grown(1)) + 0.2


def test_of_a_brood_nobody_who_is_there_already_is_taken() -> None:
    assert len(set(grown(8, mutation=0.02).members)) == 20
    assert len(set(grown(1, mutation=0.02).members)) < 20


def test_curiosity_prefers_what_is_not_known() -> None:
    def doubt(population: Population) -> float:
        return float(np.mean([population.known(genome).error for genome in population.members]))

    assert doubt(grown(4, curiosity=20.0)) > doubt(grown(4))
