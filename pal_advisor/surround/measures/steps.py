"""What is measured of a run, step by step (Liu & Wu 2001, 7.1, ch. 8). Lengths are in the book's units, NaN where unknown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from pal_advisor.surround.stimuli import stimuli_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

SURROUNDING: Final = 3
"""So many RANGERs near a WILD surround it."""


def stimulus_frequency(stimuli: NDArray[np.int64], sectors: int) -> NDArray[np.int64]:
    """How many robots meet each stimulus (Eq. 7.2).

    Args:
        stimuli: Number of the stimulus that each robot meets, 0 for who is not there, shape (..., robots).
        sectors: N.

    Returns:
        H, shape (..., stimuli); stimulus n is at n - 1.
    """
    return _frequency(stimuli, len(stimuli_of(sectors)))


def behaviour_frequency(behaviours: NDArray[np.int64], sectors: int) -> NDArray[np.int64]:
    """How many robots perform each behaviour (Eq. 7.4).

    Args:
        behaviours: What each robot performs, 1..N, 0 for who stays, shape (..., robots).
        sectors: N.

    Returns:
        ID, shape (..., N); behaviour k is at k - 1.
    """
    return _frequency(behaviours, sectors)


def _frequency(numbers: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    rows = numbers.reshape(-1, numbers.shape[-1]) if numbers.size else np.zeros((int(np.prod(numbers.shape[:-1])), 0), np.int64)
    offset = (most + 1) * np.arange(len(rows))[:, None]
    counts = np.bincount((rows + offset).ravel(), minlength=len(rows) * (most + 1))
    return counts.reshape(*numbers.shape[:-1], most + 1)[..., 1:]


def stimuli_met(stimuli: NDArray[np.int64]) -> int:
    """How many different stimuli were met.

    Args:
        stimuli: As for `stimulus_frequency`.
    """
    return len(np.unique(stimuli[stimuli > 0]))


def mean_distance(rangers: NDArray[np.float64], wilds: NDArray[np.float64]) -> float | None:
    """D(t): the mean over RANGERs of the distance to the nearest WILD.

    Args:
        rangers: Positions, shape (rangers, 2).
        wilds: Positions, shape (wilds, 2).

    Returns:
        The mean; None without a RANGER or a WILD whose position is known.
    """
    rangers, wilds = known(rangers), known(wilds)
    if not len(rangers) or not len(wilds):
        return None
    return float(between(rangers, wilds).min(axis=1).mean())


def ranger_distance(rangers: NDArray[np.float64]) -> float | None:
    """The mean distance between two RANGERs (Fig. 8.2 a).

    Args:
        rangers: Positions, shape (rangers, 2).

    Returns:
        The mean over all pairs; None where there are less than two whose position is known.
    """
    rangers = known(rangers)
    count = len(rangers)
    if count < 2:
        return None
    return float(between(rangers, rangers).sum() / (count * (count - 1)))


def share_surrounded(rangers: NDArray[np.float64], wilds: NDArray[np.float64], radius: float) -> float | None:
    """The share of WILDs with three RANGERs or more nearer than a radius.

    Args:
        rangers: Positions, shape (rangers, 2).
        wilds: Positions, shape (wilds, 2).
        radius: R0.

    Returns:
        The share; None without a RANGER or a WILD whose position is known.
    """
    rangers, wilds = known(rangers), known(wilds)
    if not len(rangers) or not len(wilds):
        return None
    return float(((between(wilds, rangers) < radius).sum(axis=1) >= SURROUNDING).mean())


def share_outside(rangers: NDArray[np.float64], area: tuple[float, float]) -> float | None:
    """The share of RANGERs that have left the area (Figs. 8.7, 8.9).

    Args:
        rangers: Positions, shape (rangers, 2).
        area: Sides of the area, about the origin.

    Returns:
        The share; None without a RANGER whose position is known.
    """
    rangers = known(rangers)
    if not len(rangers):
        return None
    return float((np.abs(rangers) > np.array(area) / 2.0).any(axis=1).mean())


def way(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far each robot has come in all, in straight steps.

    Args:
        positions: Positions, shape (steps + 1, robots, 2).

    Returns:
        The way of each, shape (robots,); steps from or to where nobody knows count as none.
    """
    total: NDArray[np.float64] = np.nansum(np.linalg.norm(np.diff(positions, axis=0), axis=2), axis=0)
    return total


def dominance(weights: NDArray[np.float64]) -> float | None:
    """The share of the two largest weights of a vector (8.8); of STIMULUS2 it says whether two behaviours dominate.

    Args:
        weights: Weight vector, shape (N,).

    Returns:
        Their sum; None where less than two behaviours are feasible.
    """
    feasible = np.sort(weights[weights >= 0.0])
    return float(feasible[-2:].sum()) if len(feasible) > 1 else None


def settle_step(distance: NDArray[np.float64], share: float = 0.1) -> int:
    """The step from which on D(t) stays near its last value (8.4).

    Args:
        distance: D, shape (steps + 1,).
        share: Near is within this share of the whole change from the first to the last value.
    """
    far = np.flatnonzero(np.abs(distance - distance[-1]) > share * abs(distance[0] - distance[-1]))
    return int(far[-1]) + 1 if len(far) else 0


def between(those: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances from each of some positions to each of others.

    Args:
        those: Positions, shape (n, 2).
        others: Positions, shape (m, 2).

    Returns:
        Distances, shape (n, m).
    """
    distances: NDArray[np.float64] = np.linalg.norm(those[:, None, :] - others[None, :, :], axis=2)
    return distances


def known(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Those of some positions that are known.

    Args:
        positions: Positions, shape (n, 2); NaN where unknown.
    """
    return positions[~np.isnan(positions).any(axis=1)]
