"""`hil explain`: why an advice is as it is."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from firmware_protocol.near import did_you_mean
from firmware_protocol.vocabulary import Stimulus, codes
from hil.cli import common
from hil.explaining import learning_of
from hil.explaining.words import plain, reasons, when, with_error
from hil.sumo.summary import label

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from hil.explaining import Explanation, Learning
    from pal_advisor.maneuvers import AdviceEntry


def _situations() -> list[str]:
    """Names of situations, for completion."""
    return [Stimulus(code).label for code in range(4)]


def explain(
    advice: Annotated[
        Path | None,
        typer.Argument(
            metavar="RUN|ADVICE|LOG",
            help="A run's folder, an advice file, or a log (.mcap); the newest run with an advice if left out.",
        ),
    ] = None,
    *,
    situation: Annotated[
        list[str] | None,
        typer.Option(
            "--situation",
            metavar="NAME",
            autocompletion=_situations,
            help="Only this situation, as left or EYE_LEFT; may be given several times.",
        ),
    ] = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """Say why each maneuver of an advice is there: how it was bred, what was foretold, what came of it, what it beat.

    Examples: hil explain; hil explain runs/20261128-130501-coach-flat-light --situation both
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    learning = learning_of(advice)
    entries = _chosen(learning, situation or [])
    explanations = learning.explained(entries)
    if as_json:
        common.print_json(_document(learning, explanations))
        return
    if learning.source != advice and not quiet:
        console.print(f"Advice: {learning.source}")
    if learning.challenge:
        console.print()
        console.print(fill(learning.challenge, console.width, break_long_words=False, break_on_hyphens=False), markup=False)
    for one in explanations:
        _tell(console, one)
    for text in learning.unknown:
        console.print()
        console.print(fill(text, console.width, break_long_words=False, break_on_hyphens=False))


def _chosen(learning: Learning, wanted: Sequence[str]) -> list[AdviceEntry]:
    """The entries that a person wants to know of; all for no name.

    Raises:
        UsageError: The advice has no such situation.
    """
    names: dict[str, list[AdviceEntry]] = {}
    for entry in learning.advice.entries:
        current = Stimulus(entry.current)
        flags = "|".join(str(flag.name) for flag in current) or "NONE"
        for name in dict.fromkeys((label(entry), current.label, flags)):
            names.setdefault(name.casefold(), []).append(entry)
    found: list[AdviceEntry] = []
    for name in wanted:
        if name.casefold() not in names:
            known = list(dict.fromkeys(label(entry) for entry in learning.advice.entries))
            choice = f"choose one of {', '.join(known)}{did_you_mean(name, names)}"
            raise common.UsageError(f"there is no situation {name!r} in {learning.source}: {choice}")
        found += names[name.casefold()]
    return list(dict.fromkeys(found)) if wanted else list(learning.advice.entries)


def _tell(console: Console, one: Explanation) -> None:
    """An entry, and why it is there."""
    called = f", {' and '.join(one.entry.names)}" if one.entry.names else ""
    console.print(f"\n{when(one)}: {codes(one.entry.actions)}{called}")
    console.print(fill(one.entry.in_words, console.width, initial_indent="  ", subsequent_indent="  "))
    for text in reasons(one):
        console.print(fill(text, console.width, initial_indent="- ", subsequent_indent="  "))
    if one.rivals:
        console.print(_table(one))


def _table(one: Explanation) -> Table:
    """The maneuver and those that come next."""
    table = Table()
    table.add_column("maneuver")
    for head in ("worth", "rated", "mean", "foretold"):
        table.add_column(head, justify="right", no_wrap=True)
    for rival in ([] if one.chosen is None else [one.chosen]) + list(one.rivals):
        foretold = rival.foretold is not None and rival.foretold_error is not None
        table.add_row(
            codes(rival.actions),
            with_error(rival.value, rival.error),
            f"{rival.rated:,}",
            "-" if rival.mean is None else f"{rival.mean:.1f}",
            with_error(rival.foretold or 0.0, rival.foretold_error or 0.0) if foretold else "-",
        )
    return table


def _document(learning: Learning, explanations: Sequence[Explanation]) -> dict[str, object]:
    advice = learning.advice
    return {
        "advice": str(learning.source),
        "run": None if learning.run is None else str(learning.run),
        "log": None if learning.log is None else str(learning.log),
        "opponent": advice.opponent,
        "objective": advice.objective.value,
        "seed": advice.seed,
        "challenge": learning.challenge or None,
        "situations": [{"situation": label(one.entry), **plain(one)} for one in explanations],
        "unknown": learning.unknown,
    }
