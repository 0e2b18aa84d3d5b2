"""What came of searches among conditions, in words and tables, as their log has it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from hil.report.report_table import ReportTable
from hil.report.swarm.searches import searches_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.report.run_data import RunData
    from hil.report.swarm.searches import SearchRun

TOP: Final = 10
"""Conditions that the table has of each search."""
KINDS: Final = {"ga": "The genetic search", "exhaustive": "The search through all conditions", "random": "The random search"}


def search_title(data: RunData) -> str:
    """The report's headline.

    Args:
        data: The log, of a search.
    """
    return f"Which conditions suit {searches_of(data)[0].fitness.name} best"


def search_said(data: RunData) -> list[str]:
    """What was found, a paragraph an item.

    Args:
        data: The log, of a search.
    """
    asked = data.metadata.get("search", {})
    kind = KINDS.get(asked.get("search", ""), "The search")
    steps = f" of {asked['steps']} steps each" if asked.get("steps", "").isdecimal() else ""
    searches = searches_of(data)
    said = []
    for search in searches:
        of = "" if len(searches) == 1 else f" with seed {search.seed}"
        text = f"{kind}{of} made {len(search.evaluations):,} evaluations{steps}."
        if search.best is not None:
            text += f" The best condition is {search.best} ({_runs(search.best.runs)})."
        if search.book is not None:
            place = search.means.index(search.book) + 1
            rank = f", which is place {place} of {len(search.means)}" if search.exhaustive else ""
            text += f" The book’s winner comes to {search.book}{rank}."
        said.append(text)
    return said


def search_numbers(data: RunData) -> list[tuple[str, str]]:
    """The figures that matter most: (value, what it is).

    Args:
        data: The log, of a search.
    """
    searches = searches_of(data)
    best = max((one for search in searches if (one := search.best) is not None), key=lambda one: one.mean, default=None)
    found = [(f"{sum(len(search.evaluations) for search in searches):,}", "evaluations")]
    if best is not None:
        found.append((f"{best.mean:.3f}", f"{searches[0].fitness.name} of {best.condition}"))
    return found


def conditions_table(searches: Sequence[SearchRun]) -> ReportTable:
    """The best conditions of each search, and the book's winner.

    Args:
        searches: The searches.
    """
    rows = []
    for search in searches:
        means = search.means
        for place, one in enumerate(means, 1):
            if place <= TOP or one == search.book:
                book = "yes" if one == search.book else ""
                told = str(one.condition), f"{one.mean:.3f}", f"± {one.half:.3f}", str(one.runs), book
                rows.append((str(search.seed), str(place), *told))
    head = ("seed", "place", "condition", "mean", "95% interval", "runs", "the book’s winner")
    return ReportTable("The best conditions", head, tuple(rows), frozenset({0, 1, 3, 4, 5}))


def _runs(count: int) -> str:
    return "1 run" if count == 1 else f"mean of {count} runs, with 95 % interval"
