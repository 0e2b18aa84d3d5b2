"""Eyes, arms and floor sensors, as the board's drivers read them."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from simdevice.arena import Dummy
from simdevice.junior.hardware import JuniorHardware
from simdevice.junior.profile import JuniorProfile
from simdevice.outline import NOTHING
from simdevice.sumo.match import Purpose, stream
from simdevice.sumo.opponents import OPPONENTS
from simdevice.sumo.ring import SumoRing

QUIET = JuniorProfile(eye_noise=0.0, floor_noise=0.0)
RING = SumoRing()


def setting(profile: JuniorProfile = QUIET, opponent: str = "flat-light") -> tuple[JuniorHardware, Dummy]:
    robot = JuniorHardware(profile, RING, stream(1, Purpose.MOTORS), stream(1, Purpose.SENSORS))
    return robot, Dummy(OPPONENTS[opponent], 0.3)


def test_the_threshold_of_a_new_robot_is_the_range() -> None:
    robot, block = setting()
    seen = {}
    for range_ in (0.39, 0.40, 0.41):
        # The nearest point that the left eye sees lies straight ahead of it, at the border of its cone.
        block.place(0.045 + range_ + 0.02, 0.0, math.pi)
        robot.sensors.sample([block])
        assert robot.sensors.distance_left == pytest.approx(range_)
        seen[range_] = robot.sensors.eye_left >= 250
    assert seen == {0.39: True, 0.40: True, 0.41: False}


def test_counts_rise_as_something_comes_nearer() -> None:
    robot, block = setting()
    counts = []
    for step in range(45):
        block.place(0.045 + 0.02 + 0.015 + 0.01 * step, 0.0, math.pi)
        robot.sensors.sample([block])
        counts.append(robot.sensors.eye_left)
    assert all(near > far for near, far in pairwise(counts))
    assert counts[0] < 1023


def test_each_eye_looks_to_its_own_side() -> None:
    robot, post = setting(opponent="point-light")
    bearings = {-50: (0, 0), -20: (0, 1), 20: (1, 0), 50: (0, 0), 180: (0, 0)}
    for degrees, expected in bearings.items():
        angle = math.radians(degrees)
        post.place(0.045 + 0.3 * math.cos(angle), 0.3 * math.sin(angle), 0.0)
        robot.sensors.sample([post])
        sensors = robot.sensors
        assert (int(sensors.distance_left < NOTHING), int(sensors.distance_right < NOTHING)) == expected, degrees


def test_an_arm_presses_at_1_mm_and_releases_at_2_5_mm() -> None:
    robot, block = setting()
    readings = []
    for gap in (3.0, 2.0, 1.1, 0.9, 2.0, 2.4, 2.6, 2.0):
        block.place(0.060 + gap * 1e-3 + 0.02, 0.0, math.pi)
        robot.sensors.sample([block])
        readings.append((robot.sensors.arm_left, robot.sensors.arm_right))
    assert readings == [(0, 0), (0, 0), (0, 0), (1, 1), (1, 1), (1, 1), (0, 0), (0, 0)]


def test_of_several_others_an_eye_sees_the_nearest_and_an_arm_feels_any() -> None:
    robot, block = setting()
    post = Dummy(OPPONENTS["point-light"], 0.3)
    block.place(0.045 + 0.3 + 0.02, 0.0, math.pi)
    post.place(0.060 + 0.02, 0.03, 0.0)
    alone = {}
    for name, others in {"block": (block,), "post": (post,), "both": (block, post), "turned": (post, block)}.items():
        sensors = setting()[0].sensors
        sensors.sample(others)
        alone[name] = (sensors.distance_left, sensors.distance_right, sensors.arm_left, sensors.arm_right)
    assert alone["both"] == alone["turned"]
    assert alone["both"][:2] == tuple(map(min, alone["block"][:2], alone["post"][:2]))
    assert (alone["block"][2:], alone["both"][2:]) == ((0, 0), (1, 0))
    robot.sensors.sample((block, post))
    post.place(0.2, -0.2, 0.0)
    robot.sensors.sample((block, post))
    assert robot.sensors.arm_left == 0, "one that moves on is felt no more, though the other has not moved"
    assert robot.sensors.distance_left == pytest.approx(0.3, abs=1e-3)


def test_an_arm_feels_what_is_in_its_span_only() -> None:
    robot, post = setting(opponent="point-light")
    for y, expected in ((0.0, (1, 1)), (0.03, (1, 0)), (-0.03, (0, 1)), (0.075, (0, 0))):
        robot.sensors.sample(())
        post.place(0.060 + 0.02, y, 0.0)
        robot.sensors.sample([post])
        assert (robot.sensors.arm_left, robot.sensors.arm_right) == expected, y


@pytest.mark.parametrize("opponent", OPPONENTS)
def test_what_touches_the_back_presses_no_arm(opponent: str) -> None:
    robot, other = setting(opponent=opponent)
    for turn in range(0, 360, 5):
        other.place(-0.060 - 0.035, 0.0, math.radians(turn))
        robot.sensors.sample([other])
        assert not robot.sensors.arm_left
        assert not robot.sensors.arm_right


def test_floor_sensors_read_high_off_the_ring() -> None:
    robot, _ = setting()
    body = robot.body
    readings = {}
    for x in (0.0, 0.270, 0.280):
        body.place(x, 0.0, 0.0)
        robot.sensors.sample(())
        readings[x] = (robot.sensors.floor_left > 500, robot.sensors.floor_right > 500)
    assert readings == {0.0: (False, False), 0.270: (False, False), 0.280: (True, True)}
    body.place(0.0, 0.18, 0.0)
    robot.sensors.sample(())
    assert (robot.sensors.floor_left > 500, robot.sensors.floor_right > 500) == (True, False)


def test_noise_is_small_and_repeatable() -> None:
    first, _ = setting(JuniorProfile())
    second, _ = setting(JuniorProfile())
    rows = []
    for robot in (first, second):
        row = []
        for _ in range(50):
            robot.sensors.sample(())
            row.append((robot.sensors.eye_left, robot.sensors.floor_right))
        rows.append(row)
    assert rows[0] == rows[1]
    assert len(set(rows[0])) > 10
    assert all(abs(eye - 60) < 20 and abs(floor - 120) < 50 for eye, floor in rows[0])
