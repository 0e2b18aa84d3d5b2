"""Entrants as they are named on the command line, and a tournament's standings as they are shown there."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.table import Table

from firmware_protocol.near import did_you_mean
from hil import runs
from hil.policies import is_policy, load_policy
from hil.sumo.advice_file import load_advice
from hil.sumo.controllers import BUILT_IN
from hil.sumo.tournament.entrants import Entrant, EntrantKind

if TYPE_CHECKING:
    from hil.sumo.tournament.standings import Standings

FROM_MEMORY: Final = "memory:"
_NAMED: Final = re.compile(r"([A-Za-z0-9][A-Za-z0-9._+-]*)=(.+)")
_FRAME: Final = 10
"""Columns of a table that are not its names and scores."""
_RUN: Final = re.compile(r"\d{8}-\d{6}-(?:coach-)?")


def entrant_of(text: str) -> Entrant:
    """An entrant as a user names it.

    Args:
        text: `chase` or another controller, a policy file, an advice file or a run's folder, `memory:` and one of the last
            two; before it `NAME=`, or not.

    Raises:
        ValueError: There is no such entrant, or it can't be called so.
        RunError: The folder has no advice.
        AdviceFileError: The file can't be read, or is no advice.
        PolicyFileError: Likewise, of a policy.
    """
    named = _NAMED.fullmatch(text)
    name, what = (named[1], named[2]) if named else ("", text)
    if what in BUILT_IN:
        return Entrant(name or what, EntrantKind(what))
    from_memory = what.startswith(FROM_MEMORY)
    path = Path(what.removeprefix(FROM_MEMORY))
    if not path.exists():
        known, meant = ", ".join(BUILT_IN), did_you_mean(what, BUILT_IN)
        raise ValueError(
            f"there is no entrant {what!r}: name a file of advice or policy, a run's folder, or one of {known}{meant}"
        )
    if not from_memory and is_policy(path):
        return Entrant(name or _called(path), EntrantKind.POLICY, policy=load_policy(path))
    advice = load_advice(runs.file_of(path, runs.ADVICE))
    called = name or _called(path) + ("+memory" if from_memory else "")
    return Entrant(called, EntrantKind.MEMORY if from_memory else EntrantKind.ADVICE, advice)


def _called(path: Path) -> str:
    """What somebody is called who plays by a file: as the file, or the run's folder that it is in, without the date."""
    stem = path.name.removesuffix(".toml").removesuffix(".json").removesuffix(".advice")
    if path.name == runs.ADVICE:
        stem = path.absolute().parent.name
    return _RUN.sub("", stem, count=1)


def standings_table(standings: Standings) -> Table:
    """The entrants, the strongest first.

    Args:
        standings: What it has come to.
    """
    tournament = standings.tournament
    title = f"{len(standings.bouts)} bouts, {tournament.bouts} of each pairing, half of them in each seat"
    table = Table(title=title, title_justify="left")
    table.add_column("", justify="right")
    table.add_column("entrant")
    for head in ("rating", "95 % interval", "won", "drawn", "lost", "points", "time to win"):
        table.add_column(head, justify="right")
    for place, one in enumerate(standings.order, start=1):
        strength, score, time = standings.ratings.strengths[one], standings.score(one), standings.median_time_to_win(one)
        low, high = strength.ci95
        table.add_row(
            str(place),
            standings.name(one),
            f"{strength.value:+.0f}",
            f"{low:+.0f} to {high:+.0f}",
            str(score.won),
            str(score.drawn),
            str(score.lost),
            f"{score.share:.3f}",
            "-" if time is None else f"{time:.2f} s",
        )
    return table


def matrix_table(standings: Standings, width: int) -> Table:
    """Each against each: won-drawn-lost, or where that finds no room, the share of the points in percent.

    Args:
        standings: What it has come to.
        width: Columns that there are.
    """
    order = standings.order
    scores = {(row, column): standings.matrix[row][column] for row in order for column in order if row != column}
    counts = {pair: f"{score.won}-{score.drawn}-{score.lost}" for pair, score in scores.items()}
    name = max(len(standings.name(one)) for one in order)
    fits = _FRAME + name + sum(3 + max(len(counts[row, one]) for row in order if row != one) for one in order) <= width
    cells = counts if fits else {pair: f"{100 * score.share:.0f}" for pair, score in scores.items()}
    table = Table(title="Won-drawn-lost against" if fits else "Share of the points against, in %", title_justify="left")
    table.add_column("", justify="right")
    table.add_column("entrant", no_wrap=True)
    for place in range(1, len(order) + 1):
        table.add_column(str(place), justify="right", no_wrap=True)
    for place, row in enumerate(order, start=1):
        table.add_row(str(place), standings.name(row), *(cells.get((row, column), "") for column in order))
    return table


def seat_line(standings: Standings) -> str:
    """What the seat is worth, in words.

    Args:
        standings: What it has come to.
    """
    seat = standings.ratings.seat
    share, low, high = (1 / (1 + 10 ** (-points / 400)) for points in (seat.value, *seat.ci95))
    return (
        "400 points more are 10 wins to 1. Among equals the home seat, which begins turned up to 90 degrees away from the "
        f"other, wins {share:.2f} of the bouts that are decided ({low:.2f} to {high:.2f})."
    )
