"""What came of searches, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.statistics import Z95
from pal_advisor.surround.search import SearchName

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.swarm.missions.evolving.evolution import Evolution
    from pal_advisor.surround.search import ConditionResult

TOP = 5
"""Conditions of an exhaustive search that are told."""


def evolution_summary(evolutions: Sequence[Evolution]) -> list[str]:
    """What came of it.

    Args:
        evolutions: The searches, at least one.

    Returns:
        Lines.
    """
    several = len(evolutions) > 1
    lines: list[str] = []
    for evolution in evolutions:
        lines += _found(evolution, of=f" (search with seed {evolution.seed})" if several else "")
    return lines


def _found(evolution: Evolution, of: str) -> list[str]:
    best, book = evolution.best, evolution.book
    name = evolution.search.fitness.name
    if best is None:
        return [f"Nothing has been evaluated{of}."]
    lines = []
    if evolution.search.search is SearchName.EXHAUSTIVE:
        ordered = sorted(evolution.means.values(), key=lambda found: -found.mean)
        lines.append(f"{name}: the best of {len(ordered)} conditions{of}:")
        lines += [f"  {place}. {_told(evolution, found)}" for place, found in enumerate(ordered[:TOP], 1)]
    else:
        lines.append(f"{name}: the best condition found is {_told(evolution, best)}{of}.")
    if book is not None:
        place = evolution.ranks.get(book.condition)
        rank = f", {place} of {len(evolution.ranks)}" if place else ""
        lines.append(f"The book's winner, {_told(evolution, book)}{rank}.")
    seeds = [each.evaluation.seed for each in evolution.done if each.evaluation.condition == best.condition]
    lines.append(
        f"To see one of its runs: hil swarm surround --case {evolution.case_of(best.condition)} "
        f"--steps {evolution.settings.steps} --seed {seeds[-1]}"
    )
    return lines


def _told(evolution: Evolution, found: ConditionResult) -> str:
    half = Z95 * found.error
    interval = f" +- {half:.3f}" if found.n > 1 else ""
    runs = f"mean of {found.n} runs" if found.n > 1 else "one run"
    return f"{evolution.case_of(found.condition)}: {found.mean:.3f}{interval} ({runs})"
