"""What was learnt, as plain values and in words; a saved adviser; conditional motion. The first wrong field is named."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest
from surround_world import Conditions, KinematicWorld, play_step

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.ring import SensorRing
from pal_advisor.surround import (
    BOOK_RULES,
    Case,
    ConditionalError,
    Motion,
    StateError,
    StimulusRecord,
    Surround,
    Tables,
    TablesError,
    case_settings,
    read_conditional,
    rules,
    start_places,
)

CASE = Case.parse("B1D3L1R6W3")


def fresh(seed: int = 1, **options: Any) -> tuple[Surround, KinematicWorld]:  # noqa: ANN401
    adviser = Surround(*case_settings(CASE, **options), np.random.default_rng(seed))
    poses = np.concatenate(start_places(CASE, np.random.default_rng(seed), (4.0, 4.0)))
    return adviser, KinematicWorld(poses, CASE.rangers, Conditions(), None, np.random.default_rng(seed))


def learnt(**options: Any) -> tuple[Surround, KinematicWorld]:  # noqa: ANN401
    adviser, world = fresh(**options)
    for _ in range(15):
        play_step(adviser, world, SensorRing())
    return adviser, world


ADVISER, WORLD = learnt(mutate_after=2)
STATE = json.loads(json.dumps(ADVISER.state_dict()))
TABLES = json.loads(json.dumps(ADVISER.tables(str(CASE)).to_dict()))


def changed(data: Any, path: tuple[Any, ...], value: object) -> Any:  # noqa: ANN401
    data = copy.deepcopy(data)
    place = data
    for step in path[:-1]:
        place = place[step]
    if value is None:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return data


def test_a_saved_adviser_goes_on_as_if_it_had_not_been_saved() -> None:
    adviser, world = learnt(mutate_after=2)
    again = Surround.from_state(json.loads(json.dumps(adviser.state_dict())))
    assert again.state_dict() == adviser.state_dict()
    other = KinematicWorld(world.poses, CASE.rangers, Conditions(), None, np.random.default_rng(9))
    for _ in range(10):
        play_step(adviser, world, SensorRing())
        play_step(again, other, SensorRing())
        assert (world.poses == other.poses).all()
    assert again.state_dict() == adviser.state_dict()


def test_all_settings_are_part_of_the_state() -> None:
    tables = {RobotClass.WILD: {2: 4, 3: 1}}
    adviser = Surround(
        *case_settings(CASE, sectors=4, gain=0.25, learning=False, feasible="1011", conditional=tables, mutate_after=7),
        np.random.default_rng(1),
    )
    again = Surround.from_state(json.loads(json.dumps(adviser.state_dict())))
    assert [group.settings for group in again.groups] == [group.settings for group in adviser.groups]
    assert again.groups[RobotClass.WILD].settings.motion == Motion.CONDITIONAL


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (("version",), 2, "version: 2 is not known; this program goes on from 1"),
        (("version",), True, "version"),
        (("rng",), None, "rng: missing"),
        (("rng", "state", "state"), -1, "rng.state.state"),
        (("groups", 1), None, "groups: expected 2 classes, not 1"),
        (("groups", 1, "settings", "sectors"), 4, r"groups\[1\].weights: expected 6 lists, not 30"),
        (("groups", 0, "settings", "kind"), "junior", r"groups\[0\].settings.kind: expected one of ranger, wild"),
        (("groups", 0, "settings", "kind"), "wild", "groups: settings of RANGERs are wanted first"),
        (("groups", 0, "settings", "motion"), "slow", r"groups\[0\].settings.motion: expected one of experience, "),
        (("groups", 0, "settings", "increment"), 9, r"groups\[0\].settings.increment: 9 won't do"),
        (
            ("groups", 0, "settings", "conditional"),
            [[1]],
            r"groups\[0\].settings.conditional: expected \[stimulus, behaviour\]",
        ),
        (("groups", 0, "settings", "extra"), 9, r"groups\[0\].settings.extra: no field has this name"),
        (("groups", 0, "weights", 3, 2), 1.5, r"groups\[0\].weights\[3\]\[2\]"),
        (("groups", 0, "weights", 3, 2), -1, r"groups\[0\].weights\[3\]\[2\]: expected a weight, 0 to 1, not -1"),
        (("groups", 0, "weights", 29, 0), 0.5, r"groups\[0\].weights\[29\]: the sum of the weights is 1.375, not 1"),
        (("groups", 0, "weights", 3), [1.0], r"groups\[0\].weights\[3\]: expected 8 weights, B1 first, not 1"),
        (("groups", 0, "met", 3), -1, r"groups\[0\].met\[3\]"),
        (("groups", 0, "met"), [1], r"groups\[0\].met: expected 30 numbers, not 1"),
        (("groups", 1, "stimulus", 0), 31, r"groups\[1\].stimulus\[0\]: expected a whole number, 0 to 30"),
        (("groups", 1, "still"), [], r"groups\[1\].still: expected 3 numbers, not 0"),
        (("groups", 1, "more"), [], r"groups\[1\].more: no field has this name"),
    ],
)
def test_a_wrong_field_of_a_state_is_named(path: tuple[Any, ...], value: object, named: str) -> None:
    with pytest.raises(StateError, match="^" + named):
        Surround.from_state(changed(STATE, path, value))


def test_tables_are_read_as_they_were_written() -> None:
    tables = ADVISER.tables(str(CASE))
    assert Tables.from_dict(TABLES) == tables
    assert tables.case == "B1C1D3L1R6S1W3"
    entry = next(entry for entry in TABLES["ranger"] if entry["stimulus"] == 2)
    assert list(entry) == ["stimulus", "pattern", "met", "behaviour", "weights"]
    assert entry["pattern"] == "00000001"
    assert entry["met"] == ADVISER.groups[0].met[1] > 0
    assert entry["behaviour"] == f"B{int(np.argmax(entry['weights'])) + 1}"


def test_learnt_tables_are_gone_on_from() -> None:
    adviser, _ = fresh()
    adviser.take(Tables.from_dict(TABLES))
    for group, learnt_group in zip(adviser.groups, ADVISER.groups, strict=True):
        assert (group.experience.weights == learnt_group.experience.weights).all()
        assert not group.met.any()


def test_what_people_leave_out_is_uniform_or_not_known() -> None:
    data = {"version": 1, "sectors": 4, "wild": [{"stimulus": 2, "pattern": "0001", "weights": [0, 1, 0, 0]}]}
    tables = Tables.from_dict(data)
    assert (tables.rangers, tables.wilds) == ({}, {2: StimulusRecord(0, (0.0, 1.0, 0.0, 0.0))})


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (("version",), 3, "version: 3 is not known; this program reads 1"),
        (("sectors",), 0, "sectors: expected a whole number, 1 to 16"),
        (("case",), 5, "case: expected a text"),
        (("ranger",), 5, "ranger: expected a list"),
        (("ranger", 1, "stimulus"), 1, r"ranger\[1\].stimulus: STIMULUS1 is there twice"),
        (("ranger", 1, "stimulus"), 31, r"ranger\[1\].stimulus: expected a whole number, 1 to 30"),
        (("ranger", 1, "pattern"), "10000000", r"ranger\[1\].pattern: STIMULUS2 is 00000001, not '10000000'"),
        (("ranger", 1, "met"), "often", r"ranger\[1\].met"),
        (("ranger", 1, "behaviour"), 8, r"ranger\[1\].behaviour"),
        (("ranger", 1, "weights"), None, r"ranger\[1\].weights: missing"),
        (("ranger", 1, "weights"), [0.5, 0.5], r"ranger\[1\].weights: expected 8 weights, B1 first, not 2"),
        (("ranger", 1, "weights", 4), "x", r"ranger\[1\].weights\[4\]: expected a number"),
        (("ranger", 1, "weights", 4), -0.1, r"ranger\[1\].weights\[4\]: expected a weight, 0 to 1, not -0.1"),
        (("ranger", 1, "weights"), [0.2] * 8, r"ranger\[1\].weights: the sum of the weights is 1.6, not 1"),
        (("ranger", 1, "extra"), 1, r"ranger\[1\].extra: no field has this name"),
        (("wilds",), [], "wilds: no field has this name"),
    ],
)
def test_a_wrong_field_of_tables_is_named(path: tuple[Any, ...], value: object, named: str) -> None:
    with pytest.raises(TablesError, match="^" + named):
        Tables.from_dict(changed(TABLES, path, value))


def test_tables_of_other_robots_are_refused_and_change_nothing() -> None:
    adviser, _ = fresh(feasible="11111110")
    before = adviser.state_dict()
    with pytest.raises(ValueError, match="STIMULUS1 of RANGERs: other behaviours are feasible than the robots can perform"):
        adviser.take(Tables.from_dict(TABLES))
    with pytest.raises(ValueError, match="the tables are of 4 sectors, the robots have 8"):
        adviser.take(Tables(4))
    assert adviser.state_dict() == before


@pytest.mark.parametrize(
    ("stimulus", "best", "line"),
    [
        (1, 8, 'STIMULUS1 "nobody near: go to the nearest farther off (B8)", 0.42; the book\'s RA1: B1'),
        (2, 8, 'STIMULUS2 "one to the side of sector 8: go to it (B8)", 0.42; the book\'s RB1: B8'),
        (2, 1, 'STIMULUS2 "one to the side of sector 8: go past it (B1)", 0.42; the book\'s RB1: B8'),
        (2, 4, 'STIMULUS2 "one to the side of sector 8: turn away from it (B4)", 0.42; the book\'s RB1: B8'),
        (3, 7, 'STIMULUS3 "others to the sides of sectors 7 and 8: go to those at 7 (B7)", 0.42; the book\'s RB2: B1 x B8'),
        (4, 7, 'STIMULUS4 "others to the sides of sectors 6 and 8: go past them at 7 (B7)", 0.42; the book\'s RB3: B7'),
        (5, 2, 'STIMULUS5 "others to the sides of sectors 5 and 8: turn away to 2 (B2)", 0.42'),
        (30, 3, 'STIMULUS30 "others all around: go to those at 3 (B3)", 0.42'),
    ],
)
def test_rules_in_words_beside_the_books(stimulus: int, best: int, line: str) -> None:
    weights = [0.58 / 7] * 8
    weights[best - 1] = 0.42
    (rule,) = rules(Tables(8, rangers={stimulus: StimulusRecord(3, tuple(weights))}), RobotClass.RANGER)
    assert str(rule) == line


def test_rules_come_as_often_met() -> None:
    uniform = (0.125,) * 8
    tables = Tables(
        8,
        wilds={
            2: StimulusRecord(3, uniform),
            8: StimulusRecord(9, uniform),
            23: StimulusRecord(3, uniform),
            1: StimulusRecord(0, (-1.0,) * 8),
        },
    )
    found = rules(tables, RobotClass.WILD)
    assert [rule.stimulus for rule in found] == [8, 2, 23, 1]
    assert [rule.book and f"{rule.book.name} {rule.book.behaviour}" for rule in found] == [
        "RD1 B2",
        "RD2 B4",
        "RD3 B4 x B6",
        None,
    ]
    assert found[0].words == "others to the sides of sectors 5, 7 and 8: no matter where (nothing learnt)"
    assert found[3].words == "nobody near: stay"
    assert all(len(rule.behaviours) == 8 for rule in found[:3])


def test_the_books_rules_are_of_eight_sectors() -> None:
    (rule,) = rules(Tables(4, rangers={2: StimulusRecord(1, (0.0, 0.0, 0.0, 1.0))}), RobotClass.RANGER)
    assert rule.book is None
    assert len(BOOK_RULES) == 9


def test_a_conditional_table_names_stimuli_by_number_or_pattern() -> None:
    data = {"ranger": {"STIMULUS2": "B8", "00000011": "B1"}, "wild": {"STIMULUS30": "B3"}}
    assert read_conditional(data, 8) == {RobotClass.RANGER: {2: 8, 3: 1}, RobotClass.WILD: {30: 3}}
    assert read_conditional({}, 8) == {}
    assert read_conditional({"wild": {"0": "B1", "1": "B1"}}, 1) == {RobotClass.WILD: {1: 1, 2: 1}}


@pytest.mark.parametrize(
    ("data", "named"),
    [
        ([], "the whole: expected a table"),
        ({"rangers": {}}, "rangers: no field has this name"),
        ({"ranger": 3}, "ranger: expected a table"),
        (
            {"ranger": {"STIMULUS31": "B1"}},
            "ranger.STIMULUS31: expected STIMULUS1 to STIMULUS30, or a canonical pattern as 00000001",
        ),
        ({"ranger": {"0001": "B1"}}, "ranger.0001: expected STIMULUS1"),
        ({"ranger": {"00011000": "B1"}}, r"ranger.00011000: .* this is 00000011 \(STIMULUS3\)"),
        ({"ranger": {"STIMULUS2": "B9"}}, "ranger.STIMULUS2: expected a behaviour, B1 to B8, not 'B9'"),
        ({"ranger": {"STIMULUS2": 8}}, "ranger.STIMULUS2: expected a text"),
        ({"wild": {"STIMULUS2": "B8", "00000001": "B8"}}, "wild.00000001: STIMULUS2 is there twice"),
    ],
)
def test_a_wrong_field_of_a_conditional_table_is_named(data: object, named: str) -> None:
    with pytest.raises(ConditionalError, match="^" + named):
        read_conditional(data, 8)
