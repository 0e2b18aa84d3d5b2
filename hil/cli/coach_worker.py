"""One of several coachings, in a worker: where it leaves what, and what is told of it."""

from __future__ import annotations

import json
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from firmware_protocol.errors import HilError
from firmware_protocol.messages import BoutOutcome
from hil.cli import common
from hil.cli.running import ActiveRun
from hil.cli.workers import PartStage
from hil.jobs.coach import CoachJob, Outputs
from hil.mcaplog.errors import LogError
from hil.sumo.team import LATELY, CoachedRun
from hil.working import WorkerError, interruptible
from hil.working.processes import tell

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hil.jobs.team import RunOrder
    from hil.sumo.bouts import Bout
    from hil.sumo.coaching import Checkpoint
    from hil.sumo.ring import Encounter
    from pal_advisor.maneuvers import Credit, GenerationRecord, Performance, Trial


@dataclass(frozen=True)
class RunTask:
    """A coaching for a worker.

    Attributes:
        order: What is wanted.
        folder: Where its log and its checkpoint go, as `run-2.mcap` and `run-2.json`; None for nowhere.
        sent: That folder is on another machine, perhaps: they are sent back.
        logged: A log is wanted.
        saved: The checkpoint that is gone on from; None begins anew.
    """

    order: RunOrder
    folder: Path | None
    logged: bool
    saved: bytes | None = None
    sent: bool = False


@dataclass(frozen=True)
class SentRun(CoachedRun):
    """What came of a coaching, with the files that it has left where nobody keeps them.

    Attributes:
        files: What is in them, by name.
    """

    files: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def alone(self) -> CoachedRun:
        """What came of it, without the files."""
        return CoachedRun(**{name: value for name, value in vars(self).items() if name != "files"})


class RunWatcher:
    """Observes a coaching, remembers how its bouts ended, and tells whoever looks on how far it is.

    Args:
        order: What is wanted.

    Attributes:
        outcomes: How its bouts ended, as `BoutOutcome`, in order.
    """

    def __init__(self, order: RunOrder) -> None:
        self.outcomes: list[int] = []
        self._place = order.number - 1
        self._settings = order.settings
        self._done = 0.0

    def decision(self, trial: Trial) -> None:
        """It counts when it was performed."""

    def credit(self, credit: Credit) -> None:
        """It tells nothing of bouts."""

    def checkpoint(self, used: int, digest: str) -> None:
        """It tells nothing of bouts."""

    def resumed(self, saved: Checkpoint) -> None:
        """It goes on from there."""
        self._done = saved.pal.seconds if self._settings.robot_time else saved.pal.used

    def trial(
        self,
        trial: Trial,  # noqa: ARG002
        encounter: Encounter,  # noqa: ARG002
        performance: Performance,
        fitness: float,  # noqa: ARG002
    ) -> None:
        """Tell how far it is."""
        self._done += performance.performed if self._settings.robot_time else 1
        lately = self.outcomes[-LATELY:]
        won = lately.count(BoutOutcome.WIN) / len(lately) if lately else -1.0
        tell(self._place, self._done / (self._settings.robot_time or self._settings.budget), won)

    def generation(self, record: GenerationRecord) -> None:
        """It tells nothing of bouts."""

    def bout(self, bout: Bout) -> None:
        """Remember a bout."""
        self.outcomes.append(int(bout.outcome))

    def interrupted(self, bout: int, error: str) -> None:
        """The bout is begun again."""


def coach_run(task: RunTask) -> CoachedRun:
    """Coach, in a worker; its log is made small, that of the first with all there is to see.

    Args:
        task: What.

    Raises:
        WorkerError: It ended by an error, or the log could not be written.
    """
    if task.folder is None or not task.sent:
        return _coached(task, task.folder)
    with TemporaryDirectory(prefix="hil-coach-") as name:
        folder = Path(name)
        run = _coached(task, folder)
        return SentRun(**vars(run), files={path.name: path.read_bytes() for path in sorted(folder.iterdir())})


def make_small(log: Path, *, slim_too: bool) -> None:
    """Make a log small in its place; where that can't be done, as on a disk that is full, it stays as it is.

    Args:
        log: The log.
        slim_too: What running it again does not need is left out.
    """
    from hil.mcaplog.making.slimming import QUICK, pack, slim  # noqa: PLC0415 - it loads all that reads logs

    small = log.with_suffix(".small")
    try:
        (slim if slim_too else pack)(log, small, level=QUICK, overwrite=True)
        small.replace(log)
    except (LogError, OSError):
        with suppress(OSError):
            small.unlink(missing_ok=True)


def _coached(task: RunTask, folder: Path | None) -> CoachedRun:
    """Coach, and leave files in a folder."""
    order = task.order
    place = None if folder is None else folder / f"run-{order.number}"
    log = place.with_suffix(".mcap") if place is not None and task.logged else None
    run = ActiveRun(None, log, overwrite=True)  # in the run's own folder: left behind by a worker that has died
    watcher = RunWatcher(order)
    job = CoachJob(
        settings=order.settings,
        choose_objective=False,
        choose_mirror=False,
        measure_wheels=False,
        opponent=order.opponent,
        held_out=0,
        seed=order.seed,
        reconnect=0.0,
        saved=task.saved,
        outputs=Outputs(
            checkpoint=None if place is None else place.with_suffix(".json"), resumed=watcher.resumed, observers=(watcher,)
        ),
    )
    console = common.plain_console(stderr=True, quiet=True)
    try:
        stage = PartStage(run, job, order.url, console, quiet=True, beside=False)
        with interruptible(), closing(stage):
            coached = job.perform(stage)
        if log is not None and not run.failures:
            make_small(log, slim_too=order.number > 1)
    except (HilError, OSError) as error:
        raise WorkerError(f"run {order.number}: {common.in_words(error)}", common.status_of(error)) from None
    if run.failures:
        raise WorkerError(f"run {order.number}: {'; '.join(run.failures)}", common.EXIT_FILE)
    pal, progress = coached.coaching.pal, coached.coaching.progress
    return CoachedRun(
        seed=order.seed,
        maneuvers=pal.used,
        bouts=progress.bouts,
        wins=progress.wins,
        losses=progress.losses,
        robot_seconds=progress.robot_seconds,
        json=json.dumps(coached.coaching.advice().to_dict(), sort_keys=True),
        digest=pal.digest,
        outcomes=tuple(watcher.outcomes),
    )
