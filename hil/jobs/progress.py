"""The display of a coaching run: a bar and a table on a terminal, a line now and then elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from firmware_protocol.messages import BoutOutcome
from hil.sumo.summary import situation_label
from hil.terminal.live_display import LiveDisplay

if TYPE_CHECKING:
    from rich.console import Console

    from hil.sumo.bouts import Bout
    from hil.sumo.junior import Junior
    from hil.sumo.ring import Encounter
    from pal_advisor.maneuvers import Credit, GenerationRecord, Pal, PalSettings, Performance, Trial

RECENT = 20
LINES = 10


class CoachingDisplay(LiveDisplay):
    """Observes a coaching run and shows it. A context manager.

    Args:
        console: Where to.
        settings: How Pal coaches.
        used: Maneuvers already performed, for a resumed run.
        seconds: Time for which the robot has performed already, in s.
        quiet: Show nothing.
    """

    def __init__(
        self, console: Console, settings: PalSettings, *, used: int = 0, seconds: float = 0.0, quiet: bool = False
    ) -> None:
        self._timed = settings.robot_time > 0.0
        self._budget = round(settings.robot_time) if self._timed else settings.budget
        self._used = used
        self._seconds = seconds
        self._told = self._done
        self._recent: list[bool] = []
        self._latest: dict[tuple[int, int], GenerationRecord] = {}
        self._counts: dict[tuple[int, int], int] = {}
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        self._progress = Progress(*columns, console=console)
        self._task = self._progress.add_task("Coaching", total=self._budget, completed=self._done)
        live = Live(console=console, refresh_per_second=8, transient=True, get_renderable=self._render)
        super().__init__(console, live, quiet=quiet)

    @property
    def _done(self) -> int:
        """What of the budget is used: maneuvers, or s."""
        return round(self._seconds) if self._timed else self._used

    def _unit(self, number: int) -> str:
        return f"{number} {'s of robot time' if self._timed else 'maneuvers'}"

    def headline(self, junior: Junior, opponent: str, pal: Pal) -> None:
        """Say what is about to happen."""
        if self._quiet:
            return
        already = f", {pal.used}{' maneuvers' if self._timed else ' of them'} done already" if pal.used else ""
        self._console.print(
            f"Connected to {junior.description}. Pal coaches it against {opponent}: {self._unit(self._budget)}{already}, "
            f"objective {pal.settings.objective.value}.",
            markup=False,
        )

    def decision(self, trial: Trial) -> None:
        """Show nothing: a maneuver counts when it was performed."""

    def credit(self, credit: Credit) -> None:
        """Show nothing: GP steps tell what comes of it."""

    def checkpoint(self, used: int, digest: str) -> None:
        """Show nothing."""

    def trial(
        self,
        trial: Trial,
        encounter: Encounter,  # noqa: ARG002
        performance: Performance,
        fitness: float,  # noqa: ARG002
    ) -> None:
        """Count a maneuver."""
        self._used += 1
        self._seconds += performance.performed
        self._counts[trial.category] = self._counts.get(trial.category, 0) + 1
        if self._alive:
            what = "Exam" if trial.exam else f"Phase {trial.phase}"
            self._progress.update(self._task, completed=self._done, description=what)
        elif not self._quiet and self._done * LINES // self._budget > self._told * LINES // self._budget:
            self._told = self._done
            best = ", ".join(f"{_name(record)} {record.best:.1f}" for _, record in sorted(self._latest.items()))
            share = f", won {sum(self._recent)} of the last {len(self._recent)} bouts" if self._recent else ""
            self._console.print(
                f"{self._done}/{self._unit(self._budget)}{share}; fitness: {best or 'not rated yet'}", markup=False
            )

    def generation(self, record: GenerationRecord) -> None:
        """Take note of a GP step."""
        self._latest[record.category] = record

    def bout(self, bout: Bout) -> None:
        """Take note of a bout."""
        self._recent = [*self._recent, bout.outcome is BoutOutcome.WIN][-RECENT:]

    def interrupted(self, bout: int, error: str) -> None:
        """Show nothing: whoever tells of the link has said it."""

    def _render(self) -> Group:
        table = Table(box=None, padding=(0, 2))
        for head in ("situation", "maneuvers", "phase", "GP steps", "best", "mean", "best maneuver"):
            table.add_column(head, justify="left" if head in {"situation", "best maneuver"} else "right")
        for category, record in sorted(self._latest.items(), key=lambda item: item[0][::-1]):
            table.add_row(
                _name(record), str(self._counts.get(category, 0)), str(record.phase), str(record.generation + 1),
                f"{record.best:.1f}", f"{record.mean:.1f}", record.maneuver,
            )  # fmt: skip
        won = f"won {sum(self._recent)} of the last {len(self._recent)} bouts" if self._recent else "no bout over yet"
        return Group(self._progress, table, won)


def _name(record: GenerationRecord) -> str:
    return situation_label(*record.category)
