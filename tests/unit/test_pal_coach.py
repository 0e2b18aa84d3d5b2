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
from pal_advisor.maneuvers import GenerationRecord, Motive, Pal, PalSettings, Performance, StateError, Trial
from pal_advisor.maneuvers.coach import MOST_EXAM_VISITS
from pal_advisor.maneuvers.settings import BEFORE

SMALL = PalSettings(budget=300, population=8)
PLAIN = PalSettings.from_dict({**SMALL.to_dict(), **BEFORE})
"""Without a model, without mirror images: what is known of a maneuver is what was seen of it."""


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
        known = set(BASIC_ACTIONS) if trial.phase == 1 else {*BASIC_ACTIONS, *FINE_ACTIONS}
        assert set(trial.maneuver.actions) <= known
    fresh = [trial for trial in trials if trial.phase == 2 and set(trial.maneuver.actions) <= set(FINE_ACTIONS)]
    assert len(fresh) > 60


def test_a_single_phase_has_its_alphabet_from_the_beginning() -> None:
    for phases, alphabet in (("basic", BASIC_ACTIONS), ("fine", FINE_ACTIONS)):
        settings = PalSettings.from_dict({**SMALL.to_dict(), "phases": phases})
        trials = coach(Pal(settings, np.random.default_rng(1)), np.random.default_rng(2))
        assert all(set(trial.maneuver.actions) <= set(alphabet) for trial in trials)


def test_pal_learns_the_toy() -> None:
    pal = Pal(PalSettings(budget=1600), np.random.default_rng(1))
    coach(pal, np.random.default_rng(2))
    advice = pal.advice()
    for current in (1, 2, 3):
        assert sum(action.family is Family.FORWARD for action in advice.choose(current).actions) >= 3
    assert {entry.current for entry in advice.entries} == {1, 2, 3}
    assert all(entry.parents for entry in advice.entries if entry.phase == 2)


def test_the_exam_tests_few() -> None:
    pal = Pal(SMALL, np.random.default_rng(1))
    trials = coach(pal, np.random.default_rng(2))
    tested = {trial.maneuver.actions for trial in trials if trial.exam and trial.category == (ANY_STIMULUS, 3)}
    learnt = {trial.maneuver.actions for trial in trials if not trial.exam and trial.category == (ANY_STIMULUS, 3)}
    assert len(tested) < len(learnt) / 2


def test_the_best_known_is_performed_in_its_share_of_the_learning() -> None:
    def repeats(greedy: float) -> int:
        pal = Pal(PalSettings.from_dict({**SMALL.to_dict(), "greedy": greedy}), np.random.default_rng(1))
        return max(Counter(trial.maneuver for trial in coach(pal, np.random.default_rng(2)) if not trial.exam).values())

    assert repeats(0.8) > 2 * repeats(0.0)


def test_what_follows_is_credited_with_fading_weight() -> None:
    """A turn that earns nothing itself is paid by the push after it, discounted by the time between."""
    pal = Pal(PalSettings.from_dict({**PLAIN.to_dict(), "credit": 0.25, "objective": "contact"}), np.random.default_rng(1))
    nothing = ActionTally(100, (0, 0), (0, 0), (0.0, 0.0), 0.0)
    push = ActionTally(100, (100, 100), (0, 0), (0.5, 0.5), 0.0)
    first = pal.ask(1, None)
    pal.tell(first, Performance((nothing,), 4))
    second = pal.ask(3, 1)
    pal.tell(second, Performance((push,), 4, over=True))
    turn, forward = pal.advice().entries
    assert turn.fitness == pytest.approx(4.0 * 0.25**0.5)
    assert forward.fitness == pytest.approx(4.0)


def test_without_credit_a_maneuver_has_its_own_fitness_alone() -> None:
    pal = Pal(PalSettings.from_dict({**PLAIN.to_dict(), "credit": 0.0, "objective": "contact"}), np.random.default_rng(1))
    push = ActionTally(100, (100, 100), (0, 0), (0.5, 0.5), 0.0)
    for current, won in ((1, False), (3, True)):
        pal.tell(pal.ask(current, None), Performance((push,), 4, won=won))
    first, second = pal.advice().entries
    assert first.fitness == pytest.approx(4.0)
    assert second.fitness == pytest.approx(4.0 + 3 * 6.0)


