"""`hil bout`: plays bouts and counts them."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from hil import runs
from hil.advice_file import load_advice
from hil.bouts import Bout, Tally, play
from hil.cli import common
from hil.cli.running import running
from hil.cli.session import Session, open_session
from hil.controllers import AdviceController, ChaseController, Controller, RandomController
from hil.ring import Ring, RingError, open_ring
from hil.seeds import Branch, bout_seed, generator
from hil.suspending import around_stop

if TYPE_CHECKING:
    from rich.console import Console


class ControllerName(StrEnum):
    """Who chooses the maneuvers."""

    ADVICE = "advice"
    CHASE = "chase"
    RANDOM = "random"


TITLES = {ControllerName.ADVICE: "the advice", ControllerName.CHASE: "chasing", ControllerName.RANDOM: "random maneuvers"}


def bout(
    link: common.LinkArgument = None,
    *,
    advice: Annotated[
        Path | None,
        typer.Option(
            "--advice",
            metavar="RUN|FILE",
            help="Advice to play by, or the run that made it; the newest of the opponent if left out.",
        ),
    ] = None,
    controller: Annotated[
        ControllerName | None, typer.Option("--controller", help="Who chooses: the advice (default), or a yardstick.")
    ] = None,
    opponent: Annotated[
        str | None,
        typer.Option("--opponent", help="Opponent to place; the advice's own, or the one that is there, if left out."),
    ] = None,
    trials: Annotated[int, typer.Option("--trials", min=1, max=100_000, help="Bouts to play.")] = 100,
    require: Annotated[
        float | None, typer.Option("--require", min=0, max=1, metavar="RATE", help="Exit 1 if fewer are won.")
    ] = None,
    signing_key: common.SigningKeyOption = None,
    reconnect: common.ReconnectOption = common.RECONNECT,
    seed: common.SeedOption = 1,
    out: common.OutOption = None,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> int:
    """Play bouts by an advice file, or by a yardstick, and count them.

    Example: hil bout --opponent flat-light --trials 200
    """
    if opponent is not None:
        common.check_opponent(opponent)
    console = common.consoles(as_json=as_json, quiet=quiet)
    name = str(controller or ControllerName.ADVICE)
    if controller in {None, ControllerName.ADVICE}:
        given, advice = advice, runs.file_of(advice, runs.ADVICE, verbs=("coach",), opponent=opponent)
        if given != advice and not quiet:
            console.print(f"Advice: {advice}", markup=False)
    else:
        advice = None
    used = None if advice is None else str(advice)
    player = _controller(advice, controller, seed)
    if opponent is None and link is None:
        learnt_against = load_advice(advice).opponent if advice else ""
        opponent = learnt_against if learnt_against in common.OPPONENTS else "flat-light"
    described = {
        "verb": "bout",
        "controller": name,
        "advice": used or "",
        "trials": trials,
        "seed": seed,
        "opponent": opponent or "",
    }
    url = common.url_of(link, opponent, seed)
    with (
        running(
            "bout",
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
        ) as run,
        open_session(
            url,
            run=run,
            config=described,
            reconnect=reconnect,
            tell=common.teller(console, quiet=quiet),
            signing_key=signing_key,
        ) as session,
    ):
        ring = open_ring(session.junior, opponent)
        title = TITLES[controller or ControllerName.ADVICE]
        seeds = [bout_seed(seed, Branch.BOUTS, number) for number in range(1, trials + 1)]
        tally = Tally.of(
            ring.opponent,
            _play(session, console, player, ring, seeds, title=title, quiet=quiet),
        )
        short = require is not None and tally.win_rate.value < require
        result = {"controller": name, "advice": used, **tally.to_dict()}
        session.finish(result)
        run.finish(result, common.EXIT_FELL_SHORT if short else common.EXIT_DONE)
    document = {
        "controller": name,
        "advice": used,
        "seed": seed,
        "run": run.folder,
        "log": run.log_file,
        **tally.to_dict(),
    }
    with run.telling():
        if as_json:
            common.print_json(document)
        else:
            console.print(_table(name, tally))
            if run.log and not quiet:
                console.print(f"Log: {run.log}", markup=False)
        if short:
            console.print(f"Won {tally.win_rate.value:.3f}, required was {require:g}.")
    return run.ended()


def _controller(advice: Path | None, name: ControllerName | None, seed: int) -> Controller:
    match name or ControllerName.ADVICE:
        case ControllerName.CHASE:
            return ChaseController()
        case ControllerName.RANDOM:
            return RandomController(generator(seed, Branch.CONTROLLER))
        case ControllerName.ADVICE:
            if advice is None:
                raise common.UsageError("give an advice with --advice RUN|FILE, or --controller chase or random")
            return AdviceController(load_advice(advice))


def _play(
    session: Session,
    console: Console,
    player: Controller,
    ring: Ring,
    seeds: list[int],
    *,
    title: str,
    quiet: bool,
) -> list[Bout]:
    if not ring.refereed:
        raise RingError("a bout needs a referee who says how it ends, and nobody answers as one: use an emulated robot")
    bouts: list[Bout] = []
    won = 0
    session.series(f"bouts played by {title}")
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with (
        Progress(*columns, console=console, disable=quiet or not console.is_terminal, transient=True) as progress,
        around_stop(progress.live.stop, progress.start),
    ):
        task = progress.add_task("Playing", total=len(seeds))
        for one in play(ring, player, seeds):
            bouts.append(one)
            won += one.outcome.name == "WIN"
            session.bout(one)
            progress.update(task, advance=1, description=f"Playing: won {won} of {len(bouts)}")
    return bouts


def _table(controller: str, tally: Tally) -> Table:
    table = Table(title=f"{tally.trials} bouts against {tally.opponent}, controller: {controller}", title_justify="left")
    for head in ("won", "lost", "drawn", "win rate", "95 % interval", "median time to win"):
        table.add_column(head, justify="right")
    low, high = tally.win_rate.ci95
    time = "-" if tally.median_time_to_win is None else f"{tally.median_time_to_win:.2f} s"
    table.add_row(
        str(tally.wins), str(tally.losses), str(tally.draws), f"{tally.win_rate.value:.3f}", f"{low:.3f} to {high:.3f}", time
    )
    return table
