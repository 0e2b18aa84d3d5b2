"""How a robot selects a behaviour from a weight vector (Liu & Wu 2001, 6.2.2).

Every selection is made with one number drawn from [0, 1) beforehand: how many numbers a round draws depends on who takes
part in it, and on nothing that they weigh.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

NONE: Final = 0
"""In place of a behaviour: there is none that the robot can perform."""


def by_probability(weights: NDArray[np.float64], draws: NDArray[np.float64]) -> NDArray[np.int64]:
    """Select each behaviour with the probability that its weight is (Eq. 6.18).

    Args:
        weights: Weight vectors, shape (robots, N). What is not feasible is negative, and takes no part. Where the rest is all
            0, each of it is as good as another.
        draws: Numbers from [0, 1), shape (robots,).

    Returns:
        Behaviours 1..N, shape (robots,); `NONE` where nothing is feasible.
    """
    shares = np.maximum(weights, 0.0)
    nothing = ~shares.any(axis=1)
    if nothing.any():
        shares[nothing] = weights[nothing] >= 0.0
    edges = np.cumsum(shares, axis=1)
    places = (edges <= (draws * edges[:, -1])[:, None]).sum(axis=1)
    # A draw next to 1 may be rounded up to the last edge.
    last = shares.shape[1] - 1 - np.argmax(shares[:, ::-1] > 0.0, axis=1)
    return np.where(edges[:, -1] > 0.0, np.minimum(places, last) + 1, NONE)


def by_maximum(weights: NDArray[np.float64], draws: NDArray[np.float64]) -> NDArray[np.int64]:
    """Select the behaviour of the largest weight (Eq. 6.19), of equals each with the same probability.

    Args:
        weights: As for `by_probability`.
        draws: As for `by_probability`.

    Returns:
        As `by_probability`.
    """
    best = (weights >= 0.0) & (weights == weights.max(axis=1, keepdims=True))
    return by_probability(np.where(best, 1.0, -1.0), draws)


def at_random(weights: NDArray[np.float64], draws: NDArray[np.float64]) -> NDArray[np.int64]:
    """Select any feasible behaviour, each with the same probability.

    Args:
        weights: As for `by_probability`.
        draws: As for `by_probability`.

    Returns:
        As `by_probability`.
    """
    return by_probability(np.where(weights >= 0.0, 1.0, -1.0), draws)
