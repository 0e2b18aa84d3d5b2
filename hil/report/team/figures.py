"""Pictures of several coachings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from hil.report.style import AMBER, BLUE, GREEN, PURPLE, SKY, VERMILLION, figure
from hil.sumo.team import shares_won

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hil.report.run_data import RunData

COLORS: Final = (BLUE, VERMILLION, GREEN, PURPLE, AMBER, SKY)
DASHES: Final = ("-", "--", "-.", ":")
MOST_DRAWN: Final = len(COLORS) * len(DASHES)
"""Runs that are told apart in a picture."""


def wins_of_runs(data: RunData) -> Figure | None:
    """Share of bouts won lately while each run learnt.

    Args:
        data: The run, in whose log others are told of.

    Returns:
        The picture; None where no run tells of enough bouts.
    """
    curves = [(run.number, *shares_won(run.bouts, run.outcomes)) for run in data.coached[:MOST_DRAWN]]
    curves = [curve for curve in curves if len(curve[1])]
    if not curves:
        return None
    drawn = figure(9.0, 2.9)
    axes = drawn.subplots()
    for place, (number, bouts, share) in enumerate(curves):
        style = DASHES[place // len(COLORS)]
        axes.plot(bouts, share, color=COLORS[place % len(COLORS)], linestyle=style, linewidth=1.8, label=f"run {number}")
    axes.set_ylim(0, 1.05)
    axes.set_yticks([0, 0.25, 0.5, 0.75, 1.0], ["0", "25%", "50%", "75%", "100%"])
    axes.set_xlim(0, max(float(np.max(bouts)) for _, bouts, _ in curves))
    axes.set_title("Bouts won while learning")
    axes.set_xlabel("Bout of the run")
    axes.set_ylabel("Won, of the last 20 bouts")
    axes.legend(loc="lower right", ncols=min(4, len(curves)))
    return drawn
