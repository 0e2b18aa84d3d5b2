"""The picture of a tournament: how strong each is, and what came of each pairing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from hil.report.style import BLUE, INK, VERMILLION, figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hil.sumo.tournament.standings import Standings

MOST_WRITTEN: Final = 20
"""Of more entrants the numbers would find no room in the squares."""


def tournament_picture(standings: Standings) -> Figure:
    """Ratings with their intervals on the left, points by pairing on the right; the strongest first.

    Args:
        standings: What it has come to.
    """
    entrants = len(standings.order)
    side = max(3.2, 0.45 * entrants + 1.0)
    drawn = figure(side + 5.0, side)
    ratings, pairings = drawn.subplots(1, 2, width_ratios=(3.6, side))
    _ratings(ratings, standings)
    _pairings(pairings, standings)
    return drawn


def _ratings(axes: Axes, standings: Standings) -> None:
    order = standings.order
    places = np.arange(len(order))
    known = [standings.ratings.strengths[one] for one in order]
    values = np.array([one.value for one in known])
    low, high = np.array([one.ci95 for one in known]).T
    axes.hlines(places, low, high, color=BLUE, linewidth=2.0)
    axes.plot(values, places, "o", color=BLUE)
    axes.set_yticks(places, [standings.name(one) for one in order])
    axes.set_ylim(len(order) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    axes.axvline(0.0, color="#B5B5B5", linewidth=0.8)
    axes.set_xlabel("points about the mean; 400 more: 10 wins to 1")
    axes.set_title("Strength, with 95 % intervals")


def _pairings(axes: Axes, standings: Standings) -> None:
    from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415 - it may not be installed

    order = standings.order
    shares = np.array([[standings.matrix[row][column].share for column in order] for row in order])
    np.fill_diagonal(shares, np.nan)
    colors = LinearSegmentedColormap.from_list("points", [VERMILLION, "#FFFFFF", BLUE])
    axes.imshow(shares, cmap=colors, vmin=0.0, vmax=1.0, aspect="equal")
    places = np.arange(len(order))
    names = [standings.name(one) for one in order]
    axes.set_xticks(places, names, rotation=45, ha="left", rotation_mode="anchor")
    axes.xaxis.tick_top()
    axes.set_yticks(places, names)
    axes.grid(visible=False)
    axes.set_xlabel("against")
    axes.xaxis.set_label_position("bottom")
    axes.set_title("Share of the points: a win 1, a draw half")
    if len(order) > MOST_WRITTEN:
        return
    for row, column in np.ndindex(shares.shape):
        share = shares[row, column]
        if np.isfinite(share):
            color = "white" if abs(share - 0.5) > 0.35 else INK
            axes.text(column, row, f"{100 * share:.0f}", ha="center", va="center", color=color, fontsize=8.0)
