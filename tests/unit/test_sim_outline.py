"""What eyes and arms measure, against brute force and against the physics engine's own queries."""

from __future__ import annotations

import math

import numpy as np
import pymunk
import pytest

from simdevice.junior.profile import JUNIOR_OUTLINE
from simdevice.outline import NOTHING, Outline
from simdevice.sumo.opponents import OPPONENTS, mean_distance

STEEPEST = math.radians(45.0)
TANGENT = math.tan(STEEPEST)
HALF_CONE = math.radians(20.0)
OUTLINES = {name: spec.outline for name, spec in OPPONENTS.items()} | {"junior": JUNIOR_OUTLINE}


def cone(axis: float) -> tuple[float, float, float, float]:
    left, right = axis + HALF_CONE, axis - HALF_CONE
    return math.cos(left), math.sin(left), math.cos(right), math.sin(right)


def surface(outline: Outline, step: float = 2e-4) -> np.ndarray:
    """Points and outward normals along an outline, densely: shape (n, 4), in m."""
    rows = []
    disc = outline.disc
    corners = outline.corners
    sides = list(zip(corners, corners[1:] + corners[:1], strict=True))
    for (ax, ay), (bx, by) in sides[1:] if disc is not None else sides:
        length = math.hypot(bx - ax, by - ay)
        share = np.linspace(0.0, 1.0, max(2, int(length / step)))
        nx, ny = (by - ay) / length, (ax - bx) / length
        rows.append(np.stack([ax + (bx - ax) * share, ay + (by - ay) * share, 0 * share + nx, 0 * share + ny], axis=1))
    if disc is not None:
        angle = np.linspace(-disc.half_angle, disc.half_angle, int(2 * disc.half_angle * disc.radius / step))
        cos, sin = np.cos(angle), np.sin(angle)
        rows.append(np.stack([disc.x + disc.radius * cos, disc.radius * sin, cos, sin], axis=1))
    return np.concatenate(rows)


def brute_force(points: np.ndarray, x: float, y: float, axis: float) -> float:
    dx, dy = points[:, 0] - x, points[:, 1] - y
    distance = np.hypot(dx, dy)
    off = np.abs(np.remainder(np.arctan2(dy, dx) - axis + math.pi, math.tau) - math.pi)
    slope = -(dx * points[:, 2] + dy * points[:, 3]) / distance
    seen = (off <= HALF_CONE) & (slope >= math.cos(STEEPEST))
    return float(distance[seen].min()) if seen.any() else NOTHING


@pytest.mark.parametrize("name", OUTLINES)
def test_an_eye_measures_the_nearest_point_that_reflects(name: str) -> None:
    outline = OUTLINES[name]
    points = surface(outline)
    random = np.random.default_rng(1)
    seen = 0
    for _ in range(400):
        bearing = random.uniform(-math.pi, math.pi)
        distance = random.uniform(outline.radius + 0.01, 0.5)
        x, y = distance * math.cos(bearing), distance * math.sin(bearing)
        axis = bearing + math.pi + random.normal(0.0, 0.5)
        expected = brute_force(points, x, y, axis)
        found = outline.nearest_seen(x, y, cone(axis), TANGENT)
        if NOTHING in (expected, found):
            seen += expected == found  # a sliver narrower than the sampling may be seen by one and not by the other
            continue
        assert found == pytest.approx(expected, abs=1e-3)
        seen += 1
    assert seen >= 380


@pytest.mark.parametrize("name", OUTLINES)
def test_a_line_enters_where_the_physics_engine_says(name: str) -> None:
    outline = OUTLINES[name]
    space = pymunk.Space()
    space.add(pymunk.Poly(space.static_body, list(outline.vertices)))
    random = np.random.default_rng(2)
    hits = 0
    for _ in range(300):
        bearing = random.uniform(-math.pi, math.pi)
        x, y = 0.4 * math.cos(bearing), 0.4 * math.sin(bearing)
        angle = bearing + math.pi + random.uniform(-0.2, 0.2)
        fx, fy = math.cos(angle), math.sin(angle)
        hit = space.segment_query_first((x, y), (x + fx, y + fy), 0.0, pymunk.ShapeFilter())
        found = outline.along(x, y, fx, fy)
        if hit is not None and found < NOTHING:
            assert found == pytest.approx(hit.alpha, abs=2e-3)
            hits += 1
    assert hits > 40


def test_a_flat_face_is_seen_at_its_distance_and_not_when_steeper_than_45_degrees() -> None:
    block = OPPONENTS["flat-light"].outline
    assert block.nearest_seen(0.02 + 0.3, 0.0, cone(math.pi), TANGENT) == pytest.approx(0.3)
    face = Outline(((0.0, -0.001), (0.0, 0.001), (-0.0002, 0.0)))
    for tilt, visible in ((44.0, True), (46.0, False)):
        bearing = math.radians(tilt)
        x, y = 0.3 * math.cos(bearing), 0.3 * math.sin(bearing)
        assert (face.nearest_seen(x, y, cone(bearing + math.pi), TANGENT) < NOTHING) is visible


def test_an_eye_has_a_cone() -> None:
    post = OPPONENTS["point-light"].outline
    for off, visible in ((0.0, True), (19.0, True), (25.0, False), (180.0, False)):
        axis = math.pi + math.radians(off)
        assert (post.nearest_seen(0.3, 0.0, cone(axis), TANGENT) < NOTHING) is visible


def test_a_strip_meets_the_nearest_point_within_it() -> None:
    post = OPPONENTS["point-light"].outline
    # Coming from +x, looking along -x, the post 30 mm to the left of the middle line.
    assert post.gaps(0.2, 0.03, -1.0, 0.0, (0.004, 0.045)) == pytest.approx((0.18, NOTHING))
    # The post beyond the strip: what counts is the border of the strip, where the post is round.
    rounding = math.sqrt(0.02**2 - 0.01**2)
    assert post.gaps(0.2, 0.055, -1.0, 0.0, (0.004, 0.045)) == pytest.approx((0.2 - rounding, NOTHING))


def test_ground_friction_acts_at_the_mean_distance_of_the_footprint() -> None:
    assert OPPONENTS["point-light"].grip == pytest.approx(2 / 3 * 0.02, rel=0.01)
    side = 0.1
    square = ((side / 2, -side / 2), (side / 2, side / 2), (-side / 2, side / 2), (-side / 2, -side / 2))
    # Mean distance from the centre of a square of side a: a (sqrt 2 + asinh 1) / 6.
    assert mean_distance(square) == pytest.approx(side * (math.sqrt(2) + math.asinh(1)) / 6, rel=1e-3)


@pytest.mark.parametrize("name", OPPONENTS)
def test_the_centre_of_mass_is_the_origin(name: str) -> None:
    body = pymunk.Body()
    shape = pymunk.Poly(body, list(OPPONENTS[name].outline.vertices))
    assert shape.center_of_gravity.length < 2e-4
