"""What came of a surround mission, in words and tables, as its log has it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from hil.doors import DocumentError, parse_json
from hil.report.report_table import ReportTable, shortened
from pal_advisor.surround import Tables, TablesError, rules

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.vocabulary import RobotClass
    from hil.mcaplog.records import SurroundStateRecord
    from hil.report.run_data import RunData

SHOWN: Final = (0, 20, 50)
"""Steps in the table, besides the last."""
MOST_STEP: Final = 10_000_000


@dataclass(frozen=True)
class SurroundRun:
    """One run.

    Attributes:
        seed: Its seed.
        states: Its start and its steps, in order.
    """

    seed: int
    states: tuple[SurroundStateRecord, ...]

    @property
    def steps(self) -> list[int]:
        """Numbers of the steps."""
        return [state.step for state in self.states]

    @property
    def tables(self) -> str:
        """What was learnt, as JSON, as it was told last; empty where it was not."""
        return next((state.tables for state in reversed(self.states) if state.tables), "")

    def series(self, name: str) -> list[float]:
        """What was measured.

        Args:
            name: Which, as `distance`.

        Returns:
            A number for each state; NaN where there was none.
        """
        return [math.nan if (value := getattr(state, name)) is None else value for state in self.states]


def surround_runs(data: RunData) -> list[SurroundRun]:
    """The runs in a log, in order; steps that are no such numbers are left out.

    Args:
        data: The log.
    """
    found: list[list[SurroundStateRecord]] = []
    for state in data.surround:
        if not 0 <= state.step <= MOST_STEP:
            continue
        if not found or state.step <= found[-1][-1].step or state.seed != found[-1][-1].seed:
            found.append([])
        found[-1].append(state)
    return [SurroundRun(states[0].seed, tuple(states)) for states in found]


def surround_said(runs: Sequence[SurroundRun]) -> list[str]:
    """What happened, a paragraph an item.

    Args:
        runs: The runs.
    """
    said = []
    if len(runs) > 1:
        said.append(f"There were {len(runs)} runs, of seeds {runs[0].seed} to {runs[-1].seed}.")
    for name, text in (
        ("distance", "The mean distance from a RANGER to the nearest WILD was {0:.2f} units at first and {1:.2f} at the end."),
        ("share_surrounded", "{1:.0%} of the WILDs had three RANGERs or more about them at the end."),
    ):
        first, last = (_mean([run.series(name)[at] for run in runs]) for at in (0, -1))
        if not math.isnan(first + last):
            said.append(text.format(first, last))
    return [" ".join(said)] if said else []


def surround_numbers(runs: Sequence[SurroundRun]) -> list[tuple[str, str]]:
    """The figures that matter most: (value, what it is).

    Args:
        runs: The runs.
    """
    found = []
    ratio = _mean([run.series("distance")[-1] / first for run in runs if (first := run.series("distance")[0])])
    share = _mean([run.series("share_surrounded")[-1] for run in runs])
    if not math.isnan(ratio):
        found.append((f"{ratio:.2f}", "of the distance at the start is left"))
    if not math.isnan(share):
        found.append((f"{share:.0%}", "of the WILDs surrounded"))
    return found


def steps_table(runs: Sequence[SurroundRun]) -> ReportTable:
    """What was measured at some steps, run by run.

    Args:
        runs: The runs, at least one.
    """
    rows = []
    for run in runs:
        for state in run.states:
            if state.step in SHOWN or state is run.states[-1]:
                measured = (state.distance, state.ranger_distance, state.share_surrounded, state.outside)
                rows.append((str(run.seed), str(state.step), *map(_number, measured)))
    head = ("seed", "step", "RANGER to WILD", "RANGER to RANGER", "WILDs surrounded", "RANGERs outside")
    return ReportTable("Distances in the book’s units, and shares", head, tuple(rows), frozenset(range(6)))


def rules_table(runs: Sequence[SurroundRun], kind: RobotClass, oddities: list[str]) -> ReportTable | None:
    """What a class has learnt in the first run, beside what the book reports.

    Args:
        runs: The runs, at least one.
        kind: The class.
        oddities: Takes what can't be read, in words.

    Returns:
        The table; None where nothing has been learnt, or it can't be read.
    """
    text = runs[0].tables
    if not text:
        return None
    try:
        tables = Tables.from_dict(parse_json(text))
    except (TablesError, DocumentError) as error:
        note = f"What was learnt can't be read: {shortened(str(error), 200)}."
        if note not in oddities:
            oddities.append(note)
        return None
    rows = tuple(
        (
            f"STIMULUS{rule.stimulus}",
            rule.pattern,
            str(rule.met),
            rule.words,
            f"{rule.weight:.2f}",
            "" if rule.book is None else f"{rule.book.name}: {rule.book.behaviour}",
        )
        for rule in rules(tables, kind)
        if rule.met
    )
    head = ("stimulus", "pattern", "met", "what they do", "weight", "the book’s rule")
    of = "" if len(runs) == 1 else f" (seed {runs[0].seed})"
    return ReportTable(f"{kind.name}s{of}", head, rows, frozenset({2, 4})) if rows else None


def missing_table(data: RunData) -> ReportTable | None:
    """Who has not answered, and when it was asked again.

    Args:
        data: The log.

    Returns:
        The table; None where everybody has always answered.
    """
    rows: list[list[str]] = []
    missing: dict[str, list[str]] = {}
    for told in data.rounds:
        for robot in told.asked:
            if robot in missing and robot not in told.missing:
                missing.pop(robot)[2] = str(told.step)
        for robot in told.missing:
            if robot not in missing:
                missing[robot] = [robot, str(told.step), "to the end"]
                rows.append(missing[robot])
    if not rows:
        return None
    return ReportTable(
        "Robots that did not answer", ("robot", "from step", "until step"), tuple(map(tuple, rows)), frozenset({1, 2})
    )


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else math.nan


def _number(value: float | None) -> str:
    return "" if value is None or math.isnan(value) else f"{value:.2f}"
