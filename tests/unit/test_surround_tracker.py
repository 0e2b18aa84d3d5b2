"""What is kept of a run while it goes: the same comes out as of its whole history, and of a run that was cut."""

from __future__ import annotations

import json
from math import nan

import numpy as np
import pytest

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.fields import FieldError, Fields
from pal_advisor.surround import StimulusRecord, Tables
from pal_advisor.surround.measures import RunMeasures, RunTracker, macro_stable, measures_of, periodic, turns

UNIFORM = np.full((4, 2), 0.5)
NOWHERE = (np.zeros((0, 2)), np.zeros((0, 2)))


class History:
    """A made-up run of 3 RANGERs and 2 WILDs in which robots now and then move to and fro, and weights now and then turn."""

    def __init__(self, seed: int, steps: int = 80) -> None:
        rng = np.random.default_rng(seed)
        self.positions = np.cumsum(rng.normal(0.0, 0.05, (steps + 1, 5, 2)), axis=0)
        swings = rng.random((steps + 1, 5)) < 0.7
        self.positions[:, :, 0] += np.where(swings, (np.arange(steps + 1) % 2)[:, None], 0.0)
        self.positions[rng.integers(steps, size=2), rng.integers(5, size=2)] = nan
        self.distance = np.where(np.arange(steps + 1) < 20, 3.0, 1.0) * rng.uniform(0.96, 1.04, steps + 1)
        self.distance[60] = nan
        self.weights = np.tile(UNIFORM, (steps + 1, 1, 1))
        for step in rng.integers(20, steps, size=3):
            self.weights[step:, 1] = rng.dirichlet((1.0, 1.0))

    def tell(self, tracker: RunTracker, begin: int, end: int) -> RunTracker:
        for step in range(begin, end):
            positions, distance = self.positions[step], self.distance[step]
            known = None if np.isnan(distance) else float(distance)
            tracker.take((positions[:3], positions[3:]), known, (UNIFORM, self.weights[step]))
        return tracker


@pytest.mark.parametrize("seed", range(20))
def test_a_tracker_finds_what_the_whole_history_holds(seed: int) -> None:
    history = History(seed)
    tracker = history.tell(RunTracker((3, 2)), 0, 81)
    moved = periodic(history.positions)
    assert tracker.periodic == (moved[:3].mean(), moved[3:].mean())
    assert tracker.macro_stable == macro_stable(history.distance, turns(history.weights)).tolist()
    learnt = history.weights[history.weights != 0.5]
    assert tracker.weights == [None, (learnt.min(), learnt.max())]


def test_the_histories_that_are_compared_hold_something() -> None:
    histories = [History(seed) for seed in range(20)]
    assert any(periodic(history.positions).any() for history in histories)
    assert any(len(macro_stable(history.distance, turns(history.weights))) for history in histories)


@pytest.mark.parametrize("cut", [0, 1, 6, 25, 61, 80])
def test_a_run_that_was_cut_tells_the_same(cut: int) -> None:
    history = History(3)
    whole = history.tell(RunTracker((3, 2)), 0, 81)
    kept = json.loads(json.dumps(history.tell(RunTracker((3, 2)), 0, cut).to_dict(), allow_nan=False))
    again = history.tell(RunTracker.from_fields(Fields(kept), (3, 2)), cut, 81)
    assert again.to_dict() == whole.to_dict()
    assert (again.periodic, again.macro_stable) == (whole.periodic, whole.macro_stable)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("positions", [[0.0] * 9], "positions: expected 10 numbers, not 9"),
        ("positions", [[0.0] * 10] * 8, "positions: expected up to 7, not 8"),
        ("distances", ["far"], r"distances\[0\]: expected a number"),
        ("turned", [1], r"turned\[0\]: expected true or false"),
        ("to_and_fro", [5], r"to_and_fro\[0\]: expected a whole number, 0 to 4"),
        ("weights", [None], "weights: expected 2 pairs, not 1"),
        ("weights", [None, [0.1]], r"weights\[1\]: expected two weights"),
    ],
)
def test_the_first_wrong_field_is_named(name: str, value: object, said: str) -> None:
    kept = {**RunTracker((3, 2)).to_dict(), name: value}
    with pytest.raises(FieldError, match=said):
        RunTracker.from_fields(Fields(kept), (3, 2))


