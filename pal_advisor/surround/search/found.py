"""What has been found out about a condition by running it several times."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pal_advisor.surround.search.conditions import Condition


@dataclass(frozen=True)
class ConditionResult:
    """Fitness of a condition over several runs.

    Attributes:
        condition: The condition.
        mean: Mean of the fitness.
        sd: Standard deviation of single runs; 0 where there is but one.
        n: How many runs.
    """

    condition: Condition
    mean: float
    sd: float
    n: int

    @property
    def error(self) -> float:
        """Standard error of the mean."""
        return self.sd / sqrt(self.n)


def summary_of(condition: Condition, scores: Sequence[float]) -> ConditionResult:
    """What several runs say of a condition.

    Args:
        condition: The condition.
        scores: Fitness of each run, at least one.
    """
    spread = float(np.std(scores, ddof=1)) if len(scores) > 1 else 0.0
    return ConditionResult(condition, float(np.mean(scores)), spread, len(scores))
