"""What the sub-commands share: options, consoles, where logs go, and how errors become exit statuses."""

from __future__ import annotations

import functools
import math
import os
import sys
from contextvars import ContextVar
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec

import typer
from rich.console import Console

from firmware_protocol.errors import AddressError, HilError, LinkError, PeerError, RefusedError
from firmware_protocol.near import did_you_mean
from hil.cli.arguments import load_config
from hil.cli.completion import link_words
from hil.files.json_text import json_text
from hil.mcaplog.errors import UnreadableLogError
from hil.sumo.deploying import DeployError
from hil.sumo.ring import OPPONENTS
from hil.working.errors import WorkerError
from hil.working.processes import MOST_WORKERS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

P = ParamSpec("P")

EXIT_DONE = 0
EXIT_FELL_SHORT = 1
EXIT_USAGE = 2
EXIT_NO_ROBOT = 3
EXIT_FILE = 4
EXIT_INTERRUPTED = 130


UNBOUNDED = 10_000
"""Columns of what is no terminal: a row of a table is a line, and no name in it is broken."""


class UsageError(Exception):
    """A wrong option or configuration file; the text says what to change."""


OPTIONS: ContextVar[Mapping[str, object]] = ContextVar("OPTIONS", default=MappingProxyType({}))
"""Every option of the sub-command that runs, as it was resolved."""


def guarded(command: Callable[P, int | None]) -> Callable[P, None]:
    """Turn every ending of a sub-command into a message and an exit status; a user's mistake shows no traceback.

    Args:
        command: The sub-command.

    Returns:
        The same, for typer.
    """

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        OPTIONS.set(kwargs)
        try:
            _check_numbers(kwargs)
            status = command(*args, **kwargs)
        except KeyboardInterrupt:
            complain("Interrupted.", program=False)
            status = EXIT_INTERRUPTED
        except BrokenPipeError:  # who reads our output has had enough; typer ends without a word
            raise
        except (UsageError, HilError) as error:
            complain(str(error))
            status = status_of(error)
        except OSError as error:
            complain(in_words(error))
            status = EXIT_FILE
        raise typer.Exit(status or EXIT_DONE)

    return run


def status_of(error: BaseException) -> int:
    """The exit status that an error ends a sub-command with.

    Args:
        error: The error.
    """
    if isinstance(error, AddressError):
        return EXIT_USAGE
    if isinstance(error, BrokenPipeError | RefusedError | DeployError):  # the first as typer ends then
        return EXIT_FELL_SHORT
    if isinstance(error, WorkerError):
        return error.status
    if isinstance(error, LinkError | PeerError):
        return EXIT_NO_ROBOT
    # What is there already was asked for wrongly; everything else of a file is the file's.
    file = error if isinstance(error, OSError) else error.__cause__ if isinstance(error, HilError) else None
    if isinstance(error, UnreadableLogError) or (isinstance(file, OSError) and not isinstance(file, FileExistsError)):
        return EXIT_FILE
    return EXIT_USAGE if isinstance(error, UsageError | HilError) else EXIT_FELL_SHORT


def in_words(error: BaseException) -> str:
    """What ended a sub-command, as a person is told.

    Args:
        error: The error.
    """
    if isinstance(error, OSError) and not isinstance(error, HilError):
        return f"{error.filename or 'the output'} cannot be written or read: {error.strerror or error}"
    if isinstance(error, SystemExit):  # rich's word for a pipe that is closed
        return "the output cannot be written: nobody reads it any more"
    return str(error)


def was_given(context: typer.Context, name: str) -> bool:
    """Whether an option was given, on the command line or by a file, and is not what it is by default.

    Args:
        context: The command line.
        name: Name of its parameter.
    """
    source = context.get_parameter_source(name)
    return source is not None and "DEFAULT" not in source.name


def complain(text: str, *, program: bool = True) -> None:
    """Say on stderr what went wrong.

    Args:
        text: What.
        program: Say who says so.
    """
    plain_console(stderr=True).print(f"hil: {text}" if program else text)


