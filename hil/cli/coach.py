"""`hil coach`: the main job."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from firmware_protocol.errors import HilError
from hil.advice_file import save_advice
from hil.bouts import Tally, play
from hil.cli import common
from hil.cli.progress import CoachingDisplay
from hil.cli.session import Session, open_session
from hil.clock import MonotonicClock
from hil.coaching import Checkpoint, CheckpointError, Coaching, check_objective, load_checkpoint, new_pal
from hil.controllers import AdviceController, Controller, RandomController
from hil.ring import Ring, open_ring
from hil.seeds import Branch, bout_seed, generator
from hil.summary import coaching_summary, per_stimulus
from pal_advisor.maneuvers import Objective, PalSettings
from pal_advisor.maneuvers.settings import SettingsError

if TYPE_CHECKING:
    from rich.console import Console


HELD_OUT_LOCKSTEP = 50
HELD_OUT_REAL_TIME = 5
RANDOM_BOUTS = 20

DEFAULTS = PalSettings()


class PhasesName(StrEnum):
    """Which phases of learning."""

    MULTI = "multi"
    BASIC = "basic"
    FINE = "fine"


@dataclass(frozen=True)
class Files:
    """Where a coaching run leaves what.

    Attributes:
        advice: Advice file.
        checkpoint: Checkpoint.
        log: Log; None for none.
        report: Folder of the report; None where there is no log.
    """

    advice: Path
    checkpoint: Path
    log: Path | None
    report: Path | None

    def check(self) -> None:
        """See that none is written over another.

        Raises:
            UsageError: Two are the same file.
        """
        paths = [path for path in (self.advice, self.checkpoint, self.log) if path and (path.is_file() or not path.exists())]
        if len({path.resolve() for path in paths}) < len(paths):
            raise common.UsageError("advice, checkpoint and log must be files of their own: two of them are the same")


def coach(
    context: typer.Context,
    link: common.LinkArgument = None,
    *,
    opponent: Annotated[
        str | None,
        typer.Option(
            "--opponent",
            help=f"One of {', '.join(common.OPPONENTS)}; an emulated robot's is flat-light if left out.",
        ),
    ] = None,
    budget: Annotated[
        int, typer.Option("--budget", min=1, max=10_000_000, help="Maneuvers to be performed.")
    ] = DEFAULTS.budget,
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
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint.")] = False,
    checkpoint: Annotated[
        Path | None, typer.Option("--checkpoint", metavar="FILE", help="[default: advice/OPPONENT-SEED.checkpoint.json]")
    ] = None,
    advice_out: Annotated[
        Path | None, typer.Option("--advice-out", metavar="FILE", help="[default: advice/OPPONENT-SEED.advice.toml]")
    ] = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Draw a report of the log at the end.")] = True,
    signing_key: common.SigningKeyOption = None,
    reconnect: common.ReconnectOption = common.RECONNECT,
    seed: common.SeedOption = 1,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> int:
    """Let Pal coach Junior, and leave advice, log and report.

    Examples: hil coach; hil coach serial:///dev/ttyACM0:115200 --objective contact
    """
    if opponent is not None:
        common.check_opponent(opponent)
    clock = MonotonicClock()
    console = common.consoles(as_json=as_json, quiet=quiet)
    here = opponent or ("robot" if link else "flat-light")
    saved = load_checkpoint(checkpoint or _beside(here, seed, "checkpoint.json")) if resume else None
    if saved is not None:
        _check_resumed(context, saved)
        opponent = saved.opponent if saved.opponent in common.OPPONENTS else opponent
        seed, here = saved.seed, here if link else saved.opponent
    elif link is None:
        opponent = here
    path = common.log_path("coach", log, no_log=no_log)
    files = Files(
        advice=advice_out or _beside(here, seed, "advice.toml"),
        checkpoint=checkpoint or _beside(here, seed, "checkpoint.json"),
        log=path,
        report=path.with_name(f"{path.stem}-report") if path and report else None,
    )
    files.check()
    try:
        settings = PalSettings(
            objective=objective or Objective.OUTCOME,
            budget=budget,
            phases=phases.value,
            pairs=pairs,
            period=period,
        )
    except SettingsError as error:
        raise common.UsageError(str(error)) from error
    if saved is not None:
        settings = saved.pal.settings
    described = {"verb": "coach", "seed": seed, "opponent": opponent or "", "settings": settings.to_dict(), "resumed": resume}
    with open_session(
        link,
        opponent=opponent,
        seed=seed,
        log=path,
        config=described,
        reconnect=reconnect,
        tell=common.teller(console, quiet=quiet),
        signing_key=signing_key,
    ) as session:
        run = _Run(session, console, opponent, seed, files, quiet=quiet)
        run.prepare(settings, saved, choose_objective=objective is None)
        try:
            run.coach()
            trials = held_out if held_out is not None else HELD_OUT_LOCKSTEP if session.lockstep else HELD_OUT_REAL_TIME
            tally, random = run.held_out(trials)
        except (HilError, KeyboardInterrupt):
            run.tell_how_to_resume(link, signing_key)
            raise
        document = run.document(tally)
        session.finish(document)
    wall_seconds = clock.now()
    if not as_json:  # before the report is drawn: should that fail, the outcome has been told
        for line in coaching_summary(
            run.coaching, tally, random, opponent=run.ring.opponent, files=document, wall_seconds=wall_seconds
        ):
            console.print(line, markup=False)
    _draw(files, document, console, announce=not as_json)
    if as_json:
        common.print_json(document)
    if require is not None and (tally is None or tally.win_rate.value < require):
        none = ": there were none" if tally is None else ""
        console.print(f"Fewer than the required {require:g} of the held-out bouts were won{none}.")
        return common.EXIT_FELL_SHORT
    return common.EXIT_DONE


def _draw(files: Files, document: dict[str, object], console: Console, *, announce: bool) -> None:
    """Draw the report, if there is to be one, and say where it is."""
    if files.report is None or files.log is None:
        return
    from hil.report import write_report  # noqa: PLC0415 - drawing takes a second to load

    document["report"] = str(write_report(files.log, files.report).page)
    if announce:
        console.print(f"{'Report:':12}{document['report']}", markup=False)


def _beside(name: str, seed: int, kind: str) -> Path:
    """Where a file of a run is by default."""
    return Path("advice") / f"{name}-{seed}.{kind}"


def _keep_unfinished(path: Path, console: Console) -> None:
    """Put the checkpoint of a run that was cut aside: to begin anew is not to throw away what was learnt.

    Args:
        path: Where the new run's checkpoint is to be.
        console: Where to say so.
    """
    try:
        saved = load_checkpoint(path)
    except CheckpointError:  # there is none, or nothing that could be resumed
        return
    if saved.pal.finished or not saved.pal.used:
        return
    kept, number = path.with_name(f"{path.name}.old"), 2
    while kept.exists():
        kept, number = path.with_name(f"{path.name}.old{number}"), number + 1
    path.rename(kept)
    console.print(f"{path} was of a run cut after {saved.pal.used} maneuvers (--resume goes on): kept as {kept}.", markup=False)


def _check_resumed(context: typer.Context, saved: Checkpoint) -> None:
    """See that nothing is asked of a resumed run that it was not begun with: mixed, it would be neither run.

    Args:
        context: The command line, which knows what was given and what is a default.
        saved: The run that was cut.

    Raises:
        UsageError: Something else is asked for.
    """
    begun: dict[str, object] = {**saved.pal.settings.to_dict(), "seed": saved.seed, "opponent": saved.opponent}
    for name in ("opponent", "seed", "budget", "objective", "phases", "pairs", "period"):
        source = context.get_parameter_source(name)
        wanted = context.params[name]
        if source is not None and "DEFAULT" not in source.name and wanted != begun[name]:
            raise common.UsageError(
                f"the run to be resumed was begun with {name} {begun[name]}, not {wanted}: leave that out, or begin anew "
                "without --resume"
            )


class _Run:
    """A coaching run from the command line's point of view."""

    ring: Ring
    coaching: Coaching

    def __init__(
        self, session: Session, console: Console, opponent: str | None, seed: int, files: Files, *, quiet: bool
    ) -> None:
        self._session = session
        self._console = console
        self._seed = seed
        self._files = files
        self._quiet = quiet
        self.ring = open_ring(session.junior, opponent)

    def prepare(self, settings: PalSettings, saved: Checkpoint | None, *, choose_objective: bool) -> None:
        """Make the adviser, or take it from the checkpoint."""
        if saved is not None:
            pal, progress = saved.pal, saved.progress
        else:
            if choose_objective and not self.ring.refereed:
                settings = PalSettings.from_dict({**settings.to_dict(), "objective": Objective.CONTACT.value})
            pal, progress = new_pal(settings, self._seed), None
            _keep_unfinished(self._files.checkpoint, self._console)
        check_objective(pal.settings.objective, self.ring)
        self._display = CoachingDisplay(self._console, pal.settings, used=pal.used, quiet=self._quiet)
        self._display.headline(self._session.junior, self.ring.opponent, pal)
        self.coaching = Coaching(
            self.ring,
            pal,
            seed=self._seed,
            checkpoint=self._files.checkpoint,
            observers=(*self._session.observers(pal.settings), self._display),
            progress=progress,
            save_on_cut=not self._session.lockstep,
        )

    def coach(self) -> None:
        """Coach, with the display, and write the advice."""
        self._session.series("coaching")
        with self._display:
            self.coaching.run()
        advice = self.coaching.pal.advice(opponent=self.ring.opponent, seed=self._seed)
        save_advice(advice, self._files.advice)
        self._session.advice(advice)

    def tell_how_to_resume(self, link: str | None, signing_key: Path | None) -> None:
        """Say where the work is, and how to go on."""
        command = ["hil", "coach", *([link] if link else []), "--resume", "--checkpoint", str(self._files.checkpoint)]
        if signing_key is not None:
            command += ["--signing-key", str(signing_key)]
        if self._files.advice != _beside("robot" if link else self.ring.opponent, self._seed, "advice.toml"):
            command += ["--advice-out", str(self._files.advice)]
        self._console.print(
            f"What was learnt so far is in {self._files.checkpoint}. To go on: {shlex.join(command)}", markup=False
        )

    def held_out(self, trials: int) -> tuple[Tally | None, Tally | None]:
        """Play bouts from fresh poses: by the advice, and in lock-step at random for comparison."""
        if not trials or not self.ring.refereed:
            return None, None
        advice = self.coaching.pal.advice(opponent=self.ring.opponent, seed=self._seed)
        tally = self._tally(AdviceController(advice), trials)
        if not self._session.lockstep:
            return tally, None
        player = RandomController(generator(self._seed, Branch.CONTROLLER))
        return tally, self._tally(player, min(trials, RANDOM_BOUTS))

    def _tally(self, controller: Controller, trials: int) -> Tally:
        seeds = [bout_seed(self._seed, Branch.HELD_OUT_BOUTS, number) for number in range(1, trials + 1)]
        bouts = []
        self._session.series(
            f"bouts played by {'the advice' if isinstance(controller, AdviceController) else 'random maneuvers'}"
        )
        for bout in play(self.ring, controller, seeds):
            bouts.append(bout)
            self._session.bout(bout)
        return Tally.of(self.ring.opponent, bouts)

    def document(self, tally: Tally | None) -> dict[str, object]:
        """What `--json` prints."""
        advice = self.coaching.pal.advice(opponent=self.ring.opponent, seed=self._seed)
        return {
            "opponent": self.ring.opponent,
            "seed": self._seed,
            "objective": advice.objective.value,
            "advice": str(self._files.advice),
            "checkpoint": str(self._files.checkpoint),
            "log": str(self._files.log) if self._files.log else None,
            "report": None,
            "maneuvers": self.coaching.pal.used,
            "bouts": self.coaching.progress.bouts,
            "robot_seconds": round(self.coaching.progress.robot_seconds, 3),
            "per_stimulus": per_stimulus(advice),
            "held_out": tally.to_dict() if tally else None,
        }
