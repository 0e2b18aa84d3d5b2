"""Pictures of the rules that were learnt, beside the book's, as Figs. 7.5 and 7.25 of Liu & Wu 2001."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING, Final

from firmware_protocol.vocabulary import RobotClass
from hil.report.style import AMBER, BLUE, GREY, INK, PALE, bare, figure
from pal_advisor.surround import rules
from pal_advisor.surround.tables import behaviour_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hil.report.swarm.runs import SurroundRun
    from pal_advisor.surround import Rule, Tables

MOST_RULES: Final = 6
"""Rules that are drawn of each class."""
INNER: Final = 0.55
"""Inner radius of the ring; its outer one is 1."""
REACH: Final = 1.12
LEARNT, BOOK = BLUE, INK


def drawn_rules(tables: Tables, kind: RobotClass) -> list[Rule]:
    """Those rules of a class that are drawn: the ones that the book reports too, then what was met most, by number.

    Args:
        tables: What was learnt.
        kind: The class.
    """
    found = [rule for rule in rules(tables, kind) if rule.met and 0 < len(rule.behaviours) < len(rule.pattern)]
    first = sorted(found, key=lambda rule: (rule.book is None, -rule.met, rule.stimulus))[:MOST_RULES]
    return sorted(first, key=lambda rule: rule.stimulus)


def rings(run: SurroundRun) -> Figure | None:
    """For each stimulus the ring of its canonical pattern with the sectors that are chosen, and below it the book's.

    Args:
        run: The run.

    Returns:
        The picture; None where nothing has been learnt.
    """
    if not run.learnt:
        return None
    tables = run.learnt[-1][1]
    rows = [(kind, found) for kind in RobotClass if (found := drawn_rules(tables, kind))]
    if not rows:
        return None
    columns = max(3, *(len(found) for _, found in rows))
    bands: list[tuple[RobotClass, list[Rule], bool]] = []
    for kind, found in rows:
        bands += [(kind, found, book) for book in (False, True) if not book or any(rule.book for rule in found)]
    drawn = figure(1.75 * columns + 0.6, 2.2 * len(bands) + 0.2)
    panels = drawn.subplots(len(bands), columns, squeeze=False)
    for row, (kind, found, book) in zip(panels, bands, strict=True):
        for axes in row[len(found) :]:
            axes.set_visible(False)
        for axes, rule in zip(row, found, strict=False):
            _ground(axes)
            if not book:
                axes.set_title(f"STIMULUS{rule.stimulus}", loc="center")
                _ring(axes, rule.pattern, rule.behaviours, LEARNT)
                axes.set_xlabel(f"{behaviour_names(rule.behaviours)}, {rule.weight:.2f}", color=LEARNT)
            elif rule.book is None:
                axes.set_xlabel("no rule", color=GREY)
            else:
                _ring(axes, rule.pattern, rule.book.behaviours, BOOK)
                axes.set_xlabel(f"{rule.book.name}: {rule.book.behaviour}", color=BOOK)
        row[0].set_ylabel("the book" if book else f"{kind.name}s learnt")
    return drawn


def _ground(axes: Axes) -> None:
    bare(axes)
    axes.set_xlim(-REACH, REACH)
    axes.set_ylim(-REACH, REACH)
    axes.set_aspect("equal")


def _ring(axes: Axes, pattern: str, behaviours: tuple[int, ...], color: str) -> None:
    """A ring of sectors, the nose up: sector 1 begins there, and they are counted to the left."""
    from matplotlib.patches import Circle, FancyArrowPatch, Wedge  # noqa: PLC0415 - as in `hil.report.style`

    sectors = len(pattern)
    width = 360.0 / sectors
    for sector, bit in enumerate(pattern):
        begin = 90.0 + sector * width
        chosen = sector + 1 in behaviours
        axes.add_patch(
            Wedge(
                (0.0, 0.0), 1.0, begin, begin + width, width=1.0 - INNER, facecolor=AMBER if bit == "1" else PALE,
                edgecolor=color if chosen else "white", linewidth=2.2 if chosen else 1.0, zorder=3 if chosen else 2,
            )
        )  # fmt: skip
        angle = (begin + width / 2.0) / 180.0 * pi
        middle = (1.0 + INNER) / 2.0
        axes.text(
            middle * cos(angle), middle * sin(angle), str(sector + 1), ha="center", va="center", zorder=4,
            fontsize=8.5 if sectors <= 9 else 6.5, color=INK if chosen or bit == "1" else GREY,
            fontweight="bold" if chosen else "normal",
        )  # fmt: skip
        if chosen:
            tip = INNER * cos(angle), INNER * sin(angle)
            axes.add_patch(
                FancyArrowPatch((0.0, 0.0), tip, arrowstyle="-|>", mutation_scale=10, color=color, linewidth=1.8, shrinkB=0.0)
            )
    axes.add_patch(Circle((0.0, 0.0), 0.11, facecolor=color, edgecolor="none"))
