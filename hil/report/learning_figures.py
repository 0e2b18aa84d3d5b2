"""Pictures of learning: wins over the run, and the maneuvers that were learnt."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import BoutOutcome
from firmware_protocol.vocabulary import ANY, ANY_STIMULUS, Speed, Stimulus, situation_name, stimulus_label
from hil.report.style import BLUE, GREEN, GREY, INK, PALE, VERMILLION, bare, figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hil.report.run_data import BoutPath, RunData
    from pal_advisor.maneuvers import AdviceEntry

PHASES: Final = {1: "Phase 1: basic actions", 2: "Phase 2: fine actions"}
MOST_STRIPS: Final = 64
"""Maneuvers drawn."""
WIDE: Final = 5
"""Where more actions than this would fit, the words are set one below the other."""
WINDOW: Final = 20
"""Bouts that the running share of wins is taken over."""
SPEEDS: Final = {
    Speed.NONE: 0.0, Speed.FAST: 1.0, Speed.MODERATE: 0.7, Speed.SLOW: 0.4, Speed.TURN: 0.35,
}  # fmt: skip
_SPEED_PARAMETERS: Final = {
    Speed.FAST: "SPD_FAST", Speed.MODERATE: "SPD_MODERATE", Speed.SLOW: "SPD_SLOW", Speed.TURN: "SPD_TURN",
}  # fmt: skip

Category = tuple[str, str]
"""Previous stimulus or `any`, current stimulus."""


_CODES: Final = {Stimulus(code).label: code for code in range(16)}


def situation(entry: AdviceEntry) -> Category:
    """The category that an entry of advice is for."""
    return stimulus_label(entry.previous), stimulus_label(entry.current)


def known(category: Category) -> bool:
    """Both stimuli are ones that this program knows: only these are drawn."""
    return category[1] in _CODES and (category[0] == "any" or category[0] in _CODES)


def eyes_of(category: Category) -> int:
    """What the eyes see in a category, 0..3."""
    return _CODES[category[1]] & 3


def category_name(category: Category) -> str:
    """A category as in all legends and tables: `left`, or `right, before: left`."""
    if not known(category):
        return f"{category[0][:40]}, {category[1][:40]} (not known)"
    previous, current = category
    return situation_name(ANY_STIMULUS if previous == ANY else _CODES[previous], _CODES[current])


def sort_key(category: Category) -> tuple[int, int, int]:
    """Order of categories: by eyes (both first), then arms, then what was before; those not known are last."""
    if not known(category):
        return 1, 0, 0
    previous, current = category
    code = _CODES[current]
    return -(code & 3), code >> 2, -1 if previous == ANY else _CODES[previous]


def wins_over_run(data: RunData, bouts: Sequence[BoutPath]) -> Figure | None:
    """Share of bouts won so far in a window, and every bout's outcome.

    Args:
        data: The run.
        bouts: Bouts of the coaching.

    Returns:
        The picture; None for fewer than five bouts.
    """
    over = [bout for bout in bouts if bout.outcome is not BoutOutcome.UNDECIDED]
    if len(over) < 5:
        return None
    used = np.array([bout.used for bout in over]) if data.trials else np.arange(1, len(over) + 1)
    won = np.array([bout.outcome is BoutOutcome.WIN for bout in over], dtype=float)
    width = min(WINDOW, len(over))
    share = np.convolve(won, np.ones(width) / width, mode="valid")
    drawn = figure(9.0, 2.9)
    axes = drawn.subplots()
    axes.plot(used[width - 1 :], share, color=BLUE, linewidth=2)
    axes.fill_between(used[width - 1 :], share, color=BLUE, alpha=0.12, linewidth=0)
    rows = ((BoutOutcome.WIN, GREEN, "won"), (BoutOutcome.DRAW, GREY, "drawn"), (BoutOutcome.LOSS, VERMILLION, "lost"))
    for row, (outcome, color, name) in enumerate(rows):
        where = [x for x, bout in zip(used, over, strict=True) if bout.outcome is outcome]
        axes.plot(where, [1.08 + 0.07 * row] * len(where), "|", color=color, markersize=6, label=f"{name}: {len(where)}")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=4, borderaxespad=0.2, handlelength=0.8, columnspacing=1.4)
    axes.set_ylim(0, 1.27)
    axes.set_yticks([0, 0.25, 0.5, 0.75, 1.0], ["0", "25%", "50%", "75%", "100%"])
    axes.set_xlim(-0.005 * max(used.max(), 1), max(used.max(), 1) * 1.005)
    axes.set_title("Bouts won while learning")
    mark_phases(axes, data, labels=False)
    axes.set_xlabel("Maneuvers performed" if data.trials else "Bout")
    axes.set_ylabel(f"Won, of the last {width} bouts")
    return drawn


def maneuver_strips(data: RunData) -> Figure | None:
    """The learnt maneuvers: for each the speeds of both wheels over time.

    Args:
        data: The run.

    Returns:
        The picture; None without advice.
    """
    from matplotlib.patches import Rectangle  # noqa: PLC0415 - as in `hil.report.style`

    if data.advice is None or not data.advice.entries:
        return None
    entries = sorted(data.advice.entries, key=lambda entry: sort_key(situation(entry)))[:MOST_STRIPS]
    drawn = figure(9.0, 0.55 + 1.25 * len(entries))
    panels = drawn.subplots(len(entries), 1, squeeze=False, sharex=True)[:, 0]
    period = data.advice.period
    paces = [period if entry.period is None else entry.period for entry in entries]
    longest = max(len(entry.actions) for entry in entries)
    span = max(len(entry.actions) * pace for entry, pace in zip(entries, paces, strict=True))
    for axes, entry, pace in zip(panels, entries, paces, strict=True):
        _strip(axes, entry, _speeds(data.parameters), pace, span)
    last = panels[-1]
    if len(set(paces)) == 1:
        ticks = [i * paces[0] for i in range(longest + 1)]
        last.set_xticks(ticks, [f"{tick:.2g} s" for tick in ticks])
    else:
        last.xaxis.set_major_formatter("{x:g} s")
    last.tick_params(axis="x", length=0, labelbottom=True)
    handles = [Rectangle((0, 0), 1, 1, color=BLUE), Rectangle((0, 0), 1, 1, color=VERMILLION)]
    drawn.legend(handles, ["wheel forward (bar up)", "wheel backward (bar down)"], loc="outside upper left", ncols=2)
    return drawn


def _strip(axes: Axes, entry: AdviceEntry, speeds: dict[Speed, float], period: float, span: float) -> None:
    from matplotlib.patches import Rectangle  # noqa: PLC0415 - as above

    bare(axes)
    lanes = {"L": 1.1, "R": -1.1}
    for lane, middle in lanes.items():
        axes.axhline(middle, xmax=1.0, color="#C8C8C8", linewidth=0.8, zorder=1)
        axes.text(-0.02 * span, middle, lane, ha="right", va="center", fontsize=8, color="#555555")
    for index, action in enumerate(entry.actions):
        spec = action.spec
        start = index * period
        for lane, direction in (("L", spec.left), ("R", spec.right)):
            height = direction * speeds[spec.speed]
            color = BLUE if direction > 0 else VERMILLION
            axes.add_patch(
                Rectangle((start + 0.03 * period, lanes[lane]), 0.94 * period, height, color=color, linewidth=0, zorder=2)
            )
        axes.text(start + period / 2, 3.5, action.name, ha="center", va="bottom", fontsize=8.5, fontweight="bold", color=INK)
        narrow = span > (WIDE + 0.5) * period
        words = spec.meaning.replace(", ", ",\n").replace(" ", "\n" if narrow else " ")
        axes.text(start + period / 2, 3.4, words, ha="center", va="top", fontsize=6.5, color="#555555", linespacing=0.95)
        axes.axvline(start + period, color=PALE, linewidth=0.8, zorder=0)
    axes.set_xlim(-0.001, span)
    axes.set_ylim(-2.3, 4.6)
    axes.tick_params(axis="x", length=0)
    name = category_name(situation(entry)).replace(", ", ",\n")
    axes.set_ylabel(name, rotation=0, ha="right", va="center", labelpad=24, fontsize=10, fontweight="bold")
    words = f"fitness {entry.fitness:.1f}\ntried {entry.evaluations} times, phase {entry.phase}"
    if entry.names:
        words += "\n" + "\n".join(name[:40] for name in entry.names[:4])
    axes.annotate(words, (1.02, 0.5), xycoords="axes fraction", va="center", fontsize=8, color="#444444", annotation_clip=False)


def _speeds(parameters: dict[str, float]) -> dict[Speed, float]:
    told = {speed: parameters.get(_SPEED_PARAMETERS.get(speed, ""), usual) for speed, usual in SPEEDS.items()}
    return {speed: value if 0.0 <= value <= 1.0 else SPEEDS[speed] for speed, value in told.items()}


def mark_phases(axes: Axes, data: RunData, *, labels: bool = True) -> None:
    """Draw where phase 2 and the exam begin."""
    second = next((index for index, trial in enumerate(data.trials) if trial.phase == 2), None)
    exam = next((index for index, trial in enumerate(data.trials) if trial.exam), None)
    marks = [] if second in {None, 0} else [(second, "phase 2")]
    if exam is not None:
        axes.axvspan(exam, len(data.trials), color=PALE, zorder=0, linewidth=0)
        marks.append((exam, "exam"))
    for where, text in marks:
        axes.axvline(where, color=INK, linewidth=0.9, linestyle=(0, (2, 3)), zorder=1)
        if labels:
            axes.annotate(text, (where, 1.0), xycoords=("data", "axes fraction"), xytext=(4, -3), textcoords="offset points",
                          va="top", fontsize=8, color="#444444")  # fmt: skip
