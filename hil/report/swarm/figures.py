"""Pictures of the surround task, as Fig. 8.2 of Liu & Wu 2001."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from hil.report.style import BLUE, GREEN, INK, VERMILLION, drawable, figure, whole_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hil.report.swarm.words import SurroundRun

MOST_LINES: Final = 60
"""Single runs that are drawn."""
MOST_BEHAVIOURS: Final = 16


def distances(runs: Sequence[SurroundRun]) -> Figure | None:
    """How close the RANGERs came, step by step, and what they did.

    Args:
        runs: The runs, at least one.

    Returns:
        The picture; None where there is but the start.
    """
    if max(len(run.states) for run in runs) < 2:
        return None
    drawn = figure(9.0, 7.2)
    near, apart, done = drawn.subplots(3, 1, sharex=True)
    _lines(near, runs, "distance", BLUE, "distance")
    near.set_ylabel("units of the book")
    near.set_title("RANGER to the nearest WILD")
    near.set_ylim(bottom=0)
    share = near.twinx()
    _lines(share, runs, "share_surrounded", GREEN, "share of WILDs surrounded")
    share.set_ylim(-0.02, 1.02)
    share.set_ylabel("share surrounded")
    share.grid(visible=False)
    handles = [*near.get_legend_handles_labels()[0], *share.get_legend_handles_labels()[0]]
    near.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=2)
    _lines(apart, runs, "ranger_distance", VERMILLION, "")
    apart.set_ylabel("units of the book")
    apart.set_title("RANGER to RANGER")
    apart.set_ylim(bottom=0)
    _behaviours(done, runs[0])
    done.set_xlabel("step")
    whole_numbers(done.xaxis)
    return drawn


def _lines(axes: Axes, runs: Sequence[SurroundRun], name: str, color: str, label: str) -> None:
    """One measure: each run, and the mean of several."""
    for run in runs[:MOST_LINES]:
        single = len(runs) == 1
        axes.plot(
            run.steps,
            drawable(run.series(name)),
            color=color,
            linewidth=2 if single else 0.7,
            alpha=1 if single else 0.35,
            label=label if single else None,
        )
    if len(runs) > 1:
        least = min(len(run.states) for run in runs)
        rows = np.array([run.series(name)[:least] for run in runs])
        axes.plot(
            runs[0].steps[:least], drawable(rows.mean(axis=0).tolist()), color=color, linewidth=2.2, label=f"{label}, mean"
        )


def _behaviours(axes: Axes, run: SurroundRun) -> None:
    """How many RANGERs chose each behaviour in each step: the more, the darker."""
    rows = [state.ranger_behaviours for state in run.states[1:]]
    count = min(MOST_BEHAVIOURS, min((len(row) for row in rows), default=0))
    axes.set_title("Behaviours of the RANGERs")
    if not count:
        return
    counts = np.clip(np.array([row[:count] for row in rows], dtype=np.float64).T, 0, 1e6)
    edges = np.array([*run.steps[1:], run.steps[-1] + 1]) - 0.5
    axes.pcolormesh(edges, np.arange(count + 1) + 0.5, counts, cmap="Blues", vmin=0)
    axes.set_yticks(range(1, count + 1), [f"B{number}" for number in range(1, count + 1)])
    axes.grid(visible=False)
    axes.tick_params(axis="y", colors=INK)
