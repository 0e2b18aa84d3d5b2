"""Pictures of the surround task, as Fig. 8.2 of Liu & Wu 2001."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from hil.report.style import BLUE, GREEN, INK, VERMILLION, drawable, figure, whole_numbers
from hil.report.swarm.runs import across

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hil.report.swarm.runs import SurroundRun

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
    _from_0(near, runs, "distance")
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
    _from_0(apart, runs, "ranger_distance")
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
        mean, half = across([run.series(name) for run in runs])
        steps = runs[0].steps[: len(mean)]
        low, high = drawable((mean - half).tolist()), drawable((mean + half).tolist())
        axes.fill_between(steps, low, high, color=color, alpha=0.18, linewidth=0)
        axes.plot(steps, drawable(mean.tolist()), color=color, linewidth=2.2, label=f"{label}, mean")


def _from_0(axes: Axes, runs: Sequence[SurroundRun], name: str) -> None:
    """Let an axis begin at 0, and end a little above the highest line."""
    values = [value for run in runs for value in drawable(run.series(name)) if not math.isnan(value)]
    highest = max(values, default=0.0)
    axes.set_ylim(0.0, 1.06 * highest if highest > 0.0 else 1.0)


def _behaviours(axes: Axes, run: SurroundRun) -> None:
    """How many RANGERs chose each behaviour in each step: the more, the darker."""
    counts = run.counts(RobotClass.RANGER, "behaviours")[:, :MOST_BEHAVIOURS]
    count = counts.shape[1]
    axes.set_title("Behaviours of the RANGERs")
    if not counts.size:
        return
    steps = [state.step for state in run.moved]
    edges = np.array([*steps, steps[-1] + 1]) - 0.5
    axes.pcolormesh(edges, np.arange(count + 1) + 0.5, counts.T, cmap="Blues", vmin=0)
    axes.set_yticks(range(1, count + 1), [f"B{number}" for number in range(1, count + 1)])
    axes.grid(visible=False)
    axes.tick_params(axis="y", colors=INK)
