"""What the physics remembers, and must not: a bout depends on its own seed; sticking and sliding; both wheels' slip."""

from __future__ import annotations

import math

import pytest

from simdevice.arena import Arena, Dummy
from simdevice.junior.motors import Motors
from simdevice.junior.profile import JuniorProfile
from simdevice.quantities import GRAVITY
from simdevice.sumo.match import Match, Purpose, stream
from simdevice.sumo.opponents import OPPONENTS

EXACT = JuniorProfile(command_noise=0.0, full_voltage=7.4, empty_voltage=7.4, resistance=0.0)


def course(match: Match, seed: int) -> list[tuple[float, ...]]:
    """A bout in which Junior rams ahead, pose by pose, from a start in which both touch."""
    match.reset(seed)
    match.robot.body.place(-0.05, 0.0, 0.0)
    match.opponent.place(0.04, 0.01, math.pi)
    match.robot.motors.command(1000, 900)
    poses: list[tuple[float, ...]] = []
    for _ in range(120):
        match.arena.step()
        poses.append((match.robot.body.x, match.robot.body.y, match.robot.body.angle, match.opponent.x, match.opponent.y))
    return poses


@pytest.mark.parametrize("opponent", [*OPPONENTS, "junior"])
def test_a_bout_is_the_same_whatever_was_before(opponent: str) -> None:
    fresh = course(Match(opponent, 1), 7)
    match = Match(opponent, 1)
    course(match, 3)  # ends in the middle of a push
    assert course(match, 7) == fresh
    assert course(match, 7) == fresh


@pytest.mark.parametrize(("speed", "slides"), [(0.0005, False), (0.0015, False), (0.0025, True), (0.01, True), (0.02, True)])
@pytest.mark.parametrize("turning", [False, True])
def test_what_moves_faster_than_two_millimetres_a_second_slides(speed: float, *, slides: bool, turning: bool) -> None:
    arena = Arena()
    dummy = Dummy(OPPONENTS["flat-heavy"], 0.3)
    arena.add(dummy)
    dummy.place(0.0, 0.0, 0.0)
    for _ in range(3):
        if turning:
            dummy.body.angle += speed * arena.period / dummy.spec.grip
        else:
            dummy.body.position += (speed * arena.period, 0.0)
        dummy.refresh()
    assert dummy.sliding is slides
    dummy.refresh()
    assert not bool(dummy.sliding), "at rest it sticks again"


@pytest.mark.parametrize("name", OPPONENTS)
def test_a_slow_push_between_both_frictions_goes_on(name: str) -> None:
    spec = OPPONENTS[name]
    arena = Arena()
    dummy = Dummy(spec, 0.3)
    arena.add(dummy)
    dummy.place(0.0, 0.0, 0.0)
    dummy.body.velocity = (0.012, 0.0)
    for _ in range(60):
        dummy.body.force = ((spec.static + spec.kinetic) / 2 * spec.mass * GRAVITY, 0.0)
        arena.step()
    assert dummy.body.velocity.x > 0.012


@pytest.mark.parametrize(
    ("left", "right"), [(1000, 1000), (1000, -1000), (-1000, 1000), (-1000, -1000), (1000, 300), (300, 1000)]
)
def test_each_wheels_travel_includes_its_slip(left: int, right: int) -> None:
    motors = Motors(EXACT, stream(1, Purpose.MOTORS))
    motors.command(left, right)
    motors.turn(0.0, 0.0, 0.005)

    def slip(effort: int) -> float:
        """Speed at which a stalled robot's wheel slips, in m/s: where its motor gives what the tyre holds."""
        most = EXACT.tyre_limit / EXACT.stall_force
        beyond = max(0.0, abs(effort) / 1000 - most)
        return math.copysign(beyond * EXACT.free_speed, effort)

    assert motors.travel_left / 0.005 == pytest.approx(slip(left))
    assert motors.travel_right / 0.005 == pytest.approx(slip(right))
    assert slip(1000) > 0.1
    assert slip(300) == 0.0
