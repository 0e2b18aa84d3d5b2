"""Eq. 10.1 and its two descendants, on hand-made tallies."""

from __future__ import annotations

import pytest

from firmware_protocol.vocabulary import ActionTally
from pal_advisor.maneuvers import Objective, ObjectiveError, PalSettings, Performance, SettingsError, fitness

BOOK = PalSettings(objective=Objective.CONTACT, contact_weight=1.0)
NOTHING = ActionTally(50, (0, 0), (0, 0), (0.0, 0.0), 0.0)
PUSH = ActionTally(50, (50, 50), (0, 0), (0.25, 0.25), 0.04)
HIT = ActionTally(50, (50, 50), (1, 1), (0.25, 0.25), 0.04)
STUCK = ActionTally(50, (50, 50), (0, 0), (0.25, 0.25), 0.004)


def performed(*tallies: ActionTally, **more: object) -> Performance:
    return Performance(tallies, 4, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("tally", "worth"),
    [
        (NOTHING, 0),
        (ActionTally(50, (25, 24), (0, 0), (0.0, 0.0), 0.0), 1),
        (ActionTally(0, (0, 0), (0, 0), (0.0, 0.0), 0.0), 0),
        (ActionTally(50, (0, 0), (2, 0), (0.0, 0.0), 0.0), 1),
        (ActionTally(50, (0, 0), (0, 0), (0.1, 0.099), 0.0), 1),
        (PUSH, 4),
        (HIT, 6),
    ],
)
def test_an_action_is_worth_what_it_saw_held_and_hit(tally: ActionTally, worth: float) -> None:
    assert fitness(performed(tally), BOOK) == worth


def test_a_perfect_maneuver_is_worth_24() -> None:
    assert fitness(performed(HIT, HIT, HIT, HIT), BOOK) == 24


def test_actions_undone_because_the_bout_was_won_count_in_full() -> None:
    assert fitness(performed(HIT, NOTHING, won=True), BOOK) == 6 + 0 + 2 * 6
    assert fitness(performed(HIT, NOTHING), BOOK) == 6


def test_action_weights_weigh_actions_in_order() -> None:
    weighted = PalSettings(objective=Objective.CONTACT, contact_weight=1.0, action_weights=(1.0, 2.0, 0.0, 0.5))
    assert fitness(performed(HIT, PUSH, HIT, won=True), weighted) == 6 + 2 * 4 + 0 + 0.5 * 6


def test_a_hold_is_effective_only_when_ground_was_gained() -> None:
    effective = PalSettings(objective=Objective.EFFECTIVE, contact_weight=1.0)
    assert fitness(performed(STUCK), BOOK) == 4
    assert fitness(performed(STUCK), effective) == 2
    assert fitness(performed(PUSH), effective) == 4


def test_an_effective_hold_is_refused_without_a_ground_odometer() -> None:
    blind = ActionTally(50, (50, 50), (1, 1), (0.25, 0.25), None)
    with pytest.raises(ObjectiveError, match="no ground odometer"):
        fitness(performed(blind), PalSettings(objective=Objective.EFFECTIVE))
    assert fitness(performed(blind), BOOK) == 6


def test_the_outcome_needs_no_ground_odometer_but_then_no_hold_counts() -> None:
    blind = ActionTally(50, (50, 50), (1, 1), (0.25, 0.25), None)
    outcome = PalSettings(objective=Objective.OUTCOME, contact_weight=1.0, score_weight=1.0)
    assert fitness(performed(blind, progress=0.05), outcome) == pytest.approx(4 + 6)


def test_the_outcome_adds_progress_and_the_end_of_the_bout() -> None:
    outcome = PalSettings(objective=Objective.OUTCOME, contact_weight=1.0, score_weight=1.0)
    assert fitness(performed(PUSH, progress=0.05), outcome) == pytest.approx(4 + 6)
    assert fitness(performed(PUSH, progress=0.05, won=True), outcome) == pytest.approx(4 + 18 + 6 + 12)
    assert fitness(performed(NOTHING, lost=True), outcome) == -20


def test_the_score_can_weigh_less_than_the_outcome() -> None:
    outcome = PalSettings(objective=Objective.OUTCOME, contact_weight=1.0, score_weight=0.25)
    assert fitness(performed(PUSH, progress=0.05), outcome) == pytest.approx(1 + 6)


def test_a_performance_must_be_possible() -> None:
    with pytest.raises(ValueError, match="only 1 planned"):
        Performance((HIT, HIT), 1)
    with pytest.raises(ValueError, match="not both"):
        Performance((), 1, won=True, lost=True)


@pytest.mark.parametrize(
    "wrong",
    [
        {"actions": 0}, {"actions": 9}, {"period": 0.01}, {"population": 1}, {"elite": 20}, {"budget": 0}, {"mutation": 1.5},
        {"caution": -1.0}, {"win": float("nan")}, {"action_weights": (1.0,)}, {"phases": "three"}, {"objective": "fame"},
    ],
)  # fmt: skip
def test_settings_that_make_no_sense_are_refused_by_name(wrong: dict[str, object]) -> None:
    with pytest.raises(SettingsError) as caught:
        PalSettings(**wrong)  # type: ignore[arg-type]
    assert caught.value.path == next(iter(wrong))


def test_settings_survive_as_plain_values() -> None:
    settings = PalSettings(objective=Objective.EFFECTIVE, action_weights=(1.0, 1.0, 0.5, 0.5), pairs=True)
    assert PalSettings.from_dict(settings.to_dict()) == settings
    for name, value in {"period": "slow", "pairs": 1, "unheard": 1, "objective": "fame", "action_weights": ["x"]}.items():
        with pytest.raises(SettingsError, match=name):
            PalSettings.from_dict({**settings.to_dict(), name: value})
