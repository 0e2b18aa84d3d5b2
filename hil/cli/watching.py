"""`hil view LINK`: the live page of robots that somebody else controls, or nobody."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.address import parse_address
from hil.cli import common
from hil.cli.running import running
from hil.cli.stage import LiveStage
from hil.jobs.watch import WatchJob

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

    from hil.cli.live import LivePage

ALONE: Final = {
    "sim": "a robot that is emulated in this process does nothing by itself: hil coach --live shows one, or serve it with "
    "hil emulate, and view its address",
    "replay": "what a log holds is over: name the log itself",
}
"""Links at which there is nothing to be watched, and what to do instead."""


def watched(
    url: str,
    page: LivePage,
    console: Console,
    *,
    duration: float | None,
    signing_key: Path | None,
    reconnect: float,
    out: Path | None,
    log: Path | None,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
    config: Path | None,
) -> int:
    """Watch the robots at a link, and show them on a page until that is ended.

    Args:
        url: Address of the link.
        page: Shows them.
        console: Where words go.
        duration: For how long, in s; None: until it is interrupted.
        signing_key: Key file.
        reconnect: How long a link that is lost is waited for, in s.
        out: The run's folder.
        log: Where the log goes.
        overwrite: Named outputs that exist may be replaced.
        as_json: JSON was asked for.
        quiet: Nothing but results is wanted.
        config: File that options were taken from.

    Returns:
        The exit status.

    Raises:
        UsageError: There is nothing to be watched at this link.
        HilError: As of every verb with a link.
    """
    instead = ALONE.get(parse_address(url).scheme)
    if instead is not None:
        raise common.UsageError(instead)
    job = WatchJob(duration, reconnect)
    with running(job.VERB, "robot", url=url, signing_key=signing_key, out=out, log=log, overwrite=overwrite) as run:
        stage = LiveStage(run, job, url, console, quiet=quiet, signing_key=signing_key, options=config, page=page)
        result = {"robots": job.perform(stage)}
        run.finish(result)
    with run.telling():
        if as_json:
            common.print_json({**result, "run": run.folder, "log": run.log_file})
        elif not quiet:
            console.print(f"Log: {run.log_file}", markup=False)
    return run.ended()
