"""What a ring of sensors reads, reckoned from the poses of all robots (Liu & Wu 2001, 6.1.2 to 6.1.4).

For robots that know where they are and have no ring, and as the measure of what rings read. Lengths have any unit that
all of them share.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, tau
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass

if TYPE_CHECKING:
    from numpy.typing import NDArray

CLASSES: Final = tuple(RobotClass)


@dataclass(frozen=True)
class SensorRing:
    """How a ring senses.

    Attributes:
        sectors: N, 1 to 16; sector k covers the bearings [(k - 1) beta, k beta) of the body, beta = 2 pi / N (Eq. 6.1).
        radius: R0. Infinite for long-range sensors (6.1.3), which have no limit at all.
        increment: dR, by which the radius grows until something is seen (Fig. 6.6); 0 for a fixed one.
        limit: No radius is greater.
    """

    sectors: int = 8
    radius: float = 1.0
    increment: float = 0.25
    limit: float = inf


@dataclass(frozen=True)
class RingReadings:
    """What the rings of n robots read; columns are classes (`RobotClass`).

    Attributes:
        near: Sectors occupied within R0, sector 1 the most significant of N bits, shape (n, 2).
        seen: Sectors occupied within the radius now used, shape (n, 2).
        count: Robots within that radius, not clipped, shape (n, 2).
        radius: The radius now used, shape (n,).
    """

    near: NDArray[np.int64]
    seen: NDArray[np.int64]
    count: NDArray[np.int64]
    radius: NDArray[np.float64]


def readings(poses: NDArray[np.float64], classes: NDArray[np.int64], ring: SensorRing) -> RingReadings:
    """What every robot's ring reads. A robot on another's very position sees it straight along the arena's x.

    Args:
        poses: x, y, heading in rad, counter-clockwise from x, shape (n, 3). A robot whose position is NaN sees nothing and
            is not seen.
        classes: Class of each robot, shape (n,).
        ring: How they sense.
    """
    distances = _distances(poses)
    others = classes[:, None] != classes[None, :]
    nearest = np.min(distances, axis=1, where=others, initial=inf)
    radius = _grown(nearest, ring)
    rows, columns = np.nonzero(distances < np.maximum(radius, ring.radius)[:, None])
    ways = poses[columns, :2] - poses[rows, :2]
    bearings = np.mod(np.arctan2(ways[:, 1], ways[:, 0]) - poses[rows, 2], tau)
    # A bearing next to 0 from below is rounded to 2 pi.
    sector = np.minimum(np.floor(bearings * (ring.sectors / tau)).astype(np.int64), ring.sectors - 1)
    bits = np.int64(1) << (ring.sectors - 1 - sector)
    found, distance = classes[columns], distances[rows, columns]
    inside, close = distance < radius[rows], distance < ring.radius
    near, seen = (np.zeros((len(poses), len(CLASSES)), dtype=np.int64) for _ in range(2))
    np.bitwise_or.at(near, (rows[close], found[close]), bits[close])
    np.bitwise_or.at(seen, (rows[inside], found[inside]), bits[inside])
    return RingReadings(near, seen, _tally(rows[inside], found[inside], len(poses)), radius)


def count_within(poses: NDArray[np.float64], classes: NDArray[np.int64], radius: NDArray[np.float64]) -> NDArray[np.int64]:
    """How many robots of each class are nearer to each robot than a radius (Eq. 6.4).

    Args:
        poses: As for `readings`.
        classes: As for `readings`.
        radius: Of each robot, shape (n,).

    Returns:
        Counts, shape (n, 2).
    """
    return _counts(_distances(poses), classes, radius)


def _counts(distances: NDArray[np.float64], classes: NDArray[np.int64], radius: NDArray[np.float64]) -> NDArray[np.int64]:
    rows, columns = np.nonzero(distances < radius[:, None])
    return _tally(rows, classes[columns], len(classes))


def _tally(rows: NDArray[np.int64], found: NDArray[np.int64], robots: int) -> NDArray[np.int64]:
    """How often each robot found each class."""
    kinds = len(CLASSES)
    return np.bincount(rows * kinds + found, minlength=robots * kinds).reshape(robots, kinds)


def _distances(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Between all robots; from itself, and from where nobody knows, a robot is infinitely far."""
    x, y = poses[:, 0], poses[:, 1]
    across, up = x[:, None] - x[None, :], y[:, None] - y[None, :]
    distances = np.sqrt(across * across + up * up)
    np.fill_diagonal(distances, inf)
    unknown = np.isnan(x) | np.isnan(y)
    if unknown.any():
        distances[unknown], distances[:, unknown] = inf, inf
    return distances


def _grown(nearest: NDArray[np.float64], ring: SensorRing) -> NDArray[np.float64]:
    """The smallest of R0, R0 + dR, ... at which the nearest is inside; where none is, the greatest within the limit."""
    if ring.increment <= 0.0 or ring.radius == inf:
        return np.full(len(nearest), ring.radius)

    def radius(steps: NDArray[np.float64]) -> NDArray[np.float64]:
        return ring.radius + steps * ring.increment

    most = np.floor((max(ring.limit, ring.radius) - ring.radius) / ring.increment)
    steps = np.clip(np.floor((nearest - ring.radius) / ring.increment) + 1.0, 0.0, most)
    # The quotient may be rounded across a whole number; what is compared with distances decides.
    steps = np.where((steps > 0.0) & (nearest < radius(steps - 1.0)), steps - 1.0, steps)
    steps = np.where((steps < most) & (nearest >= radius(steps)), steps + 1.0, steps)
    return radius(steps)
