"""Which coaching of one robot is gone on with: by `--resume`, `--resume-from`, or a checkpoint that is named."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil import runs
from hil.cli import common
from hil.cli.coach_begun import LEARNS_BY
from hil.cli.coach_team import budget_of
from hil.going_on import saved_by, successor
from hil.sumo.coaching import DOOR, Checkpoint, load_checkpoint

if TYPE_CHECKING:
    from pathlib import Path

    import typer
    from rich.console import Console

    from hil.cli.running import ActiveRun


class BegunRun:
    """The run that is to be gone on with, if one is.

    Args:
        context: The command line, which knows what was given and what is a default.
        resume: The newest that fits.
        resume_from: This one.
        checkpoint: Where the new run's checkpoint goes: one that is there is gone on from.

    Attributes:
        wanted: A run is to be gone on with.
        source: Its checkpoint, once it is found.
        content: What that file holds.
    """

    def __init__(self, context: typer.Context, *, resume: bool, resume_from: Path | None, checkpoint: Path | None) -> None:
        self._context = context
        self._from = resume_from
        self._checkpoint = checkpoint if resume else None
        self.wanted = resume or resume_from is not None
        self.source: Path | None = None
        self.content: bytes | None = None

    def named(self) -> Checkpoint | None:
        """The one that was named.

        Raises:
            CheckpointError: It can't be read, or is none.
            RunError: The run has none.
            UsageError: Something else is asked for than it was begun with.
        """
        if self._from is not None:
            return self._load(runs.file_of(self._from, runs.CHECKPOINT))
        if self._checkpoint is not None:
            return self._load(self._checkpoint)
        return None

    def newest(self, *, opponent: str | None = None, robot: str | None = None) -> Checkpoint | None:
        """The newest coaching that did not finish, and that no other has gone on from.

        Args:
            opponent: Against whom, where the robot is emulated in this process; None is anybody.
            robot: Unique id of the robot, where it is none of this process.

        Raises:
            RunError: There is none.
            UsageError: Something else is asked for than it was begun with.
        """
        if not self.wanted:
            return None
        found = [run for run in runs.all_runs() if run.record.verb == "coach"]
        of = f"of robot {robot}" if robot else f"against {opponent}" if opponent else "of an emulated robot"
        busy: runs.Run | None = None
        for run in found:
            here = robot is None and not run.record.link
            fits = here and opponent in {None, run.record.opponent} if robot is None else run.record.robot == robot != ""
            if not fits:
                continue
            later = run if run.state == runs.RUNNING else successor(run, found)
            if later is not None:
                busy = busy or (later if later.state == runs.RUNNING else None)
            elif saved_by(run) is not None:
                return self._load(run.saved_to)
        if busy is not None:
            raise runs.RunError(f"the coaching {of} in {busy.folder} goes on already, in process {busy.record.pid}")
        raise runs.RunError(
            f"there is no coaching {of} in {runs.RUNS} that did not finish: begin one without --resume, or name a run's folder "
            "or a checkpoint with --resume-from (hil runs lists the runs)"
        )

    def goes_on_in(self, checkpoint: Path) -> bool:
        """The named checkpoint is the one that is gone on from, and is kept up to date; any other is somebody's file.

        Args:
            checkpoint: Where the new run's checkpoint goes.
        """
        return self.source is not None and self.source.resolve() == checkpoint.resolve()

    def _load(self, path: Path) -> Checkpoint:
        self.content = DOOR.read(path)
        saved = load_checkpoint(path)
        _check_resumed(self._context, saved)
        self.source = path
        return saved

    def of_robot(self, uid: str) -> bytes:
        """The checkpoint of the newest that was begun with this robot; raises as `newest`.

        Args:
            uid: Its unique id.
        """
        saved = self.newest(robot=uid)
        if saved is not None and saved.vary != (self._context.params["vary"] or 0.0):
            raise common.UsageError(f"the coaching to be gone on with was begun with --vary {saved.vary:g}: say so again")
        assert self.content is not None, "none is wanted, and it was looked for all the same"
        return self.content

    def tell(self, saved: Checkpoint, run: ActiveRun, console: Console) -> None:
        """Say what is gone on from.

        Args:
            saved: It.
            run: The run that goes on.
            console: Where to say so.
        """
        run.describe(resumed_from=str(self.source), seed=saved.seed)
        console.print(f"Going on from {self.source}: {saved.pal.used} maneuvers.", markup=False)


def _check_resumed(context: typer.Context, saved: Checkpoint) -> None:
    """See that nothing is asked of a resumed run that it was not begun with: mixed, it would be neither run.

    Args:
        context: The command line, which knows what was given and what is a default.
        saved: The run that was cut.

    Raises:
        UsageError: Something else is asked for.
    """
    settings = saved.pal.settings
    budget = f"{settings.robot_time:g}s" if settings.robot_time else str(settings.budget)
    begun: dict[str, object] = {**settings.to_dict(), "seed": saved.seed, "opponent": saved.opponent, "budget": budget}
    begun["vary"] = saved.vary
    for name in ("opponent", *LEARNS_BY):
        wanted = context.params[name]
        if name == "budget" and wanted is not None and budget_of(wanted) == (settings.budget, settings.robot_time):
            continue
        if common.was_given(context, name) and wanted != begun[name]:
            raise common.UsageError(
                f"the run to be resumed was begun with {name} {begun[name]}, not {wanted}: leave that out, or begin anew "
                "without --resume"
            )
