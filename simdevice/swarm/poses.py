"""The position fixes of emulated micro-robots as a camera's program tells them: a line of text for each robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from simdevice.swarm.world import SwarmWorld

LONGEST_DATAGRAM: Final = 1400
"""In bytes: fits any path."""


class PoseLines:
    """Tells the fixes that have come since it was asked last.

    Args:
        world: The robots.
    """

    def __init__(self, world: SwarmWorld) -> None:
        self._world = world
        self._told = -1

    def news(self) -> list[bytes]:
        """Datagrams of lines `NETWORK ID x y heading age_ms`, in m and rad; none of a robot whose fix has dropped out."""
        world = self._world
        struct, arrays = world.table.arrays.struct, world.table.arrays
        every = int(struct.profile.fix_periods)
        last = (int(struct.periods) - 1) // every
        if last == self._told or struct.periods == 0:
            return []
        self._told = last
        age = int(struct.periods) - 1 - last * every
        lines = []
        for row in np.flatnonzero(arrays.fix_age <= age).tolist():
            network, number = divmod(row, world.settings.per)
            x, y, heading = arrays.fix_x[row], arrays.fix_y[row], arrays.fix_angle[row]
            lines.append(f"{network + 1} {number + 1} {x:.4f} {y:.4f} {heading:.4f} {age * world.period * 1e3:.0f}\n".encode())
        return _datagrams(lines)


def _datagrams(lines: list[bytes]) -> list[bytes]:
    """Lines put together, as many as a datagram holds."""
    found: list[bytes] = []
    for line in lines:
        if found and len(found[-1]) + len(line) <= LONGEST_DATAGRAM:
            found[-1] += line
        else:
            found.append(line)
    return found
