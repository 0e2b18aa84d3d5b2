"""`hil bout`: plays bouts and counts them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from firmware_protocol.near import did_you_mean
from hil import runs
from hil.cli import common, links
from hil.cli import live as live_options
from hil.cli import share as share_options
from hil.cli.asking import check_asked
from hil.cli.running import running
from hil.cli.stage import LiveStage
from hil.cli.workers import check_side_by_side, play_side_by_side
from hil.jobs.bout import BoutJob, ControllerName
from hil.policies import load_policy
from hil.sumo.advice_file import load_advice
from hil.sumo.ring import OPPONENTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from hil.policies import Policy
    from hil.sumo.bouts import Tally


def _controllers() -> list[str]:
    """Names of controllers, for completion."""
    return [name.value for name in ControllerName if name is not ControllerName.POLICY]


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
        str | None,
        typer.Option(
            "--controller",
            metavar="NAME|FILE",
            autocompletion=_controllers,
            help="Who chooses: advice (default), a yardstick, or the policy in a file (.json).",
        ),
    ] = None,
    opponent: Annotated[
        str | None,
        typer.Option(
            "--opponent",
            autocompletion=common.opponents,
            help="Opponent to place; the advice's own, or the one that is there, if left out.",
        ),
    ] = None,
    trials: Annotated[int, typer.Option("--trials", min=1, max=100_000, help="Bouts to play.")] = 100,
    require: Annotated[
        float | None, typer.Option("--require", min=0, max=1, metavar="RATE", help="Exit 1 if fewer are won.")
    ] = None,
    workers: Annotated[
        int | None,
        common.workers_option(
            "Play in N processes side by side, ten bouts at a time on a new emulated robot, with a log of each ten: the "
            "same result for every N. Left out: all bouts on one robot, in one log."
        ),
    ] = None,
    judge: Annotated[
        bool,
        typer.Option("--judge", help="A person sets up the ring and says how each bout ends: by keys, or on the --live page."),
    ] = False,
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
    """Play bouts by an advice file, a policy, or a yardstick, and count them.

    Examples: hil bout --opponent flat-light --trials 200; hil bout --trials 2000 --workers 4
    """
    if opponent is not None:
        common.check_opponent(opponent)
    link = links.settled(link, yes=yes, quiet=quiet, signing_key=signing_key)
    if workers is not None:
        check_side_by_side(link, log, live=live)
    page = live_options.live_page(live, open_page, public=public, no_log=no_log, viewer=viewer)
    shared = share_options.shared_address(share, link and [link], "bout", no_log=no_log)
    console = common.consoles(as_json=as_json, quiet=quiet)
    chosen, policy = _chosen(controller)
    used: str | None = None
    learnt = None
    if chosen is ControllerName.ADVICE:
        found = runs.file_of(advice, runs.ADVICE, verbs=("coach",), opponent=opponent)
        if found != advice and not quiet:
            console.print(f"Advice: {found}", markup=False)
        learnt, used = load_advice(found), str(found)
    if opponent is None and link is None:
        own = learnt.opponent if learnt is not None else policy.opponent if policy is not None else ""
        opponent = own if own in OPPONENTS else "flat-light"
    url = common.url_of(link, opponent, seed)
    in_real_time = not links.emulated_here(url)
    check_asked("--judge" if judge else None, in_real_time=in_real_time and workers is None, live=live)
    pauses = page is not None and in_real_time and not judge
    job = BoutJob(chosen, learnt, trials, opponent, seed, reconnect, judged=judge, pauses=pauses, policy=policy)
    with running(
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
    ) as run:
        logs: list[str] | None = None
        if workers is None:
            stage = LiveStage(
                run, job, url, console, quiet=quiet, signing_key=signing_key, options=config, page=page, share=shared
            )
            tally = job.perform(stage)
        else:
            tally, made = play_side_by_side(
                job, url, workers, run, console, quiet=quiet, signing_key=signing_key, options=config
            )
            logs = list(map(str, made))
        short = require is not None and tally.win_rate.value < require
        played_by = {"advice": used} if policy is None else {"policy": controller}
        result = {"controller": chosen.value, **played_by, **tally.to_dict()}
        run.finish(result, common.EXIT_FELL_SHORT if short else common.EXIT_DONE)
    document = {**result, "seed": seed, "run": run.folder, "log": run.log_file}
    if logs is not None:
        document["logs"] = logs
    with run.telling():
        if as_json:
            common.print_json(document)
        else:
            console.print(_table(chosen.value, tally))
            if not quiet:
                _tell_logs(console, [run.log_file] if logs is None else logs)
        if short:
            console.print(f"Won {tally.win_rate.value:.3f}, required was {require:g}.")
    return run.ended()


def _chosen(controller: str | None) -> tuple[ControllerName, Policy | None]:
    """Who chooses, and the policy where one does.

    Args:
        controller: As on the command line: a name, or a policy file.

    Raises:
        BadParameter: It is neither.
        PolicyFileError: The file can't be read, or holds no policy.
    """
    if controller is None:
        return ControllerName.ADVICE, None
    if controller in _controllers():
        return ControllerName(controller), None
    if Path(controller).suffix == ".json":
        return ControllerName.POLICY, load_policy(Path(controller))
    names = _controllers()
    raise typer.BadParameter(
        f"{controller!r} is none: choose one of {', '.join(names)}, or a policy file (.json){did_you_mean(controller, names)}",
        param_hint="--controller",
    )


def _tell_logs(console: Console, logs: Sequence[str | None]) -> None:
    """Say where the logs are, as far as there are any."""
    if len(logs) > 1:
        console.print(f"Logs: {logs[0]} to {logs[-1]}", markup=False)
    elif logs and logs[0]:
        console.print(f"Log: {logs[0]}", markup=False)


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
