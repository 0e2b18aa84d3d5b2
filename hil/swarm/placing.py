"""How robots get to their start places."""

from __future__ import annotations

from enum import StrEnum
from math import ceil
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import PeerError

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from hil.swarm.handle import Swarm

BEGIN: Final = 2.000
"""When the first step begins after the table was set up, in s: the robots have found out by then where they are."""
GRID: Final = 0.1
"""The table is set up at a multiple of it, in s: in lock-step what comes is gathered to multiples of an even part of it, which
then fall alike in every run."""
SLACK: Final = 1e-6
SHOWN: Final = 10
"""So many robots are named."""


class StartPlace(StrEnum):
    """How robots get to their start places."""

    TABLE = "table"
    """The emulated table puts them there."""
    DRIVE = "drive"
    """They drive there."""
    ASK = "ask"
    """A person puts them there, and says so."""
    AS_IS = "as-is"
    """They stay where they are."""


class PlacingError(PeerError):
    """Robots could not be brought to where a mission begins."""


def put_on_table(
    swarm: Swarm, poses: Mapping[int, NDArray[np.float64]], *, seed: int, size: tuple[float, float], wall: bool
) -> None:
    """Set the emulated table up anew, put robots on it, and wait until the mission begins.

    Args:
        swarm: The robots.
        poses: x, y in m and heading in rad, by row.
        seed: Seed of the table's noise.
        size: Sides of the table, in m.
        wall: A wall runs round it.

    Raises:
        PlacingError: Robots were not placed.
        PeerError: There is no table, or it refuses.
    """
    swarm.wait(ceil(swarm.now() / GRID + 1.0 - SLACK) * GRID - swarm.now())
    begun = swarm.now()
    swarm.reset_table(seed, size, wall=wall)
    x_y_heading = {swarm.addresses_by_row[row]: (float(p[0]), float(p[1]), float(p[2])) for row, p in poses.items()}
    errors = swarm.place(x_y_heading)
    if errors:
        named = "; ".join(f"{address}: {error}" for address, error in list(errors.items())[:SHOWN])
        raise PlacingError(f"{len(errors)} robots could not be placed on the table: {named}")
    if (left := begun + BEGIN - swarm.now()) > 0:
        swarm.wait(left)
