"""`hil coach --runs`: several coachings by workers, and one advice of them."""

from __future__ import annotations

import json
import re
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from hil import runs
from hil.bridge.clock import MonotonicClock
from hil.cli import common
from hil.cli.coach_files import TeamFiles
from hil.cli.coach_from import given_advice
from hil.cli.coach_worker import RunTask, coach_run
from hil.cli.running import running
from hil.cli.stage import LiveStage
from hil.files.outputs import replace_file
from hil.jobs.team import TEAM_SETTINGS, TeamJob, TeamOutputs
from hil.sumo.summary import shortfall, team_summary
from hil.working import open_crew
from hil.working.processes import cores
from pal_advisor.maneuvers.settings import MOST_BUDGET

if TYPE_CHECKING:
    from rich.console import Console

    from hil.cli.coach_begun import BegunTeam

TEAM_BUDGET: Final = f"{TEAM_SETTINGS.robot_time / 60.0:g}min"
"""Robot time of each of several runs, as it is given."""
BUDGET: Final = re.compile(r"(\d+)(min|s)?", re.ASCII)


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


def coach_team(
    job: TeamJob,
    *,
    begin_from: Path | None,
    workers: int | None,
    scheduler: str | None,
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
        begin_from: The advice that it begins from, or its run; None: none that was not begun from already.
        workers: Processes; None: as many as there are cores, and no more than runs.
        scheduler: Address of a Dask scheduler whose workers coach instead.
        require: Share of the held-out bouts to be won.
        advice_out: Advice file, instead of the one in the run's folder.
        report: A report is wanted.
        console: Where words go.
        places: Where files go.
        as_json: One JSON object is to be printed.
        quiet: Nothing but results is wanted.
        begun: What is gone on with; None begins anew.

    Returns:
        Exit status.
    """
    clock = MonotonicClock()
    given = given_advice(begin_from, job.settings, resumes=begun is not None)
    hands = workers or min(cores(), len(job.urls))
    with (
        open_crew(hands, scheduler) as crew,
        running(
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
        ) as run,
    ):
        files = TeamFiles(run, advice_out, console, report=report)
        folder = None if run.run is None else run.run.folder
        given = given or job.given
        job = replace(
            job,
            given=given,
            outputs=TeamOutputs(
                coach=coach_run,
                task_of=lambda order: RunTask(
                    order,
                    folder,
                    not places.no_log,
                    None if begun is None else begun.checkpoint(order.number),
                    sent=scheduler is not None,
                ),
                take=files.take,
                cut=lambda: files.tell_how_to_go_on(given, scheduler),
                save=files.save_advice,
                learnt=files.save_learnt,
            ),
        )
        if folder is not None:
            replace_file(folder / runs.TEAM, json.dumps(job.options(), sort_keys=True).encode())
            for name, data in job.files().items():
                replace_file(folder / name, data)
        if begun is not None:
            run.describe(resumed_from=str(begun.source))
            console.print(f"Going on from {begun.source.parent}.", markup=False)
        stage = LiveStage(
            run, job, job.urls[0], console, quiet=quiet, options=places.options, reports=files.report is not None, crew=crew
        )
        with closing(stage):
            team = job.perform(stage)
            document = {**team.facts(), **files.document(len(job.urls))}
            if not as_json:
                for line in team_summary(
                    team.advice,
                    team.runs,
                    team.verdicts,
                    team.tally,
                    team.random,
                    opponent=team.opponent,
                    robot_seconds=team.robot_seconds,
                    files={**document, "best_log": files.log_of(team.best_run)},
                    wall_seconds=clock.now(),
                    challenge=team.challenge,
                ):
                    console.print(line, markup=False)
            files.draw(stage, document, announce=not as_json)
        short = shortfall(team.tally, require)
        run.finish(document, common.EXIT_FELL_SHORT if short else common.EXIT_DONE)
    with run.telling():
        if as_json:
            common.print_json(document)
        if short:
            console.print(short)
    return run.ended()
