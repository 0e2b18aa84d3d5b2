"""Figures with their 95 % intervals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, floor, log10, sqrt
from typing import TYPE_CHECKING, Final

import numpy as np

from hil.statistics import Z95, Rate, error_of

if TYPE_CHECKING:
    from numpy.typing import NDArray


_STUDENT: Final = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)
"""By degrees of freedom, from one."""


@dataclass(frozen=True)
class Measurement:
    """A figure with its 95 % interval.

    Attributes:
        value: The figure.
        low: Lower bound of the interval.
        high: Upper bound.
        count: Of how many runs.
        text: How it is told, where the number alone says too little; empty: the number with its interval.
    """

    value: float
    low: float
    high: float
    count: int
    text: str = ""

    def told(self, text: str) -> Measurement:
        """The same, told otherwise.

        Args:
            text: How.
        """
        return replace(self, text=text)

    def __str__(self) -> str:
        if self.text:
            return self.text
        half = (self.high - self.low) / 2.0
        digits = 3 if half <= 0.0 else min(max(1 - floor(log10(half)), 0), 6)  # two figures of the interval
        return f"{self.value:.{digits}f} ({self.low:.{digits}f} to {self.high:.{digits}f})"


def about(value: float, error: float, count: int, text: str = "") -> Measurement:
    """A figure with a normal error.

    Args:
        value: The figure.
        error: Its standard error.
        count: Of how many runs.
        text: As for `Measurement`.
    """
    half = Z95 * error
    return Measurement(value, value - half, value + half, count, text)


def mean_of(values: NDArray[np.float64]) -> Measurement:
    """The mean over runs.

    Args:
        values: One for each run, two or more, shape (n,).
    """
    return about(float(values.mean()), error_of(values), len(values))


def mean_of_few(values: NDArray[np.float64]) -> Measurement:
    """The mean over few runs, with Student's interval.

    Args:
        values: One for each run, two or more, shape (n,).
    """
    half, mean = student95(len(values) - 1) * error_of(values), float(values.mean())
    return Measurement(mean, mean - half, mean + half, len(values))


def student95(freedom: int) -> float:
    """The 97.5 % point of Student's distribution, to a thousandth.

    Args:
        freedom: Degrees of freedom, one or more.
    """
    if freedom <= len(_STUDENT):
        return _STUDENT[freedom - 1]
    z = Z95  # Abramowitz & Stegun 1964, 26.7.5
    first = (z**3 + z) / 4.0
    second = (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0
    third = (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0
    return z + first / freedom + second / freedom**2 + third / freedom**3


def share_of(successes: NDArray[np.bool_], text: str = "") -> Measurement:
    """The share of runs of which something is so, with Wilson's interval.

    Args:
        successes: Of which, shape (n,).
        text: As for `Measurement`.
    """
    rate = Rate(int(np.count_nonzero(successes)), len(successes))
    return Measurement(rate.value, *rate.ci95, rate.trials, text or f"{rate.successes} of {rate.trials} ({_bounds(rate)})")


def _bounds(rate: Rate) -> str:
    low, high = rate.ci95
    return f"{low:.2f} to {high:.2f}"


def difference_of(those: Measurement, others: Measurement) -> Measurement:
    """The difference of two independent figures with normal errors.

    Args:
        those: What is subtracted from.
        others: What is subtracted.
    """
    error = sqrt((those.high - those.low) ** 2 + (others.high - others.low) ** 2) / (2.0 * Z95)
    return about(those.value - others.value, error, min(those.count, others.count))


def ratio_of(those: Measurement, others: Measurement) -> Measurement:
    """The ratio of two independent positive figures with normal errors, its interval by the delta method for its logarithm.

    Args:
        those: What is divided.
        others: By what.
    """
    relative = [(one.high - one.low) / (2.0 * one.value) for one in (those, others)]
    half = sqrt(relative[0] ** 2 + relative[1] ** 2)
    value = those.value / others.value
    return Measurement(value, value * exp(-half), value * exp(half), min(those.count, others.count))
