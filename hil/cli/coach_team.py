"""`hil coach --runs`: several coachings by workers, and one advice of them."""

from __future__ import annotations

import json
import re
import shlex
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from firmware_protocol.address import parse_address
from firmware_protocol.errors import HilError
from hil import runs
from hil.bridge.clock import MonotonicClock
from hil.cli import common
from hil.cli.running import ActiveRun, running
from hil.cli.stage import LiveStage
from hil.cli.workers import PartStage
from hil.doors import Door
from hil.files.outputs import replace_file
from hil.jobs.coach import CoachJob, Outputs
from hil.jobs.team import RunOrder, TeamJob, TeamOutputs
from hil.mcaplog.making.slimming import slim
from hil.sumo.advice_file import save_advice
from hil.sumo.coaching import DOOR as CHECKPOINT
from hil.sumo.coaching import CheckpointError
from hil.sumo.summary import shortfall, team_summary
from hil.sumo.team import CoachedRun
from hil.working import WorkerError, interruptible, open_crew
from hil.working.processes import cores
from pal_advisor.fields import FieldError, Fields
from pal_advisor.maneuvers.settings import MOST_BUDGET

if TYPE_CHECKING:
    import typer
    from rich.console import Console

    from hil.jobs.team import Team

TEAM_BUDGET: Final = "16min"
"""Robot time of each of several runs: what 1600 maneuvers take that nothing ends early."""
BUDGET: Final = re.compile(r"(\d+)(min|s)?", re.ASCII)
TEAM: Final = "team.json"
"""Name of the file that says which runs belong together; each has a checkpoint beside it, as `run-2.json`."""
DOOR: Final = Door("list of runs", CheckpointError, largest=1 << 20)
BEGUN_WITH: Final = ("team", "seed", "budget", "objective", "phases", "pairs", "mirror", "end_on_change", "period", "held_out")
OPTIONS: Final = {name: f"--{name.replace('_', '-')}" for name in BEGUN_WITH} | {"team": "--runs"}
"""Options that runs are begun with, and what they are called."""
ONE_ROBOT: Final = ("checkpoint", "live", "share", "signing_key")
"""Options of a run that has one robot."""


def budget_of(text: str) -> tuple[int, float]:
    """A budget as it is given: maneuvers, and robot time in s, which is 0 where maneuvers count.

    Args:
        text: `1600`, `15min` or `900s`.

    Raises:
        UsageError: It is none.
    """
    found = BUDGET.fullmatch(text)
    number = int(found[1]) if found is not None and len(found[1]) < 10 else 0
    if found is None or not 1 <= number <= MOST_BUDGET or (found[2] and number > 1_000_000):
        raise common.UsageError(
            f"--budget {text}: expected maneuvers (1 to {MOST_BUDGET}), or robot time (15min, 900s; up to 1000000)"
        )
    unit = {None: 0.0, "s": 1.0, "min": 60.0}[found[2]]
    return (number, 0.0) if not unit else (MOST_BUDGET, unit * number)


def check_team(context: typer.Context, link: str | None, begun: BegunTeam | None) -> None:
    """See that there can be several runs.

    Args:
        context: The command line.
        link: Address of the robot as given; None is an emulated robot in this process.
        begun: Runs that are gone on with; None begins anew.

    Raises:
        UsageError: There is but one of that robot, or something is asked for that several do not have.
    """
    if link is not None and parse_address(link).scheme != "sim":
        raise common.UsageError(f"--runs coaches several robots at once, and there is one at {link}: leave one of the two out")
    for name in ONE_ROBOT:
        if context.params[name]:
            option = name.replace("_", "-")
            raise common.UsageError(f"--{option} is for one run, and --runs makes several: leave one of the two out")
    for name in BEGUN_WITH:
        if begun is not None and common.was_given(context, name):
            raise common.UsageError(f"the runs in {begun.source.parent} go on as they were begun: leave out {OPTIONS[name]}")


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
        return _begun(resume_from / TEAM) if (resume_from / TEAM).is_file() else None
    if not resume:
        return None
    found = [run for run in runs.all_runs() if run.record.verb == "coach" and not run.record.link]
    continued = {Path(run.record.resumed_from).resolve() for run in found if run.record.resumed_from}
    for run in found:
        unfinished = run.state not in {runs.DONE, runs.RUNNING, runs.FELL_SHORT} and opponent in {None, run.record.opponent}
        if unfinished and not {(run.folder / TEAM).resolve(), run.saved_to.resolve()} & continued:
            return _begun(run.folder / TEAM) if (run.folder / TEAM).is_file() else None
    return None


def _begun(path: Path) -> BegunTeam:
    document = DOOR.document(path, json=True)
    try:
        fields = Fields(document.data)
        job = TeamJob.of_log(fields, {})
        fields.done()
    except FieldError as error:
        raise document.wrong("", f"this list of runs is damaged: {error}") from error
    return BegunTeam(job, path)


@dataclass(frozen=True)
class Places:
    """Where a run leaves its files, as it was asked for.

    Attributes:
        out: The run's folder.
        log: Its log.
        no_log: No log is wanted.
        overwrite: Named outputs that exist may be replaced.
        options: Configuration file that options were taken from.
    """

    out: Path | None
    log: Path | None
    no_log: bool
    overwrite: bool
    options: Path | None


