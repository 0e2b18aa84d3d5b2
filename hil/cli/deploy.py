"""`hil deploy`: puts an advice into the robot's own memory, and has it play from there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from firmware_protocol.address import parse_address
from firmware_protocol.messages import State
from hil import deploying, runs
from hil.advice_file import load_advice
from hil.cli import common
from hil.cli.running import running
from hil.cli.session import Session, open_session
from hil.contest import COUNTDOWN, Contest, Ending, follow_contest, start_contest

if TYPE_CHECKING:
    from rich.console import Console

    from hil.deploying import Deployment

ENDINGS = {
    Ending.ROBOT: "The robot has ended the contest: its time is over, or somebody stopped it.",
    Ending.OUT_OF_REACH: "The robot is out of reach, and plays on by itself.",
}


def deploy(
    advice: Annotated[Path, typer.Argument(metavar="RUN|ADVICE", help="Advice file, or the run of hil coach that made it.")],
    link: Annotated[str, typer.Argument(metavar="LINK", help="Address of the robot, as serial:///dev/ttyACM0:115200.")],
    *,
    contest: Annotated[
        bool, typer.Option("--contest", help="Then start a contest: the robot plays from its memory. Ctrl-C stops it.")
    ] = False,
    countdown: Annotated[
        float, typer.Option("--countdown", min=0, max=60, metavar="SECONDS", help="The robot stands still for so long first.")
    ] = COUNTDOWN,
    leave: Annotated[
        bool, typer.Option("--leave", help="With --contest: do not look on, leave the robot playing by itself.")
    ] = False,
    signing_key: common.SigningKeyOption = None,
    seed: common.SeedOption = 1,
    out: common.OutOption = None,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> int:
    """Write an advice into the robot's memory, read it back and verify it; it survives power-off.

    From then on the robot plays without a host: by --contest, or by its start module.

    Example: hil deploy runs/20261128-130501-coach-flat-light serial:///dev/ttyACM0:115200 --contest
    """
    advice = runs.file_of(advice, runs.ADVICE)
    learnt = load_advice(advice)
    if leave and not contest:
        raise common.UsageError("--leave goes with --contest: without it nothing moves")
    if leave and parse_address(link).scheme == "sim":
        raise common.UsageError("--leave makes no sense with sim://: that robot ends with this program (hil emulate stays)")
    console = common.consoles(as_json=as_json, quiet=quiet)
    described = {"verb": "deploy", "contest": contest, "seed": seed}
    told = common.teller(console, quiet=quiet)
    with (
        running(
            "deploy",
            learnt.opponent or "robot",
            url=link,
            opponent=learnt.opponent,
            seed=seed,
            signing_key=signing_key,
            out=out,
            log=log,
            no_log=no_log,
            overwrite=overwrite,
        ) as run,
        open_session(link, run=run, config=described, arm=False, tell=told, signing_key=signing_key) as session,
    ):
        done = deploying.deploy(session.junior, learnt)
        if not as_json:
            _show(console, session.junior.description, done, learnt.objective, quiet=quiet)
        ended = None
        if contest:
            if session.suspension is not None:
                session.suspension.plays_on = True
            start_contest(session.junior, countdown)
            if not quiet:
                console.print(f"Contest: the robot stands still for {countdown:g} s, then it plays. Ctrl-C stops it.")
            if leave:
                session.junior.leave()
            else:
                ended = _follow(session, console, countdown, seed, quiet=quiet)
        document = _document(done, ended)
        session.finish(document)
        run.finish(document)
    with run.telling():
        if as_json:
            common.print_json({"advice": str(advice), "run": run.folder, "log": run.log_file, **document})
        elif run.log and not quiet:
            console.print(f"Log: {run.log}", markup=False)
    return run.ended()


def _follow(session: Session, console: Console, countdown: float, seed: int, *, quiet: bool) -> Contest:
    """Look on, and say how it went."""
    told: set[State] = set()

    def each(state: State) -> None:
        if state is State.CONTEST and state not in told and not quiet:
            console.print("It plays.")
        told.add(state)

    ended = follow_contest(session.junior, countdown, seed=seed, each=each)
    if ended.outcome is not None and ended.elapsed is not None:
        console.print(f"The bout is over: {ended.outcome.name.lower()} after {ended.elapsed:.2f} s.")
    else:
        console.print(ENDINGS[ended.ending])
    if ended.ending is Ending.OUT_OF_REACH:  # should it hear us all the same: a contest is not ended by the loss of its host
        session.junior.leave()
    return ended


def _show(console: Console, robot: str, done: Deployment, objective: str, *, quiet: bool) -> None:
    """What the robot's memory holds now."""
    if not quiet:
        table = Table(title=f"Memory of {robot}", title_justify="left")
        for head in ("when it senses", "it performs", "an action lasts"):
            table.add_column(head)
        for slot in done.plan.slots:
            table.add_row(slot.situation, str(slot.maneuver), f"{slot.maneuver.period:g} s")
        console.print(table)
    count = len(done.plan.slots)
    console.print(
        f"{count} slots read back as they should be (checksum {done.checksum:#06x}): "
        f"{done.written} written, {done.kept} were there, {done.erased} others erased; learnt by objective {objective}."
    )
    if done.plan.left_out:
        rest = ", ".join(slot.situation for slot in done.plan.left_out)
        console.print(f"The robot's memory has no room for {len(done.plan.left_out)} more, least tried of all: {rest}.")


def _document(done: Deployment, ended: Contest | None) -> dict[str, object]:
    """The JSON object."""
    return {
        "verified": True,
        "slots": [
            {
                "situation": slot.situation,
                "previous": slot.previous,
                "current": slot.current,
                "actions": [action.name for action in slot.maneuver.actions],
                "period_s": slot.maneuver.period,
            }
            for slot in done.plan.slots
        ],
        "left_out": [slot.situation for slot in done.plan.left_out],
        "written": done.written,
        "kept": done.kept,
        "erased": done.erased,
        "checksum": done.checksum,
        "contest": None
        if ended is None
        else {
            "ending": str(ended.ending),
            "outcome": None if ended.outcome is None else ended.outcome.name.lower(),
            "elapsed_s": ended.elapsed,
        },
    }
