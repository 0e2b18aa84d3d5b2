"""The table of experience that a class of robots shares: a weight vector for every stimulus (Liu & Wu 2001, 6.2.1)."""

from __future__ import annotations

from math import exp
from typing import TYPE_CHECKING, Final

import numpy as np

from pal_advisor.surround.stimuli import stimuli_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

ALPHA: Final = 3.9
PSI: Final = 1.9
"""The shape of function2 in Fig. 6.15."""
INFEASIBLE: Final = -1.0
"""Weight of a behaviour that the robots can't perform (Eq. 6.9)."""


def proportional(change: NDArray[np.int64], gain: float) -> NDArray[np.float64]:
    """The increment C1: delta = clip(c dN, -1, 1) (Eq. 6.15, which leaves the evaluation open).

    Args:
        change: dN, how many more robots of the other class are inside the radius after the move; for those that want to get
            away, how many fewer.
        gain: c.
    """
    return np.clip(gain * change, -1.0, 1.0)


INCREMENTS: Final[dict[int, Callable[[NDArray[np.int64], float], NDArray[np.float64]]]] = {1: proportional}
"""Increments by the number after C in a case's name; each takes dN and the gain, and gives delta from -1 to 1."""


def function1(weight: float) -> float:
    """A weight brought into [0, 1] (Eq. 6.13)."""
    return min(max(weight, 0.0), 1.0)


def function2(weight: float) -> float:
    """A weight smoothed by the inverted sigmoid (Eq. 6.14): 0 becomes 0.05, 1 becomes 0.951.

    Args:
        weight: What function1 gave.
    """
    return ALPHA / (1.0 + exp(-weight)) - PSI


def updated(weights: list[float], behaviour: int, delta: float, *, smoothing: bool) -> list[float]:
    """A weight vector after one increment: normal(shape(W + dW)) (Eq. 6.12 to 6.15).

    Args:
        weights: Of the feasible behaviours alone; their sum is 1.
        behaviour: Index of the one that was performed.
        delta: Its increment, -1 to 1.
        smoothing: function2 is part of shape.

    Returns:
        The new vector; uniform where every weight became 0.
    """
    shaped = weights.copy()
    shaped[behaviour] = function1(shaped[behaviour] + delta)
    if smoothing:
        shaped = [ALPHA / (1.0 + exp(-weight)) - PSI for weight in shaped]
    total = sum(shaped)
    if total <= 0.0:
        return [1.0 / len(shaped)] * len(shaped)
    return [weight / total for weight in shaped]


def bounds(feasible: int) -> tuple[float, float]:
    """Least and greatest weight that smoothing leaves once a vector has been updated, [0.0074, 0.7311] for 8 behaviours.

    Args:
        feasible: How many behaviours the robots can perform, 1 or more.
    """
    low, high = function2(0.0), function2(1.0)
    return low / (low + (feasible - 1) * high), high / (high + (feasible - 1) * low)


class Experience:
    """The weights of all stimuli.

    Args:
        feasible: For each of the N behaviours, whether the robots can perform it (Eq. 6.7).
        smoothing: function2 is part of shape.

    Attributes:
        feasible: As given.
        smoothing: As given.
        weights: Weight vectors, shape (stimuli, N); that of stimulus n is at n - 1. At first uniform (Eq. 6.16); -1 where a
            behaviour is not feasible.
    """

    def __init__(self, feasible: NDArray[np.bool_], *, smoothing: bool) -> None:
        self.feasible = feasible
        self.smoothing = smoothing
        start = np.where(feasible, 1.0 / max(1, int(feasible.sum())), INFEASIBLE)
        self.weights = np.tile(start, (len(stimuli_of(len(feasible))), 1))

    def learn(
        self, stimuli: NDArray[np.int64], behaviours: NDArray[np.int64], deltas: NDArray[np.float64]
    ) -> NDArray[np.int64]:
        """Take in one round's increments, one robot after the other, each the whole of Eq. 6.12.

        Adding the increments up and smoothing once would be another algorithm. An increment of 0 changes nothing.

        Args:
            stimuli: Numbers of the stimuli that were met, shape (robots,), in the order of addresses.
            behaviours: Behaviours performed, 1..N, feasible ones, same shape.
            deltas: Their increments, same shape.

        Returns:
            Numbers of the stimuli whose weights are others than before, ascending.
        """
        rated = np.flatnonzero(deltas)
        if not len(rated):
            return np.empty(0, dtype=np.int64)
        place = np.cumsum(self.feasible) - 1
        columns = np.flatnonzero(self.feasible)
        touched: dict[int, list[float]] = {}
        steps = zip(stimuli[rated].tolist(), place[behaviours[rated] - 1].tolist(), deltas[rated].tolist(), strict=True)
        for stimulus, behaviour, delta in steps:
            before = touched.get(stimulus) or self.weights[stimulus - 1, columns].tolist()
            touched[stimulus] = updated(before, behaviour, delta, smoothing=self.smoothing)
        numbers = np.array(sorted(touched), dtype=np.int64)
        place_of = np.ix_(numbers - 1, columns)
        after = np.array([touched[number] for number in numbers.tolist()])
        changed: NDArray[np.bool_] = (self.weights[place_of] != after).any(axis=1)
        self.weights[place_of] = after
        return numbers[changed]
