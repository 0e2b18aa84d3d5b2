"""Every random choice of a run derives from one seed, each use from a branch of its own (`numpy.random.SeedSequence`)."""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Branch(IntEnum):
    """What a seed is branched for; a new use gets a new number, so that the old ones stay as they are."""

    PAL = 1
    COACHING_BOUTS = 2
    HELD_OUT_BOUTS = 3
    BOUTS = 4
    SESSION = 5
    CONTROLLER = 6
    SURROUND = 7
    START_PLACES = 8
    SEARCH = 9
    VALIDATION = 10
    TOURNAMENT = 11
    RUNS = 12
    CHALLENGE = 13
    RIVALS = 14


def generator(seed: int, branch: Branch, *part: int) -> np.random.Generator:
    """A source of chance.

    Args:
        seed: The run's seed.
        branch: What for.
        part: Which part of the run, as a number, where it has parts that know nothing of each other.
    """
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, branch, *part])))


def run_seed(seed: int, number: int) -> int:
    """Seed of one of several runs that belong together: of the first it is the seed itself.

    Args:
        seed: Seed of them all.
        number: Number of the run, from 1.

    Returns:
        0..2**32-1.
    """
    return seed if number == 1 else bout_seed(seed, Branch.RUNS, number)


def bout_seed(seed: int, branch: Branch, number: int) -> int:
    """Seed of one bout.

    Args:
        seed: The run's seed.
        branch: What for.
        number: Number of the bout.

    Returns:
        0..2**32-1.
    """
    return int(np.random.SeedSequence([seed, branch, number]).generate_state(1)[0])
