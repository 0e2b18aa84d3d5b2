"""What chapters 7 and 8 of Liu & Wu 2001 claim of whole histories: pushing together, periodic motion, stability."""

from __future__ import annotations

from math import cos, radians
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

TOGETHER: Final = 45.0
"""Ways that lie within this angle of each other are one, in degrees."""
STILL: Final = 0.03
"""Who moves less, in units, has no way: so far apart may two fixes of a robot be that stands, of which each is 1 mm off."""
PERIODS: Final = 3
"""Who comes back so often moves to and fro."""
SPAN: Final = 20
"""So many steps the swarm is stable in the large."""


def pushed(
    rangers: NDArray[np.float64],
    ranger_ways: NDArray[np.float64],
    wilds: NDArray[np.float64],
    wild_ways: NDArray[np.float64],
    contact: float,
) -> NDArray[np.bool_]:
    """Which WILDs are pushed by RANGERs together (7.2.2.3).

    They are in contact with two RANGERs or more whose moves lie within 45 degrees of each other and of the WILD's own way.

    Args:
        rangers: Positions after the move, shape (rangers, 2).
        ranger_ways: Where the RANGERs moved, or would have, shape (rangers, 2); 0 for who stays.
        wilds: Positions after the move, shape (wilds, 2).
        wild_ways: Where the WILDs came by it, shape (wilds, 2).
        contact: Distance of positions up to which two robots touch.

    Returns:
        For each WILD, shape (wilds,).
    """
    touching = np.linalg.norm(wilds[:, None, :] - rangers[None, :, :], axis=2) <= contact
    least = cos(radians(TOGETHER)) - 1e-12
    moves, ways = _directions(ranger_ways), _directions(wild_ways)
    with_it = touching & (ways @ moves.T >= least)
    alike = moves @ moves.T >= least
    np.fill_diagonal(alike, val=False)
    together = with_it @ alike.astype(np.int64) > 0
    found: NDArray[np.bool_] = (together & with_it).any(axis=1)
    return found


def _directions(ways: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors; 0 where there is no way, or nobody knows it."""
    length = np.linalg.norm(ways, axis=1, keepdims=True)
    directions: NDArray[np.float64] = np.divide(ways, length, out=np.zeros_like(ways), where=length >= STILL)
    return directions


def periodic(positions: NDArray[np.float64], within: float = 0.1, periods: int = PERIODS) -> NDArray[np.bool_]:
    """Which robots move to and fro (8.6): after two steps they are back, so many times in a row, and not in between.

    Args:
        positions: Positions, shape (steps + 1, robots, 2).
        within: Back is nearer than this, away is not, in units.
        periods: How many times in a row.

    Returns:
        For each robot, shape (robots,).
    """
    steps, robots = len(positions) - 1, positions.shape[1]
    if steps < 2 * periods:
        return np.zeros(robots, dtype=np.bool_)
    back = np.linalg.norm(positions[2:] - positions[:-2], axis=2) < within
    back &= np.linalg.norm(positions[1:-1] - positions[:-2], axis=2) >= within
    runs = np.stack([back[2 * period : len(back) - 2 * (periods - 1 - period)] for period in range(periods)])
    found: NDArray[np.bool_] = np.logical_and.reduce(runs).any(axis=0)
    return found


def macro_stable(distance: NDArray[np.float64], turned: NDArray[np.bool_], share: float = 0.05) -> NDArray[np.int64]:
    """When the swarm is stable in the large while its members are not (8.7).

    D(t) stays within 5 % of its mean over 20 steps, and meanwhile the largest entry of some weight vector of the
    WILDs becomes another.

    Args:
        distance: D, shape (T + 1,); NaN where it is unknown.
        turned: What `turns` says of the weights of the WILDs, shape (T,).
        share: How far D may be from its mean over the span, as a share of it.

    Returns:
        First steps of all such spans, ascending.
    """
    if len(distance) <= SPAN:
        return np.empty(0, dtype=np.int64)
    spans = np.lib.stride_tricks.sliding_window_view(distance, SPAN + 1)
    mean = spans.mean(axis=1, keepdims=True)
    stable = (np.abs(spans - mean) <= share * mean).all(axis=1)
    return np.flatnonzero(stable & np.lib.stride_tricks.sliding_window_view(turned, SPAN).any(axis=1))


def turns(weights: NDArray[np.float64]) -> NDArray[np.bool_]:
    """In which steps the largest entry of some weight vector becomes another.

    Args:
        weights: Weights of a class, shape (T + 1, stimuli, N).

    Returns:
        For each step, shape (T,).
    """
    best = weights.argmax(axis=2)
    changed: NDArray[np.bool_] = (best[1:] != best[:-1]).any(axis=1)
    return changed
