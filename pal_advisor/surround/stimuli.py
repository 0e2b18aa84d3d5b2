"""Stimuli: patterns of occupied sectors, alike under rotation and reflection (Liu & Wu 2001, 6.1.5, and `ret`, Eq. 6.21).

A pattern is a string of N bits, sector 1 first and most significant (6.1.2). Patterns that can be rotated or mirrored into
one another are one stimulus; the smallest of them is its canonical pattern, and the frame in which it is seen like this is
the canonical frame. Stimuli are numbered from 1 by the number of ones, then by the value of the canonical pattern. There are
2, 3, 4, 6, 8, 13, 18, 30, 46 of them for N = 1..9; the book's Table 6.1 has 14, 29, 42 for N = 6, 8, 9.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_SECTORS: Final = 16
"""A ring has no more sectors."""


@dataclass(frozen=True)
class Stimuli:
    """What all patterns of N sectors are, as arrays to look things up in; made by `stimuli_of`.

    Attributes:
        sectors: N.
        number: Number of the stimulus of every pattern, from 1, shape (2**N,).
        patterns: Canonical pattern of every stimulus, shape (stimuli,); that of number n is at n - 1.
        shift: By how many sectors a pattern, mirrored or not, is shifted circularly to the left to be canonical (Fig. 6.8),
            shape (2**N,).
        mirrored: The pattern is reversed before that, shape (2**N,). Of several ways to the canonical frame, those without
            reversal come first, then the smallest shift.
    """

    sectors: int
    number: NDArray[np.int64]
    patterns: NDArray[np.int64]
    shift: NDArray[np.int64]
    mirrored: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.patterns)

    def text(self, number: int) -> str:
        """The canonical pattern of a stimulus as the book prints it, sector 1 first.

        Args:
            number: Number of the stimulus.
        """
        return f"{int(self.patterns[number - 1]):0{self.sectors}b}"

    def to_sector(self, patterns: NDArray[np.int64], behaviours: NDArray[np.int64]) -> NDArray[np.int64]:
        """The sectors that behaviours mean (`ret`, Eq. 6.21).

        Args:
            patterns: Patterns whose canonical frame the behaviours are counted in.
            behaviours: 1..N, same shape.

        Returns:
            Sectors of the body, 1..N, same shape.
        """
        place = (behaviours - 1 + self.shift[patterns]) % self.sectors
        return np.where(self.mirrored[patterns], self.sectors - place, place + 1)


def turned(patterns: NDArray[np.int64], shift: int, sectors: int) -> NDArray[np.int64]:
    """Patterns shifted circularly to the left (Fig. 6.8): what a robot sees when it has turned left by so many sectors.

    Args:
        patterns: Patterns.
        shift: Sectors, 0..N - 1.
        sectors: N.
    """
    return (patterns << shift | patterns >> (sectors - shift)) & ((1 << sectors) - 1)


def mirrored(patterns: NDArray[np.int64], sectors: int) -> NDArray[np.int64]:
    """Patterns reversed (Fig. 6.8): what a robot sees when the world is mirrored along its nose.

    Args:
        patterns: Patterns.
        sectors: N.
    """
    reverse = np.zeros_like(patterns)
    for bit in range(sectors):
        reverse |= (patterns >> bit & 1) << (sectors - 1 - bit)
    return reverse


@cache
def stimuli_of(sectors: int) -> Stimuli:
    """All stimuli of rings of N sectors.

    Args:
        sectors: N, 1 to 16.

    Raises:
        ValueError: N is out of range.
    """
    if not 1 <= sectors <= MOST_SECTORS:
        raise ValueError(f"a ring has 1 to {MOST_SECTORS} sectors, not {sectors}")
    patterns = np.arange(1 << sectors, dtype=np.int64)
    reverse = mirrored(patterns, sectors)
    canonical, shift = patterns.copy(), np.zeros_like(patterns)
    reflected = np.zeros(len(patterns), dtype=np.bool_)
    for source, reflects in ((patterns, False), (reverse, True)):
        for step in range(sectors):
            value = turned(source, step, sectors)
            better = value < canonical
            canonical[better], shift[better], reflected[better] = value[better], step, reflects
    kinds = np.flatnonzero(canonical == patterns)
    kinds = kinds[np.lexsort((kinds, np.bitwise_count(kinds)))]
    number = np.zeros_like(patterns)
    number[kinds] = np.arange(1, len(kinds) + 1)
    number = number[canonical]
    for array in (number, kinds, shift, reflected):
        array.flags.writeable = False
    return Stimuli(sectors, number, kinds, shift, reflected)
