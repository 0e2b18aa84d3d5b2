"""Collects the sub-commands and turns every ending into an exit status.

Exit status: 0 done, 1 the job ran and fell short, 2 wrong usage or configuration, 3 no robot or link lost for good,
130 interrupted.
"""

from __future__ import annotations

import sys
from importlib import metadata
from typing import Annotated

import click
import typer
from rich.console import Console

from firmware_protocol.errors import HilError, LinkError, PeerError
from hil.cli import common
from hil.cli.bout import bout
from hil.cli.coach import coach
from hil.cli.emulate import emulate
from hil.cli.monitor import monitor
from hil.cli.param import param
from hil.cli.ports import ports
from hil.cli.report import report

app = typer.Typer(
    name="hil",
    help="Hardware-in-the-loop bridge for small robots: connect to a robot, real or emulated, let Pal coach it, look at the log.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    epilog="Exit status: 0 done, 1 ran and fell short, 2 wrong usage, 3 no robot or link lost, 130 interrupted.",
)
for command in (coach, bout, emulate, monitor, param, ports, report):
    app.command(context_settings={"help_option_names": ["-h", "--help"]})(command)


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


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and leave the process.

    Args:
        arguments: Command line without the program's name; `sys.argv` if left out.
    """
    sys.exit(run(arguments))


def run(arguments: list[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: Command line without the program's name; `sys.argv` if left out.

    Returns:
        The exit status.
    """
    errors = Console(stderr=True, highlight=False, soft_wrap=True)
    try:
        status = app(args=arguments, standalone_mode=False)
    except click.exceptions.Abort:
        errors.print("Interrupted.")
        return common.EXIT_INTERRUPTED
    except click.ClickException as error:
        error.show()
        return common.EXIT_USAGE
    except KeyboardInterrupt:
        errors.print("Interrupted.")
        return common.EXIT_INTERRUPTED
    except (LinkError, PeerError) as error:
        errors.print(f"hil: {error}", markup=False)
        return common.EXIT_NO_ROBOT
    except (common.UsageError, HilError) as error:
        errors.print(f"hil: {error}", markup=False)
        return common.EXIT_USAGE
    except BrokenPipeError:
        sys.stderr.close()
        return common.EXIT_DONE
    return status if isinstance(status, int) else common.EXIT_DONE
