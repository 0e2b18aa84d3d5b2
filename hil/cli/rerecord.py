"""`hil replay --rerecord`: the same again with today's program, on the same emulated robot, and what differs."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from firmware_protocol.errors import HilError
from hil.cli import common
from hil.cli.log_tables import print_comparison, require_compared
from hil.cli.running import ActiveRun
from hil.cli.stage import LiveStage
from hil.files.outputs import OutputError, check_output
from hil.mcaplog.compare import compare_logs
from hil.replaying.again import why_not_again
from hil.replaying.host import recorded_job
from hil.replaying.tape import ReplayError, Tape

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

    from hil.mcaplog.limits import ReadLimits


def rerecorded(
    log: Path, out: Path, limits: ReadLimits, console: Console, *, overwrite: bool, as_json: bool, quiet: bool
) -> int:
    """Do again what a log of an emulated robot in this process has recorded, into a new log, and compare the two.

    Args:
        log: The log.
        out: The new log.
        limits: What the log may unpack to.
        console: Where to say what differs.
        overwrite: A new log that exists may be replaced.
        as_json: Print JSON.
        quiet: Say nothing but that.

    Returns:
        The exit status.

    Raises:
        ReplayError: It is not of an emulated robot in lock-step, does not say what was asked for, or has
            no step that could be read.
        OutputError: The new log can't be written, or is the log.
        LogError: The log can't be read.
    """
    check_output(out, overwrite=overwrite)
    if out.exists() and out.samefile(log):
        raise OutputError(f"{out} is the log itself, which the new one is compared with: give --rerecord another name")
    tape = Tape(log, limits, compared=False)
    job, url, _ = recorded_job(tape)
    if obstacle := why_not_again(tape, url):
        raise ReplayError(obstacle)
    tape.first_step()
    run = ActiveRun(None, out, overwrite=overwrite)
    try:
        job.perform(LiveStage(run, job, url, common.plain_console(stderr=True, quiet=True), quiet=True))
    except HilError as error:
        console.print(f"The run ended: {error}", markup=False)
    found = compare_logs(log, out, limits=limits)
    require_compared(found)
    if as_json:
        common.print_json({"first": str(log), "second": str(out), "same": found.same, **asdict(found)})
    elif not quiet:
        console.print(f"A is {log}, B is {out}", markup=False)
        print_comparison(found, console)
        if not found.same:
            console.print("What to do: docs/replay.md, When a change was meant")
    status = common.EXIT_DONE if found.same else common.EXIT_FELL_SHORT
    return run.ended() or status
