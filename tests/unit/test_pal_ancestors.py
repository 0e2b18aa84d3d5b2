"""Maneuvers learnt before: ancestors in phase 2, and no members."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from firmware_protocol.vocabulary import ANY_STIMULUS, Action, ActionTally
from pal_advisor.maneuvers import Advice, AdviceEntry, Origin, Pal, PalSettings, Performance, StateError, ancestors_of

if TYPE_CHECKING:
    from pal_advisor.maneuvers.population import Genome

SETTINGS = PalSettings(budget=60, population=6, rounds=1, exam_share=0.0)
LEFT, BOTH = (Action.LBRF, Action.FF, Action.SF, Action.S), (Action.FF, Action.FB, Action.FF, Action.FB)
RIGHT = (Action.LFRB, Action.FF, Action.SF, Action.S)
GIVEN = Advice(
    SETTINGS,
    tuple(AdviceEntry(ANY_STIMULUS, code, actions, 1.0, 1) for code, actions in ((1, LEFT), (2, RIGHT), (3, BOTH))),
)


def genome(actions: tuple[Action, ...]) -> Genome:
    return tuple(map(int, actions))


def coached(settings: PalSettings = SETTINGS, given: Advice = GIVEN) -> Pal:
    pal = Pal(settings, np.random.default_rng(1), ancestors_of(given, settings))
    tally = ActionTally(30, (20, 0), (1, 0), (0.1, 0.0), 0.01)
    while not pal.finished:
        trial = pal.ask(3, None)
        pal.tell(trial, Performance((tally,) * 4, 4, progress=0.001 * (trial.id % 7)))
    return pal


def test_of_two_situations_that_mirror_each_other_one_has_an_ancestor() -> None:
    apart = ancestors_of(GIVEN, replace(SETTINGS, mirror=False))
    assert apart == {(ANY_STIMULUS, 1): genome(LEFT), (ANY_STIMULUS, 2): genome(RIGHT), (ANY_STIMULUS, 3): genome(BOTH)}
    assert ancestors_of(GIVEN, SETTINGS) == {(ANY_STIMULUS, 1): genome(LEFT), (ANY_STIMULUS, 3): genome(BOTH)}
    assert ancestors_of(GIVEN, replace(SETTINGS, actions=6)) == {}


def test_it_is_refined_in_phase_2_in_turn_with_the_winners_of_phase_1_and_is_no_member_itself() -> None:
    population, _ = coached().population((ANY_STIMULUS, 3))
    assert population is not None
    first = [one for one in population.archive.values() if (one.phase, one.born) == (2, 0)]
    refined = [one for one in first if one.parents == (genome(BOTH),)]
    assert len(first) == SETTINGS.population
    assert 1 <= len(refined) < len(first)
    for one in refined:
        assert one.origin is Origin.REFINED
        assert [Action(gene).family for gene in one.genome] in (
            [action.family for action in BOTH],
            [Action(gene).family for gene in one.parents[0]],
        )
    assert all((one.phase, one.born) != (1, 0) or one.genome != genome(BOTH) for one in population.archive.values())


@pytest.mark.parametrize("phases", ["basic", "fine"])
def test_with_one_phase_there_are_no_ancestors(phases: str) -> None:
    settings = PalSettings.from_dict({**SETTINGS.to_dict(), "phases": phases})
    population, _ = coached(settings).population((ANY_STIMULUS, 3))
    assert population is not None
    assert all(genome(BOTH) not in one.parents for one in population.archive.values())


def test_a_saved_state_has_them_and_goes_on_alike() -> None:
    pal = Pal(SETTINGS, np.random.default_rng(1), ancestors_of(GIVEN, SETTINGS))
    again = Pal.from_state(json.loads(json.dumps(pal.state_dict())))
    assert again.state_dict() == pal.state_dict()
    assert "ancestors" not in Pal(SETTINGS, np.random.default_rng(1)).state_dict()
    for wrong in ([[[255, 3], [1, 2]]], [[[255, 3]]], [[[255, 99], [1, 2, 3, 4]]]):
        with pytest.raises(StateError, match="ancestors"):
            Pal.from_state({**pal.state_dict(), "ancestors": wrong})
