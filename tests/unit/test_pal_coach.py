"""Pal by ask and tell, coached on a toy: the fitness of a maneuver is how many of its actions go forward."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

import numpy as np
import pytest

from firmware_protocol.vocabulary import (
    ANY_STIMULUS,
    BASIC_ACTIONS,
    FINE_ACTIONS,
    ActionTally,
    Family,
)
from pal_advisor.maneuvers import GenerationRecord, Pal, PalSettings, Performance, StateError, Trial

SMALL = PalSettings(budget=300, population=8)


def toy(trial: Trial, chance: np.random.Generator) -> Performance:
    """Worth 2 for each forward action, with some noise in the progress."""
    tallies = tuple(
        ActionTally(40, (40, 40) if action.family is Family.FORWARD else (0, 0), (0, 0), (0.0, 0.0), 0.0)
        for action in trial.maneuver.actions
    )
    return Performance(tallies, len(tallies), progress=float(chance.normal(0.0, 0.005)))


def stimulus(step: int) -> int:
    """A fixed, uneven course of situations: 3 comes up half of the time, 0 never."""
    return (3, 1, 3, 2)[step % 4]


def coach(pal: Pal, chance: np.random.Generator, until: int | None = None) -> list[Trial]:
    trials = []
    while not pal.finished and (until is None or pal.used < until):
        step = pal.used
        trial = pal.ask(stimulus(step), stimulus(step - 1) if step else None)
        pal.tell(trial, toy(trial, chance))
        trials.append(trial)
    return trials


def test_the_budget_is_used_and_not_exceeded() -> None:
    pal = Pal(SMALL, np.random.default_rng(1))
    trials = coach(pal, np.random.default_rng(2))
    assert len(trials) == pal.used == SMALL.budget
    assert [trial.id for trial in trials] == list(range(1, SMALL.budget + 1))
    with pytest.raises(RuntimeError, match="budget"):
        pal.ask(3, None)


def test_phases_and_exam_get_their_shares() -> None:
    trials = coach(Pal(SMALL, np.random.default_rng(1)), np.random.default_rng(2))
    assert Counter((trial.phase, trial.exam) for trial in trials) == {(1, False): 120, (2, False): 120, (2, True): 60}
    for trial in trials:
        assert set(trial.maneuver.actions) <= set(BASIC_ACTIONS if trial.phase == 1 else FINE_ACTIONS)


def test_a_single_phase_has_its_alphabet_from_the_beginning() -> None:
    for phases, alphabet in (("basic", BASIC_ACTIONS), ("fine", FINE_ACTIONS)):
        settings = PalSettings.from_dict({**SMALL.to_dict(), "phases": phases})
        trials = coach(Pal(settings, np.random.default_rng(1)), np.random.default_rng(2))
        assert all(set(trial.maneuver.actions) <= set(alphabet) for trial in trials)


def test_pal_learns_the_toy() -> None:
    pal = Pal(PalSettings(budget=800, population=8), np.random.default_rng(1))
    coach(pal, np.random.default_rng(2))
    advice = pal.advice()
    for current in (1, 2, 3):
        assert sum(action.family is Family.FORWARD for action in advice.choose(current).actions) >= 3
    assert {entry.current for entry in advice.entries} == {1, 2, 3}
    assert all(entry.phase == 2 and entry.parents for entry in advice.entries)


def test_the_exam_tests_each_best_about_equally_often() -> None:
    trials = coach(Pal(SMALL, np.random.default_rng(1)), np.random.default_rng(2))
    tested = {str(trial.maneuver) for trial in trials if trial.exam and trial.category == (ANY_STIMULUS, 3)}
    assert SMALL.exam_best <= len(tested) <= 3 * SMALL.exam_best


def test_curves_are_as_long_as_their_situations_are_frequent() -> None:
    pal = Pal(SMALL, np.random.default_rng(1))
    coach(pal, np.random.default_rng(2))
    steps = Counter(record.category[1] for record in pal.history)
    assert steps[3] > steps[1] > 0
    assert 0 not in steps
    first = pal.history[0]
    assert isinstance(first, GenerationRecord)
    assert first.generation == 0
    assert first.best >= first.mean


def test_pairs_split_the_second_phase() -> None:
    settings = PalSettings.from_dict({**SMALL.to_dict(), "pairs": True})
    trials = coach(Pal(settings, np.random.default_rng(1)), np.random.default_rng(2))
    assert {trial.category for trial in trials if trial.phase == 1} == {(ANY_STIMULUS, current) for current in (1, 2, 3)}
    assert {trial.category for trial in trials if trial.phase == 2} == {(3, 1), (1, 3), (3, 2), (2, 3)}


def test_arms_are_part_of_the_situation_when_asked_for() -> None:
    settings = PalSettings.from_dict({**SMALL.to_dict(), "arms_in_stimulus": True})
    assert Pal(settings, np.random.default_rng(1)).ask(15, None).category[1] == 15
    settings = PalSettings.from_dict({**SMALL.to_dict(), "arms_in_stimulus": False})
    assert Pal(settings, np.random.default_rng(1)).ask(15, None).category[1] == 3


def test_a_discarded_trial_costs_nothing_and_comes_again() -> None:
    pal = Pal(SMALL, np.random.default_rng(1))
    trial = pal.ask(3, None)
    pal.discard(trial)
    assert pal.used == 0
    again = pal.ask(3, None)
    assert again.maneuver == trial.maneuver
    with pytest.raises(ValueError, match="not open"):
        pal.tell(trial, toy(trial, np.random.default_rng(2)))
    pal.tell(again, toy(again, np.random.default_rng(2)))
    with pytest.raises(ValueError, match="not open"):
        pal.tell(again, toy(again, np.random.default_rng(2)))


@pytest.mark.parametrize("cut", [1, 57, 120, 200, 260, 299])
def test_a_resumed_run_equals_the_run_not_cut(cut: int) -> None:
    whole = Pal(SMALL, np.random.default_rng(1))
    chance = np.random.default_rng(2)
    coach(whole, chance)

    first = Pal(SMALL, np.random.default_rng(1))
    chance = np.random.default_rng(2)
    coach(first, chance, until=cut)
    first.ask(stimulus(cut), None)  # cut between asking and telling
    resumed = Pal.from_state(json.loads(json.dumps(first.state_dict())))
    coach(resumed, chance)

    assert resumed.advice() == whole.advice()
    assert resumed.history == whole.history
    assert {**resumed.state_dict(), "asked": 0} == {**whole.state_dict(), "asked": 0}


def test_another_seed_learns_otherwise() -> None:
    states = []
    for seed in (1, 2):
        pal = Pal(SMALL, np.random.default_rng(seed))
        coach(pal, np.random.default_rng(2))
        states.append(pal.advice().to_dict())
    assert states[0] != states[1]


@pytest.mark.parametrize("bits", [np.random.PCG64, np.random.MT19937, np.random.Philox, np.random.SFC64])
def test_any_generator_of_numpy_survives_json(bits: type[np.random.BitGenerator]) -> None:
    rng = np.random.Generator(bits(1))
    state = json.loads(json.dumps(Pal(SMALL, rng).state_dict()))
    assert Pal.from_state(state).ask(3, None) == Pal(SMALL, rng).ask(3, None)


def test_a_damaged_state_is_refused() -> None:
    state = Pal(SMALL, np.random.default_rng(1)).state_dict()
    wrongs: list[dict[str, Any]] = [
        {"version": 99}, {"rng": {"bit_generator": "os"}}, {"populations": [{}]}, {"settings": {"period": 99.0}},
    ]  # fmt: skip
    for wrong in wrongs:
        with pytest.raises(StateError):
            Pal.from_state({**state, **wrong})
