"""`hil swarm surround --evolve`: the conditions that suit a group best are looked for."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from hil import runs
from hil.bridge.clock import MonotonicClock
from hil.cli import common
from hil.cli.run_files import RunFiles
from hil.cli.running import running
from hil.cli.stage import LiveStage
from hil.cli.swarm import options
from hil.cli.swarm.resuming import EVOLVE, CutRun
from hil.jobs.swarm.evolve import EvolutionOutputs, EvolveJob
from hil.swarm.missions.evolving.checkpoint import search_dict
from hil.swarm.missions.evolving.evolution import evolution_document
from hil.swarm.missions.evolving.words import evolution_summary
from hil.terminal.interrupts import interrupts
from pal_advisor.surround import letters
from pal_advisor.surround.search import SEARCHED

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import typer
    from rich.console import Console

    from hil.cli.running import ActiveRun
    from hil.swarm.missions.evolving.checkpoint import EvolutionCheckpoint
    from hil.swarm.missions.evolving.evolution import Evolution
    from hil.swarm.missions.surround_settings import SurroundSettings
    from pal_advisor.surround.search import SearchSettings

STEPS: Final = 20
"""T1 (Table 9.2)."""
OF_A_SEARCH: Final = ("search", "population", "generations", "repeats", "budget")
"""Options that mean something with `--evolve` alone."""
OF_A_RUN: Final = (
    "links", "table_in", "table_out", "require", "place", "ring", "poses", "quorum", "spare", "deadline", "no_fence", "yes",
    "no_input", "reconnect", "signing_key", "live",
)  # fmt: skip
"""Options that mean nothing with it: every run has an emulated table of its own."""
DECIDING: Final = (
    "evolve", "search", "population", "generations", "repeats", "budget", "case", "steps", "order", "sensing", "sectors",
    "feasible", "mutate_after", "no_learning", "r0", "eta", "dr", "gain", "wild_step", "unit", "seed", "seeds",
)  # fmt: skip
"""Options that a search that is gone on with has been begun with."""


@dataclass(frozen=True)
class SearchRequest:
    """A search that is asked for on the command line.

    Attributes:
        context: The command line.
        settings: How runs go.
        search: How the search goes.
        seed: Seed of the first search.
        seeds: How many.
        workers: Processes that play runs.
        scheduler: Address of a Dask scheduler whose workers play them instead.
        resume: Go on with the newest search that did not finish.
        resume_from: Go on with this one.
        checkpoint: Where the checkpoint goes instead of the run's folder.
        report: A report is wanted.
        out: The run's folder.
        log: Where the log goes.
        no_log: No log is wanted.
        overwrite: Named outputs that exist may be replaced.
        as_json: The outcome is wanted as JSON.
        quiet: Nothing but the outcome is wanted.
        config: Configuration file that options were taken from.
    """

    context: typer.Context
    settings: SurroundSettings
    search: SearchSettings
    seed: int
    seeds: int
    workers: int
    scheduler: str | None
    resume: bool
    resume_from: Path | None
    checkpoint: Path | None
    report: bool
    out: Path | None
    log: Path | None
    no_log: bool
    overwrite: bool
    as_json: bool
    quiet: bool
    config: Path | None


def check_unsearched(context: typer.Context) -> None:
    """See that nothing of a search is asked of a run.

    Args:
        context: The command line.

    Raises:
        UsageError: It is.
    """
    for name in _given(context, OF_A_SEARCH):
        raise common.UsageError(f"--{name} is of a search among conditions: it goes with --evolve FITNESS")


def evolve_conditions(asked: SearchRequest, console: Console) -> int:
    """Look for the best conditions, and leave log, checkpoint and report.

    Args:
        asked: What is asked for.
        console: Where words go.

    Returns:
        The exit status.

    Raises:
        UsageError: Options exclude each other.
        WorkerError: Nothing could be evaluated.
        KeyboardInterrupt: The operator asked for it.
    """
    context = asked.context
    for name in _given(context, OF_A_RUN):
        option = "a LINK" if name == "links" else f"--{name.replace('_', '-')}"
        raise common.UsageError(f"{option} is of one run: with --evolve every run has an emulated table of its own")
    if searched := SEARCHED & set(letters(asked.settings.case)):
        raise common.UsageError(f"--case names {', '.join(sorted(searched))}, which --evolve looks for: leave it out")
    settings, search, seed, seeds = asked.settings, asked.search, asked.seed, asked.seeds
    if not _given(context, ("steps",)):
        settings = replace(settings, steps=STEPS)
    begun = CutRun(EVOLVE, context, link="", resume=asked.resume, resume_from=asked.resume_from, checkpoint=asked.checkpoint)
    if (saved := begun.saved) is not None:
        begun.check({name: context.params[name] for name in DECIDING}, _begun_with(saved))
        settings, search, seed, seeds = saved.settings, saved.search, saved.seed, saved.seeds
    checkpoint = asked.checkpoint
    with (
        options.crew_of(asked.workers, asked.scheduler) as crew,
        running(
            EVOLVE.verb,
            f"{search.fitness}-{search.search}",
            url="sim://swarm",
            emulated_here=True,
            seed=seed,
            out=asked.out,
            log=asked.log,
            no_log=asked.no_log,
            overwrite=asked.overwrite,
            makes={runs.CHECKPOINT: checkpoint},
            kept=(checkpoint,) if checkpoint is not None and begun.goes_on_in(checkpoint) else (),
        ) as run,
    ):
        files = _EvolutionFiles(run, checkpoint, console, report=asked.report)
        job = EvolveJob(
            settings,
            search,
            seed,
            seeds,
            begun.content,
            EvolutionOutputs(
                checkpoint=files.save_checkpoint,
                cut=lambda reached: files.tell_how_to_resume(reached, asked),
                resumed=lambda reached: files.tell_resumed(reached, begun.source),
                failed=run.failed,
            ),
        )
        if saved is None and not asked.quiet:
            console.print(_headline(job), markup=False)
        with interrupts():
            stage = LiveStage(run, job, "", console, quiet=asked.quiet, options=asked.config, beside=False, crew=crew)
            with closing(stage):
                evolutions = job.perform(stage)
        document = files.document(evolutions)
        if not asked.as_json:
            files.tell(evolutions)
        files.draw(stage, document, announce=not asked.as_json)
        whole = len(evolutions) == seeds and evolutions[-1].finished
        run.finish(_kept(document, evolutions), common.EXIT_DONE if whole else common.EXIT_FELL_SHORT)
    with run.telling():
        if asked.as_json:
            common.print_json(document)
    return run.ended()


class _EvolutionFiles(RunFiles):
    """Where searches leave what, and what is told of them."""

    def __init__(self, run: ActiveRun, checkpoint: Path | None, console: Console, *, report: bool) -> None:
        super().__init__(run, checkpoint, console, report=report)
        self._clock = MonotonicClock()
        self._since = self._clock.now()

    def tell_how_to_resume(self, reached: EvolutionCheckpoint, asked: SearchRequest) -> None:
        """Say where the work is, and how to go on."""
        command = ["hil", "swarm", "surround", "--evolve", reached.search.fitness.value]
        if asked.scheduler is not None:
            command += ["--scheduler", asked.scheduler]
        elif asked.workers > 1:
            command += ["--workers", str(asked.workers)]
        self.tell_where(f"What came of {_counted(reached.evaluations)} is", command)

    def tell_resumed(self, reached: EvolutionCheckpoint, source: Path | None) -> None:
        """Say what is gone on from."""
        self._run.describe(resumed_from=str(source), seed=reached.seed)
        self._console.print(f"Going on from {source}: {_counted(reached.evaluations)}.", markup=False)

    def document(self, evolutions: Sequence[Evolution]) -> dict[str, Any]:
        """What came of it, with the files that it has left."""
        return {
            **evolution_document(evolutions),
            "wall_seconds": round(self._clock.now() - self._since, 3),
            "run": self._run.folder,
            "log": self._run.log_file,
            "checkpoint": str(self.checkpoint),
            "report": None,
        }

    def tell(self, evolutions: Sequence[Evolution]) -> None:
        """Say what came of it, and where the files are."""
        made = sum(len(evolution.done) for evolution in evolutions)
        minutes = sum(evolution.seconds for evolution in evolutions) / 60
        self._console.print("")
        self._console.print(
            f"{made} evaluations, {minutes:.0f} robot minutes, in {self._clock.now() - self._since:.1f} s.", markup=False
        )
        for line in evolution_summary(evolutions):
            self._console.print(line, markup=False)
        if self._run.log_file:
            self._console.print(f"{'Log:':12}{self._run.log_file}", markup=False)


def _headline(job: EvolveJob) -> str:
    search = job.search
    made = f"{search.evaluations} evaluations of {job.settings.steps} steps"
    return f"Looking for the conditions that suit {search.fitness.name} best, of 96 ({search.search}): {made}."


def _counted(evaluations: int) -> str:
    return "1 evaluation" if evaluations == 1 else f"{evaluations} evaluations"


def _given(context: typer.Context, names: Sequence[str]) -> list[str]:
    """Those of some options that were given, and ask for something."""
    return [name for name in names if context.params[name] and common.was_given(context, name)]


def _begun_with(saved: EvolutionCheckpoint) -> dict[str, Any]:
    """What a search was begun with, by name of the option."""
    search = search_dict(saved.search)
    return {
        **saved.settings.to_dict(),
        **search,
        "evolve": search["fitness"],
        "budget": saved.search.budget or None,
        "no_learning": not saved.settings.learning,
        "seed": saved.seed,
        "seeds": saved.seeds,
    }


def _kept(document: dict[str, Any], evolutions: Sequence[Evolution]) -> dict[str, Any]:
    """What the run's record keeps of it, with a word for a list of runs: not what the log has of every generation."""
    found = [evolution.best for evolution in evolutions]
    best = max((each for each in found if each is not None), key=lambda each: each.mean, default=None)
    of = f"{len(evolutions)} searches, the best " if len(evolutions) > 1 else "best "
    summary = "" if best is None else f"{of}{best.condition}: {best.mean:.3f}"
    kept = {key: value for key, value in document.items() if key not in {"generations", "table", "runs"}}
    return {**kept, "summary": summary}
