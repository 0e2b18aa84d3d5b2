"""Where the robots of a case begin (Liu & Wu 2001, 7.2.1, 8.2, 9.1.1). Lengths are in the book's units."""

from __future__ import annotations

from math import cos, sin, sqrt, tau
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from pal_advisor.surround.case import Case

AREA: Final = (10.0, 10.0)
"""Sides of the area, about the origin."""
SPREAD: Final = {False: 4.0, True: 1.0}
"""Radius of the disc that WILDs begin in, decentralised and centralised."""
APART: Final = 0.2
"""Least distance between two robots: that at which they touch."""
FROM_WALL: Final = 0.15
"""Least distance of a robot's centre from a wall: half a robot, and some room."""
DRAWS: Final = 1000
"""How often a place is drawn for one robot."""


class PlacesError(ValueError):
    """The robots of a case don't fit where they are to begin."""


def start_places(
    case: Case, rng: np.random.Generator, area: tuple[float, float] = AREA
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Draw where the robots begin: WILDs uniform in a disc about the origin, then RANGERs uniform in the area.

    Args:
        case: How many there are, and their distribution.
        rng: Source of chance.
        area: Sides of the area.

    Returns:
        Poses of the RANGERs, shape (rangers, 3), and of the WILDs, shape (wilds, 3): x, y, and a heading in rad, uniform.

    Raises:
        PlacesError: No place was found for a robot in 1000 draws.
    """
    room = FROM_WALL if case.wall else 0.0
    half = np.array(area) / 2.0 - room
    spread = SPREAD[case.centralised]

    def in_disc() -> tuple[float, float]:
        distance, angle = spread * sqrt(rng.random()), tau * rng.random()
        return distance * cos(angle), distance * sin(angle)

    def in_area() -> tuple[float, float]:
        x, y = rng.uniform(-half, half)
        return float(x), float(y)

    if (half <= 0.0).any():
        raise PlacesError(f"{case}: an area of {area[0]:g} x {area[1]:g} units has no room for a robot")
    places = np.empty((case.wilds + case.rangers, 2))
    for row in range(len(places)):
        wild = row < case.wilds
        place = _free(in_disc if wild else in_area, places[:row], half)
        if place is None:
            what = f"WILD {row + 1} of {case.wilds}" if wild else f"RANGER {row - case.wilds + 1} of {case.rangers}"
            where = f"the disc of radius {spread:g}" if wild else f"the area of {area[0]:g} x {area[1]:g}"
            raise PlacesError(
                f"{case}: no place for {what} in {where} units, {APART:g} from the others, in {DRAWS} draws: too many robots"
            )
        places[row] = place
    headings = rng.uniform(-np.pi, np.pi, len(places))
    poses = np.column_stack((places, headings))
    return poses[case.wilds :], poses[: case.wilds]


def _free(
    draw: Callable[[], tuple[float, float]], taken: NDArray[np.float64], half: NDArray[np.float64]
) -> tuple[float, float] | None:
    """A place that is within the area, and far enough from those taken."""
    for _ in range(DRAWS):
        place = draw()
        ways = taken - place
        if (np.abs(place) <= half).all() and (np.sum(ways * ways, axis=1) >= APART * APART).all():
            return place
    return None
