"""`hil coach`: the main job."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import cycle, islice
from pathlib import Path
from typing import Annotated, Final

import typer

from firmware_protocol.vocabulary import LEAST_PERIOD, MOST_PERIOD
from hil.bridge.clock import MonotonicClock
from hil.cli import common, links
from hil.cli import live as live_options
from hil.cli import share as share_options
from hil.cli.asking import check_asked
from hil.cli.coach_begun import begun_team
from hil.cli.coach_files import CoachingFiles
from hil.cli.coach_from import FromOption, given_advice
from hil.cli.coach_resuming import BegunRun
from hil.cli.coach_runs import opponent_of, runs_wanted, urls_of
from hil.cli.coach_team import TEAM_BUDGET, Places, budget_of, coach_team
from hil.cli.coach_vary import VaryOption, varied
from hil.cli.rivals import opponent_named, ring_url, run_against_robots
from hil.cli.running import running
from hil.cli.stage import LiveStage
from hil.jobs.coach import HELD_OUT_LOCKSTEP, HELD_OUT_REAL_TIME, CoachJob, Outputs, Reset
from hil.jobs.team import MOST_RUNS, PACES, TEAM_SETTINGS, USUAL_RUNS, TeamJob
from hil.runs import ADVICE, CHECKPOINT
from hil.sumo.ring import OPPONENTS
from hil.sumo.summary import coaching_summary, shortfall
from pal_advisor.fields import SettingsError
from pal_advisor.maneuvers import Objective, PalSettings

DEFAULTS = PalSettings()
PACES_IN_TURN: Final = ", ".join(f"{pace:g}" for pace in PACES) + " in turn"
BATTERY_RECONNECT: Final = 600.0
"""How long a robot is waited for that a person stands beside, in s: time to charge or change a battery, and to put it back."""


class PhasesName(StrEnum):
    """Which phases of learning."""

    MULTI = "multi"
    BASIC = "basic"
    FINE = "fine"


def coach(
    context: typer.Context,
    link: common.LinkArgument = None,
    *,
    opponent: Annotated[
        str | None,
        typer.Option(
            "--opponent",
            autocompletion=common.opponents,
            help=f"One of {', '.join(OPPONENTS)}; an emulated robot's is flat-light if left out. Or emulated robots that are "
            "met in turn, as NAME,NAME: entrants of hil tournament, and self for what was learnt so far.",
        ),
    ] = None,
    budget: Annotated[
        str | None,
        typer.Option(
            "--budget",
            metavar="N|MINUTESmin|SECONDSs",
            help="Maneuvers to be performed, or robot time, of each run "
            f"[default: {DEFAULTS.budget}; of several runs {TEAM_BUDGET}]",
        ),
    ] = None,
    runs: Annotated[
        int | None,
        typer.Option(
            "--runs",
            min=1,
            max=MOST_RUNS,
            metavar="K",
            help="Coach K emulated robots apart, each with the whole budget, and put one advice together by whole bouts "
            f"[default: {USUAL_RUNS} where robots are emulated here; 1 at any other LINK, and with options of one, as --live]",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        common.workers_option(
            "Of several runs: processes that share the work; the same result for every N [default: one a core]."
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="tcp://HOST:PORT",
            help="Of several runs: have the workers of this Dask scheduler share the work instead, with the same result; they "
            "run programs as their users, so let it be on machines of yours.",
        ),
    ] = None,
    objective: Annotated[
        Objective | None,
        typer.Option("--objective", help="What a good maneuver is; outcome where there is a referee, else contact."),
    ] = None,
    phases: Annotated[
        PhasesName, typer.Option("--phases", help="Both phases, or the basic or the fine actions alone.")
    ] = PhasesName.MULTI,
    pairs: Annotated[
        bool, typer.Option("--pairs", help="Phase 2 tells situations apart by the previous stimulus too, as the book does.")
    ] = DEFAULTS.pairs,
    mirror: Annotated[
        bool | None,
        typer.Option(
            "--mirror/--no-mirror",
            help="What is learnt on the left holds on the right: for a robot whose wheels are even "
            "[default: --mirror if it is emulated, or if its encoders say that they are]",
        ),
    ] = None,
    end_on_change: Annotated[
        bool | None,
        typer.Option(
            "--end-on-change/--no-end-on-change",
            help="A maneuver ends when what the eyes see changes [default: so with several runs]",
        ),
    ] = None,
    period: Annotated[
        float | None,
        typer.Option(
            "--period",
            min=LEAST_PERIOD,
            max=MOST_PERIOD,
            help=f"Time an action lasts, in s [default: {DEFAULTS.period:g}; with --runs, {PACES_IN_TURN}]",
        ),
    ] = None,
    vary: VaryOption = None,
    held_out: Annotated[
        int | None,
        typer.Option(
            "--held-out",
            min=0,
            help="Bouts played with the advice afterwards, from fresh poses "
            f"[default: {HELD_OUT_LOCKSTEP} in lock-step, {HELD_OUT_REAL_TIME} in real time]",
        ),
    ] = None,
    require: Annotated[
        float | None,
        typer.Option("--require", min=0, max=1, metavar="RATE", help="Exit 1 if fewer of the held-out bouts are won."),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on with the newest coaching that did not finish, of the same opponent or robot."),
    ] = False,
    resume_from: Annotated[
        Path | None, typer.Option("--resume-from", metavar="RUN|FILE", help="Go on with this run, or from this checkpoint.")
    ] = None,
    begin_from: FromOption = None,
    checkpoint: Annotated[
        Path | None, typer.Option("--checkpoint", metavar="FILE", help="Instead of checkpoint.json in the run's folder.")
    ] = None,
    advice_out: Annotated[
        Path | None, typer.Option("--advice-out", metavar="FILE", help="Instead of advice.toml in the run's folder.")
    ] = None,
    reset: Annotated[
        Reset | None,
        typer.Option(
            "--reset",
            help="Of a robot at LINK without a referee: ask has a person set the ring up between bouts; auto has the robot "
            "back off and turn. Floor sensors say that a bout is lost, and 15 s that it is drawn.",
        ),
    ] = None,
    judge: Annotated[
        bool,
        typer.Option(
            "--judge", help="--reset ask, and the person alone says how each bout ends: by keys, or on the --live page."
        ),
    ] = False,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Draw a report of the log at the end.")] = True,
    live: live_options.LiveOption = False,
    open_page: live_options.OpenOption = None,
    public: live_options.PublicOption = False,
    share: share_options.ShareOption = None,
    viewer: live_options.ViewerOption = None,
    yes: links.YesOption = False,
    signing_key: common.SigningKeyOption = None,
    reconnect: common.ReconnectOption = common.RECONNECT,
    seed: common.SeedOption = 1,
    out: common.OutOption = None,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,
) -> int:
    """Let Pal coach Junior, and leave advice, log and report.

    Examples: hil coach; hil coach /dev/ttyACM0 --objective contact
    """
    opponent, rivals = opponent_named(opponent)
    context.params["opponent"] = opponent  # what it is called from now on, whatever files it was named by
    link = links.settled(link, yes=yes, quiet=quiet, signing_key=signing_key)
    team_begun = None
    if link is None and checkpoint is None:
        team_begun = begun_team(resume=resume, resume_from=resume_from, opponent=opponent)
    alone = rivals is not None and team_begun is None
    wanted = run_against_robots(runs) if alone else runs_wanted(context, runs, link, team_begun)
    clock = MonotonicClock()
    page = live_options.live_page(live, open_page, public=public, no_log=no_log, viewer=viewer)
    shared = share_options.shared_address(share, link and [link], "coach", no_log=no_log)
    console = common.consoles(as_json=as_json, quiet=quiet)
    asked = _Asked(objective, budget, phases, period, pairs, mirror, end_on_change)
    if team_begun is not None or wanted.number > 1:
        begun_job = None if team_begun is None else team_begun.job
        return coach_team(
            begun_job or asked.together(link, opponent, runs=wanted.number, vary=vary, held_out=held_out, seed=seed),
            begin_from=begin_from,
            workers=workers,
            scheduler=scheduler,
            require=require,
            advice_out=advice_out,
            report=report,
            console=console,
            places=Places(out, log, no_log=no_log, overwrite=overwrite, options=config),
            as_json=as_json,
            quiet=quiet,
            begun=team_begun,
        )
    wanted.tell(console, quiet=quiet)
    begun = BegunRun(context, resume=resume, resume_from=resume_from, checkpoint=checkpoint)
    saved = begun.named() or (begun.newest(opponent=opponent) if link is None else None)
    if saved is not None:
        rivals = saved.rivals
        opponent = saved.opponent if rivals is not None or saved.opponent in OPPONENTS else opponent
        seed, vary = saved.seed, saved.vary
    elif link is None:
        opponent = opponent or "flat-light"
    settings = asked.settings(together=False) if saved is None else saved.pal.settings
    given = given_advice(begin_from, settings, resumes=begun.wanted, reset=reset)
    url = varied(common.url_of(link, opponent, seed) if rivals is None else ring_url(link, seed), vary)
    reset = _reset(reset, judge=judge, in_real_time=not links.emulated_here(url), live=live)
    if reset is not None and not common.was_given(context, "reconnect"):
        reconnect = BATTERY_RECONNECT
    with running(
        "coach",
        rivals.short_name if rivals is not None else opponent or "robot",
        url=url,
        emulated_here=link is None,
        opponent=opponent or "",
        seed=seed,
        signing_key=signing_key,
        out=out,
        log=log,
        no_log=no_log,
        overwrite=overwrite,
        makes={ADVICE: advice_out, CHECKPOINT: checkpoint},
        kept=(checkpoint,) if checkpoint is not None and begun.goes_on_in(checkpoint) else (),
    ) as run:
        files = CoachingFiles(run, advice_out, checkpoint, console, report=report)
        job = CoachJob(
            settings=settings,
            choose_objective=objective is None,
            choose_mirror=mirror is None,
            measure_wheels=mirror is None,
            opponent=opponent if rivals is None else None,
            held_out=held_out,
            seed=seed,
            reconnect=reconnect,
            saved=begun.content,
            pauses=page is not None and not links.emulated_here(url) and reset is None,
            reset=reset,
            judged=judge,
            vary=vary or 0.0,
            rivals=rivals,
            given=given,
            find=begun.of_robot if begun.wanted and saved is None else None,
            outputs=Outputs(
                checkpoint=files.checkpoint,
                save=files.save_advice,
                learnt=files.save_learnt,
                keep=files.keep_advice,
                cut=lambda coaching: files.tell_how_to_resume(
                    coaching, [*([link] if link else []), *_words(reset, judge=judge)], signing_key
                ),
                unsaved=run.failed,
                resumed=lambda found: begun.tell(found, run, console),
            ),
        )
        stage = LiveStage(
            run,
            job,
            url,
            console,
            quiet=quiet,
            signing_key=signing_key,
            options=config,
            reports=files.report is not None,
            page=page,
            share=shared,
        )
        with closing(stage):
            coached = job.perform(stage)
            coaching, tally = coached.coaching, coached.tally
            document = {**coached.facts(), **files.document(coaching)}
            wall_seconds = clock.now()
            if not as_json:  # before the report is drawn: should that fail, the outcome has been told
                for line in coaching_summary(
                    coaching,
                    tally,
                    coached.random,
                    opponent=coached.opponent,
                    files=document,
                    wall_seconds=wall_seconds,
                    by_rival=coached.by_rival,
                ):
                    console.print(line, markup=False)
            files.draw(stage, document, announce=not as_json)
        short = shortfall(tally, require)
        run.finish(document, common.EXIT_FELL_SHORT if short else common.EXIT_DONE)
    with run.telling():
        if as_json:
            common.print_json(document)
        if short:
            console.print(short)
    return run.ended()


@dataclass(frozen=True)
class _Asked:
    """What was asked for of how Pal coaches; see the options of `coach`."""

    objective: Objective | None
    budget: str | None
    phases: PhasesName
    period: float | None
    pairs: bool
    mirror: bool | None
    end_on_change: bool | None

    def settings(self, *, together: bool) -> PalSettings:
        """As settings.

        Args:
            together: One of several runs.

        Raises:
            UsageError: A value makes no sense.
        """
        usual = TEAM_SETTINGS if together else DEFAULTS
        maneuvers, robot_time = (usual.budget, usual.robot_time) if self.budget is None else budget_of(self.budget)
        try:
            return replace(
                usual,
                objective=self.objective or Objective.OUTCOME,
                budget=maneuvers,
                robot_time=robot_time,
                phases=self.phases.value,
                pairs=self.pairs,
                mirror=self.mirror is not False,
                end_on_change=usual.end_on_change if self.end_on_change is None else self.end_on_change,
                period=usual.period if self.period is None else self.period,
            )
        except SettingsError as error:
            raise common.UsageError(str(error)) from error

    def together(
        self, link: str | None, opponent: str | None, *, runs: int, vary: float | None, held_out: int | None, seed: int
    ) -> TeamJob:
        """As several runs.

        Args:
            link: Address of the emulated robots; None: as usual.
            opponent: Their opponent; None: that of the address, or as usual.
            runs: How many.
            vary: By how much their worlds differ from bout to bout; None: as the address says.
            held_out: Bouts to be played with the advice; None is as many as usual.
            seed: Seed of it all.

        Raises:
            UsageError: A value makes no sense.
        """
        opponent = opponent_of(link, opponent)
        periods = tuple(islice(cycle(PACES), runs)) if self.period is None else ()
        urls = tuple(varied(url, vary) for url in urls_of(link, opponent, seed, runs))
        return TeamJob(self.settings(together=True), opponent, urls, held_out, seed, periods)


def _reset(reset: Reset | None, *, judge: bool, in_real_time: bool, live: bool) -> Reset | None:
    """How the ring is set up.

    Raises:
        UsageError: There is no person where one is needed, or a person is to judge whom nobody is to ask.
    """
    if reset is Reset.AUTO and judge:
        raise common.UsageError("--judge has a person beside the ring, who sets it up: leave --reset auto out")
    check_asked("--judge" if judge else reset and "--reset", in_real_time=in_real_time, live=live)
    return Reset.ASK if judge else reset


def _words(reset: Reset | None, *, judge: bool) -> list[str]:
    """How the ring is set up, as on a command line."""
    return ["--judge"] if judge else ["--reset", reset.value] if reset else []
