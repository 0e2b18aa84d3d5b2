"""Learning to surround, in a kinematic world: a few seeds of what `surround_figures.py` measures with intervals."""

from __future__ import annotations

from dataclasses import replace
from math import radians
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from surround_world import Conditions, KinematicWorld, play_step, run

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.ring import SensorRing
from pal_advisor.surround import Case, Motion, Sensing, Surround, case_settings, start_places
from pal_advisor.surround.measures import settle_step

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

SEEDS = range(1, 5)
NOISE = Conditions(distance_noise=0.03, heading_noise=radians(3), loss=0.05)


def nearer(name: str, conditions: Conditions | None = None, **options: Any) -> list[float]:  # noqa: ANN401
    """D at step 50 as a share of D at the start, for each seed."""
    histories = [run(name, seed, 50, conditions, **options) for seed in SEEDS]
    return [float(history.distance[-1] / history.distance[0]) for history in histories]


def test_rangers_learn_to_surround_wilds_that_stand() -> None:
    history = run("B2D3", 1, 50)
    assert history.distance[-1] < 0.3 * history.distance[0]
    assert history.surrounded[-1] >= 0.9
    assert history.behaviours.shape == (50, 25)


def test_without_learning_they_stay_away() -> None:
    history = run("B2D3", 1, 50, learning=False)
    assert history.distance[-1] > 0.9 * history.distance[0]
    assert (history.weights == 0.125).all()


def test_long_range_learns_nothing() -> None:
    """Rule RE, Eq. 8.1: nobody ever leaves or enters a radius without a limit."""
    history = run("B1D3S2", 1, 30)
    assert (history.weights == 0.125).all()
    assert history.outside[-1] > 0.0, "without a wall they leave the area"


def crowd(change: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> tuple[Surround, KinematicWorld]:
    """Many WILDs among RANGERs, on start poses that are changed."""
    case = Case.parse("B1D1R25W80")
    poses = np.concatenate(start_places(case, np.random.default_rng(1), (6.0, 6.0)))
    adviser = Surround(*case_settings(case), np.random.default_rng(2))
    return adviser, KinematicWorld(change(poses), case.rangers, Conditions(), None, np.random.default_rng(3))


def rotated(poses: NDArray[np.float64], angle: float = 2.0) -> NDArray[np.float64]:
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.column_stack((poses[:, :2] @ turn, poses[:, 2] + angle))


def test_turning_the_world_with_its_headings_turns_all_that_happens() -> None:
    (adviser, world), (turned_adviser, turned_world) = crowd(lambda poses: poses), crowd(rotated)
    for _ in range(5):
        play_step(adviser, world, SensorRing())
        play_step(turned_adviser, turned_world, SensorRing())
    assert turned_world.poses[:, :2] == pytest.approx(rotated(world.poses)[:, :2], abs=1e-9)
    for group, turned_group in zip(adviser.groups, turned_adviser.groups, strict=True):
        assert (group.experience.weights == turned_group.experience.weights).all()


def test_mirroring_the_world_mirrors_the_moves_where_the_frame_is_unique() -> None:
    (adviser, world), (mirrored_adviser, mirrored_world) = crowd(lambda poses: poses), crowd(lambda poses: poses * (1, -1, -1))
    there = np.ones(25, dtype=np.bool_)
    sights = world.sights(RobotClass.RANGER, SensorRing(), there)
    moves = adviser.ask(RobotClass.RANGER, sights)
    image = mirrored_adviser.ask(RobotClass.RANGER, mirrored_world.sights(RobotClass.RANGER, SensorRing(), there))
    assert (moves.stimulus == image.stimulus).all()
    assert (moves.behaviour == image.behaviour).all()
    ways = [
        {f"{each}{each}"[step : step + 8] for step in range(8) for each in (text, text[::-1])}
        for text in map("{:08b}".format, sights.seen)
    ]
    unique = np.array([len(each) == 16 for each in ways])
    assert unique.sum() >= 3
    assert (moves.sector + image.sector)[unique].tolist() == [9] * int(unique.sum())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "conditions", "options", "worst"),
    [
        ("B2D3", None, {}, 0.35),
        ("B2D3", NOISE, {}, 0.35),
        ("B2D3", Conditions(distance_noise=0.1, heading_noise=radians(10)), {}, 0.35),
        ("B2D3", Conditions(loss=0.3), {}, 0.35),
        ("B2D3", Conditions(rigid=True), {}, 0.35),
        ("B2D3", None, {"sensing": Sensing.ADJUSTABLE}, 0.35),
        ("B1D3", None, {}, 0.6),
        ("B1D3", Conditions(order="all"), {}, 0.6),
        ("B3D3", None, {}, 0.6),
        ("B2D4", None, {}, 0.35),
        ("B1D4", None, {}, 0.6),
    ],
)
def test_it_converges(name: str, conditions: Conditions | None, options: dict[str, Any], worst: float) -> None:
    assert max(nearer(name, conditions, **options)) < worst


@pytest.mark.slow
def test_one_robot_after_the_other_converges_too() -> None:
    history = run("B2D3", 1, 50, Conditions(order="sequential"))
    assert history.distance[-1] < 0.35 * history.distance[0]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["B1D1", "B2D1", "B1D2"])
def test_it_converges_where_wilds_are_scattered(name: str) -> None:
    assert np.mean(nearer(name)) < 0.7


@pytest.mark.slow
def test_fixed_short_sensors_do_not_find_them() -> None:
    assert np.mean(nearer("B2D3", sensing=Sensing.FIXED)) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("learning", [1, 2, 3, 4])
def test_smoothing_keeps_every_choice_alive(learning: int) -> None:
    """8.3: smoothed weights stay away from 0 and 1; others don't."""
    for seed in SEEDS:
        weights = run(f"B1D3L{learning}", seed, 100).weights[-1, RobotClass.RANGER]
        learnt = weights[(weights != 0.125).any(axis=1)]
        if learning <= 2:
            assert 0.03 <= learnt.min() <= learnt.max() <= 0.55
        else:
            assert (learnt == 0.0).any(axis=1).mean() > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("wilds", ["B1", "B2"])
def test_selection_by_maximum_settles_faster(wilds: str) -> None:
    """8.4."""
    by_probability, by_maximum = (
        np.mean([settle_step(run(f"{wilds}D3L{learning}", seed, 100).distance) for seed in SEEDS]) for learning in (1, 2)
    )
    assert by_probability >= 2.0 * by_maximum


@pytest.mark.slow
def test_a_rule_that_is_given_is_as_good_as_one_that_is_learnt() -> None:
    """Conditional motion: STIMULUS1 and STIMULUS2 by the behaviour that leads to whom they see."""
    rangers, wilds = case_settings(Case.parse("B2D3"), learning=False)
    given = replace(rangers, motion=Motion.CONDITIONAL, conditional={1: 8, 2: 8})
    assert max(nearer("B2D3", settings=(given, wilds))) < 0.3
