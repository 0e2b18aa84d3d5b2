"""A ring that differs from the nominal one: told by its address, or drawn for each bout from its seed."""

from __future__ import annotations

from dataclasses import asdict

import pytest

from firmware_protocol.address import parse_address
from firmware_protocol.errors import AddressError
from hil.connecting.junior_address import junior_settings
from simdevice.sumo.conditions import CONDITIONS, DELAY_UNIT, NOMINAL, Conditions
from simdevice.sumo.crowd import Crowd
from simdevice.sumo.late import Late
from simdevice.sumo.match import Match, Purpose, stream
from simdevice.sumo.opponents import OPPONENTS
from simdevice.sumo.settings import WorldSettings


def seen(match: Match) -> tuple[object, ...]:
    """What a bout begins with."""
    robot, other = match.robot, match.opponent
    poses = [(piece.x, piece.y, piece.angle) for piece in (robot.body, other)]
    return match.conditions, robot.profile, robot.body.body.mass, other.body.mass, *poses


def test_an_address_tells_conditions() -> None:
    settings = junior_settings(
        parse_address("sim://junior?opponent=flat-heavy&mass=0.85&opponent_friction=0.7&delay=0.02&vary=0.1")
    )
    assert settings.conditions == Conditions(mass=0.85, opponent_friction=0.7, delay=0.02)
    assert settings.vary == 0.1
    assert junior_settings(parse_address("sim://junior")) == WorldSettings(seed=0)


@pytest.mark.parametrize("name", CONDITIONS)
def test_every_condition_is_an_option(name: str) -> None:
    value = 0.25 if name == "delay" else 0.9
    assert junior_settings(parse_address(f"sim://junior?{name}={value}")).conditions == Conditions(**{name: value})


@pytest.mark.parametrize(
    "option", ["mass=0", "mass=nan", "mass=light", "delay=-1", "delay=0.6", "vary=1", "vary=-0.1", "vary=nan"]
)
def test_nonsense_is_refused_by_name(option: str) -> None:
    with pytest.raises(AddressError, match=option.partition("=")[0]):
        junior_settings(parse_address(f"sim://junior?{option}"))


def test_a_bout_has_the_conditions_of_its_seed_whatever_was_before() -> None:
    one, other = Match("flat-heavy", seed=1, vary=0.3), Match("flat-heavy", seed=2, vary=0.3)
    other.reset(4, "point-light")
    one.reset(7)
    other.reset(7, "flat-heavy")
    assert seen(one) == seen(other)
    one.reset(8)
    assert one.conditions != other.conditions


def test_conditions_leave_start_poses_as_they_are() -> None:
    nominal, varied = Match("flat-heavy", seed=3), Match("flat-heavy", seed=3, vary=0.3)
    assert seen(nominal)[-2:] == seen(varied)[-2:]
    assert seen(nominal)[:2] != seen(varied)[:2]


def test_drawn_conditions_are_about_those_that_were_told() -> None:
    about = Conditions(mass=0.8, delay=0.02)
    for seed in range(50):
        drawn = about.drawn(0.15, stream(seed, Purpose.CONDITIONS))
        for name, value in asdict(drawn).items():
            if name == "delay":
                assert 0.02 <= value <= 0.02 + 0.15 * DELAY_UNIT
            else:
                assert 0.85 <= value / getattr(about, name) <= 1.15


def test_conditions_reach_bodies_and_robot() -> None:
    conditions = Conditions(mass=0.8, friction=0.9, eyes=0.5, battery=0.9, right=0.7, opponent_mass=1.2, opponent_friction=0.5)
    match = Match("flat-heavy", conditions=conditions)
    profile = match.robot.profile
    assert match.robot.body.body.mass == pytest.approx(0.4)
    assert (profile.tyre_limit, profile.eye_range) == pytest.approx((0.72 * 0.4 * 9.81 / 2, 0.2))
    assert profile.wheel_gain == (1.0, 0.7)
    assert match.robot.motors.voltage == pytest.approx(6.75)
    assert match.opponent.body.mass == pytest.approx(1.2)
    assert conditions.dummy(OPPONENTS["flat-heavy"]).static == pytest.approx(0.24)


def test_nominal_conditions_change_nothing() -> None:
    match = Match("junior")
    assert NOMINAL.junior(match.robot.profile) is match.robot.profile
    assert NOMINAL.dummy(OPPONENTS["flat-heavy"]) is OPPONENTS["flat-heavy"]


def test_a_late_line_keeps_the_order() -> None:
    late = Late()
    assert late.arriving(b"a", 0, 5) == b""
    assert late.next(0, 100) == 5
    assert late.arriving(b"b", 2, 0) == b""  # behind another one
    assert late.arriving(b"", 5, 0) == b"ab"
    assert late.next(5, 100) == 100
    assert late.arriving(b"c", 6, 0) == b"c"


def test_several_robots_on_one_line_have_no_conditions_that_vary() -> None:
    with pytest.raises(ValueError, match="several robots"):
        Crowd(2, WorldSettings(vary=0.1))
