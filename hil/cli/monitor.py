"""`hil monitor`: a live view of robots, and the keys that drive them."""

from __future__ import annotations

from typing import Annotated

import typer

from hil.cli import common, links
from hil.cli import share as share_options
from hil.cli.running import running
from hil.cli.stage import LiveStage
from hil.cockpit.window import can_show
from hil.jobs.monitor import MonitorJob


def monitor(
    link: common.LinkArgument = None,
    *,
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration",
            min=0.1,
            help="Stop after this time, in s; left out, when q is pressed. Without a terminal a robot emulated in this process "
            "is shown for its first 10 s.",
        ),
    ] = None,
    robot: Annotated[
        str, typer.Option("--robot", metavar="ADDRESS", help="Of a swarm this micro-robot alone, in full: ID, or NETWORK.ID.")
    ] = "",
    micro: Annotated[bool, typer.Option("--micro", help="Micro-robots alone, where others are at LINK, too.")] = False,
    share: share_options.ShareOption = None,
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
    """Show robots on the terminal: where they are, what they sense, how good the link is. Drive them by keys.

    Who is there is found out by listening. Without LINK it is an emulated robot in real time: the key a arms it, arrows
    drive it, ? shows all keys. Without a terminal a line is printed every second.

    Pull the plug and put it back: it goes on, and the robot is disarmed.

    Of several robots on one link each has a line. They are only watched; the keys n and p choose one, and the first key that
    moves it stops and disarms it first. So it is with micro-robots; with --robot one is shown in full.

    Example: hil monitor /dev/ttyACM0
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    link = links.settled(link, yes=yes, quiet=quiet, signing_key=signing_key)
    url = common.url_of(link, None, seed)
    live = not (as_json or quiet) and can_show()
    shared = share_options.shared_address(share, link and [link], "monitor", no_log=no_log, paced=live)
    job = MonitorJob(duration, seed, reconnect, silent=as_json or quiet, micro=micro, robot=robot, live=live)
    with running(
        "monitor",
        "emulated" if link is None else "robot",
        url=url,
        emulated_here=link is None,
        seed=seed,
        signing_key=signing_key,
        out=out,
        log=log,
        no_log=no_log,
        overwrite=overwrite,
    ) as run:
        stage = LiveStage(run, job, url, console, quiet=quiet, signing_key=signing_key, options=config, live=live, share=shared)
        document = job.perform(stage)
        run.finish({})
    if as_json:
        with run.telling():
            common.print_json(document)
    return run.ended()
