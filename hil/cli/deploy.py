"""`hil deploy`: puts an advice into the robot's own memory, and has it play from there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from firmware_protocol.address import parse_address
from hil import runs
from hil.cli import common, links
from hil.cli import share as share_options
from hil.cli.running import running
from hil.cli.stage import LiveStage
from hil.jobs.deploy import DeployJob
from hil.sumo.advice_file import load_advice
from hil.sumo.contest import COUNTDOWN, Contest, Ending

if TYPE_CHECKING:
    from rich.console import Console

    from hil.sumo.deploying import Deployment

ENDINGS = {
    Ending.ROBOT: "The robot has ended the contest: its time is over, or somebody stopped it.",
    Ending.OUT_OF_REACH: "The robot is out of reach, and plays on by itself.",
}


def deploy(
    advice: Annotated[Path, typer.Argument(metavar="RUN|ADVICE", help="Advice file, or the run of hil coach that made it.")],
    link: common.RobotArgument,
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
    share: share_options.ShareOption = None,
    yes: links.YesOption = False,
    signing_key: common.SigningKeyOption = None,
    seed: common.SeedOption = 1,
    out: common.OutOption = None,
    log: common.LogOption = None,
    no_log: common.NoLogOption = False,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,
) -> int:
    """Write advice into the robot's memory, read it back and verify it; it survives power-off.

    From then on the robot plays without a host: by --contest, or by its start module.

    Example: hil deploy runs/20261128-130501-coach-flat-light /dev/ttyACM0 --contest
    """
    advice = runs.file_of(advice, runs.ADVICE)
    learnt = load_advice(advice)
    if leave and not contest:
        raise common.UsageError("--leave goes with --contest: without it nothing moves")
    link = links.settled(link, yes=yes, quiet=quiet, signing_key=signing_key)
    if leave and parse_address(link).scheme == "sim":
        raise common.UsageError("--leave makes no sense with sim://: that robot ends with this program (hil emulate stays)")
    shared = share_options.shared_address(share, [link], "deploy", no_log=no_log)
    if leave and shared is not None:
        raise common.UsageError("--share ends with this program, which --leave ends at once: leave out one of the two")
    console = common.consoles(as_json=as_json, quiet=quiet)

    def stored(robot: str, memory: Deployment) -> None:
        if not as_json:
            _show(console, robot, memory, learnt.objective, quiet=quiet)

    job = DeployJob(learnt, contest=contest, countdown=countdown, leave=leave, seed=seed, stored=stored)
    with running(
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
    ) as run:
        stage = LiveStage(run, job, link, console, quiet=quiet, signing_key=signing_key, options=config, share=shared)
        deployed = job.perform(stage)
        document = deployed.facts()
        run.finish(document)
    with run.telling():
        if deployed.contest is not None:
            _tell_ending(console, deployed.contest)
        if as_json:
            common.print_json({"advice": str(advice), "run": run.folder, "log": run.log_file, **document})
        elif run.log and not quiet:
            console.print(f"Log: {run.log}", markup=False)
    return run.ended()


def _tell_ending(console: Console, ended: Contest) -> None:
    """Say how the contest went."""
    if ended.outcome is not None and ended.elapsed is not None:
        console.print(f"The bout is over: {ended.outcome.name.lower()} after {ended.elapsed:.2f} s.")
    else:
        console.print(ENDINGS[ended.ending])


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
