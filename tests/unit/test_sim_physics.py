"""Motors, tyres, ground friction, battery: the figures that decide who pushes whom."""

from __future__ import annotations

import math
from statistics import fmean

import pytest

from simdevice.arena import Arena, Dummy, Rover
from simdevice.junior.motors import Motors
from simdevice.junior.profile import JuniorProfile
from simdevice.quantities import GRAVITY
from simdevice.sumo.match import Match, Purpose, stream
from simdevice.sumo.opponents import OPPONENTS
from simdevice.sumo.ring import SumoRing

EXACT = JuniorProfile(command_noise=0.0, full_voltage=7.4, empty_voltage=7.4, resistance=0.0)
"""A robot without errors and with a stiff supply."""


def rover(profile: JuniorProfile = EXACT) -> tuple[Arena, Rover, Motors]:
    arena = Arena()
    motors = Motors(profile, stream(1, Purpose.MOTORS))
    body = Rover(profile, motors)
    arena.add(body)
    body.place(0.0, 0.0, 0.0)
    return arena, body, motors


@pytest.mark.parametrize(
    ("effort", "speed", "force"), [(1000, 0.0, 1.962), (500, 0.0, 1.5), (1000, 0.40, 0.0), (1000, 0.20, 1.5)]
)
def test_a_motor_has_a_linear_torque_speed_curve_up_to_what_the_tyre_holds(effort: int, speed: float, force: float) -> None:
    motors = Motors(EXACT, stream(1, Purpose.MOTORS))
    motors.command(effort, -effort)
    motors.turn(speed, -speed, 0.005)
    assert motors.force_left == pytest.approx(force, abs=1e-9)
    assert motors.force_right == pytest.approx(-force, abs=1e-9)


def test_a_slipping_wheel_runs_ahead_of_the_ground() -> None:
    motors = Motors(EXACT, stream(1, Purpose.MOTORS))
    motors.command(1000, 1000)
    motors.turn(0.0, 0.0, 0.005)
    # 3.0 (1 - v / 0.4) = 1.962 N
    assert motors.travel_left / 0.005 == pytest.approx(0.4 * (1 - 1.962 / 3.0))


def test_free_speed_is_reached_within_a_decimetre() -> None:
    arena, body, motors = rover()
    motors.command(1000, 1000)
    while body.x < 0.10:
        arena.step()
    assert 0.36 < body.body.velocity.x < 0.40
    for _ in range(100):
        arena.step()
    assert body.body.velocity.x == pytest.approx(0.40, rel=1e-3)
    assert body.ground == pytest.approx(body.x, abs=3e-3)


def test_wheels_turn_the_body_about_the_middle_of_the_axle() -> None:
    arena, body, motors = rover()
    motors.command(-350, 350)
    for _ in range(400):
        arena.step()
    assert body.body.angular_velocity == pytest.approx(0.35 * 0.40 / 0.045, rel=1e-3)
    assert math.hypot(body.x, body.y) < 1e-3


def test_tyres_hold_sideways_up_to_their_friction() -> None:
    for force, moves in ((3.8, False), (4.1, True)):
        arena, body, _ = rover()
        for _ in range(40):
            body.body.apply_force_at_local_point((0.0, force), (0.0, 0.0))
            before = body.body.force
            body.drive()
            body.body.force = before
            arena.space.step(arena.period)
            body.refresh()
        assert (body.y > 1e-3) is moves


def test_a_steady_push_is_at_most_the_tyres_friction() -> None:
    arena, _, motors = rover()
    wall = Dummy(OPPONENTS["flat-heavy"], 0.3)
    arena.add(wall)
    wall.place(0.08, 0.0, math.pi)
    motors.command(1000, 1000)
    for _ in range(400):
        arena.step()
    assert motors.force_left + motors.force_right == pytest.approx(0.8 * 0.5 * GRAVITY)
    assert not wall.sliding
    assert wall.x == pytest.approx(0.08, abs=1e-3)


@pytest.mark.parametrize("name", OPPONENTS)
def test_static_friction_holds_more_than_kinetic(name: str) -> None:
    spec = OPPONENTS[name]
    weight = spec.mass * GRAVITY

    def pushed(force: float, speed: float) -> float:
        arena = Arena()
        dummy = Dummy(spec, 0.3)
        arena.add(dummy)
        dummy.place(0.0, 0.0, 0.0)
        dummy.body.velocity = (speed, 0.0)
        for _ in range(60):
            dummy.body.force = (force, 0.0)
            arena.step()
        return float(dummy.body.velocity.x)

    between = (spec.static + spec.kinetic) / 2 * weight
    assert pushed(between, 0.0) < 1e-3
    assert pushed(spec.static * weight * 1.02, 0.0) > 1e-3
    assert pushed(between, 0.05) > 0.05
    assert pushed(spec.kinetic * weight * 0.9, 0.05) < 0.05


def test_a_ram_moves_the_heavy_block_about_seven_centimetres() -> None:
    """The reference figure is 67 mm for a ram from 10 cm."""
    way = []
    for seed in range(20):
        match = Match("flat-heavy", seed)
        match.robot.body.place(-0.2, 0.0, 0.0)
        match.opponent.place(-0.2 + 0.06 + 0.10 + 0.02, 0.0, math.pi)
        match.robot.motors.command(1000, 1000)
        for _ in range(300):
            match.arena.step()
        way.append(match.opponent.x + 0.02)
    assert 0.055 < fmean(way) < 0.095


def test_the_error_of_a_command_is_drawn_when_it_changes() -> None:
    motors = Motors(JuniorProfile(), stream(1, Purpose.MOTORS))
    forces = []
    for effort in (300, 300, 400, 300):
        motors.command(effort, 0)
        motors.turn(0.0, 0.0, 0.005)
        forces.append(motors.force_left)
    assert forces[0] == pytest.approx(forces[1], rel=1e-2)
    assert abs(forces[3] / forces[0] - 1) > 1e-3
    assert motors.force_right == 0.0


def test_the_battery_sags_under_load_and_runs_down_to_its_end() -> None:
    motors = Motors(JuniorProfile(), stream(1, Purpose.MOTORS))
    motors.turn(0.0, 0.0, 0.005)
    idle = motors.voltage
    motors.command(1000, 1000)
    motors.turn(0.0, 0.0, 0.005)
    assert 0.05 < idle - motors.voltage < 0.15
    motors.charge = 2 * JuniorProfile().capacity
    motors.turn(0.0, 0.0, 0.005)
    assert motors.voltage == pytest.approx(7.0, abs=0.1)


def test_a_dead_motor_gives_nothing() -> None:
    arena, body, motors = rover(JuniorProfile(wheel_gain=(0.0, 1.0)))
    motors.command(1000, 1000)
    for _ in range(100):
        arena.step()
    assert body.angle > 0.5


def test_the_border_and_the_rim() -> None:
    ring = SumoRing()
    assert ring.clearance(0.0, 0.0) == pytest.approx(0.21)
    assert ring.clearance(0.330, 0.0) == pytest.approx(-0.005)
    arena, body, motors = rover()
    motors.command(1000, 1000)
    for _ in range(1500):
        arena.step()
    assert body.x < ring.width / 2 + ring.rim
