"""Who chooses Junior's maneuvers."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from firmware_protocol.vocabulary import ANY_STIMULUS, FINE_ACTIONS, Action, Family, Maneuver, Stimulus
from hil.sumo.controllers import AdviceController, ChaseController, RandomController
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings


def test_random_maneuvers_are_fine_actions_all_of_them_alike() -> None:
    player = RandomController(np.random.default_rng(1), actions=4, period=0.3)
    drawn: Counter[Action] = Counter()
    for _ in range(2000):
        maneuver = player.choose(Stimulus.NONE, None)
        assert len(maneuver.actions) == 4
        assert maneuver.period == 0.3
        drawn.update(maneuver.actions)
    assert set(drawn) == set(FINE_ACTIONS)
    mean = 8000 / len(FINE_ACTIONS)
    assert all(abs(count - mean) < 6 * mean**0.5 for count in drawn.values())


def test_random_maneuvers_follow_from_their_source_of_chance() -> None:
    def play(seed: int) -> list[Maneuver]:
        player = RandomController(np.random.default_rng(seed))
        return [player.choose(Stimulus.NONE, None) for _ in range(5)]

    assert play(1) == play(1) != play(2)


@pytest.mark.parametrize("arms", [Stimulus.NONE, Stimulus.ARM_LEFT, Stimulus.ARM_LEFT | Stimulus.ARM_RIGHT])
@pytest.mark.parametrize(
    ("eyes", "family"),
    [
        (Stimulus.NONE, Family.LEFT),
        (Stimulus.EYE_LEFT, Family.LEFT),
        (Stimulus.EYE_RIGHT, Family.RIGHT),
        (Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT, Family.FORWARD),
    ],
)
def test_the_chaser_turns_to_the_eye_that_sees_whatever_the_arms_feel(eyes: Stimulus, family: Family, arms: Stimulus) -> None:
    maneuver = ChaseController().choose(eyes | arms, None)
    assert {action.family for action in maneuver.actions} == {family}
    assert maneuver.end_on_change


def test_advice_is_played_by_situation() -> None:
    entries = (
        AdviceEntry(ANY_STIMULUS, 0, (Action.L,), 1.0, 5),
        AdviceEntry(ANY_STIMULUS, 3, (Action.FF,), 1.0, 5),
        AdviceEntry(3, 0, (Action.R,), 1.0, 5),
    )
    player = AdviceController(Advice(PalSettings(actions=1, period=0.15), entries))
    both = Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT
    assert player.choose(Stimulus.NONE, None).actions == (Action.L,)
    assert player.choose(Stimulus.NONE, Stimulus.EYE_LEFT).actions == (Action.L,)
    assert player.choose(Stimulus.NONE, both).actions == (Action.R,)
    assert player.choose(both | Stimulus.ARM_LEFT, None) == Maneuver((Action.FF,), period=0.15, hold=True)
