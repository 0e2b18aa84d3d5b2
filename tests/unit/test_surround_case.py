"""Cases by the book's names, and where their robots begin."""

from __future__ import annotations

import numpy as np
import pytest

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.surround import Case, CaseError, Motion, PlacesError, WildMotion, case_settings, letters, start_places


def test_a_name_is_read_and_written() -> None:
    case = Case.parse("B2C1D4L3R7S2W3")
    assert str(case) == "B2C1D4L3R7S2W3"
    assert case == Case(WildMotion.STATIONARY, 1, 4, 3, 7, 2, 3)
    assert (case.wall, case.centralised, case.smoothing, case.by_maximum, case.long_range) == (True, True, False, False, True)


def test_letters_come_in_any_order_and_those_left_out_have_defaults() -> None:
    assert str(Case.parse("W3D1b2")) == "B2C1D1L1R25S1W3"
    assert Case.parse("") == Case()
    assert str(Case()) == "B1C1D3L1R25S1W8"
    assert letters("R0W12") == {"R": 0, "W": 12}


@pytest.mark.parametrize(
    ("distribution", "wall", "centralised"), [(1, False, False), (2, True, False), (3, False, True), (4, True, True)]
)
def test_the_distributions(distribution: int, wall: bool, centralised: bool) -> None:  # noqa: FBT001
    case = Case(distribution=distribution)
    assert (case.wall, case.centralised) == (wall, centralised)


@pytest.mark.parametrize(("learning", "smoothing", "by_maximum"), [(1, 1, 0), (2, 1, 1), (3, 0, 0), (4, 0, 1)])
def test_the_kinds_of_learning(learning: int, smoothing: int, by_maximum: int) -> None:
    case = Case(learning=learning)
    assert (case.smoothing, case.by_maximum) == (smoothing, by_maximum)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("B1B2", r"B \(how WILDs move\) is there twice"),
        ("B1X2", "'X' is no letter of a case; there are B how WILDs move, C increment, "),
        ("B4", r"B \(how WILDs move\) is 1 to 3, not 4"),
        ("C2", r"C \(increment\) is one of 1, not 2"),
        ("D0", r"D \(distribution and wall\) is 1 to 4, not 0"),
        ("L5", "is 1 to 4, not 5"),
        ("S3", "is 1 to 2, not 3"),
        ("R10000", r"R \(RANGERs\) is 0 to 9999, not 10000"),
        ("B1D", r"D \(distribution and wall\) needs a number, 1 to 4"),
        ("D-1", "needs a number"),
        ("7", "'7' is no letter"),
        ("B1 D3", "' ' is no letter"),
        ("R9999999999", "R .* is 0 to 9999, not 999999999"),
    ],
)
def test_what_is_wrong_is_named(name: str, said: str) -> None:
    with pytest.raises(CaseError, match=said) as raised:
        Case.parse(name)
    assert repr(name) in str(raised.value)
    assert isinstance(raised.value, ValueError)


@pytest.mark.parametrize(("name", "motion"), [("B1", Motion.EXPERIENCE), ("B2", Motion.STATIONARY), ("B3", Motion.RANDOM)])
def test_b_is_how_wilds_move(name: str, motion: Motion) -> None:
    rangers, wilds = case_settings(Case.parse(name), mutate_after=9)
    assert (rangers.motion, wilds.motion) == (Motion.EXPERIENCE, motion)
    assert (rangers.sign, wilds.sign) == (1, -1)
    assert (rangers.mutate_after, wilds.mutate_after) == (9, 0), "RC1 is a rule of RANGERs"


def test_a_conditional_table_makes_the_motion_conditional_but_of_those_that_stand_or_wander() -> None:
    tables = {RobotClass.RANGER: {2: 8}, RobotClass.WILD: {2: 4}}
    rangers, wilds = case_settings(Case.parse("B1"), conditional=tables)
    assert (rangers.motion, rangers.conditional, wilds.motion) == (Motion.CONDITIONAL, {2: 8}, Motion.CONDITIONAL)
    with pytest.raises(ValueError, match=r"conditional: .* none unless the motion is conditional"):
        case_settings(Case.parse("B2"), conditional=tables)


@pytest.mark.parametrize(("name", "spread", "half"), [("D1", 4, 5), ("D2", 4, 4.85), ("D3", 1, 5), ("D4", 1, 4.85)])
def test_start_places_are_apart_and_where_the_case_says(name: str, spread: float, half: float) -> None:
    for seed in range(10):
        rangers, wilds = start_places(Case.parse(name + "R60"), np.random.default_rng(seed))
        assert (rangers.shape, wilds.shape) == ((60, 3), (8, 3))
        places = np.concatenate((rangers, wilds))[:, :2]
        distances = np.linalg.norm(places[:, None] - places[None], axis=2) + np.eye(68)
        assert distances.min() >= 0.2
        assert np.abs(places).max() <= half
        assert np.hypot(wilds[:, 0], wilds[:, 1]).max() <= spread
        assert np.abs(np.concatenate((rangers, wilds))[:, 2]).max() <= np.pi


def test_start_places_are_uniform() -> None:
    """A quarter of a disc is within half its radius; RANGERs fill the whole square."""
    rng = np.random.default_rng(1)
    wilds = np.concatenate([start_places(Case.parse("D1R0W8"), rng)[1] for _ in range(200)])
    assert (np.hypot(wilds[:, 0], wilds[:, 1]) < 2).mean() == pytest.approx(0.25, abs=0.04)
    rangers = np.concatenate([start_places(Case.parse("D1R25W0"), rng)[0] for _ in range(80)])
    assert (np.abs(rangers[:, :2]) > 2.5).mean(axis=0) == pytest.approx([0.5, 0.5], abs=0.04)


def test_the_same_seed_draws_the_same_places() -> None:
    first, again = (start_places(Case(), np.random.default_rng(3)) for _ in range(2))
    assert all((one == other).all() for one, other in zip(first, again, strict=True))


@pytest.mark.parametrize(
    ("name", "area", "said"),
    [
        ("D3W90", (10.0, 10.0), "no place for WILD .* of 90 in the disc of radius 1 units, .* in 1000 draws: too many robots"),
        ("D4R25W0", (0.8, 0.8), "no place for RANGER .* of 25 in the area of 0.8 x 0.8 units"),
        ("D4", (0.3, 5.0), "has no room for a robot"),
    ],
)
def test_too_many_robots_are_told_of(name: str, area: tuple[float, float], said: str) -> None:
    with pytest.raises(PlacesError, match=said):
        start_places(Case.parse(name), np.random.default_rng(1), area)


def test_no_robots_have_no_places() -> None:
    rangers, wilds = start_places(Case.parse("R0W0"), np.random.default_rng(1))
    assert (rangers.shape, wilds.shape) == ((0, 3), (0, 3))
