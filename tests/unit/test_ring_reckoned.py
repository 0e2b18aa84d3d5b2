"""What a ring reads, reckoned from poses."""

from __future__ import annotations

from math import inf, nan, pi, tau

import numpy as np
import pytest

from pal_advisor.ring import RingReadings, SensorRing, count_within, readings


def read(robots: list[tuple[float, float, float, int]], ring: SensorRing | None = None) -> RingReadings:
    """RingReadings of robots given as x, y, heading, class."""
    data = np.array(robots).reshape(-1, 4)
    return readings(data[:, :3], data[:, 3].astype(np.int64), ring or SensorRing())


def at(bearing: float, distance: float = 0.5) -> tuple[float, float, float, int]:
    return (distance * np.cos(bearing), distance * np.sin(bearing), 0.0, 1)


@pytest.mark.parametrize(("bearing", "bits"), [(0.0, 0b10000000), (0.1, 0b10000000), (pi / 4, 0b01000000), (pi, 0b00001000)])
def test_a_sector_has_its_first_bearing_and_not_its_last(bearing: float, bits: int) -> None:
    assert read([(0, 0, 0, 0), at(bearing)]).near[0].tolist() == [0, bits]


def test_a_bearing_next_to_0_from_below_is_of_the_last_sector() -> None:
    assert read([(0, 0, 0, 0), (0.5, -1e-18, 0, 1)]).near[0, 1] == 1


def test_sectors_turn_with_the_body() -> None:
    assert read([(0, 0, pi / 2, 0), at(pi / 2 + 0.1)]).near[0, 1] == 0b10000000
    assert read([(0, 0, -3.0, 0), at(-3.1)]).near[0, 1] == 0b00000001


def test_each_class_has_its_own_column() -> None:
    found = read([(0, 0, 0, 0), (0.5, 0.1, 0, 0), (-0.5, 0.1, 0, 1), (-0.6, 0.1, 0, 1)])
    assert found.near[0].tolist() == [0b10000000, 0b00010000]
    assert found.count[0].tolist() == [1, 2]
    assert found.count[2].tolist() == [1, 1], "the other RANGER is 1.0 away, which is not inside"


def test_inside_is_strictly_nearer() -> None:
    """Eq. 6.4."""
    assert read([(0, 0, 0, 0), (1.0, 0.0, 0, 1)], SensorRing(increment=0.0)).near[0, 1] == 0
    assert read([(0, 0, 0, 0), (np.nextafter(1.0, 0), 0.0, 0, 1)], SensorRing(increment=0.0)).near[0, 1] == 128


@pytest.mark.parametrize(
    ("distance", "radius"),
    [(0.3, 1.0), (0.999, 1.0), (1.0, 1.25), (1.2499, 1.25), (1.25, 1.5), (2.6, 2.75), (100.0, 100.25)],
)
def test_the_radius_grows_until_somebody_is_seen(distance: float, radius: float) -> None:
    """Fig. 6.6."""
    found = read([(0, 0, 0, 0), (distance, 0, 0, 1)])
    assert found.radius.tolist() == [radius, radius]
    assert found.seen[0, 1] == 128
    assert found.near[0, 1] == (128 if distance < 1 else 0)
    assert found.count[0, 1] == 1


@pytest.mark.parametrize("increment", [0.1, 0.05, 1 / 3, 0.7])
def test_the_grown_radius_is_the_smallest_whatever_rounding_does(increment: float) -> None:
    ring = SensorRing(radius=0.2, increment=increment)
    for steps in range(40):
        for distance in (0.2 + steps * increment, np.nextafter(0.2 + steps * increment, 0)):
            expected = next(0.2 + k * increment for k in range(99) if distance < 0.2 + k * increment)
            assert read([(0, 0, 0, 0), (distance, 0, 0, 1)], ring).radius[0] == expected


def test_only_the_other_class_stops_the_radius() -> None:
    found = read([(0, 0, 0, 0), (0.5, 0, 0, 0), (1.6, 0, 0, 1)])
    assert found.radius.tolist() == [1.75, 1.25, 1.25]
    assert found.seen[0].tolist() == [128, 128]
    assert found.near[0].tolist() == [128, 0]


def test_no_radius_is_greater_than_the_limit() -> None:
    found = read([(0, 0, 0, 0), (3.1, 0, 0, 1)], SensorRing(limit=3.1))
    assert found.radius.tolist() == [3.0, 3.0]
    assert found.seen.tolist() == [[0, 0], [0, 0]]


def test_long_range_has_no_limit() -> None:
    found = read([(0, 0, 0, 0), (1e6, 1, 0, 1), (-1, -1, 0, 0)], SensorRing(radius=inf))
    assert found.radius.tolist() == [inf] * 3
    assert found.near[0].tolist() == [0b00000100, 0b10000000]
    assert (found.near == found.seen).all()


def test_without_the_other_class_the_radius_grows_to_the_limit() -> None:
    assert read([(0, 0, 0, 0), (0.5, 0, 0, 0)], SensorRing(limit=2.1)).radius.tolist() == [2.0, 2.0]
    assert read([(0, 0, 0, 0)]).radius.tolist() == [inf]
    assert read([]).near.shape == (0, 2)


def test_robots_on_one_point_see_each_other_along_the_arenas_x() -> None:
    found = read([(1, 1, 0, 0), (1, 1, pi / 2, 1), (1, 1, 0, 1)])
    assert found.near[0].tolist() == [0, 128]
    assert found.near[1].tolist() == [0b00000010, 0b00000010]
    assert found.count[0].tolist() == [0, 2]


def test_who_is_nowhere_sees_nothing_and_is_not_seen() -> None:
    found = read([(0, 0, 0, 0), (nan, nan, 0, 1), (2, 0, 0, 1)], SensorRing(limit=5.0))
    assert found.radius.tolist() == [2.25, 5.0, 2.25]
    assert found.seen.tolist() == [[0, 128], [0, 0], [8, 0]]


def test_counts_within_other_radii() -> None:
    poses = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    classes = np.array([0, 1, 1])
    assert count_within(poses, classes, np.array([1.0, inf, 1.5])).tolist() == [[0, 0], [1, 1], [0, 1]]


@pytest.mark.parametrize("sectors", [1, 3, 8, 16])
def test_whole_arrays_read_as_one_robot_after_the_other(sectors: int) -> None:
    rng = np.random.default_rng(sectors)
    poses = np.column_stack((rng.uniform(-4, 4, (40, 2)), rng.uniform(-pi, pi, 40)))
    classes = (rng.random(40) < 0.2).astype(np.int64)
    found = readings(poses, classes, SensorRing(sectors=sectors))
    for row, (x, y, heading) in enumerate(poses):
        others = [other for other in range(40) if other != row]
        away = {other: float(np.hypot(*(poses[other, :2] - (x, y)))) for other in others}
        nearest = min(away[other] for other in others if classes[other] != classes[row])
        radius = next(1.0 + 0.25 * step for step in range(99) if nearest < 1.0 + 0.25 * step)
        near, seen, count = [0, 0], [0, 0], [0, 0]
        for other in others:
            bearing = (np.arctan2(poses[other, 1] - y, poses[other, 0] - x) - heading) % tau
            bit = 1 << (sectors - 1 - int(bearing / (tau / sectors)))
            near[classes[other]] |= bit * (away[other] < 1.0)
            seen[classes[other]] |= bit * (away[other] < radius)
            count[classes[other]] += away[other] < radius
        assert found.radius[row] == radius
        assert (found.near[row].tolist(), found.seen[row].tolist(), found.count[row].tolist()) == (near, seen, count)
