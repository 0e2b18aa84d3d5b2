"""Rings, tables and senses drawn in characters: to scale, as many lines as there is room for, in ASCII where it must be."""

from __future__ import annotations

from math import pi

import pytest

from hil.cockpit.canvas import Canvas, drawn
from hil.cockpit.snapshot import Body, Figure, PlanView, Senses

RING = PlanView(
    (
        Body(Figure.OPPONENT, (-0.4, 0.2), 0.0, 0.05),
        Body(Figure.JUNIOR, (0.3, -0.3), pi / 2, 0.05, chosen=True),
    ),
    ring=0.77,
    caption="bout 3, 1.2 s",
)


def text(ground: PlanView | Senses, columns: int, rows: int, *, braille: bool = True) -> list[str]:
    return [line.plain for line in drawn(ground, columns, rows, braille=braille)]


@pytest.mark.parametrize(("columns", "rows"), [(24, 14), (60, 20), (3, 2), (200, 5), (1, 1), (0, 0)])
@pytest.mark.parametrize("braille", [True, False])
@pytest.mark.parametrize("ground", [RING, Senses((True, False), (False, False), (False, True)), PlanView(())])
def test_it_fills_the_room_and_no_more(ground: PlanView | Senses, columns: int, rows: int, *, braille: bool) -> None:
    lines = text(ground, columns, rows, braille=braille)
    assert len(lines) == (rows if columns else 0)
    if isinstance(ground, PlanView):
        assert all(len(line) <= columns for line in lines)
    if not braille:
        assert all(line.isascii() for line in lines)


def test_everybody_is_where_he_is() -> None:
    lines = text(RING, 40, 21)
    (junior,) = [(row, line.index("J")) for row, line in enumerate(lines[:-1]) if "J" in line]
    (opponent,) = [(row, line.index("O")) for row, line in enumerate(lines[:-1]) if "O" in line]
    assert junior[0] > opponent[0]
    assert junior[1] > opponent[1]
    assert lines[junior[0]][junior[1] + 1] == "↑"
    assert lines[opponent[0]][opponent[1] + 1] == "→"
    assert lines[-1] == "bout 3, 1.2 s"


def test_a_ring_is_round() -> None:
    canvas = Canvas(40, 40, (-1.0, -1.0, 1.0, 1.0), braille=True)
    canvas.circle(0.0, 0.0, 1.0)
    lines = [line.plain for line in canvas.lines()]
    used = [row for row, line in enumerate(lines) if line.strip()]
    width = max(len(line.rstrip()) - len(line) + len(line.lstrip()) for line in lines)
    assert len(used) * 2 == pytest.approx(width, abs=2)


def test_the_chosen_one_is_in_front() -> None:
    there = (0.0, 0.0)
    bodies = (Body(Figure.RANGER, there, None, 0.02, chosen=True), Body(Figure.WILD, there, None, 0.02))
    assert "R" in "".join(text(PlanView(bodies), 20, 10))


def test_what_is_sensed_is_in_capitals() -> None:
    lines = "\n".join(text(Senses((True, False), (False, False), (False, True)), 40, 10))
    assert "SEES" in lines
    assert "sees" in lines
    assert "EDGE" in lines
    assert "TOUCH" not in lines
