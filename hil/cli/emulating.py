"""`hil emulate`: what can be emulated, one sub-command each; without a name it is a Junior."""

from __future__ import annotations

from typing import Any

from hil.cli.verbs import Verb, VerbGroup, group_of

JUNIOR = "junior"


class Emulated(VerbGroup):
    """A group whose first sub-command is meant where none is named."""

    VERBS = (
        Verb(
            JUNIOR,
            "hil.cli.emulate:emulate",
            "Serve an emulated robot until interrupted: to any program that speaks MAVLink, or CAN, at the pace of real time.",
        ),
        Verb(
            "swarm",
            "hil.cli.emulate_swarm:swarm",
            "Serve emulated micro-robots on one table until interrupted, each with its firmware, at the pace of real time.",
        ),
    )

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer brings a click of its own, or not
        """Take the command line apart; one that begins with an option is a Junior's."""
        begun = not args and not ctx.resilient_parsing  # a shell that completes is told the names
        if begun or (args and args[0].startswith("-") and args[0] not in ctx.help_option_names):
            args = [JUNIOR, *args]
        return super().parse_args(ctx, args)


app = group_of(
    "emulate",
    Emulated,
    "Serve emulated robots in real time: a Junior, where nothing else is named, or a swarm of micro-robots.",
    shows_help=False,
)
