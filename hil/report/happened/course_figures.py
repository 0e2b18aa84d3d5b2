"""The time line of a run: in which state robots were, and what happened to them."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages.robot import State
from hil.report.happened.words import STOPPING, state_name
from hil.report.report_table import shortened
from hil.report.style import AMBER, BLUE, GREEN, GREY, INK, PURPLE, SKY, VERMILLION, figure, whole_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from hil.report.run_data import RunData

COLUMNS: Final = 600
"""Moments that a time line is drawn with, where more happened than it has room for."""
MOST_LANES: Final = 16
"""Robots that have a row each; of more it is counted how many are in which state."""
MOST_MARKS: Final = 400
MOST_CHAPTERS: Final = 12
LETTERS: Final = 110
"""Letters of titles that have room above a time line."""
LEAST_ROOM: Final = 8
STATE_COLORS: Final = {
    State.DISARMED: "#B5B5B5", State.READY: SKY, State.DRIVING: BLUE, State.PERFORMING: GREEN, State.COUNTDOWN: AMBER,
    State.CONTEST: PURPLE, State.STOPPED: VERMILLION,
}  # fmt: skip
_MARKED: Final = (
    (STOPPING, "emergency stop", VERMILLION),
    ("key", "keys", INK),
    ("link", "link", AMBER),
    ("other", "other", GREY),
)

Span = tuple[float, float, int]
"""From, to, in s, and the state."""


def time_line(data: RunData) -> Figure | None:
    """In which state robots were over the run, and below it marks of what happened.

    Of one robot each state has a row, of a few each robot; of many it is counted how many are in which state.

    Args:
        data: The run.

    Returns:
        The picture; None where no robot has told of its state.
    """
    course = data.course
    spans = {system: found for system in sorted(course.states) if (found := course.spans(system, data.end))}
    if not spans or data.duration <= 0.0:
        return None
    scale, unit = (60.0, "min") if data.duration > 300 else (1.0, "s")
    marks = _marks(data)
    states = sorted({state for found in spans.values() for _, _, state in found})
    rows = len(states) if len(spans) == 1 else len(spans) if len(spans) <= MOST_LANES else 7
    drawn = figure(9.0, 0.9 + 0.24 * rows + 0.2 * len(marks) + (0.25 if len(spans) > 1 else 0.0))
    upper, lower = drawn.subplots(2, 1, sharex=True, height_ratios=[rows, max(0.8 * len(marks), 0.01)])
    if len(spans) == 1:
        ((_, found),) = spans.items()
        _rows(upper, [(state_name(state), [one for one in found if one[2] == state]) for state in states], data, scale)
    elif len(spans) <= MOST_LANES:
        _rows(upper, [(f"robot {system}", found) for system, found in spans.items()], data, scale)
    else:
        _counts(upper, list(spans.values()), states, data, scale)
    if len(spans) > 1:
        _legend(drawn, states)
    _chapters(upper, course.chapters[:MOST_CHAPTERS], data, scale)
    for row, (_, color, times) in enumerate(reversed(marks)):
        lower.plot([time / scale for time in times], [row] * len(times), "|", color=color, markersize=8, markeredgewidth=1.6)
        lower.axhline(row, color="#E4E4E4", linewidth=0.6, zorder=0)
    lower.set_ylim(-0.6, max(len(marks), 1) - 0.4)
    lower.set_yticks(range(len(marks)), [name for name, _, _ in reversed(marks)])
    lower.tick_params(axis="y", length=0)
    lower.grid(visible=False, axis="y")
    lower.set_xlim(data.start / scale, data.end / scale)
    lower.set_xlabel(f"Log time ({unit})")
    return drawn


def _rows(axes: Axes, rows: Sequence[tuple[str, list[Span]]], data: RunData, scale: float) -> None:
    """Rows of bars, the first one on top."""
    for row, (_, found) in enumerate(reversed(rows)):
        axes.axhline(row, color="#E4E4E4", linewidth=0.6, zorder=0)
        few = thinned(found, data.start, data.end)
        for state in sorted({state for _, _, state in few}):
            bars = [(start / scale, max(end - start, data.duration / 2000) / scale) for start, end, one in few if one == state]
            axes.broken_barh(bars, (row - 0.36, 0.72), facecolors=_color(state), linewidth=0)
    axes.set_yticks(range(len(rows)), [name for name, _ in reversed(rows)])
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")


def _chapters(axes: Axes, chapters: Sequence[tuple[float, str]], data: RunData, scale: float) -> None:
    """Where a series of bouts begins, and its title as far as there is room for it."""
    for (when, title), (until, _) in pairwise([*chapters, (data.end, "")]):
        axes.axvline(when / scale, color=INK, linewidth=0.8, linestyle=(0, (2, 3)), zorder=3)
        room = int(LETTERS * (until - when) / data.duration)
        if room >= LEAST_ROOM:
            axes.annotate(shortened(title, room), (when / scale, 1.0), xycoords=("data", "axes fraction"), xytext=(3, 2),
                          textcoords="offset points", va="bottom", fontsize=7.5, color="#444444")  # fmt: skip


def _counts(axes: Axes, robots: Sequence[Sequence[Span]], states: Sequence[int], data: RunData, scale: float) -> None:
    """How many of many robots are in which state, one upon the other."""
    edges = np.linspace(data.start, data.end, COLUMNS // 2 + 1)
    middles = (edges[:-1] + edges[1:]) / 2
    counts = dict.fromkeys(states, np.zeros(len(middles)))
    for found in robots:
        starts, ends, told = (np.array(column, dtype=np.float64) for column in zip(*found, strict=True))
        at = np.searchsorted(starts, middles, side="right") - 1
        inside = (at >= 0) & (middles <= ends[at])
        for state in states:
            counts[state] = counts[state] + (inside & (told[at] == state))
    axes.stackplot(middles / scale, *counts.values(), colors=[_color(state) for state in states], step="mid", linewidth=0)
    axes.set_ylabel("Robots")
    axes.set_ylim(0, len(robots))
    whole_numbers(axes.yaxis)


def _legend(drawn: Figure, states: Sequence[int]) -> None:
    from matplotlib.patches import Rectangle  # noqa: PLC0415 - as in `hil.report.style`

    handles = [Rectangle((0, 0), 1, 1, color=_color(state)) for state in states]
    drawn.legend(handles, [state_name(state) for state in states], loc="outside upper left", ncols=7)


def _color(state: int) -> str:
    return STATE_COLORS[State(state)] if state in STATE_COLORS else GREY


def _marks(data: RunData) -> list[tuple[str, str, list[float]]]:
    """Rows of marks: name, colour, times in s."""
    course = data.course
    times: dict[str, list[float]] = {kind: [] for kind, _, _ in _MARKED}
    times[STOPPING] = [stop.time for stop in course.stops()]
    for happening in course.happenings:
        times[happening.kind if happening.kind in times else "other"].append(happening.time)
    for time, event in data.events:
        if event.kind not in {"bout", "result"}:
            times[event.kind if event.kind in times else "other"].append(time)
    return [(name, color, _apart(times[kind], data.duration)) for kind, name, color in _MARKED if times[kind]]


def _apart(times: Sequence[float], duration: float) -> list[float]:
    """Times of which no two would be drawn on one another."""
    found: list[float] = []
    for time in sorted(times):
        if not found or time - found[-1] >= duration / MOST_MARKS:
            found.append(time)
    return found


def thinned(spans: Sequence[Span], start: float, end: float, columns: int = COLUMNS) -> list[Span]:
    """States over time as few bars: where there are many, that of each moment which lasted longest in it.

    An emergency stop is never left out.

    Args:
        spans: In order.
        start: Where the drawing begins, in s.
        end: Where it ends, in s.
        columns: Moments that it has room for.

    Returns:
        Spans, at most one per moment; those given where they are few.
    """
    if len(spans) <= columns // 2 or end <= start:
        return list(spans)
    states = sorted({state for _, _, state in spans})
    width = (end - start) / columns
    covered: NDArray[np.float64] = np.zeros((len(states), columns))
    edges = start + width * np.arange(columns + 1)
    for begin, until, state in spans:
        first, last = (int(np.clip((time - start) / width, 0, columns - 1)) for time in (begin, until))
        at = slice(first, last + 1)
        shared = np.minimum(until, edges[1:][at]) - np.maximum(begin, edges[:-1][at])
        covered[states.index(state), at] += np.maximum(shared, 0.0)
    if State.STOPPED in states:
        covered[states.index(State.STOPPED)] *= columns  # however short
    longest = np.where(covered.max(axis=0) > 0.0, covered.argmax(axis=0), -1)
    cuts = np.concatenate(([0], np.flatnonzero(np.diff(longest)) + 1, [columns]))
    return [
        (float(edges[a]), float(edges[b]), states[longest[a]])
        for a, b in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True)
        if longest[a] >= 0
    ]
