"""Convex outlines, and the two questions that sensors ask of them: how far, and how near to a bumper.

An outline is the intersection of half-planes and, where it is round, one disc. So a block, a wedge, a cylinder and a
convex arc are measured exactly, by a handful of float operations, without any query of the physics engine.
Everything is in the outline's own frame: metres, x forward, y left, origin at the centre of mass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

Point = tuple[float, float]
NOTHING: Final = math.inf
"""Distance to what is not there."""

Edge = tuple[float, float, float, float, float]
"""x and y of the first corner, unit tangent x and y (counter-clockwise), length; the outward normal is (ty, -tx)."""


@dataclass(frozen=True)
class Disc:
    """The round part of an outline: a centre in m, a radius in m, and half the angle of the arc that belongs to it.

    Attributes:
        x: Centre; the centre's y is 0.
        radius: Radius.
        half_angle: The arc runs from -half_angle to +half_angle about the x axis, in rad; pi is a whole circle.
    """

    x: float
    radius: float
    half_angle: float


class Outline:
    """A convex outline.

    Args:
        corners: Corners of the polygon part, counter-clockwise, in m; empty for a circle. The first side of the polygon
            is left out where a disc with less than a whole circle is given: the arc takes its place, from the first
            corner to the second.
        disc: The round part, if any.
        arc_segments: Sides that stand for the arc in `vertices`.
    """

    def __init__(self, corners: tuple[Point, ...] = (), disc: Disc | None = None, arc_segments: int = 16) -> None:
        self.disc = disc
        self.corners = corners
        sides = [_edge(corners[i], corners[(i + 1) % len(corners)]) for i in range(len(corners))]
        self.edges: tuple[Edge, ...] = tuple(sides[1:] if disc is not None else sides)
        if disc is None:
            self.vertices: tuple[Point, ...] = corners
        else:
            whole = disc.half_angle >= math.pi
            count = 2 * arc_segments if whole else arc_segments
            angles = [disc.half_angle * (2 * i / count - 1) for i in range(count if whole else count + 1)]
            arc = [(disc.x + disc.radius * math.cos(a), disc.radius * math.sin(a)) for a in angles]
            self.vertices = tuple(arc) + corners[2:]
        self.radius = max(math.hypot(x, y) for x, y in self.vertices)
        """Radius of the circle about the origin that holds everything, in m."""

    def nearest_seen(self, x: float, y: float, cone: tuple[float, float, float, float], tangent: float) -> float:
        """Distance of the nearest point that an eye sees.

        A point is seen when it lies in the eye's cone, on a side turned to the eye, and the ray meets the surface at no
        more than the steepest angle from its normal (a reflective sensor gets nothing back from a steeper one).

        Args:
            x: Position of the eye, in m.
            y: Likewise.
            cone: Unit vectors along the left and the right border of the cone (lx, ly, rx, ry), less than 180 degrees apart.
            tangent: Of the greatest angle between ray and normal.

        Returns:
            Distance in m; infinite when nothing is seen.
        """
        lx, ly, rx, ry = cone
        radius = self.radius
        if ly * x - lx * y > radius or rx * y - ry * x > radius:  # the whole body is beyond one border of the cone
            return NOTHING
        best = NOTHING
        for x0, y0, tx, ty, length in self.edges:
            px = x - x0
            py = y - y0
            height = px * ty - py * tx
            if height <= 0.0:
                continue
            ahead_left = ly * tx - lx * ty
            ahead_right = ry * tx - rx * ty
            if ahead_left <= 0.0 and ahead_right <= 0.0:
                continue
            # Along the side, from the foot of the perpendicular: what reflects, what exists, what the cone holds.
            high = height * tangent
            low = -high
            foot = px * tx + py * ty
            low = max(low, -foot)
            high = min(high, length - foot)
            if ahead_left > 0.0:
                border = height * (lx * tx + ly * ty) / ahead_left
                low = max(low, border)
            if ahead_right > 0.0:
                border = height * (rx * tx + ry * ty) / ahead_right
                high = min(high, border)
            if low > high:
                continue
            along = low if low > 0.0 else min(0.0, high)
            square = height * height + along * along
            best = min(best, square)
        best = math.sqrt(best) if best < NOTHING else NOTHING
        return best if self.disc is None else min(best, self._arc_seen(self.disc, x, y, cone, tangent))

    def _arc_seen(self, disc: Disc, x: float, y: float, cone: tuple[float, float, float, float], tangent: float) -> float:
        """Distance of the nearest point of the arc that an eye sees; arguments as `nearest_seen`."""
        toward_x = disc.x - x
        toward_y = -y
        distance = math.sqrt(toward_x * toward_x + toward_y * toward_y)
        radius = disc.radius
        if distance <= radius:
            return NOTHING
        lx, ly, rx, ry = cone
        # Angles of sight about the line from the eye to the centre, counter-clockwise positive.
        high = math.atan2(toward_x * ly - toward_y * lx, toward_x * lx + toward_y * ly)
        low = math.atan2(toward_x * ry - toward_y * rx, toward_x * rx + toward_y * ry)
        if low > high:  # the centre is behind the eye, where the angles wrap
            return NOTHING
        widest = math.asin(radius * tangent / math.sqrt(1.0 + tangent * tangent) / distance)
        high = min(high, widest)
        low = max(low, -widest)
        if disc.half_angle < math.pi:
            facing = math.atan2(-toward_y, -toward_x)  # angle on the disc of the point that is nearest to the eye
            high = min(high, _sight(distance, radius, facing + disc.half_angle))
            low = max(low, _sight(distance, radius, facing - disc.half_angle))
        if low > high:
            return NOTHING
        angle = low if low > 0.0 else min(high, 0.0)
        offset = distance * math.sin(angle)
        return distance * math.cos(angle) - math.sqrt(max(0.0, radius * radius - offset * offset))

    def gaps(self, x: float, y: float, fx: float, fy: float, span: tuple[float, float]) -> tuple[float, float]:
        """How far ahead of two strips, either side of a middle line, the nearest point of the outline is.

        Args:
            x: Origin of the strips' frame, in m.
            y: Likewise.
            fx: Unit vector of their forward direction.
            fy: Likewise.
            span: Least and greatest distance of a strip from the middle line, in m.

        Returns:
            For the left and the right strip: forward distance in m from the frame's origin to the nearest point within
            the strip; infinite when nothing of the outline lies in it.
        """
        foremost, side = self._foremost(x, y, fx, fy)
        near, far = span
        # The outline is convex: what is nearest within a strip is the foremost point, or lies on the border next to it.
        left = side if near <= side <= far else near if side < near else far
        right = side if -far <= side <= -near else -far if side < -far else -near
        return (
            foremost if left == side else self.along(x - fy * left, y + fx * left, fx, fy),
            foremost if right == side else self.along(x - fy * right, y + fx * right, fx, fy),
        )

    def _foremost(self, x: float, y: float, fx: float, fy: float) -> tuple[float, float]:
        """Forward and lateral position of the point that comes first; arguments as `gaps`."""
        disc = self.disc
        if disc is not None:
            bearing = math.atan2(-fy, -fx)
            if abs(bearing) <= disc.half_angle:
                px = disc.x - disc.radius * fx - x
                py = -disc.radius * fy - y
                return px * fx + py * fy, py * fx - px * fy
        nearest = NOTHING
        side = 0.0
        for cx, cy in self.corners:
            px = cx - x
            py = cy - y
            ahead = px * fx + py * fy
            if ahead < nearest:
                nearest = ahead
                side = py * fx - px * fy
        return nearest, side

    def along(self, x: float, y: float, fx: float, fy: float) -> float:
        """Where a line enters the outline.

        Args:
            x: Point of the line, in m.
            y: Likewise.
            fx: Unit vector along the line.
            fy: Likewise.

        Returns:
            Distance along the line from the point, in m, negative behind it; infinite when the line misses.
        """
        enter = -NOTHING
        leave = NOTHING
        for x0, y0, tx, ty, _ in self.edges:
            height = (x - x0) * ty - (y - y0) * tx
            rate = fx * ty - fy * tx
            if rate < 0.0:
                enter = max(enter, -height / rate)
            elif rate > 0.0:
                leave = min(leave, -height / rate)
            elif height > 0.0:
                return NOTHING
        disc = self.disc
        if disc is not None:
            px = x - disc.x
            middle = -(px * fx + y * fy)
            offset = px * fy - y * fx
            square = disc.radius * disc.radius - offset * offset
            if square < 0.0:
                return NOTHING
            half = math.sqrt(square)
            enter = max(enter, middle - half)
            leave = min(leave, middle + half)
        return enter if enter <= leave else NOTHING


def _edge(a: Point, b: Point) -> Edge:
    """The side from corner a to corner b."""
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    return a[0], a[1], (b[0] - a[0]) / length, (b[1] - a[1]) / length, length


def _sight(distance: float, radius: float, angle: float) -> float:
    """Angle at which the point of a disc at `angle` from the nearest point is seen from a distance; all in m, rad.

    Counter-clockwise on the disc is clockwise for the eye; the caller has turned the sign already. What lies beyond
    the horizon is taken to be on it.
    """
    horizon = math.acos(radius / distance)
    angle = max(-horizon, min(horizon, angle))
    return math.atan2(radius * math.sin(angle), distance - radius * math.cos(angle))