def test_wilds_that_are_pushed_are_counted() -> None:
    """Two RANGERs in touch with the first WILD go its way; nobody is near the second, which moves by itself."""
    tracker = RunTracker((2, 2))
    before = np.array([[-0.3, 0.0], [-0.28, 0.1]]), np.array([[-0.1, 0.0], [3.0, 0.0]])
    after = (before[0] + [0.1, 0.0], before[1] + [0.1, 0.0])
    tracker.push(before, after, 0.21)
    tracker.push(before, after, 0.21)
    tracker.push(before, before, 0.21)
    assert tracker.pushed == 2


def test_a_fix_that_is_a_little_off_is_no_way() -> None:
    tracker = RunTracker((2, 1))
    before = np.array([[-0.3, 0.0], [-0.28, 0.1]]), np.array([[0.0, 0.0]])
    tracker.push(before, (before[0] + [0.1, 0.0], before[1] + [0.02, 0.0]), 0.21)
    assert tracker.pushed == 0
    tracker.push(before, (before[0] + [0.1, 0.0], before[1] + [0.04, 0.0]), 0.25)
    assert tracker.pushed == 1


def test_who_takes_a_place_has_no_history() -> None:
    to_and_fro = np.zeros((7, 2, 2))
    to_and_fro[1::2, :, 0] = 1.0
    tracker = RunTracker((1, 1))
    for step, (ranger, wild) in enumerate(to_and_fro):
        if step == 5:
            tracker.replace(RobotClass.WILD, 0)
        tracker.take((ranger[None], wild[None]), 1.0, (UNIFORM, UNIFORM))
    assert tracker.periodic == (1.0, 0.0)


def test_nobody_has_no_share() -> None:
    tracker = RunTracker((0, 0))
    tracker.take(NOWHERE, None, (UNIFORM, UNIFORM))
    told = measures_of(tracker, [None], Tables(8))
    assert (told.periodic, told.settle_step, told.dominance) == ((None, None), None, None)
    assert RunMeasures.from_dict(json.loads(json.dumps(told.to_dict()))) == told


def test_what_is_told_of_a_run() -> None:
    """8.2: what was met; 8.3: weights seen, and vectors with a 0; 8.4; 8.8: two of STIMULUS2's weights hold 0.7 of it."""
    tracker = RunTracker((1, 1))
    weights = UNIFORM.copy()
    for low in (0.5, 0.2, 0.3):
        weights[1] = low, 1.0 - low
        tracker.take((np.zeros((1, 2)), np.zeros((1, 2))), 1.0, (weights, UNIFORM))
    known = {
        1: StimulusRecord(7, (0.125,) * 8),
        2: StimulusRecord(5, (0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.3, 0.4)),
        3: StimulusRecord(0, (0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    }
    told = measures_of(tracker, [3.0, 1.2, 1.0], Tables(8, "", known, {4: StimulusRecord(2, (-1.0, *[1 / 7] * 7))}))
    assert told.to_dict() == {
        "pushed": 0,
        "periodic": {"ranger": 0.0, "wild": 0.0},
        "macro_stable": [],
        "dominance": 0.7,
        "stimuli_met": {"ranger": 2, "wild": 1},
        "settle_step": 1,
        "weights": {"ranger": [0.2, 0.8], "wild": None},
        "uniform": {"ranger": False, "wild": True},
        "with_zero": {"ranger": 0.5, "wild": None},
    }
    assert RunMeasures.from_dict(told.to_dict()) == told


@pytest.mark.parametrize(("name", "value"), [("pushed", -1), ("dominance", nan), ("weights", {"ranger": [1], "wild": None})])
def test_measures_that_are_none_are_named(name: str, value: object) -> None:
    told = measures_of(RunTracker((1, 1)), [1.0], Tables(8)).to_dict()
    with pytest.raises(FieldError, match=name):
        RunMeasures.from_dict({**told, name: value})
