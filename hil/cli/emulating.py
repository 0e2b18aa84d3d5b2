"""`hil emulate`: what can be emulated, one sub-command each; without a name it is a Junior."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup

from hil.cli import common
from hil.cli.arguments import Subcommand
from hil.cli.emulate import emulate
from hil.cli.emulate_swarm import swarm

JUNIOR = "junior"


class _Emulated(TyperGroup):
    """A group whose first sub-command is meant where none is named."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer brings a click of its own, or not
        """Take the command line apart; one that begins with an option is a Junior's."""
        if not args or (args[0].startswith("-") and args[0] not in ctx.help_option_names):
            args = [JUNIOR, *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_Emulated,
    help="Serve emulated robots in real time: a Junior, where nothing else is named, or a swarm of micro-robots.",
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for name, command in ((JUNIOR, emulate), ("swarm", swarm)):
    app.command(name, cls=Subcommand, context_settings={"help_option_names": ["-h", "--help"]})(common.guarded(command))
