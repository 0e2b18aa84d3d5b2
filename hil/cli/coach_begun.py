"""Several coachings that were begun together, and are gone on with together."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from hil import runs
from hil.cli import common
from hil.doors import Door
from hil.going_on import can_go_on, successor
from hil.jobs.team import TeamJob
from hil.sumo.advice_file import DOOR as ADVICE
from hil.sumo.coaching import DOOR as CHECKPOINT
from hil.sumo.coaching import CheckpointError
from pal_advisor.fields import FieldError, Fields

if TYPE_CHECKING:
    import typer

DOOR: Final = Door("list of runs", CheckpointError, largest=1 << 20)
LEARNS_BY: Final = ("seed", "budget", "objective", "phases", "pairs", "mirror", "end_on_change", "period", "vary")
"""Options that decide how a run learns."""
BEGUN_WITH: Final = ("runs", *LEARNS_BY, "held_out")
"""Options that runs are begun with."""


def check_begun(context: typer.Context, begun: BegunTeam) -> None:
    """See that nothing is asked of runs that are gone on with that they were not begun with.

    Args:
        context: The command line.
        begun: The runs.

    Raises:
        UsageError: Something is.
    """
    for name in BEGUN_WITH:
        if common.was_given(context, name):
            option = f"--{name.replace('_', '-')}"
            raise common.UsageError(f"the runs in {begun.source.parent} go on as they were begun: leave out {option}")


@dataclass(frozen=True)
class BegunTeam:
    """Runs that were begun together, and are to be gone on with.

    Attributes:
        job: What was asked for then.
        source: The file that says so.
    """

    job: TeamJob
    source: Path

    def checkpoint(self, number: int) -> bytes | None:
        """What a run has saved; None where it saved nothing.

        Args:
            number: Its number, from 1.
        """
        path = self.source.with_name(f"run-{number}.json")
        return CHECKPOINT.read(path) if path.exists() else None


def begun_team(*, resume: bool, resume_from: Path | None, opponent: str | None) -> BegunTeam | None:
    """Runs that are to be gone on with; None where one run is, or none.

    Args:
        resume: The newest coaching on emulated robots that did not finish.
        resume_from: This one.
        opponent: Against whom; None is anybody.

    Raises:
        CheckpointError: What was begun can't be read.
    """
    if resume_from is not None:
        return _begun(resume_from / runs.TEAM) if (resume_from / runs.TEAM).is_file() else None
    if not resume:
        return None
    found = [run for run in runs.all_runs() if run.record.verb == "coach" and not run.record.link]
    for run in found:
        fits = run.state != runs.RUNNING and opponent in {None, run.record.opponent}
        if fits and can_go_on(run) and successor(run, found) is None:
            return None if run.team is None else _begun(run.team)
    return None


def _begun(path: Path) -> BegunTeam:
    document = DOOR.document(path, json=True)
    try:
        fields = Fields(document.data)
        given = path.with_name(runs.GIVEN)
        job = TeamJob.of_log(fields, {runs.GIVEN: ADVICE.read(given)} if given.is_file() else {})
        fields.done()
    except FieldError as error:
        raise document.wrong("", f"this list of runs is damaged: {error}") from error
    return BegunTeam(job, path)
