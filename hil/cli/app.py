"""Collects the sub-commands and turns every ending into an exit status.

Exit status: 0 done, 1 the job ran and fell short, 2 wrong usage or configuration, 3 no robot or link lost for good,
4 a file could not be read or written, 130 interrupted.
"""

from __future__ import annotations

import sys
from importlib import metadata
from io import TextIOWrapper
from typing import Annotated

import typer

from hil.cli import common
from hil.cli.arguments import Subcommand
from hil.cli.bout import bout
from hil.cli.check import check
from hil.cli.coach import coach
from hil.cli.deploy import deploy
from hil.cli.emulating import app as emulate_app
from hil.cli.keygen import key, keygen
from hil.cli.log import app as log_app
from hil.cli.monitor import monitor
from hil.cli.param import param
from hil.cli.ports import ports
from hil.cli.replay import replay
from hil.cli.report import report
from hil.cli.runs import runs
from hil.cli.swarm.app import app as swarm_app
from hil.cli.view import view

app = typer.Typer(
    name="hil",
    help="Hardware-in-the-loop bridge for small robots: connect to a robot, real or emulated, let Pal coach it, read the log.",
    no_args_is_help=True,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    epilog="Exit status: 0 done, 1 fell short, 2 wrong usage, 3 no robot or link lost, 4 a file failed, 130 interrupted.",
)
for command in (coach, bout, deploy, check, monitor, param, ports, keygen, key, replay, report, runs, view):
    app.command(cls=Subcommand, context_settings={"help_option_names": ["-h", "--help"]})(common.guarded(command))
app.add_typer(emulate_app, name="emulate")
app.add_typer(log_app, name="log")
app.add_typer(swarm_app, name="swarm")


def _version(value: bool) -> None:  # noqa: FBT001 - typer's callback protocol
    if value:
        sys.stdout.write(f"hil {metadata.version('junior-hil')}\n")
        raise typer.Exit


@app.callback()
def _root(
    *,
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")] = False,
) -> None:
    """Take the options that come before the sub-command."""


def main() -> None:
    """Run the command line and leave the process."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a name that the terminal has no letters for is no reason to fail
            stream.reconfigure(errors="backslashreplace")
    app()


def run(arguments: list[str]) -> int:
    """Run the command line and stay.

    Args:
        arguments: Command line without the program's name.

    Returns:
        The exit status.
    """
    try:
        app(args=arguments)
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else common.EXIT_DONE
    return common.EXIT_DONE
