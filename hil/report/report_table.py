"""Tables of a report, and texts short enough for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

MOST_ROWS: Final = 300
LONGEST_CELL: Final = 2000


@dataclass(frozen=True)
class ReportTable:
    """A table; of many rows it has the first, of a long text the beginning.

    Attributes:
        title: What it shows.
        head: Column names.
        rows: Cells, as text; one row each.
        numbers: Columns that hold numbers.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        more = len(self.rows) - MOST_ROWS
        rows = tuple(tuple(shortened(cell) for cell in row) for row in self.rows[:MOST_ROWS])
        if more > 0:
            rows = (*rows, (f"… and {more:,} more", *("" for _ in self.head[1:])))
        object.__setattr__(self, "rows", rows)


def shortened(text: str, most: int = LONGEST_CELL) -> str:
    """The beginning of a text, where it is long."""
    return text if len(text) <= most else text[: most - 1] + "…"


def counted(number: int, one: str, several: str) -> str:
    """A number and what it counts.

    Args:
        number: How many.
        one: What one of them is called.
        several: What several are.
    """
    return f"{number:,} {one if number == 1 else several}"
