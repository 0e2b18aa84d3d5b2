"""The 96 conditions that are selected among, and their chromosomes (Liu & Wu 2001, 9.2.1, Fig. 9.3, Table 9.1)."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Final, NamedTuple

from pal_advisor.surround.measures import Fitness

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from pal_advisor.evolution import Genes

CHROMOSOME: Final = {"B": 2, "D": 2, "L": 2, "S": 1}
"""Bits of each letter, in their order on the chromosome, the most significant first; the code is the letter's number - 1."""
BITS: Final = sum(CHROMOSOME.values())
SEARCHED: Final = frozenset(CHROMOSOME)
"""Letters of a case that a search decides."""
ILLEGAL_MOTION: Final = (1, 1)
"""Bits of a B that there is not: WILDs move in three ways."""


class Condition(NamedTuple):
    """What a search decides of a case.

    Attributes:
        motion: B, how WILDs move, 1 to 3.
        distribution: D, 1 to 4.
        learning: L, 1 to 4.
        sensor_range: S, 1 or 2.
    """

    motion: int
    distribution: int
    learning: int
    sensor_range: int

    def __str__(self) -> str:
        return "".join(f"{letter}{number}" for letter, number in zip(CHROMOSOME, self, strict=True))


CONDITIONS: Final = tuple(Condition(*numbers) for numbers in product((1, 2, 3), (1, 2, 3, 4), (1, 2, 3, 4), (1, 2)))
"""All that there are, B first."""
BOOK_WINNERS: Final[Mapping[Fitness, Condition]] = {
    Fitness.CONTACT: Condition(2, 2, 1, 1),
    Fitness.SURROUND: Condition(1, 3, 3, 1),
    Fitness.CHASE: Condition(1, 4, 4, 1),
    Fitness.FOCUS: Condition(1, 1, 1, 1),
}
"""What the book's evolution came to (Figs. 9.5 to 9.8)."""


def condition_of(chromosome: Genes) -> Condition:
    """What a chromosome stands for.

    Args:
        chromosome: Bits, shape (7,).

    Raises:
        ValueError: It has another length, or a B that there is not.
    """
    bits = chromosome.tolist()
    if len(bits) != BITS:
        raise ValueError(f"a chromosome has {BITS} bits, not {len(bits)}")
    if not _is_legal(chromosome):
        raise ValueError("WILDs move in three ways: the bits 11 stand for none")
    numbers, place = [], 0
    for width in CHROMOSOME.values():
        numbers.append(int("".join(map(str, bits[place : place + width])), 2) + 1)
        place += width
    return Condition(*numbers)


def random_chromosome(rng: np.random.Generator) -> Genes:
    """Any chromosome that stands for a condition.

    Args:
        rng: Source of chance.
    """
    return repaired(rng.integers(2, size=BITS), rng)


def repaired(chromosome: Genes, rng: np.random.Generator) -> Genes:
    """A chromosome whose B there is: both its bits are drawn again until it is so.

    Args:
        chromosome: Bits, shape (7,); left as it is.
        rng: Source of chance.
    """
    legal = chromosome.copy()
    while not _is_legal(legal):
        legal[: CHROMOSOME["B"]] = rng.integers(2, size=CHROMOSOME["B"])
    return legal


def _is_legal(chromosome: Genes) -> bool:
    return tuple(chromosome[: CHROMOSOME["B"]].tolist()) != ILLEGAL_MOTION
