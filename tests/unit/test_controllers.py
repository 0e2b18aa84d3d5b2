"""Who chooses Junior's maneuvers."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
import pytest

import hil
from firmware_protocol.vocabulary import ANY_STIMULUS, FINE_ACTIONS, Action, Family, Maneuver, Stimulus
from hil.sumo.bouts import Tally, play
from hil.sumo.controllers import (
    BUILT_IN,
    AdviceController,
    Chase2Controller,
    ChaseController,
    HobbyController,
    RandomController,
)
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import Advice, AdviceEntry, PalSettings

if TYPE_CHECKING:
    from hil.sumo.controllers import Controller


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


NONE, LEFT, RIGHT = Stimulus.NONE, Stimulus.EYE_LEFT, Stimulus.EYE_RIGHT
BOTH = LEFT | RIGHT
TOUCH = Stimulus.ARM_LEFT | Stimulus.ARM_RIGHT


def told(player: Controller, *stimuli: Stimulus) -> list[str]:
    """What a controller does as it senses one thing after the other from the beginning of a bout."""
    before: list[Stimulus | None] = [None, *stimuli]
    return [str(player.choose(current, previous)) for current, previous in zip(stimuli, before, strict=False)]


def test_the_rammer_backs_off_from_what_it_has_pushed_for_a_while_and_rams_it() -> None:
    ahead = "FF FF FF FF FF FF FF FF"
    assert told(Chase2Controller(), BOTH, BOTH | TOUCH, BOTH | TOUCH, BOTH | TOUCH, BOTH | TOUCH) == [
        ahead, ahead, "FB", ahead, "FB",
    ]  # fmt: skip


def test_the_rammer_goes_on_pushing_where_the_contact_has_changed() -> None:
    one = LEFT | Stimulus.ARM_LEFT
    assert "FB" not in told(Chase2Controller(), one, BOTH | TOUCH, RIGHT | Stimulus.ARM_RIGHT, BOTH, BOTH | TOUCH)


def test_the_rammer_goes_on_a_little_after_what_is_lost_from_sight_then_looks_round() -> None:
    look = "LBRF LBRF LBRF LBRF LBRF LBRF LBRF LBRF"
    assert told(Chase2Controller(), NONE, LEFT, NONE, NONE, NONE)[1:] == ["LBRF FF FF LBRF FF FF", "FF", look, "FF"]
    assert told(Chase2Controller(), NONE) == [look]


def test_the_hobby_robot_turns_to_where_it_has_seen_the_other_last() -> None:
    assert told(HobbyController(), RIGHT, NONE)[1].startswith("LFRB")
    assert told(HobbyController(), LEFT, NONE)[1].startswith("LBRF")


def test_the_hobby_robot_searches_elsewhere_after_a_turn() -> None:
    assert told(HobbyController(), NONE, NONE, NONE)[1:] == ["MF MF", "LBRF LBRF LBRF LBRF LBRF LBRF LBRF LBRF"]


def test_the_hobby_robot_evades_a_stalemate_to_the_other_side() -> None:
    assert told(HobbyController(), RIGHT, BOTH | TOUCH, BOTH | TOUCH)[2] == "FB FB LSRF LSRF"
    assert told(HobbyController(), LEFT, BOTH | TOUCH, BOTH | TOUCH)[2] == "FB FB LFRS LFRS"


@pytest.mark.parametrize("name", ["chase2", "hobby"])
def test_a_bout_knows_nothing_of_the_one_before(name: str) -> None:
    stimuli = [NONE, NONE, RIGHT, BOTH | TOUCH, BOTH | TOUCH, NONE]
    player = BUILT_IN[name](np.random.default_rng(1))
    assert [told(player, *stimuli) for _ in range(2)] == [told(BUILT_IN[name](np.random.default_rng(1)), *stimuli)] * 2


@pytest.mark.slow
@pytest.mark.parametrize("opponent", ["flat-light", "flat-heavy", "curved-light", "corner-light", "point-light"])
def test_the_rammer_beats_every_dummy(opponent: str) -> None:
    with hil.connect(f"sim://junior?opponent={opponent}") as junior:
        junior.arm()
        bouts = list(play(open_ring(junior, opponent), Chase2Controller(), range(100, 140)))
    assert Tally.of(opponent, bouts).wins >= 38