@dataclass(frozen=True)
class RunTask:
    """A coaching for a worker.

    Attributes:
        order: What is wanted.
        folder: Where its log and its checkpoint go, as `run-2.mcap` and `run-2.json`; None for nowhere.
        logged: A log is wanted.
        saved: The checkpoint that is gone on from; None begins anew.
    """

    order: RunOrder
    folder: Path | None
    logged: bool
    saved: bytes | None = None


def coach_run(task: RunTask) -> CoachedRun:
    """Coach, in a worker's process; the log of all runs but the first is made small.

    Args:
        task: What.

    Raises:
        WorkerError: It ended by an error, or the log could not be written.
    """
    order, folder = task.order, task.folder
    place = None if folder is None else folder / f"run-{order.number}"
    log = place.with_suffix(".mcap") if place is not None and task.logged else None
    run = ActiveRun(None, log, overwrite=True)  # in the run's own folder: left behind by a worker that has died
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
        outputs=Outputs(checkpoint=None if place is None else place.with_suffix(".json")),
    )
    console = common.plain_console(stderr=True, quiet=True)
    try:
        stage = PartStage(run, job, order.url, console, quiet=True, beside=False)
        with interruptible(), closing(stage):
            coached = job.perform(stage)
        if log is not None and order.number > 1 and not run.failures:
            small = log.with_suffix(".slim")
            slim(log, small, overwrite=True)
            small.replace(log)
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
    )


def coach_team(
    job: TeamJob,
    *,
    workers: int | None,
    require: float | None,
    advice_out: Path | None,
    report: bool,
    console: Console,
    places: Places,
    as_json: bool,
    quiet: bool,
    begun: BegunTeam | None = None,
) -> int:
    """Coach several robots, put one advice together, and try it.

    Args:
        job: What is asked for.
        workers: Processes; None: as many as there are cores, and no more than runs.
        require: Share of the held-out bouts to be won.
        advice_out: Advice file, instead of the one in the run's folder.
        report: A report of the best run is wanted.
        console: Where words go.
        places: Where files go.
        as_json: One JSON object is to be printed.
        quiet: Nothing but results is wanted.
        begun: What is gone on with; None begins anew.

    Returns:
        Exit status.
    """
    clock = MonotonicClock()
    hands = workers or min(cores(), len(job.urls))
    with running(
        "coach",
        job.opponent,
        url=job.urls[0],
        emulated_here=True,
        opponent=job.opponent,
        seed=job.seed,
        out=places.out,
        log=places.log,
        no_log=places.no_log,
        overwrite=places.overwrite,
        makes={runs.ADVICE: advice_out},
    ) as run:
        advice = run.place(advice_out, runs.ADVICE)
        folder = None if run.run is None else run.run.folder
        job = replace(
            job,
            outputs=TeamOutputs(
                coach=coach_run,
                task_of=lambda order: RunTask(
                    order, folder, not places.no_log, None if begun is None else begun.checkpoint(order.number)
                ),
                cut=lambda: _tell_how_to_go_on(console, folder),
                save=lambda learnt: save_advice(learnt, advice, overwrite=places.overwrite),
            ),
        )
        if folder is not None:
            replace_file(folder / TEAM, json.dumps(job.options(), sort_keys=True).encode())
        if begun is not None:
            run.describe(resumed_from=str(begun.source))
            console.print(f"Going on from {begun.source.parent}.", markup=False)
        with open_crew(hands) as crew:
            stage = LiveStage(run, job, "", console, quiet=quiet, options=places.options, crew=crew)
            with closing(stage):
                team = job.perform(stage)
        document = {
            **team.facts(),
            "run": run.folder,
            "advice": str(advice),
            "log": run.log_file,
            "logs": []
            if folder is None or places.no_log
            else [str(folder / f"run-{n + 1}.mcap") for n in range(len(job.urls))],
            "report": None,
        }
        if not as_json:
            for line in team_summary(
                team.advice,
                team.runs,
                team.verdicts,
                team.tally,
                team.random,
                opponent=team.opponent,
                robot_seconds=team.robot_seconds,
                files=document,
                wall_seconds=clock.now(),
            ):
                console.print(line, markup=False)
        _draw(run, team, document, console, wanted=report and not places.no_log, announce=not as_json)
        short = shortfall(team.tally, require)
        run.finish(document, common.EXIT_FELL_SHORT if short else common.EXIT_DONE)
    with run.telling():
        if as_json:
            common.print_json(document)
        if short:
            console.print(short)
    return run.ended()


def _tell_how_to_go_on(console: Console, folder: Path | None) -> None:
    if folder is not None:
        console.print(
            f"What was learnt so far is in {folder}. To go on: hil coach --resume-from {shlex.quote(str(folder))}", markup=False
        )


def _draw(run: ActiveRun, team: Team, document: dict[str, object], console: Console, *, wanted: bool, announce: bool) -> None:
    """Draw the report of the run that the advice comes from."""
    if not wanted or run.run is None:
        return
    from hil.report import write_report  # noqa: PLC0415 - drawing takes half a second to load

    try:
        page = write_report(run.run.folder / f"run-{team.best_run}.mcap", run.run.report).page
    except HilError as error:
        run.failed(str(error))
        return
    document["report"] = str(page)
    if announce:
        console.print(f"{'Report:':12}{page}", markup=False)
