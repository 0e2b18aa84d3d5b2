"""The first generation of a phase: where it comes from."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from firmware_protocol.vocabulary import BASIC_ACTIONS, FINE_ACTIONS, Action
from pal_advisor.maneuvers import PalSettings
from pal_advisor.maneuvers.population import Population

ANCESTORS = [
    (int(Action.F),) * 4,
    (int(Action.L),) * 4,
    (int(Action.B), int(Action.R), int(Action.B), int(Action.R)),
]


@pytest.mark.parametrize(("population", "shares"), [(8, [3, 3, 2]), (12, [4, 4, 4]), (4, [2, 1, 1])])
def test_the_winners_of_phase_1_take_turns_in_being_refined(population: int, shares: list[int]) -> None:
    tried = Population()
    settings = PalSettings(budget=300, population=population)
    tried.begin(2, ANCESTORS, settings, np.random.default_rng(1))
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
        tried = Population()
        tried.begin(phase, [], settings, np.random.default_rng(1))
        assert len(set(tried.members)) > 30
        assert {Action(gene) for member in tried.members for gene in member} == set(alphabet)
        assert all(candidate.parents == () for candidate in tried.archive.values())
