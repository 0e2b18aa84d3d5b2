"""An address as a QR code on the terminal, for the camera of a phone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from rich.text import Text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

QUIET_ZONE: Final = 4
"""Modules that are left free around the code, as ISO/IEC 18004 asks."""
_HALVES: Final = {(False, False): " ", (True, False): "▀", (False, True): "▄", (True, True): "█"}
"""Two modules, one above the other, by which of them are dark."""
COLORS: Final = "rgb(0,0,0) on rgb(255,255,255)"
"""Dark on light whatever the terminal's own colours are: not every camera reads the inverse."""


def show_qr(address: str, console: Console) -> None:
    """Print the code of an address, where the terminal can show one: it has colours, block characters, and room.

    Args:
        address: The address.
        console: Where.
    """
    plain = console.color_system is None or console.no_color
    if not console.is_terminal or plain or not console.encoding.startswith("utf"):
        return
    lines = halves(_modules(address))
    if lines and len(lines[0]) <= console.width:
        for line in lines:
            console.print(Text(line, style=COLORS, no_wrap=True))


def _modules(address: str) -> list[tuple[bool, ...]]:
    """The rows of the code, dark modules being true; none where what makes it is not installed."""
    try:
        import segno  # noqa: PLC0415 - only where it is shown
    except ImportError:
        return []
    code = segno.make_qr(address, error="l")
    return [tuple(map(bool, row)) for row in code.matrix_iter(border=QUIET_ZONE)]


def halves(rows: Sequence[Sequence[bool]]) -> list[str]:
    """Rows of modules as lines of block characters, two rows a line.

    Args:
        rows: Dark modules are true.
    """
    even = [*rows, (False,) * len(rows[0])] if len(rows) % 2 else rows
    return ["".join(_HALVES[pair] for pair in zip(*pairs, strict=True)) for pairs in zip(even[::2], even[1::2], strict=True)]
