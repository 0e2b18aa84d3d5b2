"""Fitness curves, as in Fig. 10.7 of Liu & Wu 2001: one for each category, of different lengths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.vocabulary import Stimulus
from hil.report.learning_figures import Category, eyes_of, known, mark_phases, sort_key
from hil.report.style import BLUE, EYE_STYLES, GREEN, INK, PURPLE, VERMILLION, drawable, figure, whole_numbers

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hil.mcaplog.records import StepRecord
    from hil.report.run_data import RunData

PHASES: Final = {1: "Phase 1: basic actions", 2: "Phase 2: fine actions"}
_EYES: Final = {3: "both eyes see it", 2: "the right eye sees it", 1: "the left eye sees it", 0: "no eye sees it"}
_VARIANTS: Final[tuple[dict[str, Any], ...]] = (
    {"color": INK, "linestyle": "-", "linewidth": 1.8, "marker": ""},
    {"color": BLUE, "linestyle": ":", "linewidth": 1.8, "marker": "o", "markersize": 3.5},
    {"color": VERMILLION, "linestyle": "--", "linewidth": 1.5, "marker": "*", "markersize": 6},
    {"color": GREEN, "linestyle": "-.", "linewidth": 1.5, "marker": "s", "markersize": 3.5},
    {"color": PURPLE, "linestyle": "-", "linewidth": 1.0, "marker": ""},
)
_BEFORE: Final = ("none", "left", "right", "both")

Steps = dict[Category, list["StepRecord"]]


def by_phase(generations: Sequence[StepRecord]) -> dict[int, Steps]:
    """Steps by phase and category, in order; those that this program does not know are left out.

    Args:
        generations: Steps as recorded.
    """
    found: dict[int, Steps] = {}
    for step in generations:
        if step.phase not in PHASES or not known((step.previous, step.current)):
            continue
        found.setdefault(step.phase, {}).setdefault((step.previous, step.current), []).append(step)
    return {phase: {key: found[phase][key] for key in sorted(found[phase], key=sort_key)} for phase in sorted(found)}


def fitness_by_generation(data: RunData) -> Figure | None:
    """Best fitness by generation, a panel for each phase.

    Where there are more than four categories, what the eyes see has a row of its own.

    Args:
        data: The run.

    Returns:
        The picture; None where nothing was learnt.
    """
    phases = by_phase(data.generations)
    if not phases:
        return None
    rows, style = _layout(phases)
    drawn = figure(9.0, 3.7 if len(rows) == 1 else 0.6 + 1.75 * len(rows))
    grid = drawn.subplots(len(rows), len(phases), sharey=True, sharex="col", squeeze=False)
    for panels, (title, eyes) in zip(grid, rows, strict=True):
        for axes, (phase, of_phase) in zip(panels, phases.items(), strict=True):
            for category, steps in of_phase.items():
                if eyes_of(category) in eyes:
                    _draw(axes, [step.generation for step in steps], [step.best for step in steps], style(category))
            axes.set_title(
                f"Phase {phase}, {title}" if title else PHASES.get(phase, f"Phase {phase}"), fontsize=9 if title else 10
            )
            whole_numbers(axes.xaxis)
        panels[0].set_ylabel("Best fitness" if title else "Best fitness in the generation")
    for axes in grid[-1]:
        axes.set_xlabel("Generation of the category")
    _legend(drawn, grid.ravel().tolist(), single=len(rows) == 1)
    return drawn


def fitness_by_maneuvers(data: RunData) -> Figure | None:
    """Best fitness against maneuvers performed, with the phase boundary and the exam marked.

    Args:
        data: The run.

    Returns:
        The picture; None where nothing was learnt.
    """
    phases = by_phase(data.generations)
    if not phases:
        return None
    rows, style = _layout(phases)
    drawn = figure(9.0, 3.9 if len(rows) == 1 else 0.6 + 1.75 * len(rows))
    panels = drawn.subplots(len(rows), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, (title, eyes) in zip(panels, rows, strict=True):
        for of_phase in phases.values():
            for category, steps in of_phase.items():
                if eyes_of(category) in eyes:
                    _draw(axes, [step.used for step in steps], [step.best for step in steps], style(category))
        mark_phases(axes, data, labels=axes is panels[0])
        axes.set_title(title[:1].upper() + title[1:], fontsize=9)
        axes.set_ylabel("Best fitness" if title else "Best fitness in the generation")
        axes.set_xlim(0, max(len(data.trials), drawable([data.generations[-1].used])[0], 1))
    panels[-1].set_xlabel("Maneuvers performed, all categories together")
    _legend(drawn, panels.tolist(), single=len(rows) == 1)
    return drawn


def _layout(phases: dict[int, Steps]) -> tuple[list[tuple[str, frozenset[int]]], Callable[[Category], dict[str, Any]]]:
    """Rows of panels, as (title, what the eyes see), and the style of a category's line."""
    categories = {category for of_phase in phases.values() for category in of_phase}
    if len(categories) <= 4:
        return [("", frozenset(_EYES))], lambda category: EYE_STYLES[eyes_of(category)]
    seen = {eyes_of(category) for category in categories}
    plain = "no arm touches" if any(_arms_of(category) for category in categories) else "whatever was before"
    rows = [(title, frozenset({eyes})) for eyes, title in _EYES.items() if eyes in seen]
    return rows, lambda category: _variant(category, plain)


def _arms_of(category: Category) -> int:
    """What the arms touch in a category, 0..3."""
    return int(Stimulus.from_label(category[1])) >> 2


def _variant(category: Category, plain: str) -> dict[str, Any]:
    """Style by what the arms touch; where that does not count, by what was sensed before."""
    previous, arms = category[0], _arms_of(category)
    if arms:
        label = ("", "left arm touches", "right arm touches", "both arms touch")[arms]
        return {**_VARIANTS[arms], "label": label}
    if previous == "any":
        return {**_VARIANTS[0], "label": plain}
    eyes = int(Stimulus.from_label(previous)) & 3
    return {**_VARIANTS[1 + eyes], "label": f"before: {_BEFORE[eyes]}"}


def _draw(axes: Axes, x: Sequence[float], y: Sequence[float], style: dict[str, Any]) -> None:
    axes.plot(drawable(x), drawable(y), markevery=max(1, len(x) // 12), **style)


def _legend(drawn: Figure, panels: Sequence[Axes], *, single: bool) -> None:
    found: dict[str, Any] = {}
    for axes in panels:
        for handle, text in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(text, handle)
    drawn.legend(
        list(found.values()),
        list(found),
        loc="outside upper left",
        ncols=5,
        title="The eyes that see it:" if single else None,
        title_fontsize=8.5,
        alignment="left",
        handlelength=3.2,
    )
