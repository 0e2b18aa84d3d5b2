"""The runs that the book's claims are judged by: for each a name and the one command that makes it."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from pal_advisor.surround import Case
from pal_advisor.surround.measures import Fitness

SEEDS: Final = 40
"""Runs of each condition."""
SEARCHES: Final = 20
"""Evolutions of each fitness."""
REPEATS: Final = 10
"""Runs of each condition of the exhaustive table."""
FITNESSES: Final = tuple(fitness.value for fitness in Fitness)
"""Names of the fitness functions of chapter 9 (Eq. 9.3 to 9.8)."""
_WORKERS: Final = ("--workers", "2")
_QUIET: Final = ("--no-log", "--no-report", "--quiet", "--json")


class ResultKind(StrEnum):
    """What an experiment's document is about."""

    RUNS = "runs"
    """One condition, several seeds."""
    SEARCH = "search"
    """Evolutions, or searches at random, with several seeds."""
    TABLE = "table"
    """All conditions of chapter 9."""


@dataclass(frozen=True)
class Experiment:
    """A command whose document claims are judged by.

    Attributes:
        name: Name of the stored result.
        kind: What its document is about.
        arguments: Arguments of `hil`.
    """

    name: str
    kind: ResultKind
    arguments: tuple[str, ...]

    @property
    def command(self) -> str:
        """The command as one types it."""
        return shlex.join(("hil", *self.arguments))


def _runs(name: str, case: str, steps: int, *words: str, link: str = "") -> Experiment:
    links, workers = ((link,), ()) if link else ((), _WORKERS)  # who plays beside others has a table of its own
    arguments = (*links, "--case", str(Case.parse(case)), "--steps", str(steps), *words, "--seeds", str(SEEDS), *workers)
    return Experiment(name, ResultKind.RUNS, ("swarm", "surround", *arguments, *_QUIET))


def _search(fitness: str, search: str) -> Experiment:
    words = () if search == "ga" else ("--search", search)
    arguments = ("--evolve", fitness, *words, "--seeds", str(SEARCHES), *_WORKERS, *_QUIET)
    return Experiment(f"{search}-{fitness}", ResultKind.SEARCH, ("swarm", "surround", *arguments))


_TABLE = Experiment(
    "exhaustive",
    ResultKind.TABLE,
    (
        "swarm", "surround", "--evolve", "contact", "--search", "exhaustive", "--repeats", str(REPEATS), *_WORKERS, *_QUIET,
    ),
)  # fmt: skip
_LOSSY = "sim://swarm?rangers=25&wilds=8&size=2,2&seed=1&faults=drop:0.05"

EXPERIMENTS: Final = {
    experiment.name: experiment
    for experiment in (
        _runs("b2d3", "B2D3", 50),
        _runs("b2d3-control", "B2D3", 50, "--no-learning"),
        _runs("b2d3-loss", "B2D3", 50, link=_LOSSY),
        _runs("b2d3-adjustable", "B2D3", 50, "--sensing", "adjustable"),
        _runs("b2d3-fixed", "B2D3", 50, "--sensing", "fixed"),
        _runs("b2d3-sequential", "B2D3", 50, "--order", "sequential"),
        _runs("b2d4", "B2D4", 50),
        _runs("b1d3", "B1D3", 50),
        _runs("b1d3-control", "B1D3", 50, "--no-learning"),
        _runs("b1d2", "B1D2", 50),
        _runs("b1d3s2", "B1D3S2", 50),
        _runs("b1d1s2", "B1D1S2", 50),
        *(_runs(f"b{b}d1", f"B{b}D1", 100) for b in (1, 2, 3)),
        *(_runs(f"b{b}d3l{how}", f"B{b}D3L{how}", 100) for b in (1, 2) for how in (1, 2, 3, 4)),
        _runs("b3d3", "B3D3", 100),
        _runs("b1d4", "B1D4", 100),
        *(_runs(f"b{b}d3-mutate", f"B{b}D3", 100, "--mutate-after", "10") for b in (1, 2)),
        _runs("b1d1l3s2", "B1D1L3S2", 100),
        _TABLE,
        *(_search(fitness, search) for fitness in FITNESSES for search in ("ga", "random")),
    )
}
"""By name."""
