"""The conditions that suit a group best are looked for: one search for each seed, one after the other."""

from __future__ import annotations

from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from math import isnan
from typing import TYPE_CHECKING, Any, ClassVar, Final

from hil.jobs.options import MOST_SEED
from hil.jobs.session import CHECKPOINT, attach, begin_log, note_cut_short
from hil.jobs.words import nothing
from hil.mcaplog.records import SurroundEvaluationRecord
from hil.swarm.missions.evolving.checkpoint import (
    RESULT,
    EvolutionCheckpoint,
    evolution_of,
    read_search,
    search_dict,
)
from hil.swarm.missions.evolving.evaluation import EvaluationResult, evaluate
from hil.swarm.missions.evolving.evolution import Evolution
from hil.swarm.missions.surround_checkpoint import MOST_SEEDS
from hil.swarm.missions.surround_settings import SurroundSettings
from hil.terminal.bars import bar
from hil.working import WorkerError
from hil.working.recorded import Recorded
from pal_advisor.fields import is_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from typing import Self

    from rich.console import Console

    from hil.jobs.stage import Stage
    from hil.recording.recorder import Recorder
    from pal_advisor.fields import Fields
    from pal_advisor.surround.search import Generation, SearchSettings

SAVE_EVERY: Final = 20
"""Evaluations between two checkpoints, besides those at the end of a generation."""


@dataclass(frozen=True)
class EvolutionOutputs:
    """Where searches leave what; by default nowhere.

    Attributes:
        checkpoint: Writes the checkpoint.
        cut: Is told that they are cut short, and how far they had come.
        resumed: Is told what is gone on from.
        failed: Is told why evaluations could not be had.
    """

    checkpoint: Callable[[bytes], object] = nothing
    failed: Callable[[str], None] = nothing
    cut: Callable[[EvolutionCheckpoint], None] = nothing
    resumed: Callable[[EvolutionCheckpoint], None] = nothing


@dataclass(frozen=True)
class EvolveJob:
    """Searches among the conditions of the surround task.

    Attributes:
        settings: How runs go.
        search: How the searches go.
        seed: Seed of the first search.
        seeds: How many.
        saved: The checkpoint that is gone on from; None begins anew.
        outputs: Where it leaves what.
    """

    VERB: ClassVar[str] = "swarm surround --evolve"

    settings: SurroundSettings
    search: SearchSettings
    seed: int = 1
    seeds: int = 1
    saved: bytes | None = None
    outputs: EvolutionOutputs = field(default=EvolutionOutputs(), compare=False)

    @property
    def reconnect(self) -> float:
        """Nobody is waited for: every run has robots of its own."""
        return 0.0

    def options(self) -> dict[str, Any]:
        """Everything that decides, but for the checkpoint."""
        return {
            "settings": self.settings.to_dict(),
            "search": search_dict(self.search),
            "seed": self.seed,
            "seeds": self.seeds,
        }

    def files(self) -> dict[str, bytes]:
        """The checkpoint that it begins with."""
        return {} if self.saved is None else {CHECKPOINT: self.saved}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:
        """As a log has it; see `Job.of_log`."""
        return cls(
            settings=SurroundSettings.from_fields(options.table("settings")),
            search=read_search(options.table("search")),
            seed=options.integer("seed", 0, MOST_SEED),
            seeds=options.integer("seeds", 1, MOST_SEEDS),
            saved=files.get(CHECKPOINT),
        )

    def perform(self, stage: Stage) -> list[Evolution]:
        """Make all searches.

        Args:
            stage: The outside.

        Returns:
            The searches; the last one is not finished where evaluations could not be had.

        Raises:
            EvolutionCheckpointError: What is to be gone on from is of another version.
            KeyboardInterrupt: The operator asked for it.
        """
        with ExitStack() as stack:
            return _Searches(self, stage, begin_log(stack, stage)).make()


