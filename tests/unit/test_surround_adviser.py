"""The adviser of the surround task: who moves where, who learns from what, and whose number is drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from firmware_protocol.vocabulary import RobotClass, SwarmOutcome
from pal_advisor.surround import (
    Case,
    GroupSettings,
    Lesson,
    Motion,
    Moves,
    Results,
    RobotGroup,
    Sensing,
    Sights,
    Surround,
    case_settings,
    stimuli_of,
)
from pal_advisor.surround.experience import updated

UNIFORM = [0.125] * 8
RANGERS = GroupSettings(RobotClass.RANGER, 3)
WILDS = GroupSettings(RobotClass.WILD, 2)


def sights(
    near: list[int], seen: list[int] | None = None, *, count: int = 1, radius: float = 200.0, there: list[int] | None = None
) -> Sights:
    """What robots see; where nobody is near, one is seen in sector 8 by the grown radius."""
    rows = len(near)
    grown = [pattern or 1 for pattern in near] if seen is None else seen
    return Sights(
        np.ones(rows, dtype=np.bool_) if there is None else np.array(there, dtype=np.bool_),
        np.array(near, dtype=np.int64),
        np.array(grown, dtype=np.int64),
        np.full(rows, count),
        np.full(rows, radius),
    )


def results(outcome: list[int], count_before: list[int], radius: float = 200.0) -> Results:
    return Results(np.array(outcome), np.array(count_before), np.full(len(outcome), radius))


def group(**changes: Any) -> RobotGroup:  # noqa: ANN401
    return RobotGroup(replace(RANGERS, **changes))


def bits(rng: np.random.Generator) -> object:
    return rng.bit_generator.state["state"]


def prefer(robots: RobotGroup, behaviour: int) -> None:
    """Give a behaviour all the weight, whatever the stimulus."""
    robots.experience.weights[:] = 0.0
    robots.experience.weights[:, behaviour - 1] = 1.0


def test_a_move_goes_to_the_sector_that_ret_gives() -> None:
    robots = group()
    prefer(robots, 8)
    moves = robots.ask(sights([0b00000001, 0b00100000, 0b00011000]), np.random.default_rng(1))
    assert moves.stimulus.tolist() == [2, 2, 3]
    assert moves.behaviour.tolist() == [8, 8, 8]
    assert moves.sector.tolist() == [8, 3, 5]
    assert robots.met[:3].tolist() == [0, 2, 1]


@pytest.mark.parametrize(
    ("sensing", "stimuli", "sectors"),
    [(Sensing.HYBRID, [1, 2, 3], [3, 4, 5]), (Sensing.ADJUSTABLE, [2, 2, 3], [3, 4, 5]), (Sensing.FIXED, [1, 2, 3], [8, 4, 5])],
)
def test_what_makes_stimulus_and_frame(sensing: Sensing, stimuli: list[int], sectors: list[int]) -> None:
    robots = group(sensing=sensing)
    prefer(robots, 8)
    seen = sights([0, 0b00010000, 0b00011000], [0b00100000, 0b00010000, 0b00011000])
    moves = robots.ask(seen, np.random.default_rng(1))
    assert (moves.stimulus.tolist(), moves.sector.tolist()) == (stimuli, sectors)


def test_turning_every_heading_turns_every_move() -> None:
    """What robots see shifts by as many sectors as they turn, and so do their moves; weights and draws are the same."""
    near = [0b00000001, 0b00101100, 0b01110000]
    first = group().ask(sights(near), np.random.default_rng(5))
    for step in range(1, 8):
        shifted = [(pattern << step | pattern >> 8 - step) & 255 for pattern in near]
        moves = group().ask(sights(shifted), np.random.default_rng(5))
        assert moves.behaviour.tolist() == first.behaviour.tolist()
        assert ((moves.sector - first.sector) % 8).tolist() == [8 - step] * 3


def test_mirroring_the_world_mirrors_the_moves_where_the_frame_is_unique() -> None:
    near = [0b00001011, 0b00110100, 0b01101110]
    image = [int(f"{pattern:08b}"[::-1], 2) for pattern in near]
    first, second = (group().ask(sights(each), np.random.default_rng(5)) for each in (near, image))
    assert (first.sector + second.sector).tolist() == [9, 9, 9]


def tell(
    count_before: int,
    outcome: int = SwarmOutcome.ARRIVED,
    *,
    radius: float = 200.0,
    **changes: Any,  # noqa: ANN401
) -> tuple[RobotGroup, Moves, Lesson]:
    """One robot of three moves and is told of."""
    robots = group(**changes)
    moves = robots.ask(sights([1, 1, 1], there=[0, 1, 0]), np.random.default_rng(1))
    return robots, moves, robots.tell(results([0, outcome, 0], [9, count_before, 9], radius))


def test_weights_are_updated_by_who_came_inside() -> None:
    robots, moves, learnt = tell(2)
    assert learnt.delta.tolist() == [0, 0.5, 0]
    assert learnt.learnt.tolist() == [False, True, False]
    assert learnt.changed.tolist() == [2]
    assert robots.experience.weights[1].tolist() == updated(UNIFORM, int(moves.behaviour[1]) - 1, 0.5, smoothing=True)


def test_wilds_want_others_out_of_their_radius() -> None:
    assert tell(2, kind=RobotClass.WILD)[2].delta.tolist() == [0, -0.5, 0]
    assert tell(0, kind=RobotClass.WILD)[2].delta.tolist() == [0, 0.5, 0]


def test_an_increment_is_1_at_most() -> None:
    assert tell(200)[2].delta[1] == 1.0
    assert tell(2, gain=0.0)[2].delta[1] == 0.0


@pytest.mark.parametrize("outcome", [SwarmOutcome.ARRIVED, SwarmOutcome.BLOCKED, SwarmOutcome.TIMED_OUT])
def test_these_moves_are_learnt_from(outcome: SwarmOutcome) -> None:
    assert tell(2, outcome)[2].changed.tolist() == [2]


@pytest.mark.parametrize("outcome", [SwarmOutcome.NONE, SwarmOutcome.STOPPED, SwarmOutcome.REFUSED, SwarmOutcome.REPLACED])
def test_these_moves_are_not(outcome: SwarmOutcome) -> None:
    robots, _, learnt = tell(2, outcome)
    assert not learnt.learnt.any()
    assert (robots.experience.weights == 0.125).all()


def test_nothing_is_learnt_from_another_radius() -> None:
    assert not tell(2, radius=250.0)[2].learnt.any()


def test_nothing_is_learnt_without_learning() -> None:
    assert not tell(2, learning=False)[2].learnt.any()
    assert not tell(2, motion=Motion.RANDOM)[2].learnt.any()


def test_an_unchanged_count_changes_nothing() -> None:
    robots, _, learnt = tell(1)
    assert learnt.learnt.tolist() == [False, True, False]
    assert (robots.experience.weights == 0.125).all()


def test_who_did_not_move_learns_nothing() -> None:
    robots = group(motion=Motion.STATIONARY)
    moves = robots.ask(sights([1, 1, 1]), np.random.default_rng(1))
    assert moves.sector.tolist() == [0, 0, 0]
    assert moves.stimulus.tolist() == [2, 2, 2]
    assert not robots.tell(results([1, 1, 1], [5, 5, 5])).learnt.any()


def test_a_move_is_told_of_once() -> None:
    robots, _, _ = tell(2)
    assert not robots.tell(results([1, 1, 1], [2, 2, 2])).learnt.any()


def test_robots_learn_one_after_the_other() -> None:
    robots = group()
    moves = robots.ask(sights([1, 128, 64]), np.random.default_rng(3))
    robots.tell(results([1, 1, 1], [2, 0, 3]))
    expected = UNIFORM
    for behaviour, delta in zip(moves.behaviour.tolist(), (0.5, -0.5, 1.0), strict=True):
        expected = updated(expected, behaviour - 1, delta, smoothing=True)
    assert robots.experience.weights[1].tolist() == expected


def test_who_is_there_draws_one_number_and_who_is_not_draws_none() -> None:
    rng, counted = np.random.default_rng(7), np.random.default_rng(7)
    moves = group().ask(sights([1, 999, 1], there=[1, 0, 1]), rng)
    counted.random(2)
    assert bits(rng) == bits(counted)
    assert moves.stimulus.tolist() == [2, 0, 2]
    assert moves.sector[1] == 0


@pytest.mark.parametrize("changes", [{"motion": Motion.STATIONARY}, {"feasible": "00000000"}, {"robots": 0}])
def test_who_can_not_move_draws_none(changes: dict[str, Any]) -> None:
    rng = np.random.default_rng(7)
    robots = group(**changes)
    moves = robots.ask(sights([1] * robots.settings.robots), rng)
    assert not moves.sector.any()
    assert bits(rng) == bits(np.random.default_rng(7))
    assert not robots.tell(results([1] * len(moves.sector), [2] * len(moves.sector))).learnt.any()


def test_the_only_feasible_behaviour_is_performed_and_keeps_its_weight() -> None:
    robots = group(feasible="00000100")
    for seed in range(5):
        moves = robots.ask(sights([1, 3, 0]), np.random.default_rng(seed))
        assert moves.behaviour.tolist() == [6, 6, 6]
        robots.tell(results([1, 1, 1], [0, 3, 0]))
    assert (robots.experience.weights[:, 5] == 1.0).all()
    assert robots.redraw(np.ones(3, dtype=np.bool_), np.random.default_rng(1)).sector.tolist() == [0, 0, 0]


def test_what_is_not_feasible_is_never_selected() -> None:
    robots, rng = group(feasible="10100000"), np.random.default_rng(1)
    seen = {int(one) for _ in range(100) for one in robots.ask(sights([1, 3, 0]), rng).behaviour}
    assert seen == {1, 3}


def test_a_refused_move_is_drawn_again_once() -> None:
    robots, rng = group(), np.random.default_rng(1)
    first = robots.ask(sights([1, 3, 0b1011]), rng)
    second = robots.redraw(np.array([False, True, False]), rng)
    assert second.behaviour[[0, 2]].tolist() == first.behaviour[[0, 2]].tolist()
    assert second.behaviour[1] not in {0, first.behaviour[1]}
    third = robots.redraw(np.array([True, True, False]), rng)
    assert third.sector[1] == 0, "refused again: it stays"
    assert third.sector[0] not in {0, first.sector[0]}
    learnt = robots.tell(results([1, 1, 1], [2, 2, 2]))
    assert learnt.learnt.tolist() == [True, False, True]
    assert robots.experience.weights[2].tolist() == UNIFORM
    assert robots.experience.weights[1].argmax() + 1 == third.behaviour[0], "learnt is what it did, not what was refused"


@pytest.mark.parametrize("by_maximum", [True, False])
def test_the_rest_is_as_if_what_was_refused_were_not_feasible(by_maximum: bool) -> None:  # noqa: FBT001
    robots = group(by_maximum=by_maximum)
    robots.experience.weights[1] = [0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.7]
    robots.experience.weights[2] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    for seed in range(20):
        rng = np.random.default_rng(seed)
        first = robots.ask(sights([1, 1, 3]), rng)
        second = robots.redraw(np.ones(3, dtype=np.bool_), rng)
        assert (first.behaviour + second.behaviour)[:2].tolist() == [9, 9]
        assert 1 <= second.behaviour[2] <= 7, "of weights that are all 0 any"
    assert robots.experience.weights[1].tolist()[7] == 0.7


def test_only_who_is_drawn_again_draws_a_number() -> None:
    robots, rng, counted = group(), np.random.default_rng(1), np.random.default_rng(1)
    robots.ask(sights([1, 1, 1]), rng)
    robots.redraw(np.array([True, False, True]), rng)
    robots.redraw(np.array([True, False, True]), rng)
    counted.random(5)
    assert bits(rng) == bits(counted)


def test_conditional_motion_overrides_selection_and_learns() -> None:
    robots = group(motion=Motion.CONDITIONAL, conditional={2: 5})
    prefer(robots, 1)
    moves = robots.ask(sights([1, 3, 0]), np.random.default_rng(1))
    assert moves.behaviour.tolist() == [5, 1, 1]
    assert robots.tell(results([1, 1, 1], [2, 1, 1])).changed.tolist() == [2]


def test_random_motion_minds_no_weights() -> None:
    robots, rng = group(motion=Motion.RANDOM), np.random.default_rng(1)
    prefer(robots, 1)
    assert len({int(one) for _ in range(100) for one in robots.ask(sights([1, 3, 0]), rng).behaviour}) == 8


def test_a_robot_whose_weights_stand_still_mutates_once() -> None:
    """RC1, Eq. 7.8: after three rounds without a change, then again after three."""
    robots, rng = group(mutate_after=3), np.random.default_rng(4)
    prefer(robots, 8)
    mutated = []
    for round_ in range(9):
        moves = robots.ask(sights([1, 3, 0b101 if round_ % 2 else 3], there=[1, round_ != 1, 1]), rng)
        robots.tell(results([1, 1, 1], [1, 1, 1]))
        mutated.append(moves.mutated.tolist())
        assert (moves.behaviour == 8)[~moves.mutated & (moves.behaviour > 0)].all()
    assert [row[0] for row in mutated] == [False, False, False, True, False, False, True, False, False]
    assert [row[1] for row in mutated] == [False, False, False, False, True, False, False, True, False]
    assert not any(row[2] for row in mutated), "it meets now this, now that"


def test_a_robot_whose_weights_change_does_not_mutate() -> None:
    robots, rng = group(mutate_after=2), np.random.default_rng(4)
    for round_ in range(12):
        moves = robots.ask(sights([1, 1, 1]), rng)
        assert not moves.mutated.any()
        robots.tell(results([1, 1, 1], [1 + (round_ % 2), 1, 1]))


def test_a_mutated_move_is_learnt_from() -> None:
    robots, rng = group(mutate_after=1), np.random.default_rng(4)
    robots.ask(sights([1, 1, 1]), rng)
    robots.tell(results([1, 1, 1], [1, 1, 1]))
    assert robots.ask(sights([1, 1, 1]), rng).mutated.all()
    assert robots.tell(results([1, 1, 1], [2, 2, 2])).learnt.all()


def both(case: str = "B1D3R3W2", seed: int = 1) -> Surround:
    return Surround(*case_settings(Case.parse(case)), np.random.default_rng(seed))


def test_both_classes_can_be_asked_before_either_is_told() -> None:
    adviser = both()
    rangers, wilds = adviser.ask(RobotClass.RANGER, sights([1, 1, 1])), adviser.ask(RobotClass.WILD, sights([3, 3]))
    assert adviser.tell(RobotClass.WILD, results([1, 1], [0, 0])).delta.tolist() == [0.5, 0.5]
    assert adviser.tell(RobotClass.RANGER, results([1, 1, 1], [2, 2, 2])).delta.tolist() == [0.5, 0.5, 0.5]
    assert (len(rangers.sector), len(wilds.sector)) == (3, 2)
    assert (adviser.groups[RobotClass.RANGER].experience.weights[2] == 0.125).all(), "each class has a table of its own"
    assert (adviser.groups[RobotClass.WILD].experience.weights[1] == 0.125).all()


def test_one_robot_after_the_other_is_asked_and_told() -> None:
    adviser = both()
    for row in range(3):
        moves = adviser.ask(RobotClass.RANGER, sights([1, 1, 1], there=[index == row for index in range(3)]))
        assert np.flatnonzero(moves.sector).tolist() == [row]
        assert adviser.tell(RobotClass.RANGER, results([1, 1, 1], [2, 2, 2])).learnt.sum() == 1
    assert adviser.groups[RobotClass.RANGER].met[1] == 3


def test_one_sector_is_enough() -> None:
    """N = 1: there is one way to go, and everybody or nobody is seen."""
    rangers, wilds = case_settings(Case.parse("R2W1"), sectors=1)
    adviser = Surround(rangers, wilds, np.random.default_rng(1))
    moves = adviser.ask(RobotClass.RANGER, sights([0, 1], [1, 1]))
    assert (moves.stimulus.tolist(), moves.sector.tolist()) == ([1, 2], [1, 1])
    adviser.tell(RobotClass.RANGER, results([1, 1], [9, 0]))
    assert (adviser.groups[0].experience.weights == 1.0).all()


@pytest.mark.parametrize("case", ["R0W2", "R3W0", "R0W0", "R1W1"])
def test_a_class_may_have_no_robots_or_one(case: str) -> None:
    adviser = both(case)
    for kind in RobotClass:
        rows = adviser.groups[kind].settings.robots
        # Without the other class nobody is seen.
        moves = adviser.ask(kind, sights([0] * rows, [0] * rows, count=0, radius=65500.0))
        adviser.redraw(kind, np.ones(rows, dtype=np.bool_))
        learnt = adviser.tell(kind, results([1] * rows, [0] * rows, 65500.0))
        assert moves.stimulus.tolist() == [1] * rows
        assert not learnt.changed.size


def test_what_does_not_fit_is_refused() -> None:
    robots, rng = group(), np.random.default_rng(1)
    with pytest.raises(ValueError, match=r"there has shape \(2,\); there are 3 robots"):
        robots.ask(sights([1, 1]), rng)
    with pytest.raises(ValueError, match="8 sectors has no more bits"):
        robots.ask(sights([256, 1, 1]), rng)
    with pytest.raises(ValueError, match=r"outcome has shape \(2,\), the class 3 robots"):
        robots.tell(results([1, 1], [1, 1]))
    with pytest.raises(ValueError, match="RANGERs are wanted first"):
        Surround(WILDS, RANGERS, rng)
    with pytest.raises(ValueError, match="not 8 and 4"):
        Surround(RANGERS, replace(WILDS, sectors=4), rng)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"robots": -1}, "robots: -1 won't do; wanted: 0 to 9999"),
        ({"sectors": 17}, "sectors: 17 won't do; wanted: 1 to 16"),
        ({"increment": 3}, "increment: 3 won't do; wanted: one of 1"),
        ({"gain": float("nan")}, "gain: nan won't do; wanted: a number, 0 to"),
        ({"feasible": "1111"}, "feasible: '1111' won't do; wanted: 8 digits 0 or 1, B1 first"),
        ({"feasible": "1111111x"}, "feasible"),
        ({"mutate_after": -1}, "mutate_after"),
        ({"motion": Motion.CONDITIONAL, "conditional": {31: 1}}, "wanted: stimuli from 1 to 30"),
        ({"motion": Motion.CONDITIONAL, "conditional": {1: 9}}, "wanted: behaviours from 1 to 8"),
        ({"motion": Motion.CONDITIONAL, "conditional": {1: 8}, "feasible": "11111110"}, "none that is not feasible, as B8"),
    ],
)
def test_settings_that_make_no_sense(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        group(**changes)


def test_16_sectors() -> None:
    robots = group(sectors=16, feasible="1" * 16)
    moves = robots.ask(sights([1 << 15, 0b1011, 0]), np.random.default_rng(1))
    assert moves.stimulus.tolist() == [2, int(stimuli_of(16).number[0b1011]), 1]
    assert ((moves.sector >= 1) & (moves.sector <= 16)).all()
