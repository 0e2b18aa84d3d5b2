"""A bout is what its seed makes it: not what was played before, nor the phase of anybody's reports."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import hil
from firmware_protocol.links import MemoryLink
from firmware_protocol.vocabulary import Action, Maneuver
from hil.bridge.bridge import Bridge
from hil.sumo.ring import Encounter, open_ring
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.maneuver_fields import ManeuverReport
    from hil.sumo.junior import Junior

SEED = 7
AHEAD = Maneuver((Action.FF,) * 4, period=0.2, hold=True)
ROUND = Maneuver((Action.LBRF, Action.FF, Action.FF, Action.SF), period=0.2, hold=True)


def bout(junior: Junior, seed: int) -> list[Encounter]:
    """One bout by simple reflexes, at most ten maneuvers long."""
    ring = open_ring(junior)
    current = ring.begin(seed)
    done: list[Encounter] = []
    while len(done) < 10 and (not done or not done[-1].outcome):
        done.append(ring.engage(AHEAD if current & 3 else ROUND))
        current = done[-1].stimulus
    return done


def after(opponent: str, *, before: Sequence[int] = (), idle: float = 0.0) -> list[tuple[object, ...]]:
    """The bout with the seed `SEED`, after others and after a time of doing nothing; without the numbers of messages."""
    with hil.connect(f"sim://junior?opponent={opponent}&seed=1") as junior:
        junior.arm()
        for seed in before:
            bout(junior, seed)
        junior.wait(idle)
        played = bout(junior, SEED)
    return [(tallies(one.report), one.stimulus, one.outcome, one.elapsed, one.progress) for one in played]


def tallies(report: ManeuverReport) -> tuple[object, ...]:
    return report.outcome, report.reason, report.tallies


@pytest.mark.slow
@pytest.mark.parametrize("opponent", ["flat-light", "curved-light", "corner-light", "junior"])
def test_a_bout_does_not_depend_on_what_was_before(opponent: str) -> None:
    alone = after(opponent)
    assert after(opponent, before=[4]) == alone
    assert after(opponent, before=[1, 2]) == alone
    for phase in range(1, 10, 2):
        assert after(opponent, idle=0.005 * phase) == alone


def test_the_time_of_a_bout_and_the_verdict_stand_when_it_is_over() -> None:
    with hil.connect("sim://junior?seed=1") as junior:
        junior.arm()
        last = bout(junior, SEED)[-1]
        assert last.outcome
        assert junior.referee is not None
        verdict = junior.referee.latest
        junior.drive(-1.0, -1.0)
        junior.wait(1.0)
        assert junior.referee.latest == verdict
        assert junior.referee.state().elapsed == verdict.elapsed == last.elapsed


@pytest.mark.parametrize("metres", [2147.4836, 4294.967, -2147.4837])
def test_a_robot_may_go_farther_than_its_encoders_count(metres: float) -> None:
    """They count micrometres in 32 bits, and wrap."""
    world = junior_world(WorldSettings(seed=1))
    motors, body = world.device.robot.motors, world.device.robot.body
    motors.travel_left = motors.travel_right = body.ground = metres
    with hil.Junior(Bridge(MemoryLink(world), world, session=lambda: 1)) as junior:
        junior.find()
        before = junior.read_sensors().travel
        motors.travel_left += 0.02
        motors.travel_right += 0.02
        body.ground += 0.02
        assert junior.read_sensors().travel == pytest.approx([way + 0.02 for way in before], abs=0.0011)
