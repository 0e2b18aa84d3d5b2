"""Where robots stand on a table before anybody has placed them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from simdevice.swarm.rooms import Room

_SPACING: Final = 0.1
"""Between two of them, in m."""
_CLEAR: Final = 0.01
"""Least room between a robot and a wall or the box, in m."""


def free_places(
    count: int,
    radius: float,
    *,
    walls: NDArray[np.float64],
    within: tuple[float, float] | None,
    box_half: float,
    room: Room | None,
) -> NDArray[np.float64]:
    """The free points of a lattice that are nearest to the middle.

    Args:
        count: Number of robots.
        radius: Of a robot, in m.
        walls: All that stands there, as segments: x, y of one end and x, y of the other, in m; shape (n, 4).
        within: Half width and half height of the wall around the table, in m; None: there is none.
        box_half: Half of the side of a box in the middle, in m; 0: there is none.
        room: Whose obstacles are among the walls.

    Returns:
        x and y in m, shape (count, 2).

    Raises:
        ValueError: There are too few.
    """
    clear = radius + _CLEAR
    reach = _SPACING * math.ceil(math.sqrt(count) / 2 + 2) + (0.0 if room is None else max(room.size))
    half_x, half_y = (reach, reach) if within is None else (min(side - clear, reach) for side in within)
    steps_x, steps_y = math.floor(half_x / _SPACING), math.floor(half_y / _SPACING)
    if steps_x < 0 or steps_y < 0:
        raise ValueError(f"a robot of {2 * radius} m does not fit within the wall")
    lattice = np.stack(np.meshgrid(np.arange(-steps_x, steps_x + 1), np.arange(-steps_y, steps_y + 1)), -1).reshape(-1, 2)
    points = np.asarray(lattice[np.argsort((lattice**2).sum(axis=1), kind="stable")] * _SPACING, np.float64)
    free = np.ones(len(points), bool) if room is None else room.is_free(points)
    for end_x, end_y, to_x, to_y in walls.tolist():
        along = np.array([to_x - end_x, to_y - end_y])
        from_end = points - (end_x, end_y)
        share = np.clip(from_end @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        free &= np.hypot(*(from_end - share[:, None] * along).T) >= clear
    if box_half:
        free &= np.abs(points).max(axis=1) >= box_half + clear
    if np.count_nonzero(free) < count:
        raise ValueError(f"there is no room for {count} robots on this table: make it larger")
    return points[free][:count]
