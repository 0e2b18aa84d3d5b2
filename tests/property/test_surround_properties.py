"""What holds for the surround task's method whatever happens."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.surround import Case, GroupSettings, Results, Sensing, Sights, Surround, case_settings
from pal_advisor.surround.experience import Experience, bounds
from pal_advisor.surround.selection import at_random, by_maximum, by_probability
from pal_advisor.surround.stimuli import mirrored, stimuli_of, turned

masks = st.lists(st.booleans(), min_size=1, max_size=16).filter(any)
deltas = st.one_of(st.sampled_from([-1.0, -0.5, 0.0, 0.5, 1.0]), st.floats(-1.0, 1.0))
seeds = st.integers(0, 2**32 - 1)


@given(masks, st.booleans(), st.lists(st.tuples(st.integers(1, 2), st.integers(0, 15), deltas), max_size=60))
def test_weights_stay_a_distribution(mask: list[bool], smoothing: bool, steps: list[tuple[int, int, float]]) -> None:  # noqa: FBT001
    """Within the bounds that function2 gives once they are smoothed, for any sequence of increments."""
    feasible = np.array(mask)
    places = np.flatnonzero(feasible) + 1
    table = Experience(feasible, smoothing=smoothing)
    low, high = bounds(len(places)) if smoothing else (0.0, 1.0)
    for stimulus, choice, delta in steps:
        table.learn(np.array([stimulus]), places[[choice % len(places)]], np.array([delta]))
        assert (table.weights[:, ~feasible] == -1.0).all()
        assert np.abs(table.weights[:, feasible].sum(axis=1) - 1.0).max() < 1e-12
        assert table.weights[:, feasible].min() >= low - 1e-12
        assert table.weights[:, feasible].max() <= high + 1e-12


@given(st.lists(st.tuples(st.integers(1, 30), st.integers(1, 8), deltas), max_size=40), st.booleans())
def test_a_round_is_one_robot_after_the_other(steps: list[tuple[int, int, float]], smoothing: bool) -> None:  # noqa: FBT001
    at_once, singly = (Experience(np.ones(8, dtype=np.bool_), smoothing=smoothing) for _ in range(2))
    stimuli, behaviours = (np.array([step[part] for step in steps], dtype=np.int64) for part in (0, 1))
    increments = np.array([step[2] for step in steps], dtype=np.float64)
    before = at_once.weights.copy()
    changed = at_once.learn(stimuli, behaviours, increments)
    for row in range(len(steps)):
        singly.learn(stimuli[[row]], behaviours[[row]], increments[[row]])
    assert (at_once.weights == singly.weights).all()
    assert changed.tolist() == (np.flatnonzero((at_once.weights != before).any(axis=1)) + 1).tolist()


@given(st.integers(1, 16), st.data())
def test_what_is_alike_is_one_stimulus(sectors: int, data: st.DataObject) -> None:
    stimuli = stimuli_of(sectors)
    pattern = np.array([data.draw(st.integers(0, (1 << sectors) - 1))])
    alike = turned(pattern, data.draw(st.integers(0, sectors - 1)), sectors)
    if data.draw(st.booleans()):
        alike = mirrored(alike, sectors)
    assert stimuli.number[alike] == stimuli.number[pattern]
    assert stimuli.patterns[stimuli.number[pattern] - 1] <= pattern


@given(
    st.lists(st.sampled_from([-1.0, 0.0, 1e-300, 0.1, 0.5, 1.0]), min_size=1, max_size=16), st.floats(0, 1, exclude_max=True)
)
def test_what_is_selected_is_feasible(weights: list[float], draw: float) -> None:
    row, draws = np.array([weights]), np.array([draw])
    for select in (by_probability, by_maximum, at_random):
        (behaviour,) = select(row, draws).tolist()
        assert (behaviour == 0) == (max(weights) < 0)
        if behaviour:
            assert weights[behaviour - 1] >= 0
            assert select is at_random or weights[behaviour - 1] > 0 or max(weights) <= 0
        if behaviour and select is by_maximum:
            assert weights[behaviour - 1] == max(weights)


@settings(max_examples=30)
@given(st.integers(1, 8), st.integers(1, 8), st.sampled_from(Sensing), st.booleans(), seeds)
def test_any_round_is_taken_in(sectors: int, robots: int, sensing: Sensing, by_maximum_: bool, seed: int) -> None:  # noqa: FBT001
    """Whoever is there or missing, refused or lost: sectors are sectors, and a saved adviser decides as the other."""
    rng = np.random.default_rng(seed)
    mask = "".join(rng.choice(["0", "1"], sectors))
    rangers = GroupSettings(
        RobotClass.RANGER, robots, sectors, sensing=sensing, by_maximum=by_maximum_, feasible=mask, mutate_after=2
    )
    adviser = Surround(rangers, replace(rangers, kind=RobotClass.WILD), np.random.default_rng(seed))
    for _ in range(6):
        kind = RobotClass(int(rng.integers(2)))
        seen = rng.integers(1 << sectors, size=robots)
        near = seen * (rng.random(robots) < 0.7)
        radius = rng.integers(1, 3, robots).astype(np.float64)
        sights = Sights(rng.random(robots) < 0.8, near, seen, rng.integers(9, size=robots), radius)
        again = Surround.from_state(adviser.state_dict())
        moves, same = adviser.ask(kind, sights), again.ask(kind, sights)
        assert (moves.sector == same.sector).all()
        refused = rng.random(robots) < 0.3
        moves = adviser.redraw(kind, refused)
        assert ((moves.sector == 0) == (moves.behaviour == 0)).all()
        assert not moves.sector[~sights.there].any()
        assert set(moves.sector.tolist()) <= set(range(sectors + 1))
        assert all(mask[behaviour - 1] == "1" for behaviour in moves.behaviour.tolist() if behaviour)
        learnt = adviser.tell(kind, Results(rng.integers(7, size=robots), rng.integers(9, size=robots), sights.radius))
        assert not learnt.learnt[moves.sector == 0].any()
        assert (np.abs(learnt.delta) <= 1.0).all()


@given(st.permutations("BCDLRSW"), st.data())
def test_a_case_has_one_name(order: list[str], data: st.DataObject) -> None:
    ranges = {"B": (1, 3), "C": (1, 1), "D": (1, 4), "L": (1, 4), "R": (0, 9999), "S": (1, 2), "W": (0, 9999)}
    value = {letter: data.draw(st.integers(*ranges[letter])) for letter in "BCDLRSW"}
    case = Case.parse("".join(f"{letter}{value[letter]}" for letter in order))
    assert str(case) == "".join(f"{letter}{number}" for letter, number in value.items())
    assert Case.parse(str(case)) == case
    assert [group.robots for group in case_settings(case)] == [value["R"], value["W"]]
