"""Figs. 10.5 to 10.7 of Liu & Wu 2001, as stored results have them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from hil.book.sumo.methods import CORNER, CURVED, FLAT, HEAVY, OPPONENTS, POINT, SQUARE
from hil.book.sumo.reduction import MODES
from hil.recording.scene import junior_outline, ring_size
from hil.report.bout_figures import placed
from hil.report.style import BLUE, EYE_STYLES, INK, PALE, VERMILLION, bare, figure, whole_numbers
from simdevice.junior.profile import JuniorProfile
from simdevice.quantities import GRAVITY
from simdevice.sumo.opponents import OPPONENTS as SPECS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from hil.book.results import StoredResults

PANELS: Final = dict(
    zip(
        (*OPPONENTS, SQUARE),
        (
            "(a) light, flat", "(b) heavy, flat", "(c) light, curved", "(d) light, corner: a wedge", "(e) light, point",
            "(d) light, corner: a small square",
        ),
        strict=True,
    )
)  # fmt: skip
_CONTACTS: Final = {FLAT: 0, HEAVY: 0, CURVED: 0, CORNER: 1, POINT: 2}
_BESIDE: Final = {FLAT: -0.24, HEAVY: 0.0, CURVED: 0.24, CORNER: 0.0, POINT: 0.0}
_POINTS: Final = 420.0
"""Points that a metre of an outline takes in the classification."""
_STROBES: Final = 9
"""Most poses of a bout that are drawn."""
_MARGIN: Final = 0.07
"""What is shown beyond the border, in m."""
_FULL: Final = 24
"""The most that a maneuver of four actions can be worth."""


def complexity() -> Figure:
    """Fig. 10.5: the opponents by engagement, and by the force that gets them going."""
    from matplotlib.path import Path  # noqa: PLC0415 - as in `hil.report.style`

    drawn = figure(7.5, 3.9)
    axes = drawn.subplots()
    for opponent, column in _CONTACTS.items():
        spec = SPECS[opponent]
        x, force = column + _BESIDE[opponent], spec.mass * GRAVITY * spec.static
        corners = np.array(spec.outline.vertices) @ np.array([[0.0, -1.0], [1.0, 0.0]])  # front down, where Junior comes from
        closed = np.vstack((corners, corners[:1]))
        reach = float(np.abs(closed).max())  # to which matplotlib scales a marker
        size = (2.0 * reach * _POINTS) ** 2
        axes.scatter(x, force, marker=Path(closed), s=size, facecolor="#F3C9A8", edgecolor=VERMILLION, zorder=3)
        axes.annotate(
            f"{PANELS[opponent].partition(':')[0]}\n{spec.mass:g} kg", (x, force), xytext=(0, 0.4 * reach * _POINTS + 8),
            textcoords="offset points", ha="center", fontsize=8, linespacing=1.3,
        )  # fmt: skip
    push = JuniorProfile().tyre_friction * JuniorProfile().mass * GRAVITY
    axes.axhline(push, color=INK, linewidth=1.0, linestyle="--")
    axes.annotate("Junior's steady push", (2.45, push), xytext=(0, 4), textcoords="offset points", ha="right", fontsize=8)
    axes.set_xlim(-0.5, 2.5)
    axes.set_ylim(-0.4, 6.0)
    axes.set_xticks([0, 1, 2], ["surface", "corner", "point"])
    axes.set_xlabel("Contact when they engage")
    axes.set_ylabel("Force that gets it going (N)")
    axes.grid(visible=False, axis="x")
    return drawn


def curves(results: StoredResults) -> Figure:
    """Fig. 10.7: best fitness over GP steps, a curve for each sensing mode.

    Each is the mean over the seeds that have got so far, and as long as that of the middle seed.

    Args:
        results: Stored results.
    """
    drawn = figure(10.0, 6.4)
    panels = drawn.subplots(2, 3, sharex=True, sharey=True).ravel()
    order = (FLAT, HEAVY, CURVED, CORNER, POINT, SQUARE)
    for axes, opponent in zip(panels, order, strict=True):
        for name, mode in MODES.items():
            line = mean_curve(_data(results, opponent).get("curves", {}).get(name, []))
            if len(line):
                steps = np.arange(1, len(line) + 1)
                style = {**EYE_STYLES[mode], "label": f"{name}: {len(line)}"}
                axes.plot(steps, line, markevery=2, zorder=2 + mode, **style)
        axes.set_title(PANELS[opponent], fontsize=10)
        axes.set_ylim(0, _FULL)
        whole_numbers(axes.xaxis)
        if axes.lines:
            axes.legend(loc="upper left", title="GP steps", title_fontsize=8, fontsize=8)
    panels[0].set_xlim(0, None)  # which all share
    for axes in panels[3:]:
        axes.set_xlabel("GP step of the sensing mode (20 performances)")
    for axes in panels[::3]:
        axes.set_ylabel("Best fitness (Eq. 10.1)")
    return drawn


def mean_curve(each: Sequence[Sequence[float | None]]) -> NDArray[np.float64]:
    """The mean of curves of different lengths, as long as that of the middle one.

    Args:
        each: A curve for each seed; None where it has no value yet.

    Returns:
        A value for each step; NaN where no seed has one.
    """
    length = int(np.median([len(curve) for curve in each])) if each else 0
    values = np.full((len(each), length), np.nan)
    for row, curve in zip(values, each, strict=True):
        part = np.array(curve[:length], dtype=np.float64)
        row[: len(part)] = part
    known = ~np.isnan(values)
    counts = known.sum(axis=0)
    mean: NDArray[np.float64] = np.where(known, values, 0.0).sum(axis=0) / np.maximum(counts, 1)
    return np.where(counts > 0, mean, np.nan)


def maneuvers(results: StoredResults) -> Figure:
    """Fig. 10.6: a bout against each opponent, as it was performed by what was learnt.

    Args:
        results: Stored results.
    """
    drawn = figure(10.0, 5.0)
    panels = drawn.subplots(2, 3).ravel()
    for axes, opponent in zip(panels, OPPONENTS, strict=False):
        _draw_bout(axes, opponent, _data(results, opponent).get("bout", {"poses": [], "words": "not measured"}))
    bare(panels[-1])
    for color, label in ((BLUE, "Junior"), (VERMILLION, "opponent")):
        panels[-1].plot([], [], color=color, linewidth=1.4, label=f"{label}, darker as time goes on")
    panels[-1].legend(loc="center left")
    return drawn


def _draw_bout(axes: Axes, opponent: str, bout: Mapping[str, Any]) -> None:
    from matplotlib.patches import Polygon, Rectangle  # noqa: PLC0415 - as in `hil.report.style`

    bare(axes)
    width, height = ring_size()
    axes.add_patch(Rectangle((-width / 2, -height / 2), width, height, facecolor=PALE, edgecolor=INK, linewidth=1.2, zorder=0))
    poses = np.array(bout["poses"], dtype=np.float64).reshape(-1, 6)
    chosen = np.unique(np.linspace(0, max(len(poses) - 1, 0), min(len(poses), _STROBES)).round().astype(int))
    for index, at in enumerate(chosen):
        shade = 0.12 + 0.78 * (index + 1) / len(chosen)
        for outline, pose, color in (
            (SPECS[opponent].outline.vertices, poses[at, 3:], VERMILLION),
            (junior_outline(), poses[at, :3], BLUE),
        ):
            corners = placed(outline, *pose)
            axes.add_patch(Polygon(corners, facecolor="none", edgecolor=color, alpha=shade, linewidth=1.3, zorder=2 + index))
    for first, color in ((0, BLUE), (3, VERMILLION)):
        axes.plot(poses[:, first], poses[:, first + 1], color=color, linewidth=0.8, alpha=0.7, zorder=20)
    axes.set_xlim(-width / 2 - _MARGIN, width / 2 + _MARGIN)
    axes.set_ylim(-height / 2 - _MARGIN, height / 2 + _MARGIN)
    axes.set_aspect("equal")
    axes.set_title(f"{PANELS[opponent].partition(':')[0]}: {bout['words']}", fontsize=8.5, pad=2)


def _data(results: StoredResults, opponent: str) -> dict[str, Any]:
    """What is stored of the book's method against an opponent; nothing where it has not been made."""
    name = f"book-{opponent}"
    return results.runs(name).data if results.has(name) else {}
