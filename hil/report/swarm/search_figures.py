"""Pictures of searches among conditions, as Figs. 9.9 to 9.12 of Liu & Wu 2001."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from hil.report.style import BLUE, GREEN, GREY, INK, PALE, VERMILLION, drawable, figure, whole_numbers
from hil.report.swarm.runs import across
from hil.report.swarm.searches import condition_of_case, level_means
from pal_advisor.surround.search import BOOK_WINNERS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hil.report.swarm.searches import SearchRun

MOST_LINES: Final = 60
"""Single searches that are drawn."""
LEVELS: Final = {
    "B1": "WILDs learn", "B2": "WILDs stand", "B3": "WILDs at random",
    "D1": "decentralised", "D2": "decentralised, wall", "D3": "centralised", "D4": "centralised, wall",
    "L1": "smoothed, by probability", "L2": "smoothed, maximum", "L3": "original, by probability", "L4": "original, maximum",
    "S1": "short range", "S2": "long range",
}  # fmt: skip
"""What the letters of a condition mean, one row of the picture each."""


def elite_means(search: SearchRun) -> list[float]:
    """The mean that the elite of each generation came to when it was run again; NaN where it was not.

    Args:
        search: The search.
    """
    means = {one.condition: one.mean for one in search.means} if search.told else {}
    return [
        np.nan if (found := condition_of_case(one.elite)) is None else means.get(found, np.nan) for one in search.generations
    ]


def evolution(searches: Sequence[SearchRun]) -> Figure | None:
    """Best and mean fitness of each generation, and what its elite came to when it was run again.

    Args:
        searches: The searches, at least one.

    Returns:
        The picture; None where there is no generation.
    """
    genetic = [search for search in searches if search.generations]
    if not genetic:
        return None
    drawn = figure(9.0, 4.2)
    axes = drawn.subplots()
    rows = (
        ("best of the generation", BLUE, [[one.best for one in search.generations] for search in genetic]),
        ("mean of the generation", GREEN, [[one.mean for one in search.generations] for search in genetic]),
        ("its elite, run again: mean", VERMILLION, [elite_means(search) for search in genetic]),
    )
    for label, color, values in rows:
        _lines(axes, label, color, values)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("generation")
    axes.set_ylabel(f"{genetic[0].fitness.name} fitness")
    whole_numbers(axes.xaxis)
    drawn.legend(loc="outside upper right", ncols=3)
    return drawn


def _lines(axes: Axes, label: str, color: str, values: list[list[float]]) -> None:
    """Of one search a line; of several their mean with its interval, and each of them thin."""
    several = len(values) > 1
    for row in values[:MOST_LINES]:
        steps = range(1, len(row) + 1)
        width, alpha = (0.6, 0.3) if several else (1.8, 1.0)
        axes.plot(
            steps, drawable(row), color=color, linewidth=width, alpha=alpha, marker="" if several else "o", markersize=3,
            label=None if several else label,
        )  # fmt: skip
    if several:
        mean, half = across(values)
        steps = range(1, len(mean) + 1)
        low, high = drawable((mean - half).tolist()), drawable((mean + half).tolist())
        axes.fill_between(steps, low, high, color=color, alpha=0.15, linewidth=0)
        axes.plot(steps, drawable(mean.tolist()), color=color, linewidth=2.2, label=label)


def conditions(search: SearchRun) -> Figure | None:
    """Means of all conditions with their intervals, the best first, and below which letters each of them has.

    Args:
        search: The search.

    Returns:
        The picture; None where fewer than two conditions are known.
    """
    means = search.means
    if len(means) < 2:
        return None
    drawn = figure(12.5, 7.4)
    above, below = drawn.subplots(2, 1, sharex=True, height_ratios=[1.25, 1.0])
    places = np.arange(1, len(means) + 1)
    colors = [INK if one.condition.sensor_range == 1 else GREY for one in means]
    above.errorbar(places, [one.mean for one in means], [one.half for one in means], fmt="none", ecolor=colors, elinewidth=1.0)
    above.scatter(places, [one.mean for one in means], c=colors, s=14, zorder=3)
    winner = BOOK_WINNERS[search.fitness]
    for place, one in zip(places.tolist(), means, strict=True):
        if one.condition == winner:
            above.axvline(place, color=VERMILLION, linewidth=1.0, linestyle=(0, (3, 2)), zorder=1)
            above.scatter([place], [one.mean], color=VERMILLION, s=40, zorder=4)
            above.annotate(
                f"the book’s: {winner}, {place} of {len(means)}", (place, 1.0), xycoords=("data", "axes fraction"),
                xytext=(5, -4), textcoords="offset points", va="top", color=VERMILLION, fontsize=9,
            )  # fmt: skip
    above.set_ylim(bottom=0.0)
    above.set_ylabel(f"{search.fitness.name} fitness")
    _letters(below, search)
    below.set_xlabel("conditions, the best first")
    below.set_xlim(0.0, len(means) + 1.0)
    return drawn


def _letters(axes: Axes, search: SearchRun) -> None:
    """Which letters each condition has, and at the right the mean over all that have one."""
    means, levels = search.means, level_means(search.means)
    for row, level in enumerate(LEVELS):
        at = [place for place, one in enumerate(means, 1) if f"{level[0]}{one.condition['BDLS'.index(level[0])]}" == level]
        axes.plot([0, len(means) + 1], [row, row], color=PALE, linewidth=0.8, zorder=1)
        axes.scatter(at, [row] * len(at), marker="s", s=16, color=BLUE, linewidths=0, zorder=2)
        if level in levels:
            axes.annotate(
                f"{levels[level]:.3f}", (1.0, row), xycoords=("axes fraction", "data"), xytext=(4, 0),
                textcoords="offset points", va="center", fontsize=8, annotation_clip=False,
            )  # fmt: skip
        if row and level.endswith("1"):
            axes.axhline(row - 0.5, color=GREY, linewidth=0.8)
    axes.annotate(
        "mean", (1.0, 1.0), xycoords="axes fraction", xytext=(4, 4), textcoords="offset points", fontsize=8,
        annotation_clip=False,
    )  # fmt: skip
    axes.set_yticks(range(len(LEVELS)), [f"{level} {words}" for level, words in LEVELS.items()])
    axes.set_ylim(len(LEVELS) - 0.5, -0.5)
    axes.grid(visible=False)
    axes.tick_params(axis="y", length=0)
