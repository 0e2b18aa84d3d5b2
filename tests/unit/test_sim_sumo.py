"""Start poses and rules of a bout; and two hand-written controllers that say whether the physics is right."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import replace

import pytest

from firmware_protocol.messages import BoutOutcome
from simdevice.junior.profile import JuniorProfile
from simdevice.junior.sensors import Sensors
from simdevice.outline import Outline
from simdevice.sumo.match import Match, opponent_code
from simdevice.sumo.opponents import LARGEST, OPPONENTS, outline

Controller = Callable[[Sensors, float], tuple[float, float]]


def chase() -> Controller:
    """Both eyes: ahead; one: turn to it; none: spin."""

    def control(sensors: Sensors, _: float) -> tuple[float, float]:
        left, right = sensors.eye_left >= 250, sensors.eye_right >= 250
        if left and right:
            return 1.0, 1.0
        return (0.35, -0.35) if right else (-0.35, 0.35)

    return control


def chase2() -> Controller:
    """Arcs towards what one eye sees, backs off after 0.6 s of holding, and rams again."""
    held_since = backing_until = -1.0
    side = 1

    def control(sensors: Sensors, time: float) -> tuple[float, float]:
        nonlocal held_since, backing_until, side
        left, right = sensors.eye_left >= 250, sensors.eye_right >= 250
        if time < backing_until:
            return -1.0, -1.0
        if not (sensors.arm_left or sensors.arm_right):
            held_since = -1.0
        elif held_since < 0.0:
            held_since = time
        elif time - held_since > 0.6:
            held_since, backing_until = -1.0, time + 0.25
        if left != right:
            side = 1 if left else -1
        if (left and right) or (sensors.arm_left and sensors.arm_right):
            return 1.0, 1.0
        if left or sensors.arm_left:
            return 0.5, 1.0
        if right or sensors.arm_right:
            return 1.0, 0.5
        return -0.35 * side, 0.35 * side

    return control


def rate(opponent: str, controller: Callable[[], Controller], bouts: int) -> tuple[float, float]:
    """Share of bouts won, and mean time of those, in s."""
    match = Match(opponent, 7)
    times = []
    for bout in range(bouts):
        outcome, time = match.play(controller(), 5000 + bout)
        if outcome is BoutOutcome.WIN:
            times.append(time)
    return len(times) / bouts, sum(times) / max(1, len(times))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("opponent", "least", "most"),
    [
        ("flat-light", 0.9, 1.0),
        ("flat-heavy", 0.0, 0.1),
        ("curved-light", 0.9, 1.0),
        ("corner-light", 0.3, 0.9),
        ("point-light", 0.0, 0.1),
    ],
)
def test_chasing_wins_where_it_should(opponent: str, least: float, most: float) -> None:
    won, _ = rate(opponent, chase, 16)
    assert least <= won <= most


@pytest.mark.parametrize(("opponent", "longest"), [(name, 7.0 if name == "flat-heavy" else 3.0) for name in OPPONENTS])
def test_ramming_wins_everywhere(opponent: str, longest: float) -> None:
    won, time = rate(opponent, chase2, 12)
    assert won >= 0.9
    assert time < longest


@pytest.mark.parametrize("opponent", [*OPPONENTS, "junior"])
def test_start_poses(opponent: str) -> None:
    match = Match(opponent, 1)
    junior, other = match.robot.body, match.opponent
    poses = set()
    for seed in range(60):
        match.reset(seed)
        bearing = math.atan2(other.y - junior.y, other.x - junior.x)
        assert abs(math.remainder(junior.angle - bearing, math.tau)) <= math.radians(90.0) + 1e-9
        assert abs(math.remainder(other.angle - bearing - math.pi, math.tau)) <= math.radians(15.0) + 1e-9
        assert match.arena.ring.clearance(junior.x, junior.y) >= 0.07
        assert match.arena.ring.clearance(other.x, other.y) >= 0.07
        match.arena.space.reindex_shapes_for_body(other.body)
        touched = {info.shape for info in match.arena.space.shape_query(junior.shape)}
        assert other.shape not in touched
        poses.add((junior.x, other.y))
    assert len(poses) == 60


def test_the_same_seed_is_the_same_bout() -> None:
    def trace(seed: int, start: int) -> list[float]:
        match = Match("curved-light", seed)
        match.play(chase2(), start)
        return [match.opponent.x, match.opponent.y, match.robot.body.angle, match.elapsed]

    assert trace(1, 5) == trace(1, 5)
    assert trace(1, 5) == trace(2, 5)  # a bout depends on its own seed and on nothing that was before
    assert trace(1, 5) != trace(1, 6)
    assert trace(1, 5) != trace(1, 6)


@pytest.mark.parametrize(
    ("junior", "opponent", "outcome"),
    [
        ((0.0, 0.0), (0.2, 0.0), BoutOutcome.UNDECIDED),
        ((0.0, 0.0), (0.33, 0.0), BoutOutcome.WIN),
        ((0.0, 0.22), (0.2, 0.0), BoutOutcome.LOSS),
        ((0.0, 0.22), (0.33, 0.0), BoutOutcome.DRAW),
    ],
)
def test_out_is_whose_centre_left_the_ring(
    junior: tuple[float, float], opponent: tuple[float, float], outcome: BoutOutcome
) -> None:
    match = Match("flat-light", 1)
    match.robot.body.place(*junior, 0.0)
    match.opponent.place(*opponent, 0.0)
    while match.lifted:
        match.step()
    match.step()
    assert match.outcome is outcome


def test_fifteen_seconds_are_a_draw() -> None:
    match = Match("flat-light", 1)
    outcome, time = match.play(lambda _sensors, _time: (0.0, 0.0), 3)
    assert outcome is BoutOutcome.DRAW
    assert time == pytest.approx(15.0)


def test_opponents_can_be_exchanged() -> None:
    match = Match("flat-light", 1)
    for name in (*OPPONENTS, "junior", "flat-light"):
        match.reset(1, name)
        assert match.name == name
        assert match.arena.pieces == [match.robot.body, match.opponent]
        assert opponent_code(name).label == name
    with pytest.raises(ValueError, match="flat-light"):
        Match("round-heavy")


@pytest.mark.parametrize("name", [*OPPONENTS, "junior"])
def test_an_outline_can_be_drawn(name: str) -> None:
    corners = outline(name)
    area = sum(ax * by - ay * bx for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True)) / 2
    assert 0.001 < area < 0.0145
    assert max(math.hypot(x, y) for x, y in corners) < LARGEST


def test_an_opponent_that_is_too_large_for_the_ring_is_refused() -> None:
    block = Outline(((0.02, -0.1), (0.02, 0.1), (-0.02, 0.1), (-0.02, -0.1)))
    with pytest.raises(ValueError, match=r"opponent flat-light reaches 0\.102 m .* must stay below 0\.09"):
        replace(OPPONENTS["flat-light"], outline=block)


def test_the_outline_of_nobody_is_an_error() -> None:
    with pytest.raises(ValueError, match="point-light"):
        outline("round-heavy")


def test_a_profile_comes_from_a_toml_table() -> None:
    table = tomllib.loads("mass = 1\nwheel_gain = [1.0, 0]\nencoders = false\nuid = 7")
    assert JuniorProfile.from_table(table) == JuniorProfile(mass=1.0, wheel_gain=(1.0, 0.0), encoders=False, uid=7)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("weight = 1", "unknown quantity 'weight'"),
        ("mass = 'heavy'", "mass is 'heavy'"),
        ("mass = true", "mass is True"),
        ("uid = 1.5", "uid is 1.5"),
        ("encoders = 1", "encoders is 1"),
        ("arm_span = [1.0]", "arm_span"),
        ("track = 0.0", "track must be positive"),
    ],
)
def test_a_profile_says_what_is_wrong(text: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        JuniorProfile.from_table(tomllib.loads(text))
