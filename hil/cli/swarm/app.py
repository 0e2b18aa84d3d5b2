"""Collects the sub-commands of `hil swarm`."""

from __future__ import annotations

import typer

from hil.cli import common
from hil.cli.arguments import Subcommand
from hil.cli.swarm.robots import identify, list_robots
from hil.cli.swarm.surround import surround

app = typer.Typer(
    name="swarm",
    help="Micro-robots: let a swarm of them, emulated or real, learn a task.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for command in (surround, identify):
    app.command(cls=Subcommand, context_settings={"help_option_names": ["-h", "--help"]})(common.guarded(command))
app.command("list", cls=Subcommand, context_settings={"help_option_names": ["-h", "--help"]})(common.guarded(list_robots))
