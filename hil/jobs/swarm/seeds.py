"""RANGERs learn to surround WILDs: the runs of several seeds side by side, by workers, each on an emulated table of its own."""

from __future__ import annotations

from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from firmware_protocol.errors import HilError
from hil.jobs.session import CHECKPOINT, WITHOUT_A_WORD, attach, begin_log, nothing_said
from hil.jobs.swarm.display import LINES
from hil.jobs.swarm.surround import SurroundJob, tables_name
from hil.swarm.missions.surround_checkpoint import SurroundCheckpoint, checkpoint_of
from hil.swarm.missions.surround_run import play
from hil.swarm.missions.tables_file import tables_of, tables_text
from hil.terminal.bars import bar
from pal_advisor.surround import Case

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rich.console import Console

    from hil.jobs.stage import Stage
    from hil.recording.recorder import Recorder
    from hil.swarm.missions.surround import SurroundState
    from hil.swarm.missions.surround_outcome import SurroundOutcome
    from hil.swarm.missions.surround_settings import SurroundSettings
    from hil.working import Crew
    from pal_advisor.surround import Tables


@dataclass(frozen=True)
class SeedTask:
    """A run that is wanted, for a worker.

    Attributes:
        settings: How it goes.
        case: The case that is played.
        seed: Its seed.
        tables: What is gone on from; None: nothing has been learnt.
        own_rings: As of `play`.
        deadline: As of `play`.
    """

    settings: SurroundSettings
    case: Case
    seed: int
    tables: Tables | None
    own_rings: bool
    deadline: float | None


def play_seed(task: SeedTask) -> tuple[list[SurroundState], SurroundOutcome]:
    """Play a run.

    Args:
        task: Which.
    """
    return play(task.settings, task.case, task.seed, tables=task.tables, own_rings=task.own_rings, deadline=task.deadline)


@dataclass(frozen=True)
class SeedsJob(SurroundJob):
    """Runs of the surround task by workers. What comes out, log and all, is the same for any number of them.

    Attributes:
        crew: The workers.
    """

    VERB: ClassVar[str] = "swarm surround --workers"

    crew: Crew | None = field(default=None, compare=False)

    def perform(self, stage: Stage) -> list[SurroundOutcome]:
        """Play all runs.

        Args:
            stage: The outside.

        Returns:
            What came of each.

        Raises:
            MissionError: There is no room for so many robots.
            WorkerError: Runs can't be had.
            KeyboardInterrupt: The operator asked for it.
        """
        with ExitStack() as stack:
            stack.enter_context(stage.interrupts())
            recorder = begin_log(stack, stage)
            runs = _SeedRuns(self, stage, recorder)
            try:
                with nothing_said(recorder):
                    runs.play()
            except WITHOUT_A_WORD:
                raise
            except (HilError, KeyboardInterrupt):
                runs.save()
                runs.attach()
                self.outputs.cut(runs.checkpoint)
                raise
            runs.attach()
            runs.finish()
        return runs.finished


class _SeedRuns:
    """The runs of all seeds.

    Args:
        job: What was asked for.
        stage: The outside.
        recorder: Writes the log; None where there is none.
    """

    def __init__(self, job: SeedsJob, stage: Stage, recorder: Recorder | None) -> None:
        self._job = job
        self._stage = stage
        self._recorder = recorder
        saved = None if job.saved is None else checkpoint_of(job.saved)
        self._settings = job.settings if saved is None else saved.settings
        self._seed, self._seeds = (job.seed, job.seeds) if saved is None else (saved.seed, saved.seeds)
        self.finished: list[SurroundOutcome] = [] if saved is None else list(saved.finished)
        if saved is not None:
            job.outputs.resumed(saved)

    @property
    def checkpoint(self) -> SurroundCheckpoint:
        """How far they have come, in whole runs."""
        return SurroundCheckpoint(self._settings, self._seed, self._seeds, tuple(self.finished))

    def play(self) -> None:
        """Play all that are left."""
        assert self._job.crew is not None, "runs by workers have a crew"
        job, case = self._job, Case.parse(self._settings.case)
        tables = None if job.tables is None else tables_of(job.tables)
        seeds = range(self._seed + len(self.finished), self._seed + self._seeds)
        tasks = [SeedTask(self._settings, case, seed, tables, job.ring != "positions", job.deadline) for seed in seeds]
        if not self._stage.quiet:
            self._stage.say(
                f"{case.rangers} RANGERs are to surround {case.wilds} WILDs: case {case}, {self._settings.steps} steps, "
                f"{len(tasks)} seeds, each on a table of its own."
            )
        self.save()
        with (
            counting_seeds(self._stage.console, self._seeds, len(self.finished), quiet=self._stage.quiet) as count,
            closing(self._job.crew.in_order(play_seed, tasks)) as results,
        ):
            for states, outcome in results:
                self._record(states, outcome)
                self.finished.append(outcome)
                job.outputs.save(outcome.seed, outcome.tables)
                self.save()
                job.outputs.ended(outcome)
                count(outcome)

    def save(self) -> None:
        """Write the checkpoint."""
        self._job.outputs.checkpoint(self.checkpoint.to_bytes())

    def attach(self) -> None:
        """Put into the log how far they have come, and what was learnt: whoever has the log can go on from there."""
        attach(self._recorder, CHECKPOINT, self.checkpoint.to_bytes())
        for outcome in self.finished:
            attach(self._recorder, tables_name(outcome.seed, self._seeds), tables_text(outcome.tables).encode())

    def finish(self) -> None:
        """Put the result into the log."""
        if self._recorder is not None:
            self._recorder.note("result", "done", seeds=[outcome.seed for outcome in self.finished])

    def _record(self, states: Sequence[SurroundState], outcome: SurroundOutcome) -> None:
        """Tell the log of a run: it begins when the one before is over."""
        recorder = self._recorder
        if recorder is None:
            return
        begun = recorder.now
        recorder.series(f"{outcome.case}, seed {outcome.seed}")
        for state in states:
            recorder.now = begun + state.seconds
            recorder.surround_state(state)
        recorder.flush()


@contextmanager
def counting_seeds(console: Console, seeds: int, finished: int, *, quiet: bool) -> Iterator[Callable[[SurroundOutcome], None]]:
    """Inside, a bar shows on a terminal how many runs are over, and elsewhere a line now and then; gives what is told of each.

    Args:
        console: Where.
        seeds: Runs that there are to be.
        finished: Runs that were over before.
        quiet: Show nothing.
    """
    alive = console.is_terminal and not quiet
    with bar(console, shown=alive) as progress:
        task = progress.add_task("seeds", total=seeds, completed=finished)
        done = finished

        def count(outcome: SurroundOutcome) -> None:
            nonlocal done
            done += 1
            distance, share = outcome.history.series["distance"][-1], outcome.last_share
            said = (
                f"seed {outcome.seed}: D {'-' if distance is None else f'{distance:.2f}'}, "
                f"{'-' if share is None else f'{share:.0%}'} surrounded"
            )
            progress.update(task, completed=done, description=said)
            if not alive and not quiet and done * LINES // seeds > (done - 1) * LINES // seeds:
                console.print(f"{done}/{seeds} seeds, {said}", markup=False)

        yield count
