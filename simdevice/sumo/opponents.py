"""The five dummies of the sumo ring, and what they are made of.

Bodies, masses and friction are those of the five kinds of engagement (Liu & Wu 2001, ch. 10): surface, heavy surface,
slipping surface, corner to edge, and point. The front of each is its +x side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from firmware_protocol.near import did_you_mean
from simdevice.junior.profile import JUNIOR_OUTLINE
from simdevice.outline import Disc, Outline, Point

LARGEST: Final = 0.09
"""All of an opponent is nearer to its centre of mass than this, in m: a start pose has that 0.08 m inside the border."""


@dataclass(frozen=True)
class OpponentSpec:
    """What a dummy is made of.

    Attributes:
        name: Name on the command line.
        mass: Mass in kg.
        static: Coefficient of static friction on the ring.
        kinetic: Coefficient of kinetic friction.
        outline: Its shape.
        grip: Radius in m at which ground friction resists a turn about the centre of mass: the mean distance of the
            footprint's area from it, for a load that is spread evenly.
        engagement: How Junior meets it.

    Raises:
        ValueError: It is too large.
    """

    name: str
    mass: float
    static: float
    kinetic: float
    outline: Outline
    grip: float
    engagement: str

    def __post_init__(self) -> None:
        reach = max(math.hypot(x, y) for x, y in self.outline.vertices)
        if reach >= LARGEST:
            raise ValueError(
                f"opponent {self.name} reaches {reach:.3f} m from its centre of mass, and must stay below {LARGEST}"
            )


def _block(depth: float, width: float) -> Outline:
    """A rectangle; sizes in m."""
    x, y = depth / 2, width / 2
    return Outline(((x, -y), (x, y), (-x, y), (-x, -y)))


def _wedge(depth: float, width: float) -> Outline:
    """An isosceles triangle, corner forward, right-angled where it is half as deep as wide; sizes in m."""
    apex = 2 * depth / 3
    return Outline(((apex, 0.0), (apex - depth, width / 2), (apex - depth, -width / 2)))


def _arc(radius: float, width: float) -> Outline:
    """A segment of a disc, round side forward; radius and chord in m."""
    half = math.asin(width / 2 / radius)
    area = radius**2 * (half - math.sin(half) * math.cos(half))
    centroid = width**3 / (12 * area)  # of a segment, from the centre of its disc
    chord = radius * math.cos(half) - centroid
    return Outline(((chord, -width / 2), (chord, width / 2)), Disc(-centroid, radius, half))


def mean_distance(vertices: tuple[Point, ...], rings: int = 64) -> float:
    """Mean distance of an outline's area from the origin.

    Args:
        vertices: Corners of a convex polygon that holds the origin, counter-clockwise, in m.
        rings: Steps of the integration along each side.

    Returns:
        Mean distance in m: for each triangle (origin, a, b) of area A, 2/3 of the mean distance of the side a-b.
    """
    moment = total = 0.0
    for i, (ax, ay) in enumerate(vertices):
        bx, by = vertices[(i + 1) % len(vertices)]
        area = (ax * by - ay * bx) / 2
        shares = [(k + 0.5) / rings for k in range(rings)]
        side = sum(math.hypot(ax + (bx - ax) * s, ay + (by - ay) * s) for s in shares) / rings
        moment += area * side * 2 / 3
        total += area
    return moment / total


def _spec(name: str, mass: float, friction: tuple[float, float], outline: Outline, engagement: str) -> OpponentSpec:
    """Fill in what follows from the outline; friction is (static, kinetic)."""
    return OpponentSpec(name, mass, *friction, outline, mean_distance(outline.vertices), engagement)


OPPONENTS: Final[dict[str, OpponentSpec]] = {
    spec.name: spec
    for spec in (
        _spec("flat-light", 0.15, (0.40, 0.30), _block(0.04, 0.14), "surface"),
        _spec("flat-heavy", 1.0, (0.48, 0.41), _block(0.04, 0.14), "surface"),
        _spec("curved-light", 0.15, (0.40, 0.30), _arc(0.09, 0.14), "surface, slipping"),
        _spec("corner-light", 0.15, (0.40, 0.30), _wedge(0.07, 0.14), "corner to edge"),
        _spec("point-light", 0.10, (0.40, 0.30), Outline(disc=Disc(0.0, 0.02, math.pi)), "point"),
    )
}
"""Every dummy by name."""

JUNIOR_OPPONENT: Final = "junior"
"""Name of the opponent that is a second Junior."""


def outline(name: str) -> list[Point]:
    """Corners to draw an opponent by.

    Args:
        name: Name of the opponent; `junior` is a second Junior.

    Returns:
        Corners, counter-clockwise, in its own frame: m, x forward, origin at the centre of mass.

    Raises:
        ValueError: There is no opponent of this name.
    """
    if name == JUNIOR_OPPONENT:
        return list(JUNIOR_OUTLINE.vertices)
    if name not in OPPONENTS:
        known = (*OPPONENTS, JUNIOR_OPPONENT)
        raise ValueError(f"unknown opponent {name!r}: expected one of {', '.join(known)}{did_you_mean(name, known)}")
    return list(OPPONENTS[name].outline.vertices)
