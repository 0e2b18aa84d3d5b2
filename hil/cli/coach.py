"""`hil coach`: the main job."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from hil import runs
from hil.bridge.clock import MonotonicClock
from hil.cli import common, links
from hil.cli import live as live_options
from hil.cli import share as share_options
from hil.cli.asking import check_asked
from hil.cli.coach_team import TEAM_BUDGET, Places, begun_team, budget_of, check_team, coach_team
from hil.cli.run_files import RunFiles
from hil.cli.running import ActiveRun, running
from hil.cli.stage import LiveStage
from hil.going_on import saved_by, successor
from hil.jobs.coach import HELD_OUT_LOCKSTEP, HELD_OUT_REAL_TIME, CoachJob, Outputs, Reset
from hil.jobs.team import MOST_RUNS, TeamJob
from hil.seeds import run_seed
from hil.sumo.advice_file import AdviceFileError, advice_text, save_advice
from hil.sumo.coaching import DOOR, Checkpoint, load_checkpoint
from hil.sumo.ring import OPPONENTS
from hil.sumo.summary import coaching_summary, shortfall
from pal_advisor.fields import SettingsError
from pal_advisor.maneuvers import Objective, PalSettings

if TYPE_CHECKING:
    from rich.console import Console

    from hil.sumo.coaching import Coaching
    from pal_advisor.maneuvers import Advice

DEFAULTS = PalSettings()
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
            help=f"One of {', '.join(OPPONENTS)}; an emulated robot's is flat-light if left out.",
        ),
    ] = None,
    budget: Annotated[
        str | None,
        typer.Option(
            "--budget",
            metavar="N|MINUTESmin|SECONDSs",
            help=f"Maneuvers to be performed, or robot time, a run [default: {DEFAULTS.budget}; with --runs {TEAM_BUDGET}]",
        ),
    ] = None,
    team: Annotated[
        int,
        typer.Option(
            "--runs",
            min=1,
            max=MOST_RUNS,
            metavar="K",
            help="Coach K emulated robots apart, each with the whole budget, and put one advice together by whole bouts.",
        ),
    ] = 1,
    workers: Annotated[
        int | None,
        common.workers_option("With --runs: processes that share the work; the same result for every N [default: one a core]."),
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
            help="A maneuver ends when what the eyes see changes [default: so with --runs]",
        ),
    ] = None,
    period: Annotated[float, typer.Option("--period", min=0.02, max=5.0, help="Time an action lasts, in s.")] = DEFAULTS.period,
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
    if opponent is not None:
        common.check_opponent(opponent)
    link = links.settled(link, yes=yes, quiet=quiet, signing_key=signing_key)
    team_begun = None
    if link is None and checkpoint is None:
        team_begun = begun_team(resume=resume, resume_from=resume_from, opponent=opponent)
    if team > 1 or team_begun is not None:
        check_team(context, link, team_begun)
    clock = MonotonicClock()
    page = live_options.live_page(live, open_page, public=public, no_log=no_log, viewer=viewer)
    shared = share_options.shared_address(share, link and [link], "coach", no_log=no_log)
    console = common.consoles(as_json=as_json, quiet=quiet)
    asked = _Asked(objective, budget, phases, period, pairs, mirror, end_on_change)
    if team_begun is not None or team > 1:
        return coach_team(
            _together(asked, link, opponent, team=team, held_out=held_out, seed=seed) if team_begun is None else team_begun.job,
            workers=workers,
            require=require,
            advice_out=advice_out,
            report=report,
            console=console,
            places=Places(out, log, no_log=no_log, overwrite=overwrite, options=config),
            as_json=as_json,
            quiet=quiet,
            begun=team_begun,
        )
    begun = _Begun(context, resume=resume, resume_from=resume_from, checkpoint=checkpoint)
    saved = begun.named() or (begun.newest(opponent=opponent) if link is None else None)
    if saved is not None:
        opponent = saved.opponent if saved.opponent in OPPONENTS else opponent
        seed = saved.seed
    elif link is None:
        opponent = opponent or "flat-light"
    settings = asked.settings(together=False) if saved is None else saved.pal.settings
    url = common.url_of(link, opponent, seed)
    reset = _reset(reset, judge=judge, in_real_time=not links.emulated_here(url), live=live)
    if reset is not None and not common.was_given(context, "reconnect"):
        reconnect = BATTERY_RECONNECT
    with running(
        "coach",
        opponent or "robot",
        url=url,
        emulated_here=link is None,
        opponent=opponent or "",
        seed=seed,
        signing_key=signing_key,
        out=out,
        log=log,
        no_log=no_log,
        overwrite=overwrite,
        makes={runs.ADVICE: advice_out, runs.CHECKPOINT: checkpoint},
        kept=(checkpoint,) if checkpoint is not None and begun.goes_on_in(checkpoint) else (),
    ) as run:
        files = _CoachingFiles(run, advice_out, checkpoint, console, report=report)
        job = CoachJob(
            settings=settings,
            choose_objective=objective is None,
            choose_mirror=mirror is None,
            measure_wheels=mirror is None,
            opponent=opponent,
            held_out=held_out,
            seed=seed,
            reconnect=reconnect,
            saved=begun.content,
            pauses=page is not None and not links.emulated_here(url) and reset is None,
            reset=reset,
            judged=judge,
            find=begun.of_robot if begun.wanted and saved is None else None,
            outputs=Outputs(
                checkpoint=files.checkpoint,
                save=files.save_advice,
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
            document: dict[str, object] = {
                **coached.facts(),
                "run": run.folder,
                "advice": None if files.unsaved else str(files.advice),
                "checkpoint": None if coaching.unsaved else str(files.checkpoint),
                "log": run.log_file,
                "report": None,
            }
            wall_seconds = clock.now()
            if not as_json:  # before the report is drawn: should that fail, the outcome has been told
                for line in coaching_summary(
                    coaching, tally, coached.random, opponent=coached.opponent, files=document, wall_seconds=wall_seconds
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
    period: float
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
        maneuvers, robot_time = budget_of(self.budget or (TEAM_BUDGET if together else str(DEFAULTS.budget)))
        try:
            return PalSettings(
                objective=self.objective or Objective.OUTCOME,
                budget=maneuvers,
                robot_time=robot_time,
                phases=self.phases.value,
                pairs=self.pairs,
                mirror=self.mirror is not False,
                end_on_change=together if self.end_on_change is None else self.end_on_change,
                period=self.period,
            )
        except SettingsError as error:
            raise common.UsageError(str(error)) from error


def _together(asked: _Asked, link: str | None, opponent: str | None, *, team: int, held_out: int | None, seed: int) -> TeamJob:
    """Several runs, as they were asked for."""
    opponent = opponent or "flat-light"
    urls = [common.url_of(link, opponent, run_seed(seed, number)) for number in range(1, team + 1)]
    return TeamJob(asked.settings(together=True), opponent, tuple(urls), held_out, seed)


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


class _Begun:
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
        self.newest(robot=uid)
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
    for name in ("opponent", "seed", "budget", "objective", "phases", "pairs", "mirror", "end_on_change", "period"):
        wanted = context.params[name]
        if name == "budget" and wanted is not None and budget_of(wanted) == (settings.budget, settings.robot_time):
            continue
        if common.was_given(context, name) and wanted != begun[name]:
            raise common.UsageError(
                f"the run to be resumed was begun with {name} {begun[name]}, not {wanted}: leave that out, or begin anew "
                "without --resume"
            )


class _CoachingFiles(RunFiles):
    """Where a coaching run leaves what.

    Args:
        run: The run.
        advice: Advice file, instead of the one in the run's folder.
        checkpoint: Checkpoint, likewise.
        console: Where to say so.
        report: A report is wanted.

    Attributes:
        advice: Advice file.
        unsaved: No file holds the advice.
    """

    def __init__(self, run: ActiveRun, advice: Path | None, checkpoint: Path | None, console: Console, *, report: bool) -> None:
        super().__init__(run, checkpoint, console, report=report)
        self.advice = run.place(advice, runs.ADVICE)
        self.unsaved = False
        self._kept = False

    def keep_advice(self, advice: Advice) -> None:
        """Write the best advice so far; where that fails, say so once."""
        try:
            save_advice(advice, self.advice, overwrite=self._run.overwrite or self._kept)
            self._kept = True
        except AdviceFileError as error:
            self._failed(self.advice, str(error))

    def save_advice(self, advice: Advice) -> None:
        """Write the advice; where that fails, say what it is."""
        try:
            save_advice(advice, self.advice, overwrite=self._run.overwrite or self._kept)
        except AdviceFileError as error:
            self._run.failed(str(error))
            common.complain("what was learnt, for no file to hold:")
            common.complain(advice_text(advice), program=False)
            self.unsaved = True

    def tell_how_to_resume(self, coaching: Coaching, words: list[str], signing_key: Path | None) -> None:
        """Say where the work is, and how to go on, by these words; where no file holds it, say what it is."""
        if not self.checkpoint.is_file() or coaching.unsaved:
            if coaching.pal.used:
                common.complain("no file holds what was learnt so far. It is:")
                common.complain(advice_text(coaching.advice()), program=False)
            return
        if self._kept:
            self._console.print(f"The best advice so far: {self.advice}", markup=False)
        self.tell_where("What was learnt so far is", ["hil", "coach", *words], signing_key)
