"""Pictures of where the robots were, seen from above, as Figs. 7.3, 8.19 and 9.5 of Liu & Wu 2001."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from hil.report.style import BLUE, GREY, INK, VERMILLION, figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from hil.mcaplog.records import SurroundStateRecord
    from hil.report.swarm.runs import SurroundRun

SHOWN: Final = 4
"""Snapshots: the start, two between, the end."""
STRETCH: Final = 10
"""Steps in one picture of trajectories."""
WIDEST: Final = 2.0
"""Who is farther out than so many halves of the area is not drawn, but counted."""
MARGIN: Final = 0.04
COLORS: Final = {RobotClass.RANGER: BLUE, RobotClass.WILD: VERMILLION}
EDGES: Final = {RobotClass.RANGER: "none", RobotClass.WILD: INK}


def snapshots(run: SurroundRun) -> Figure | None:
    """Where everybody was at the start, at two steps between, and at the end.

    Args:
        run: The run.

    Returns:
        The picture; None where nobody is known to be anywhere.
    """
    chosen = [run.states[index] for index in _spread(len(run.states), SHOWN)]
    if not _somebody(run, chosen):
        return None
    view = _view(run, chosen)
    panels, drawn = _panels(len(chosen), view)
    for axes, state in zip(panels, chosen, strict=True):
        _ground(axes, run, view)
        out = 0
        for kind in RobotClass:
            places = run.positions(kind, [state])[0]
            out += _robots(axes, places, run.body, kind, view)
        _titled(axes, "start" if state.step == 0 else f"step {state.step}", out)
    _legend(drawn, run)
    return drawn


def trajectories(run: SurroundRun, *, chosen: bool = False) -> Figure | None:
    """Which ways everybody went: in the first and the second ten steps, or in all steps that were chosen.

    Args:
        run: The run.
        chosen: Its steps are those that were chosen.

    Returns:
        The picture; None where there are fewer than two states, or nobody is known to be anywhere.
    """
    from matplotlib.collections import LineCollection  # noqa: PLC0415 - as in `hil.report.style`

    stretches = [stretch for stretch in _stretches(run, chosen=chosen) if len(stretch) > 1 and _somebody(run, stretch)]
    if not stretches:
        return None
    view = _view(run, [state for stretch in stretches for state in stretch])
    panels, drawn = _panels(len(stretches), view)
    for axes, stretch in zip(panels, stretches, strict=True):
        _ground(axes, run, view)
        out = 0
        for kind in RobotClass:
            places = run.positions(kind, stretch)
            ways = LineCollection(list(places.transpose(1, 0, 2)), colors=COLORS[kind], linewidths=0.9, alpha=0.75, zorder=2)
            axes.add_collection(ways, autolim=False)
            out += _robots(axes, places[-1], run.body, kind, view)
        _titled(axes, f"steps {stretch[0].step} to {stretch[-1].step}", out)
    _legend(drawn, run)
    return drawn


def _stretches(run: SurroundRun, *, chosen: bool) -> list[list[SurroundStateRecord]]:
    """States that are drawn in one picture, the last of one being the first of the next."""
    if chosen:
        return [list(run.states)]
    ends = [(begin, begin + STRETCH) for begin in (0, STRETCH)]
    return [[state for state in run.states if begin <= state.step <= end] for begin, end in ends]


def _spread(count: int, wanted: int) -> list[int]:
    """Indices of the first of some, the last, and those that part the rest evenly."""
    return sorted({round(index * (count - 1) / (wanted - 1)) for index in range(wanted)})


def _somebody(run: SurroundRun, states: Sequence[SurroundStateRecord]) -> bool:
    return any(not np.isnan(run.positions(kind, states)).all() for kind in RobotClass)


def _panels(count: int, view: NDArray[np.float64]) -> tuple[list[Axes], Figure]:
    columns = min(2, count)
    rows = -(-count // columns)
    height = 4.5 * min(3.0, max(0.3, view[1] / view[0]))
    drawn = figure(4.7 * columns, (height + 0.45) * rows + 0.45)
    found = list(drawn.subplots(rows, columns, squeeze=False).flat)
    for axes in found[count:]:
        axes.set_visible(False)
    return found[:count], drawn


def _view(run: SurroundRun, states: Sequence[SurroundStateRecord]) -> NDArray[np.float64]:
    """Half sides of what is seen: of the area's shape, and with those that have left it, within bounds."""
    area = np.array(run.area) / 2.0
    reach = 1.0
    for kind in RobotClass:
        places = np.abs(run.positions(kind, states).reshape(-1, 2)) + run.body
        near = places[(places <= WIDEST * area).all(axis=1)]
        if len(near):
            reach = max(reach, float((near / area).max()))
    seen: NDArray[np.float64] = (reach + MARGIN) * area
    return seen


def _ground(axes: Axes, run: SurroundRun, view: NDArray[np.float64]) -> None:
    """The area with its wall, or its border where there is none."""
    from matplotlib.patches import Rectangle  # noqa: PLC0415 - as in `hil.report.style`

    width, height = run.area
    border = Rectangle((-width / 2, -height / 2), width, height, fill=False, zorder=1, **_border(run))
    axes.add_patch(border)
    axes.set_xlim(-view[0], view[0])
    axes.set_ylim(-view[1], view[1])
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _border(run: SurroundRun) -> dict[str, Any]:
    """How the border of the area looks."""
    if run.wall:
        return {"color": INK, "linewidth": 2.2}
    return {"color": GREY, "linewidth": 0.9, "linestyle": (0, (4, 3))}


def _robots(axes: Axes, places: NDArray[np.float64], body: float, kind: RobotClass, view: NDArray[np.float64]) -> int:
    """Robots to scale.

    Returns:
        How many are out of the picture.
    """
    from matplotlib.collections import EllipseCollection  # noqa: PLC0415 - as in `hil.report.style`

    there = places[~np.isnan(places).any(axis=1)]
    inside = (np.abs(there) <= view).all(axis=1)
    if inside.any():
        size = np.full(int(inside.sum()), 2.0 * body)
        axes.add_collection(
            EllipseCollection(
                size, size, np.zeros_like(size), units="xy", offsets=there[inside], offset_transform=axes.transData,
                facecolors=COLORS[kind], edgecolors=EDGES[kind], linewidths=0.7, zorder=3 + kind,
            ),
            autolim=False,
        )  # fmt: skip
    return int((~inside).sum())


def _titled(axes: Axes, title: str, out: int) -> None:
    axes.set_title(title + (f"; {out} farther out" if out else ""))


def _legend(drawn: Figure, run: SurroundRun) -> None:
    from matplotlib.lines import Line2D  # noqa: PLC0415 - as in `hil.report.style`

    handles = [
        Line2D([], [], marker="o", linestyle="", color=COLORS[kind], markeredgecolor=EDGES[kind], label=f"{kind.name}s")
        for kind in RobotClass
    ]
    handles.append(Line2D([], [], label="wall" if run.wall else "border of the area", **_border(run)))
    drawn.legend(handles=handles, loc="outside lower center", ncols=3)
