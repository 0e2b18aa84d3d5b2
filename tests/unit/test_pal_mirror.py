"""Left and right exchanged: actions, situations, and a learner that is taught on one side and knows the other."""

from __future__ import annotations

import numpy as np
import pytest

from firmware_protocol.vocabulary import ANY_STIMULUS, BASIC_ACTIONS, FINE_ACTIONS, Action, ActionTally, Stimulus
from pal_advisor.maneuvers import Pal, PalSettings, Performance
from pal_advisor.maneuvers.mirror import home_of, is_symmetric, one_of_two, reflected, reflected_category

LEFT, RIGHT, BOTH = int(Stimulus.EYE_LEFT), int(Stimulus.EYE_RIGHT), 3
SETTINGS = PalSettings(budget=200, population=6)


def codes(names: str) -> tuple[int, ...]:
    return tuple(int(Action[name]) for name in names.split())


def test_an_action_and_its_image_exchange_the_wheels_and_stay_in_their_alphabet() -> None:
    for action in Action:
        (image,) = reflected((int(action),))
        assert (Action(image).spec.left, Action(image).spec.right) == (action.spec.right, action.spec.left)
        assert Action(image).spec.speed == action.spec.speed
        for alphabet in (BASIC_ACTIONS, FINE_ACTIONS):
            assert (action in alphabet) == (Action(image) in alphabet)
        assert reflected((image,)) == (int(action),)
    assert reflected(codes("LSRF LBRS F L")) == codes("LFRS LSRB F R")


@pytest.mark.parametrize(
    ("category", "home", "mirrored"),
    [
        ((ANY_STIMULUS, LEFT), (ANY_STIMULUS, LEFT), False),
        ((ANY_STIMULUS, RIGHT), (ANY_STIMULUS, LEFT), True),
        ((ANY_STIMULUS, BOTH), (ANY_STIMULUS, BOTH), False),
        ((RIGHT, BOTH), (LEFT, BOTH), True),
        ((LEFT, RIGHT), (RIGHT, LEFT), True),
        ((ANY_STIMULUS, 3 | 8), (ANY_STIMULUS, 3 | 4), True),
        ((ANY_STIMULUS, 1 | 8), (ANY_STIMULUS, 1 | 8), False),
        ((ANY_STIMULUS, 2 | 4), (ANY_STIMULUS, 1 | 8), True),
    ],
)
def test_a_situation_and_its_image_have_one_home(category: tuple[int, int], home: tuple[int, int], mirrored: bool) -> None:  # noqa: FBT001
    assert home_of(category) == (home, mirrored)
    assert home_of(reflected_category(category))[0] == home
    assert not (mirrored and is_symmetric(category))


def test_every_pair_of_situations_has_one_home() -> None:
    everything = [(previous, current) for previous in (*range(16), ANY_STIMULUS) for current in range(16)]
    homes = {home_of(category)[0] for category in everything}
    assert all(home_of(home) == (home, False) for home in homes)
    symmetric = sum(map(is_symmetric, everything))
    assert len(homes) == (len(everything) + symmetric) // 2


def test_of_a_maneuver_and_its_image_the_one_that_turns_left_first_is_kept() -> None:
    assert one_of_two(codes("FF R L S")) == codes("FF L R S")
    assert one_of_two(codes("FF L R S")) == codes("FF L R S")
    assert one_of_two(codes("FF SB S S")) == codes("FF SB S S")


def coached(settings: PalSettings, course: tuple[int, ...]) -> Pal:
    """Worth is how far the robot turns to the side that sees."""
    pal, chance = Pal(settings, np.random.default_rng(1)), np.random.default_rng(2)
    while not pal.finished:
        current = course[pal.used % len(course)]
        trial = pal.ask(current, None)
        side = {LEFT: 1, RIGHT: -1}.get(current, 0)
        turned = sum(side * (action.spec.right - action.spec.left) for action in trial.maneuver.actions)
        tally = ActionTally(30, (0, 0), (0, 0), (0.0, 0.0), 0.0)
        pal.tell(trial, Performance((tally,) * 4, 4, progress=0.02 * turned + float(chance.normal(0.0, 0.005)), over=True))
    return pal


def test_what_is_learnt_on_one_side_is_advice_for_the_other() -> None:
    advice = coached(SETTINGS, (LEFT, BOTH)).advice()
    left, right = advice.choose(LEFT), advice.choose(RIGHT)
    assert sum(action.spec.right - action.spec.left for action in left.actions) >= 4
    assert tuple(int(action) for action in right.actions) == reflected(tuple(int(action) for action in left.actions))
    assert [entry.current for entry in advice.entries] == [LEFT, RIGHT, BOTH]


def test_experience_on_both_sides_is_one() -> None:
    pal = coached(SETTINGS, (LEFT, RIGHT))
    assert {record.category for record in pal.history} == {(ANY_STIMULUS, LEFT)}
    turned = pal.advice().choose(RIGHT)
    assert sum(action.spec.left - action.spec.right for action in turned.actions) >= 4


def test_a_trial_says_that_it_is_mirrored_and_names_the_parents_as_they_would_have_been() -> None:
    pal = coached(SETTINGS, (RIGHT,))
    entry = pal.advice().find(RIGHT)
    assert entry.parents
    again = Pal.from_state({**pal.state_dict(), "used": 100})
    trial = again.ask(RIGHT, None)
    assert trial.mirrored
    assert trial.category == (ANY_STIMULUS, RIGHT)
    assert not again.ask(LEFT, None).mirrored


def test_without_it_the_sides_know_nothing_of_each_other() -> None:
    advice = coached(PalSettings.from_dict({**SETTINGS.to_dict(), "mirror": False}), (LEFT, BOTH)).advice()
    assert [entry.current for entry in advice.entries] == [LEFT, BOTH]


def test_in_a_symmetric_situation_no_member_turns_right_first() -> None:
    for entry in coached(SETTINGS, (BOTH, 0)).state_dict()["populations"]:
        for genome, *_ in entry["archive"]:
            assert one_of_two(tuple(genome)) == tuple(genome)
