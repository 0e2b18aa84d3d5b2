"""Lists the sub-commands of `hil swarm`."""

from __future__ import annotations

import typer

from hil.cli.help_page import HELP
from hil.cli.verbs import Verb, VerbGroup


class SwarmVerbs(VerbGroup):
    """The verbs of `hil swarm`."""

    VERBS = (
        Verb(
            "surround",
            "hil.cli.swarm.surround:surround",
            "Let RANGERs learn to surround WILDs, and leave tables, log and report.",
        ),
        Verb(
            "identify",
            "hil.cli.swarm.robots:identify",
            "Have one micro-robot turn 20 degrees to the left and to the right, to see which it is.",
        ),
        Verb(
            "list",
            "hil.cli.swarm.robots:list_robots",
            "List the micro-robots on one link or several: they are only looked at, and go on with what they do.",
        ),
    )


app = typer.Typer(
    name="swarm",
    cls=SwarmVerbs,
    help="Micro-robots: let a swarm of them, emulated or real, learn a task.",
    no_args_is_help=True,
    context_settings=HELP,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


@app.callback()
def _swarm() -> None:
    """Take what comes before the sub-command: nothing."""
