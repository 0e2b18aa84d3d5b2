"""The display of several coachings on a terminal: a bar for each, one for the team exam, one for the bouts afterwards."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from rich.live import Live
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from hil.terminal.live_display import LiveDisplay

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rich.console import Console

EXAM: Final = "Team exam"
BOUTS: Final = "Bouts from fresh poses"
LATER: Final = (EXAM, BOUTS)
"""What comes when the runs are over."""


class TeamDisplay(LiveDisplay):
    """Shows how far several coachings are, and what is made of them. A context manager.

    Args:
        console: Where to.
        runs: How many there are.
        read: What a run, by its place from 0, has told last: how far it is, 0..1, and the share of its last bouts that it
            won, below 0 where there was none; None where none of them can tell.
        quiet: Show nothing.
    """

    def __init__(self, console: Console, runs: int, read: Callable[[int], Sequence[float]] | None, *, quiet: bool) -> None:
        self._read = read
        self._over: set[int] = set()
        columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()
        self._progress = Progress(*columns, TextColumn("{task.fields[note]}"), console=console)
        self._runs = [self._progress.add_task(f"Run {number}", total=1.0, note="") for number in range(1, runs + 1)]
        self._later = {name: self._progress.add_task(name, total=None, start=False, visible=False, note="") for name in LATER}
        live = Live(console=console, refresh_per_second=4, transient=True, get_renderable=self._render)
        super().__init__(console, live, quiet=quiet)

    def run_over(self, place: int) -> None:
        """A run is over.

        Args:
            place: Its place, from 0.
        """
        self._over.add(place)
        self._progress.update(self._runs[place], completed=1.0, note="")

    def examined(self, bouts: int, most: int) -> None:
        """Bouts of the team exam are over.

        Args:
            bouts: How many so far.
            most: How many there will be, at the most.
        """
        self._advance(EXAM, bouts, most)

    def played(self, bouts: int, total: int) -> None:
        """Bouts with the advice, or at random, are over.

        Args:
            bouts: How many so far.
            total: Of how many.
        """
        self._progress.update(self._later[EXAM], visible=False)
        self._advance(BOUTS, bouts, total)

    def _advance(self, name: str, done: int, total: int) -> None:
        for task in self._runs:
            self._progress.update(task, visible=False)
        self._progress.start_task(self._later[name])
        self._progress.update(self._later[name], visible=True, completed=done, total=max(1, total), note=f"{done} bouts")

    def _render(self) -> Progress:
        for place, task in enumerate(self._runs):
            if self._read is not None and place not in self._over:
                share, won = self._read(place)
                lately = f"won {won:.0%} of its last bouts" if share > 0.0 and won >= 0.0 else ""
                self._progress.update(task, completed=share, note=lately)
        return self._progress
