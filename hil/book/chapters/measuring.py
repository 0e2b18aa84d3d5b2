"""What runs of one condition leave of the distance at their start, and other columns that several claims ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.book.measurement import Measurement, mean_of, share_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hil.book.results import StoredResults


def left_at_50(results: StoredResults, name: str) -> NDArray[np.float64]:
    """D(50) / D(0), one a seed.

    Args:
        results: What the experiments have left.
        name: Name of the experiment.
    """
    runs = results.runs(name)
    left: NDArray[np.float64] = runs.column("distance_50") / runs.column("distance_0")
    return left


def left_of_distance(results: StoredResults, name: str) -> Measurement:
    """Mean of D(50) / D(0), and D at steps 0, 20 and 50.

    Args:
        results: What the experiments have left.
        name: Name of the experiment.
    """
    runs, found = results.runs(name), mean_of(left_at_50(results, name))
    course = " / ".join(f"{runs.column(f'distance_{step}').mean():.2f}" for step in (0, 20, 50))
    return found.told(f"{found}; D {course}")


def below(results: StoredResults, name: str, limit: float) -> Measurement:
    """Share of runs that leave less than a limit of their distance, and the most that any leaves.

    Args:
        results: What the experiments have left.
        name: Name of the experiment.
        limit: The limit.
    """
    left = left_at_50(results, name)
    found = share_of(left < limit)
    return found.told(f"{found}; at most {left.max():.2f}")


def mean_column(results: StoredResults, name: str, column: str) -> Measurement:
    """Mean of a column.

    Args:
        results: What the experiments have left.
        name: Name of the experiment.
        column: Name of the column.
    """
    return mean_of(results.runs(name).column(column))
