"""What is drawn on a terminal over and over while something goes on: gone while the program is stopped, and afterwards."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING, Self

from hil.terminal.suspending import around_stop

if TYPE_CHECKING:
    from rich.console import Console
    from rich.live import Live
    from rich.progress import Progress


class LiveDisplay:
    """Draws from the beginning of its `with` block to the end, where there is a terminal.

    Args:
        console: Where to.
        drawn: What draws.
        quiet: Show nothing.
    """

    def __init__(self, console: Console, drawn: Live | Progress, *, quiet: bool) -> None:
        self._console = console
        self._quiet = quiet
        self._alive = console.is_terminal and not quiet
        self._drawn = drawn
        self._shown = ExitStack()

    def __enter__(self) -> Self:
        if self._alive:
            self._shown.enter_context(self._drawn)
            self._shown.enter_context(around_stop(self._drawn.stop, self._drawn.start))
        return self

    def __exit__(self, *_: object) -> None:
        self._shown.close()