LinkArgument = Annotated[
    str | None,
    typer.Argument(
        metavar="LINK",
        autocompletion=link_words,
        help="Address of the robot: /dev/ttyACM0, serial:///dev/ttyACM0:57600, tcp://127.0.0.1:5760, udpin://127.0.0.1:14550, "
        "sim://junior?opponent=flat-light; auto: the one that answers. Left out: an emulated robot in this process.",
    ),
]
RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar="LINK",
        autocompletion=link_words,
        help="Address of the robot, as /dev/ttyACM0; auto: the one that answers.",
    ),
]
"""As `LinkArgument`, where an emulated robot in this process would be gone at once."""
ConfigOption = Annotated[
    Path | None,
    typer.Option("--config", is_eager=True, callback=load_config, help="TOML file that sets any option.", metavar="FILE.toml"),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object to stdout, everything else to stderr.")]
JsonLinesOption = Annotated[
    bool,
    typer.Option("--json", help="Print JSON lines to stdout: what is served; at the end what was late, if anything was."),
]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print the result only.")]
SeedOption = Annotated[int, typer.Option("--seed", min=0, max=2**31 - 1, help="Seed of every random choice.")]
LogOption = Annotated[
    Path | None,
    typer.Option("--log", metavar="FILE.mcap", help="Where the log goes; log.mcap in the run's folder if left out."),
]
SigningKeyOption = Annotated[
    Path | None,
    typer.Option(
        "--signing-key", metavar="FILE", help="Key file: sign what is sent, believe what is signed (hil keygen makes one)."
    ),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="The run's folder, made by it; runs/DATE-TIME-VERB-WHAT if left out."),
]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace named outputs that exist, when the new are whole.")]
NoLogOption = Annotated[bool, typer.Option("--no-log", help="Write no log.")]
ReconnectOption = Annotated[
    float,
    typer.Option(
        "--reconnect",
        min=0,
        max=86400,
        metavar="SECONDS",
        help="Wait so long for a robot or a link that is lost to come back; 0 ends the run at once.",
    ),
]
RECONNECT = 30.0
"""How long a lost robot is waited for, in s, where nothing else is said: time to plug it in again or to change a battery."""


def workers_option(text: str) -> Any:  # noqa: ANN401 - as typer has it
    """The option `--workers`: how many processes share the work.

    Args:
        text: Its help.
    """
    return typer.Option("--workers", min=1, max=MOST_WORKERS, metavar="N", help=text, show_default=False)


def _check_numbers(options: dict[str, Any]) -> None:
    """See that every option with a number has one.

    Raises:
        UsageError: One is NaN or infinite, which passes every bound.
    """
    for name, value in options.items():
        if isinstance(value, float) and not math.isfinite(value):
            raise UsageError(f"{name.replace('_', '-')}: expected a number, not {value}")


def opponents() -> list[str]:
    """Names of the opponents, for a shell that completes."""
    return list(OPPONENTS)


def check_opponent(name: str) -> str:
    """See that there is such an opponent.

    Args:
        name: Name as given.

    Returns:
        The name.

    Raises:
        UsageError: There is none of this name.
    """
    if name not in OPPONENTS:
        raise UsageError(f"there is no opponent {name!r}: choose one of {', '.join(OPPONENTS)}{did_you_mean(name, OPPONENTS)}")
    return name


def url_of(link: str | None, opponent: str | None, seed: int) -> str:
    """The address of the robot.

    Args:
        link: As given; None is an emulated robot in this process.
        opponent: Its opponent; None is `flat-light`.
        seed: Its seed.
    """
    return link if link is not None else f"sim://junior?opponent={opponent or 'flat-light'}&seed={seed}"


def consoles(*, as_json: bool, quiet: bool = False) -> Console:
    """The console for words and tables: stderr when stdout is to carry JSON.

    Args:
        as_json: JSON was asked for.
        quiet: Nothing but results is wanted.

    Returns:
        A console.
    """
    return plain_console(stderr=as_json, quiet=quiet and as_json)


def plain_console(*, stderr: bool, quiet: bool = False) -> Console:
    """A console that prints every text as it is, in tables too: no brackets or colons in a name are markup.

    Args:
        stderr: It prints to stderr, not to stdout.
        quiet: It prints nothing.
    """
    console = Console(stderr=stderr, quiet=quiet, highlight=False, soft_wrap=True, markup=False, emoji=False)
    if not console.is_terminal and "COLUMNS" not in os.environ:  # then nobody's screen ends a line
        console.width = UNBOUNDED
    return console


def print_json(document: dict[str, Any] | list[Any]) -> None:
    """Print one JSON document to stdout, where there is one; JSON has no word for NaN and infinity: they are null."""
    if sys.stdout is not None:
        sys.stdout.write(json_text(document))
    flush()


def print_json_line(document: dict[str, Any]) -> None:
    """Print one JSON document to a line of stdout of its own, where there is one, and see that it is out."""
    if sys.stdout is not None:
        sys.stdout.write(json_text(document, indent=None))
    flush()


def flush() -> None:
    """See that what was printed is out, where there is a stdout."""
    if sys.stdout is not None:
        sys.stdout.flush()