class _Searches:
    """All searches of a run.

    Args:
        job: What was asked for.
        stage: The outside.
        recorder: Writes the log; None where there is none.
    """

    def __init__(self, job: EvolveJob, stage: Stage, recorder: Recorder | None) -> None:
        self._job = job
        self._stage = stage
        self._recorder = recorder
        saved = None if job.saved is None else evolution_of(job.saved)
        self._settings, self._search = (job.settings, job.search) if saved is None else (saved.settings, saved.search)
        self._seed, self._seeds = (job.seed, job.seeds) if saved is None else (saved.seed, saved.seeds)
        self._begun: list[Evolution] = [] if saved is None else list(saved.begun)
        self._seconds = 0.0
        self._unsaved = 0
        if saved is not None:
            job.outputs.resumed(saved)

    @property
    def checkpoint(self) -> EvolutionCheckpoint:
        """How far they have come."""
        return EvolutionCheckpoint(self._settings, self._search, self._seed, self._seeds, tuple(self._begun))

    def make(self) -> list[Evolution]:
        """Make all that are left."""
        if self._recorder is not None:
            facts = {name: str(value) for name, value in search_dict(self._search).items()}
            self._recorder.metadata("search", {**facts, "steps": str(self._settings.steps)})
        self._save()
        try:
            with showing(self._stage.console, quiet=self._stage.quiet) as show:
                for evolution in self._all():
                    self._go_on(evolution, show)
        except (WorkerError, KeyboardInterrupt) as error:
            self._save()
            note_cut_short(self._recorder, error)
            self._attach()
            self._job.outputs.cut(self.checkpoint)
            if isinstance(error, KeyboardInterrupt) or not self.checkpoint.evaluations:
                raise
            self._job.outputs.failed(str(error))
            return self._begun
        self._attach()
        if self._recorder is not None:
            self._recorder.note("result", "done", seeds=[evolution.seed for evolution in self._begun])
        return self._begun

    def _all(self) -> Iterator[Evolution]:
        """The searches in order: what was evaluated before is told to the log again, then they go on."""
        begun, self._begun = self._begun, []
        for number in range(self._seeds):
            before = begun[number] if number < len(begun) else None
            evolution = Evolution(self._settings, self._search, self._seed + number)
            self._begun.append(evolution)
            for each in before.done if before is not None else ():
                self._take(evolution, each.result, told=False)
            yield evolution

    def _go_on(self, evolution: Evolution, show: Callable[[Evolution], None]) -> None:
        show(evolution)
        while not evolution.finished:
            tasks = [evolution.task_of(wanted) for wanted in evolution.wanted]
            before = self.checkpoint.evaluations
            for result in self._stage.results(evaluate, tasks, RECORDED, before):
                self._take(evolution, result)
                show(evolution)
        if self._recorder is not None:
            self._recorder.search_over(evolution)
        self._save()

    def _take(self, evolution: Evolution, result: EvaluationResult, *, told: bool = True) -> None:
        """Take in a result."""
        generation: Generation | None = evolution.tell(result)
        self._seconds += result.seconds
        if self._recorder is not None:
            self._recorder.now = self._seconds
            self._recorder.evaluated(evolution)
            if generation is not None:
                self._recorder.search_generation(evolution, generation)
        self._unsaved += 1
        if told and (generation is not None or self._unsaved >= SAVE_EVERY):
            self._save()

    def _save(self) -> None:
        self._unsaved = 0
        self._job.outputs.checkpoint(self.checkpoint.to_bytes())

    def _attach(self) -> None:
        """Put into the log how far they have come: whoever has it can go on from there."""
        attach(self._recorder, CHECKPOINT, self.checkpoint.to_bytes())


def _result_of(entry: object) -> EvaluationResult | None:
    """The result that an entry of a log tells of."""
    if not isinstance(entry, SurroundEvaluationRecord):
        return None
    values = {name: getattr(entry, name) for name in RESULT}
    values = {name: None if isinstance(value, float) and isnan(value) else value for name, value in values.items()}
    known = [value for value in values.values() if value is not None]
    if values["seconds"] is None or not all(is_number(value) and value >= 0.0 for value in known):
        return None
    return EvaluationResult(**values)


RECORDED: Final = Recorded("/surround/evaluation", _result_of)
"""How a log tells of evaluations."""


@contextmanager
def showing(console: Console, *, quiet: bool) -> Iterator[Callable[[Evolution], None]]:
    """Inside, a bar shows on a terminal how far a search is, and elsewhere a line now and then; gives what is told of it.

    Args:
        console: Where.
        quiet: Show nothing.
    """
    alive = console.is_terminal and not quiet
    with bar(console, shown=alive) as progress:
        task = progress.add_task("evaluations")
        lines = _Lines(console)

        def show(evolution: Evolution) -> None:
            said = _said(evolution)
            if alive:
                progress.update(task, total=evolution.expected, completed=len(evolution.done), description=said)
            elif not quiet:
                lines.show(evolution, said)

        yield show


class _Lines:
    """A line for every fifth part of a search, where there is no terminal."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._said = (-1, -1)

    def show(self, evolution: Evolution, said: str) -> None:
        """How a search stands."""
        done, expected = len(evolution.done), max(1, evolution.expected)
        reached = evolution.seed, 5 * done // expected
        if done and reached != self._said:
            self._console.print(f"{done}/{expected} evaluations, {said}", markup=False)
        self._said = reached


def _said(evolution: Evolution) -> str:
    if not evolution.generations:
        return f"seed {evolution.seed}"
    last = evolution.generations[-1]
    return f"seed {evolution.seed}: generation {last.number}, best {last.best:.3f}, mean {last.mean:.3f}"
