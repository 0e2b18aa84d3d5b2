"""What came of a surround mission, in words and tables, as its log has it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import RobotClass
from hil.doors import DocumentError, parse_json
from hil.report.report_table import ReportTable, shortened
from hil.report.swarm.runs import across
from pal_advisor.surround import Tables, TablesError, rules

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.report.run_data import RunData
    from hil.report.swarm.runs import SurroundRun
    from pal_advisor.surround.measures import RunMeasures

SHOWN: Final = (0, 20, 50)
"""Steps in the table, besides the last."""
MeasureRow = tuple[str, str, list[float | None]]
"""A measure: what it is, the section of the book, and its value in each run."""


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
    measures = [run.measures for run in runs]
    if all(one is not None and not any(one.weights) for one in measures):
        said.append("All weights have stayed exactly uniform: nothing was learnt, as rule RE has it of long range (8.1).")
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


def measures_table(runs: Sequence[SurroundRun]) -> ReportTable | None:
    """Measures of whole runs, beside where the book speaks of them; of several runs mean and 95 % interval.

    Args:
        runs: The runs.

    Returns:
        The table; None where they were not told, or can't be read.
    """
    found = [measures for run in runs if (measures := run.measures) is not None]
    if not found:
        return None
    rangers, wilds = RobotClass
    rows: list[MeasureRow] = [
        ("WILDs pushed by RANGERs together, times", "7.2.2.3", [float(one.pushed) for one in found]),
        ("stimuli met by RANGERs", "8.2", [float(one.stimuli_met[rangers]) for one in found]),
        ("stimuli met by WILDs", "8.2", [float(one.stimuli_met[wilds]) for one in found]),
        *_weight_rows(found),
        ("distance settled from step", "8.4", [None if one.settle_step is None else float(one.settle_step) for one in found]),
        ("share of RANGERs that moved to and fro", "8.6", [one.periodic[rangers] for one in found]),
        ("share of WILDs that moved to and fro", "8.6", [one.periodic[wilds] for one in found]),
        (
            "spans of 20 steps, stable in the large and not in its members",
            "8.7",
            [float(len(one.macro_stable)) for one in found],
        ),
        ("share of the two largest weights of STIMULUS2", "8.8", [one.dominance for one in found]),
    ]
    cells = tuple((name, section, _mean_and_half(values)) for name, section, values in rows)
    of = "" if len(found) == 1 else f", mean of {len(found)} with 95 % interval"
    return ReportTable(f"Of the whole run{of}", ("measure", "section of the book", "value"), cells, frozenset({2}))


def _weight_rows(found: Sequence[RunMeasures]) -> list[MeasureRow]:
    """What 8.1 and 8.3 speak of: how far weights go, and whether any is 0."""
    rows: list[MeasureRow] = []
    for kind in RobotClass:
        pairs = [one.weights[kind] for one in found]
        rows += [
            (f"least weight that {kind.name}s learnt", "8.3", [None if pair is None else pair[0] for pair in pairs]),
            (f"greatest weight that {kind.name}s learnt", "8.3", [None if pair is None else pair[1] for pair in pairs]),
            (f"share of what {kind.name}s learnt that has a weight of 0", "8.3", [one.with_zero[kind] for one in found]),
        ]
    return rows


def _mean_and_half(values: Sequence[float | None]) -> str:
    known = [value for value in values if value is not None]
    if not known:
        return "none"
    if len(values) == 1:
        return f"{known[0]:.3g}"
    mean, half = across([[value] for value in known])
    return f"{mean[0]:.3g} ± {half[0]:.2g}" + ("" if len(known) == len(values) else f" ({len(known)} runs)")


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
