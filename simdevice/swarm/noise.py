"""Noise of micro-robots: one stream of standard normal deviates for each robot and sensor.

A stream is named by the seed, the robot's row and what it is for, and read by count: what a robot draws depends on nothing but
how often it has drawn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def stream(seed: int, row: int, kind: int) -> np.random.Generator:
    """The stream of a robot's sensor.

    Args:
        seed: The table's seed, 0 or more.
        row: The robot's row.
        kind: What it is for.
    """
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(row, kind))))


class Noise:
    """Blocks of the streams of one kind, which the kernel reads.

    Args:
        rows: Number of robots.
        kind: What it is for.
        size: Deviates in a block; 0 where none are needed.

    Attributes:
        deviates: Shape (rows, size).
        at: Which deviate of its block each robot draws next, shape (rows,).
    """

    def __init__(self, rows: int, kind: int, size: int) -> None:
        self._kind = kind
        self._size = size
        self._seed = 0
        self._streams: list[np.random.Generator | None] = []
        self.deviates: NDArray[np.float64] = np.zeros((rows, size))
        self.at: NDArray[np.uint32] = np.zeros(rows, np.uint32)

    def restart(self, seed: int) -> None:
        """Begin all streams anew.

        Args:
            seed: The table's seed, 0 or more.
        """
        self._seed = seed
        self._streams = [None] * len(self.at)
        self.at[:] = self._size
        self.refill()

    def refill(self) -> None:
        """Draw what has been read; what has not been read stays next."""
        for row in np.flatnonzero(2 * self.at >= self._size).tolist() if self._size else ():
            source = self._streams[row]
            if source is None:
                source = self._streams[row] = stream(self._seed, row, self._kind)
            block = self.deviates[row]
            left = self._size - int(self.at[row])
            block[:left] = block[self._size - left :].copy()
            source.standard_normal(out=block[left:])
            self.at[row] = 0
