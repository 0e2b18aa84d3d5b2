"""Whether a robot's wheels are even: found out by driving, with a person who makes room where one is there."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

from firmware_protocol.links.memory import MemoryLink
from hil.bridge.bridge import Bridge
from hil.bridge.operator import READY, Operator
from hil.questions import Questions
from hil.sumo.attended.evenness import FEWEST, MOST, Evenness, WheelDifference, WheelVerdict, try_wheels
from hil.sumo.junior import Junior
from hil.sumo.ring import open_ring
from simdevice.junior.profile import JuniorProfile
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from simdevice.sumo.world import World


@contextmanager
def robot(profile: JuniorProfile, operator: Operator | None = None) -> Iterator[tuple[Junior, World]]:
    """A robot that nobody referees, in lock-step."""
    world = junior_world(WorldSettings(seed=3, referee=False, profile=profile))
    with Junior(Bridge(MemoryLink(world), world, operator=operator)) as junior:
        junior.find()
        yield junior, world


@pytest.mark.parametrize(
    ("gains", "noise", "verdict", "trim"),
    [
        ((1.0, 1.0), 0.01, WheelVerdict.EVEN, None),
        ((1.0, 1.0), 0.05, WheelVerdict.EVEN, None),
        ((0.85, 1.0), 0.05, WheelVerdict.UNEVEN, ("TRIM_RIGHT", 0.85)),
        ((1.0, 0.9), 0.01, WheelVerdict.UNEVEN, ("TRIM_LEFT", 0.9)),
        ((0.95, 1.0), 0.05, WheelVerdict.UNCLEAR, None),
        ((0.0, 1.0), 0.05, WheelVerdict.UNEVEN, None),
        ((0.0, 0.0), 0.05, WheelVerdict.NO_ROOM, None),
    ],
)
def test_wheels_are_found_to_be_what_they_are(
    gains: tuple[float, float], noise: float, verdict: WheelVerdict, trim: tuple[str, float] | None
) -> None:
    with robot(JuniorProfile(wheel_gain=gains, command_noise=noise)) as (junior, _):
        found = try_wheels(junior, open_ring(junior))
        assert found.verdict is verdict, str(found)
        if found.ahead is not None and found.back is not None:
            expected = (gains[0] - gains[1]) / sum(gains) * 2
            for one in (found.ahead, found.back):
                assert FEWEST <= one.drives <= MOST
                assert one.value == pytest.approx(expected, abs=3.5 * one.error + 0.01)
        assert (found.trim is None) == (trim is None)
        if found.trim is not None and trim is not None:
            assert found.trim[0] == trim[0]
            assert found.trim[1] == pytest.approx(trim[1], abs=0.03)
            junior.set_parameter(*trim)
            assert try_wheels(junior, open_ring(junior)).even


def test_a_robot_without_encoders_does_not_move_and_is_not_taken_for_even() -> None:
    with robot(JuniorProfile(encoders=False)) as (junior, _):
        found = try_wheels(junior, open_ring(junior))
        assert (found.verdict, found.even, junior.armed) == (WheelVerdict.NO_ENCODERS, False, False)
        assert junior.read_sensors().travel == (0.0, 0.0)


def test_a_person_makes_room_and_the_robot_is_disarmed_before_and_after() -> None:
    operator = Operator()
    questions = Questions(operator, None, None)
    armed: list[tuple[bool | None, tuple[float, float]]] = []
    with robot(JuniorProfile(command_noise=0.01), operator) as (junior, world):

        def answer() -> None:
            if questions.open and not armed:
                armed.append((junior.armed, world.device.wheels))
                operator.ask(READY)

        junior.between = answer
        junior.arm()
        before = junior.now()
        assert try_wheels(junior, open_ring(junior), questions).even
        assert junior.now() - before > 5.0  # the countdown
        assert armed == [(False, (0.0, 0.0))]
        assert not junior.armed


def test_wheels_that_are_even_on_the_average_only_are_not_even() -> None:
    ahead, back = WheelDifference(0.08, 0.01, 20), WheelDifference(-0.08, 0.01, 20)
    found = Evenness.of(ahead, back)
    assert (found.verdict, found.trim) == (WheelVerdict.UNEVEN, None)
    assert Evenness.of(WheelDifference(0.0, 0.01, 20), WheelDifference(0.04, 0.01, 20)).verdict is WheelVerdict.UNCLEAR


def test_ways_are_compared_whichever_way_encoders_count() -> None:
    found = WheelDifference.of([(0.03, -0.04), (-0.03, -0.04), (-0.03, 0.04)])
    assert found.value == pytest.approx(-2 / 7)
    assert found.error == pytest.approx(0.0)
    assert found.drives == 3
