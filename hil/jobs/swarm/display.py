"""The display of a surround mission: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from hil.terminal.live_display import LiveDisplay

if TYPE_CHECKING:
    from rich.console import Console

    from hil.swarm.handle import Swarm
    from hil.swarm.missions.surround import SurroundMission, SurroundState
    from hil.swarm.missions.surround_settings import SurroundSettings
    from pal_advisor.surround import Case

LINES: Final = 5
"""Lines of a run where there is no terminal."""


class SurroundDisplay(LiveDisplay):
    """Observes a surround mission and shows it. A context manager.

    Args:
        console: Where to.
        quiet: Show nothing.
    """

    def __init__(self, console: Console, *, quiet: bool = False) -> None:
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        self._progress = Progress(*columns, console=console, transient=True)
        self._task = self._progress.add_task("steps")
        super().__init__(console, self._progress, quiet=quiet)

    def headline(self, swarm: Swarm, case: Case, settings: SurroundSettings) -> None:
        """Say what is about to happen."""
        if self._quiet:
            return
        networks = len(swarm.networks.bridges)
        where = "" if networks == 1 else f" on {networks} networks"
        self._console.print(
            f"{len(swarm.addresses_by_row)} micro-robots{where}. {case.rangers} RANGERs are to surround {case.wilds} WILDs: "
            f"case {case}, {settings.steps} steps.",
            markup=False,
        )

    def begin(self, seed: int, mission: SurroundMission) -> None:
        """The run of a seed begins, or goes on."""
        self._progress.reset(
            self._task, total=mission.settings.steps, completed=mission.step_number, description=f"seed {seed}"
        )

    def surround_state(self, state: SurroundState) -> None:
        """A step is over."""
        if self._quiet:
            return
        distance = "-" if state.distance is None else f"{state.distance:.2f}"
        share = "-" if state.share_surrounded is None else f"{state.share_surrounded:.0%}"
        said = f"seed {state.seed}: D {distance}, {share} surrounded"
        if self._alive:
            self._progress.update(self._task, completed=state.step, description=said)
        elif state.step and state.step * LINES // state.steps > (state.step - 1) * LINES // state.steps:
            self._console.print(f"step {state.step}/{state.steps}, {said}", markup=False)
