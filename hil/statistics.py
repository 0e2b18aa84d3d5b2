"""The few statistics that the bridge prints: win rates with intervals, standard errors, quantiles."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

Z95 = 1.959963984540054
"""97.5 % point of the standard normal distribution."""


def quantile(values: Sequence[float] | NDArray[np.float64], share: float) -> float:
    """The value below which a share of the values lies, interpolated between neighbours (Hyndman & Fan 1996, type 7).

    Args:
        values: The values, at least one, in any order.
        share: Of them, 0 to 1; 0.5 is the median.
    """
    return float(np.quantile(values, share))


def error_of(values: NDArray[np.float64]) -> float:
    """Standard error of a mean.

    Args:
        values: Independent values, two or more, shape (n,).
    """
    return float(values.std(ddof=1)) / sqrt(len(values))


@dataclass(frozen=True)
class Rate:
    """A share of successes with its 95 % Wilson score interval (Wilson 1927).

    Attributes:
        successes: How many succeeded.
        trials: Of how many.
    """

    successes: int
    trials: int

    @property
    def value(self) -> float:
        """The share; 0 where nothing was tried."""
        return self.successes / self.trials if self.trials else 0.0

    @property
    def ci95(self) -> tuple[float, float]:
        """Lower and upper bound; (0, 1) where nothing was tried."""
        n = self.trials
        if not n:
            return 0.0, 1.0
        p, z2 = self.value, Z95 * Z95
        middle = (p + z2 / (2 * n)) / (1 + z2 / n)
        half = Z95 / (1 + z2 / n) * sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        low, high = max(0.0, middle - half), min(1.0, middle + half)
        return (low if self.successes else 0.0), (high if self.successes < n else 1.0)  # exactly, whatever the rounding

    def __str__(self) -> str:
        low, high = self.ci95
        return f"{self.value:.3f} (95 % interval {low:.3f} to {high:.3f})"