def test_after_a_win_everything_counts_in_full() -> None:
    """The limit of a bout that goes on for ever with every action worth the most: rate / -ln(credit)."""
    settings = PalSettings.from_dict({**PLAIN.to_dict(), "credit": 0.5, "objective": "contact"})
    pal = Pal(settings, np.random.default_rng(1))
    perfect = ActionTally(30, (30, 30), (1, 1), (0.15, 0.15), 0.0)
    pal.tell(pal.ask(3, None), Performance((perfect,), 4, won=True, duration=0.15))
    rest = 6.0 / settings.period / np.log(2.0) * 0.5 ** (4 * settings.period)
    assert pal.advice().entries[0].fitness == pytest.approx(4 * 6.0 + rest)


def test_a_performance_without_an_action_is_refused() -> None:
    pal = Pal(SMALL, np.random.default_rng(1))
    with pytest.raises(ValueError, match="discard"):
        pal.tell(pal.ask(3, None), Performance((), 4))


def test_curves_are_as_long_as_their_situations_are_frequent() -> None:
    pal = Pal(PLAIN, np.random.default_rng(1))
    coach(pal, np.random.default_rng(2))
    steps = Counter(record.category[1] for record in pal.history)
    assert steps[3] > 0
    assert 0 not in steps
    assert max(record.evaluations for record in pal.history if record.category[1] == 3) > 100
    assert max((record.evaluations for record in pal.history if record.category[1] == 1), default=0) < 80
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


def in_bouts(pal: Pal, chance: np.random.Generator, length: int = 12) -> list[list[Trial]]:
    """Coach by bouts of so many maneuvers."""
    bouts: list[list[Trial]] = []
    while not pal.finished:
        bouts.append([])
        for step in range(min(length, pal.settings.budget - pal.used)):
            trial = pal.ask(stimulus(step), None)
            performance = toy(trial, chance)
            pal.tell(trial, Performance(performance.tallies, 4, progress=performance.progress, over=step == length - 1))
            bouts[-1].append(trial)
    return bouts


def test_a_maneuver_is_handed_out_again_when_its_situation_comes_up_again_in_the_same_bout() -> None:
    for bout in in_bouts(Pal(SMALL, np.random.default_rng(1)), np.random.default_rng(2)):
        both = [trial for trial in bout if trial.category[1] == 3]
        if any(trial.exam for trial in both):
            continue
        assert [trial.motive is Motive.AGAIN for trial in both] == [False, True] * (len(both) // 2)
        for first, second in zip(both[::2], both[1::2], strict=True):
            assert first.maneuver == second.maneuver


def test_in_the_exam_a_situation_keeps_one_maneuver_for_the_whole_bout() -> None:
    bouts = in_bouts(Pal(SMALL, np.random.default_rng(1)), np.random.default_rng(2))
    exams = [bout for bout in bouts if bout[0].exam]
    assert len(exams) >= 4
    for bout in exams:
        assert len({trial.maneuver for trial in bout if trial.category[1] == 3}) == 1
    assert len({bout[0].maneuver for bout in exams}) > 1


def test_where_no_bout_ends_the_exam_tests_several_all_the_same() -> None:
    pal = Pal(PalSettings.from_dict({**SMALL.to_dict(), "budget": 1000}), np.random.default_rng(1))
    tested = [trial.maneuver for trial in coach(pal, np.random.default_rng(2)) if trial.exam and trial.category[1] == 3]
    assert len(tested) == 100
    assert len(set(tested)) > 1
    assert len(set(tested[:MOST_EXAM_VISITS])) <= 2


def test_a_budget_of_robot_time_is_shared_as_one_of_maneuvers_is() -> None:
    """Each maneuver of the toy takes 4 x 0.2 s: 300 take 240 s."""
    timed = PalSettings.from_dict({**SMALL.to_dict(), "robot_time": 240.0, "budget": 5})
    trials = coach(Pal(timed, np.random.default_rng(1)), np.random.default_rng(2))
    assert trials == coach(Pal(SMALL, np.random.default_rng(1)), np.random.default_rng(2))


def test_a_run_on_robot_time_equals_the_run_not_cut() -> None:
    settings = PalSettings.from_dict({**SMALL.to_dict(), "robot_time": 60.0})
    pal, chance = Pal(settings, np.random.default_rng(1)), np.random.default_rng(2)
    coach(pal, chance, until=40)
    state = json.loads(json.dumps(pal.state_dict()))
    again, rest = Pal.from_state(state), np.random.default_rng(5)
    assert coach(again, rest) == coach(pal, np.random.default_rng(5))
    assert again.seconds == pal.seconds == pytest.approx(60.0)
