"""Pictures of bouts, made from the referee's messages and from nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import BoutOutcome
from hil.recording.scene import junior_outline, opponent_outline, ring_size
from hil.report.style import BLUE, GREEN, GREY, INK, VERMILLION, figure, whole_numbers
from hil.statistics import quantile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from hil.report.run_data import BoutPath

OUTCOME_WORDS: Final = {
    BoutOutcome.WIN: "won", BoutOutcome.LOSS: "lost", BoutOutcome.DRAW: "drawn", BoutOutcome.UNDECIDED: "broken off",
}  # fmt: skip
OUTCOME_COLORS: Final = {
    BoutOutcome.WIN: GREEN, BoutOutcome.LOSS: VERMILLION, BoutOutcome.DRAW: GREY, BoutOutcome.UNDECIDED: GREY,
}  # fmt: skip
PANELS: Final = 6
LONGEST: Final = 600.0
"""No bout is drawn beyond this time, in s."""
MOST_ROWS: Final = 12
"""Series of which the times are drawn."""
MARGIN: Final = 0.08
"""What is shown beyond the border, in m."""


def choose(bouts: Sequence[BoutPath], *, learnt: bool) -> list[BoutPath]:
    """A few bouts worth looking at.

    Args:
        bouts: All of them.
        learnt: They are of a coaching run: take the first, middle and last ones, which show what changed. Otherwise take
            the quickest, middle and slowest win, and one of each other outcome.

    Returns:
        At most six, in order.
    """
    seen = [bout for bout in bouts if len(bout.times) > 1]
    if learnt and len(seen) > PANELS:
        seen = [bout for bout in seen if bout.outcome is not BoutOutcome.UNDECIDED] or seen
    if len(seen) <= PANELS:
        return seen
    if learnt:
        middle = len(seen) // 2
        return [seen[0], seen[1], seen[middle - 1], seen[middle], seen[-2], seen[-1]]
    wins = sorted((bout for bout in seen if bout.outcome is BoutOutcome.WIN), key=lambda bout: bout.duration)
    chosen = [wins[i] for i in sorted({0, len(wins) // 2, len(wins) - 1})] if wins else []
    for outcome in (BoutOutcome.LOSS, BoutOutcome.DRAW, BoutOutcome.UNDECIDED):
        chosen += [bout for bout in seen if bout.outcome is outcome][:1]
    taken = {bout.number for bout in chosen}
    chosen += [bout for bout in seen if bout.number not in taken][: PANELS - len(chosen)]
    return sorted(chosen[:PANELS], key=lambda bout: bout.number)


def trajectories(bouts: Sequence[BoutPath]) -> Figure | None:
    """Ring, start and end poses and paths of a few bouts.

    Args:
        bouts: The bouts to draw, at most six.

    Returns:
        The picture; None where there is none.
    """
    if not bouts:
        return None
    columns = min(3, len(bouts))
    rows = -(-len(bouts) // columns)
    drawn = figure(3.0 * columns + 0.1, 2.32 * rows + (0.35 if columns > 1 else 0.75))
    panels = drawn.subplots(rows, columns, squeeze=False).ravel()
    for axes, bout in zip(panels, bouts, strict=False):
        _draw_bout(axes, bout)
    for axes in panels[len(bouts) :]:
        axes.set_axis_off()
    handles = [
        *panels[0].plot([], [], color=BLUE, linewidth=1.6, label="Junior"),
        *panels[0].plot([], [], color=VERMILLION, linewidth=1.6, label="opponent"),
        *panels[0].plot([], [], "o", color="white", markeredgecolor=INK, markersize=4, label="every second"),
    ]
    drawn.legend(handles=handles, loc="outside upper left", ncols=min(3, columns + 1), title=None)
    return drawn


def _draw_bout(axes: Axes, bout: BoutPath) -> None:
    from matplotlib.colors import to_rgba  # noqa: PLC0415 - as in `hil.report.style`
    from matplotlib.patches import Polygon, Rectangle  # noqa: PLC0415 - likewise

    axes.set_axis_off()
    width, height = ring_size()
    axes.add_patch(
        Rectangle((-width / 2, -height / 2), width, height, facecolor="#F4F2EC", edgecolor=INK, linewidth=1.4, zorder=0)
    )
    for path, outline, color in (
        (bout.other, opponent_outline(bout.opponent), VERMILLION),
        (bout.junior, junior_outline(), BLUE),
    ):
        if len(outline):
            start, end = placed(outline, *path[0]), placed(outline, *path[-1])
            axes.add_patch(Polygon(start, facecolor="none", edgecolor=color, linewidth=1.0, linestyle=(0, (2, 1.5)), zorder=2))
            axes.add_patch(Polygon(end, facecolor=to_rgba(color, 0.25), edgecolor=color, linewidth=1.2, zorder=2))
        axes.plot(path[:, 0], path[:, 1], color=color, linewidth=1.6, zorder=3, solid_capstyle="round")
        seconds = _every_second(bout.times)
        axes.plot(path[seconds, 0], path[seconds, 1], "o", color="white", markeredgecolor=color, markersize=3.2, zorder=4)
        _nose(axes, path[0], color)
        _nose(axes, path[-1], color)
    axes.set_xlim(-width / 2 - MARGIN, width / 2 + MARGIN)
    axes.set_ylim(-height / 2 - MARGIN, height / 2 + MARGIN)
    axes.set_aspect("equal")
    words = OUTCOME_WORDS[bout.outcome]
    title = axes.set_title(f"Bout {bout.number}: {words} after {bout.duration:.1f} s", fontsize=9, pad=4)
    title.set_color(OUTCOME_COLORS[bout.outcome] if bout.outcome is not BoutOutcome.DRAW else INK)


def _nose(axes: Axes, pose: NDArray[np.float64], color: str) -> None:
    """A short line in the direction of the heading."""
    x, y, heading = pose
    axes.plot(
        [x, x + 0.045 * np.cos(heading)], [y, y + 0.045 * np.sin(heading)], color=color, linewidth=1.0, alpha=0.8, zorder=3
    )


def _every_second(times: NDArray[np.float64]) -> NDArray[np.intp]:
    marks = np.arange(1.0, min(times[-1], LONGEST), 1.0)
    at = np.unique(np.searchsorted(times, marks))
    return at[at < len(times)]


def times_to_win(bouts: Sequence[BoutPath]) -> Figure | None:
    """How long wins took, a row for each series and opponent with five wins or more.

    Args:
        bouts: Bouts played.

    Returns:
        The picture; None where no series has five wins.
    """
    rows: dict[str, list[float]] = {}
    for bout in bouts:
        if bout.outcome is BoutOutcome.WIN and 0.0 <= bout.duration <= LONGEST:
            rows.setdefault(f"{bout.series or 'bouts'}, against {bout.opponent_name}", []).append(bout.duration)
    rows = {name[:100]: times for name, times in list(rows.items())[:MOST_ROWS] if len(times) >= 5}
    if not rows:
        return None
    longest = max(max(times) for times in rows.values())
    edges = np.arange(0.0, longest + 0.5, 0.5 if longest > 4 else 0.25)
    drawn = figure(9.0, 0.7 + 1.4 * len(rows))
    panels = drawn.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (name, times) in zip(panels, rows.items(), strict=True):
        axes.hist(times, bins=list(edges), color=GREEN, alpha=0.85, edgecolor="white", linewidth=0.8)
        middle = quantile(times, 0.5)
        axes.axvline(middle, color=INK, linewidth=1.2, linestyle="--")
        axes.set_title(f"{name[:1].upper()}{name[1:]}: {len(times)} wins, half of them within {middle:.1f} s", fontsize=9)
        axes.set_ylabel("Bouts")
        whole_numbers(axes.yaxis)
    panels[-1].set_xlabel("Time to win (s)")
    panels[-1].set_xlim(0, None)
    return drawn


def placed(outline: Sequence[tuple[float, float]], x: float, y: float, heading: float) -> NDArray[np.float64]:
    """An outline in the arena.

    Args:
        outline: Corners in the body's frame, in m.
        x: Position of the body, in m.
        y: Likewise.
        heading: Of the body, in rad, counter-clockwise.

    Returns:
        Corners in the arena's frame, in m; shape (n, 2).
    """
    cos, sin = np.cos(heading), np.sin(heading)
    corners: NDArray[np.float64] = np.asarray(outline, dtype=np.float64).reshape(-1, 2) @ np.array([[cos, sin], [-sin, cos]])
    corners += np.array([x, y])
    return corners
