"""A plane seen from above, drawn in characters: dots of Braille, two by four in each, or plain ASCII."""

from __future__ import annotations

from math import ceil, cos, pi, sin
from typing import TYPE_CHECKING, Final

from rich.text import Text

from hil.cockpit.snapshot import Body, Figure, PlanView, Senses

if TYPE_CHECKING:
    from collections.abc import Callable

_WIDE, _HIGH = 2, 4
"""Dots of a character."""
_BRAILLE: Final = 0x2800
_BITS: Final = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""Of the dots of a character, by row and column, from the top."""
_ARROWS: Final = "→↗↑↖←↙↓↘"
_ARROWS_ASCII: Final = ">/^\\</v\\"
STYLES: Final = {
    Figure.JUNIOR: "bold green",
    Figure.OPPONENT: "bold red",
    Figure.RANGER: "bold cyan",
    Figure.WILD: "bold magenta",
    Figure.BOX: "bold yellow",
    Figure.GOAL: "yellow",
    Figure.ROBOT: "bold",
}
CHOSEN: Final = "reverse"
TRAIL: Final = "dim"


class Canvas:
    """Characters on which a plane is drawn to scale, x to the right and y up.

    Args:
        columns: How many there are.
        rows: Likewise.
        bounds: Least x and y, greatest x and y that have to fit, in m.
        braille: Characters may be those of Braille; else ASCII.
    """

    def __init__(self, columns: int, rows: int, bounds: tuple[float, float, float, float], *, braille: bool) -> None:
        self._columns, self._rows = max(1, columns), max(1, rows)
        self._braille = braille
        left, bottom, right, top = bounds
        wide, high = self._columns * _WIDE - 1, self._rows * _HIGH - 1
        self.scale = min(wide / max(right - left, 1e-3), high / max(top - bottom, 1e-3))
        """Dots for a metre."""
        self._x = (left + right) / 2 - wide / 2 / self.scale
        self._y = (bottom + top) / 2 + high / 2 / self.scale
        self._dots = [[0] * self._columns for _ in range(self._rows)]
        self._dot_styles = [[""] * self._columns for _ in range(self._rows)]
        self._letters: dict[tuple[int, int], tuple[str, str]] = {}

    def dot(self, x: float, y: float, style: str = "") -> None:
        """Set one dot.

        Args:
            x: Where, in m; y likewise.
            y: See x.
            style: Of its character, where nothing else is in it.
        """
        across, down = round((x - self._x) * self.scale), round((self._y - y) * self.scale)
        column, row = across // _WIDE, down // _HIGH
        if 0 <= column < self._columns and 0 <= row < self._rows:
            self._dots[row][column] |= _BITS[down % _HIGH][across % _WIDE]
            self._dot_styles[row][column] = style or self._dot_styles[row][column]

    def circle(self, x: float, y: float, radius: float, style: str = "") -> None:
        """Draw a circle; see `dot`."""
        steps = max(8, ceil(2 * pi * radius * self.scale))
        for step in range(steps):
            angle = 2 * pi * step / steps
            self.dot(x + radius * cos(angle), y + radius * sin(angle), style)

    def letters(self, x: float, y: float, text: str, style: str) -> None:
        """Write characters, the first where a point is, in front of all dots; see `dot`."""
        column, row = round((x - self._x) * self.scale) // _WIDE, round((self._y - y) * self.scale) // _HIGH
        for at, letter in enumerate(text):
            if 0 <= column + at < self._columns and 0 <= row < self._rows:
                self._letters[row, column + at] = (letter, style)

    def lines(self) -> list[Text]:
        """What was drawn, from the top."""
        found = []
        for row in range(self._rows):
            text = Text(no_wrap=True, end="")
            for column in range(self._columns):
                letter, style = self._letters.get((row, column), ("", ""))
                if not letter and (dots := self._dots[row][column]):
                    letter, style = self._dotted(dots), self._dot_styles[row][column]
                text.append(letter or " ", style)
            found.append(text)
        return found

    def _dotted(self, dots: int) -> str:
        if self._braille:
            return chr(_BRAILLE + dots)
        return ":" if dots & 0x1B and dots & 0xE4 else "'" if dots & 0x1B else "."


def drawn(ground: PlanView | Senses, columns: int, rows: int, *, braille: bool) -> list[Text]:
    """Draw what there is to see, its caption below.

    Args:
        ground: What there is to see.
        columns: How many characters wide.
        rows: Likewise, high.
        braille: Characters may be those of Braille; else ASCII.

    Returns:
        So many lines.
    """
    if rows < 2 or columns < 1:
        return [Text()] * rows if columns > 0 else []
    caption = Text(ground.caption[:columns], "dim", no_wrap=True)
    if isinstance(ground, Senses):
        return [*_sensing(ground, columns, rows - 1, braille=braille), caption]
    left, bottom, right, top = ground.bounds
    canvas = Canvas(columns, rows - 1, (left, bottom, right, top), braille=braille)
    if ground.ring:
        canvas.circle(0.0, 0.0, ground.ring)
    for x, y in ground.trail:
        canvas.dot(x, y, TRAIL)
    arrows = _ARROWS if braille else _ARROWS_ASCII
    for body in sorted(ground.bodies, key=lambda body: body.chosen):
        _draw_body(canvas, body, arrows)
    return [*canvas.lines(), caption]


def _draw_body(canvas: Canvas, body: Body, arrows: str) -> None:
    x, y = body.position
    style = f"{STYLES[body.figure]}{f' {CHOSEN}' if body.chosen else ''}"
    if body.radius * canvas.scale >= _HIGH:
        canvas.circle(x, y, body.radius, STYLES[body.figure])
    mark = body.figure.value
    if body.heading is not None and body.radius * canvas.scale >= _WIDE:
        mark += arrows[round(body.heading / (pi / 4)) % 8]
    canvas.letters(x, y, mark, style)


def _sensing(senses: Senses, columns: int, rows: int, *, braille: bool) -> list[Text]:
    """A robot from above, and round it what it senses: in capitals and reversed where there is something."""

    def word(name: str, there: bool) -> tuple[str, str]:  # noqa: FBT001 - one of two
        return (name.upper(), f"bold {CHOSEN}") if there else (name, "dim")

    corners = "┌┐└┘─│" if braille else "++++-|"
    width = 9
    left, right = 12, 12
    beside: list[Callable[[int], tuple[str, bool]]] = [
        lambda side: ("sees", senses.eyes[side]),
        lambda side: ("edge", senses.off_ring[side]),
        lambda side: ("touch", senses.arms[side]),
    ]
    body = (
        corners[0] + corners[4] * 3 + "^" + corners[4] * 3 + corners[1],
        corners[5] + "eyes".center(width - 2) + corners[5],
        corners[5] + "floor".center(width - 2) + corners[5],
        corners[5] + "arms".center(width - 2) + corners[5],
        corners[2] + corners[4] * (width - 2) + corners[3],
    )
    lines: list[Text] = []
    for at, part in enumerate(body):
        line = Text(no_wrap=True)
        for side, room in ((0, left), (1, right)):
            if side:
                line.append(part, "bold green")
            if 1 <= at <= len(beside):
                text, style = word(*beside[at - 1](side))
                pad = " " * (room - len(text) - 1)
                line.append(f"{pad}" if not side else " ")
                line.append(text, style)
                line.append(" " if not side else pad)
            else:
                line.append(" " * room)
        lines.append(line)
    indent = max(0, (columns - left - right - width) // 2)
    above = max(0, (rows - len(lines)) // 2)
    placed = [Text()] * above + [Text(" " * indent).append_text(line) for line in lines]
    return (placed + [Text()] * rows)[:rows]
