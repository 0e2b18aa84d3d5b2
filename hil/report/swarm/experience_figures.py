"""Pictures of what robots met, chose and learnt over the steps, as Figs. 7.1, 7.2 and 7.4 of Liu & Wu 2001."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from hil.report.style import AMBER, BLUE, GREEN, GREY, INK, PURPLE, SKY, VERMILLION, figure, whole_numbers
from hil.report.swarm.runs import across
from pal_advisor.surround import stimuli_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from hil.report.swarm.runs import SurroundRun

MOST_STIMULI: Final = 6
"""Stimuli that are drawn: those met most."""
MOST_RUNS: Final = 20
"""Runs of which weights are averaged: the first ones."""
COLUMNS: Final = 3
CLASS_COLORS: Final = {RobotClass.RANGER: BLUE, RobotClass.WILD: VERMILLION}
_LINES: Final = (BLUE, VERMILLION, GREEN, AMBER, PURPLE, SKY, INK, GREY)


@dataclass(frozen=True)
class StimulusCurve:
    """What became of one stimulus, step by step; of several runs their mean.

    Attributes:
        number: Number of the stimulus.
        pattern: Its canonical pattern; empty where nobody knows it.
        steps: Numbers of the steps, shape (T,).
        met: How many robots met it in each, shape (T,).
        half: Half of the 95 % interval of that, shape (T,).
        told: After which steps weights are known, shape (K,).
        weights: Weight of each behaviour then, shape (K, N); NaN where it is not feasible.
    """

    number: int
    pattern: str
    steps: NDArray[np.int64]
    met: NDArray[np.float64]
    half: NDArray[np.float64]
    told: NDArray[np.int64]
    weights: NDArray[np.float64]


def stimulus_curves(runs: Sequence[SurroundRun], kind: RobotClass) -> list[StimulusCurve]:
    """The stimuli that a class met, those met most first.

    Args:
        runs: The runs, at least one.
        kind: The class.
    """
    counted = [run.counts(kind, "stimuli") for run in runs]
    width = min(counts.shape[1] for counts in counted)
    mean, half = across([counts[:, :width] for counts in counted])
    steps = np.array([state.step for state in runs[0].moved][: len(mean)], dtype=np.int64)
    sectors = next((tables.sectors for run in runs for _, tables in run.learnt), None)
    known = None if sectors is None or len(stimuli_of(sectors)) < width else stimuli_of(sectors)
    total = mean.sum(axis=0)
    order = sorted(np.flatnonzero(total).tolist(), key=lambda index: (-total[index], index))
    return [
        StimulusCurve(
            index + 1,
            "" if known is None else known.text(index + 1),
            steps,
            mean[:, index],
            half[:, index],
            *_weights(runs, kind, index + 1, sectors or 0),
        )
        for index in order
    ]


def _weights(
    runs: Sequence[SurroundRun], kind: RobotClass, stimulus: int, sectors: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """After which steps weights are known in all runs, and their mean."""
    each: list[dict[int, NDArray[np.float64]]] = []
    for run in runs[:MOST_RUNS]:
        found: dict[int, NDArray[np.float64]] = {}
        for step, tables in run.learnt:
            if tables.sectors == sectors:
                record = tables.of(kind).get(stimulus)  # what is left out is uniform
                row = np.full(sectors, 1.0 / sectors) if record is None else np.array(record.weights)
                found[step] = np.where(row < 0.0, np.nan, row)
        each.append(found)
    steps = sorted(set.intersection(*map(set, each)))
    rows = [np.mean([found[step] for found in each], axis=0) for step in steps]
    return np.array(steps, dtype=np.int64), np.array(rows).reshape(len(steps), sectors)


def stimuli(runs: Sequence[SurroundRun], kind: RobotClass) -> Figure | None:
    """How many robots of a class met each stimulus, step by step, and below what they had learnt of it by then.

    Args:
        runs: The runs, at least one.
        kind: The class.

    Returns:
        The picture; None where nobody met anything.
    """
    curves = stimulus_curves(runs, kind)[:MOST_STIMULI]
    if not curves:
        return None
    columns = min(COLUMNS, len(curves))
    bands = -(-len(curves) // columns)
    drawn = figure(3.4 * columns + 0.4, 3.9 * bands + 0.4)
    panels = drawn.subplots(2 * bands, columns, squeeze=False, sharex=True, height_ratios=[1.0, 1.3] * bands)
    highest = max(float((curve.met + curve.half).max()) for curve in curves)
    for place in range(bands * columns):
        above, below = panels[2 * (place // columns) : 2 * (place // columns) + 2, place % columns]
        if place < len(curves):
            _counts(above, curves[place], CLASS_COLORS[kind], highest)
            _weight_lines(below, curves[place])
        else:
            above.set_visible(False)
            below.set_visible(False)
        if place % columns == 0:
            above.set_ylabel(f"{kind.name}s")
            below.set_ylabel("weight")
        if place + columns >= len(curves):
            below.set_xlabel("step")
            below.tick_params(labelbottom=True)
    handles = panels[1, 0].get_legend_handles_labels()
    if handles[0]:
        drawn.legend(*handles, loc="outside lower center", ncols=8)
    return drawn


def _counts(axes: Axes, curve: StimulusCurve, color: str, highest: float) -> None:
    _histogram(axes, curve.steps, curve.met, curve.half, color)
    pattern = f" {curve.pattern}" if curve.pattern else ""
    axes.set_title(f"STIMULUS{curve.number}{pattern}")
    axes.set_ylim(0, highest * 1.05 or 1.0)
    whole_numbers(axes.yaxis)


def _histogram(axes: Axes, steps: NDArray[np.int64], mean: NDArray[np.float64], half: NDArray[np.float64], color: str) -> None:
    """How many there were in each step, with the interval of that where there is one."""
    edges = np.append(steps, steps[-1:] + 1) - 0.5
    axes.stairs(mean, edges, color=color, alpha=0.35, fill=True, linewidth=0)
    if half.any():
        axes.stairs(mean + half, edges, baseline=np.maximum(0.0, mean - half), color=color, alpha=0.25, fill=True, linewidth=0)
    axes.stairs(mean, edges, baseline=None, color=color, linewidth=1.2)


def _weight_lines(axes: Axes, curve: StimulusCurve) -> None:
    for behaviour in range(curve.weights.shape[1]):
        axes.plot(curve.told, curve.weights[:, behaviour], label=f"B{behaviour + 1}", **_line(behaviour))
    axes.set_ylim(0, 1)
    whole_numbers(axes.xaxis)


def _line(behaviour: int) -> dict[str, Any]:
    """How the line of a behaviour looks: eight colours, then the same dashed."""
    return {
        "color": _LINES[behaviour % len(_LINES)],
        "linestyle": "-" if behaviour < len(_LINES) else (0, (3, 1.5)),
        "linewidth": 1.4,
        "marker": "o",
        "markersize": 2.2,
    }


def behaviours(runs: Sequence[SurroundRun], kind: RobotClass = RobotClass.RANGER) -> Figure | None:
    """How often each behaviour was selected, step by step.

    Args:
        runs: The runs, at least one.
        kind: The class.

    Returns:
        The picture; None where nobody did anything.
    """
    counted = [run.counts(kind, "behaviours") for run in runs]
    width = min(counts.shape[1] for counts in counted)
    mean, half = across([counts[:, :width] for counts in counted])
    if not mean.any():
        return None
    steps = np.array([state.step for state in runs[0].moved][: len(mean)])
    columns = min(4, width)
    rows = -(-width // columns)
    drawn = figure(9.6, 1.7 * rows + 0.5)
    panels = drawn.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for place, axes in enumerate(panels.flat):
        if place >= width:
            axes.set_visible(False)
            continue
        _histogram(axes, steps, mean[:, place], half[:, place], CLASS_COLORS[kind])
        axes.set_title(f"B{place + 1}, {mean[:, place].sum() / mean.sum():.0%}")
        axes.set_ylim(0, float((mean + half).max()) * 1.05)
        whole_numbers(axes.yaxis)
        whole_numbers(axes.xaxis)
        if place % columns == 0:
            axes.set_ylabel(f"{kind.name}s")
        if place + columns >= width:
            axes.set_xlabel("step")
            axes.tick_params(labelbottom=True)
    return drawn
