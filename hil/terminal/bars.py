"""A bar that shows on a terminal how far something has come."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from hil.terminal.suspending import around_stop

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console


@contextmanager
def bar(console: Console, *, shown: bool) -> Iterator[Progress]:
    """Inside, there is a bar, which gives the terminal back while the program is stopped, and is gone afterwards.

    Args:
        console: Where.
        shown: It is to be seen.

    Yields:
        The bar, without a task yet.
    """
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with (
        Progress(*columns, console=console, disable=not shown, transient=True) as progress,
        around_stop(progress.live.stop, progress.start),
    ):
        yield progress
