"""Lists the sub-commands and turns every ending into an exit status.

Exit status: 0 done, 1 the job ran and fell short, 2 wrong usage or configuration, 3 no robot or link lost for good,
4 a file could not be read or written, 130 interrupted.
"""

from __future__ import annotations

import sys
from io import TextIOWrapper
from typing import Annotated

import typer

from hil.cli.help_page import HELP
from hil.cli.verbs import Verb, VerbGroup


class Verbs(VerbGroup):
    """The verbs of `hil`."""

    VERBS = (
        Verb("coach", "hil.cli.coach:coach", "Let Pal coach Junior, and leave advice, log and report."),
        Verb("bout", "hil.cli.bout:bout", "Play bouts by an advice file, a policy, or a yardstick, and count them."),
        Verb(
            "tournament",
            "hil.cli.tournament:tournament",
            "Let robots play against each other, and say how strong each is.",
        ),
        Verb(
            "deploy",
            "hil.cli.deploy:deploy",
            "Write advice into the robot's memory, read it back and verify it; it survives power-off.",
        ),
        Verb(
            "check",
            "hil.cli.check:check",
            "Check that a robot, physical or emulated, keeps the protocol.",
        ),
        Verb(
            "monitor",
            "hil.cli.monitor:monitor",
            "Show robots on the terminal: where they are, what they sense, how good the link is.",
        ),
        Verb(
            "param",
            "hil.cli.param:param",
            "List, read, write, save or load a robot's parameters.",
        ),
        Verb(
            "ports",
            "hil.cli.ports:ports",
            "List serial ports and CAN interfaces, and say which answer as a robot.",
        ),
        Verb(
            "keygen",
            "hil.cli.keygen:keygen",
            "Make a signing key: a file that only you can read.",
        ),
        Verb(
            "key",
            "hil.cli.keygen:key",
            "Give a robot a signing key, change it, or take it away.",
        ),
        Verb(
            "replay",
            "hil.cli.replay:replay",
            "Do again what a log has recorded, on what it has recorded, and compare what is decided, up to the first "
            "difference.",
        ),
        Verb("view", "hil.cli.view:view", "Make one HTML page that plays a log: the arena, curves, events, lessons."),
        Verb("report", "hil.cli.report:report", "Say what happened in a run, on one self-contained HTML page with pictures."),
        Verb(
            "explain",
            "hil.cli.explain:explain",
            "Say why each maneuver of an advice is there: how it was bred, what was foretold, what came of it, what it beat.",
        ),
        Verb(
            "runs",
            "hil.cli.runs:runs",
            "List the runs in ./runs, the newest first: when, what, with what result, how large.",
        ),
        Verb(
            "emulate",
            "hil.cli.emulating:app",
            "Serve emulated robots in real time: a Junior, where nothing else is named, or a swarm of micro-robots.",
        ),
        Verb(
            "log",
            "hil.cli.log_app:app",
            "Look into logs: what is in one, whether it is in order; make it whole, small, or tables; compare two.",
        ),
        Verb("swarm", "hil.cli.swarm.app:app", "Micro-robots: let a swarm of them, emulated or real, learn a task."),
    )


app = typer.Typer(
    name="hil",
    cls=Verbs,
    help="Hardware-in-the-loop bridge for small robots: connect to a robot, real or emulated, let Pal coach it, read the log.",
    no_args_is_help=True,
    context_settings=HELP,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    epilog="Exit status: 0 done, 1 fell short, 2 wrong usage, 3 no robot or link lost, 4 a file failed, 130 interrupted.",
)


def _version(value: bool) -> None:  # noqa: FBT001 - typer's callback protocol
    if value:
        from hil import __version__  # noqa: PLC0415 - importlib.metadata takes a moment to load

        sys.stdout.write(f"hil {__version__}\n")
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
    app(prog_name="hil")


def run(arguments: list[str]) -> int:
    """Run the command line and stay.

    Args:
        arguments: Command line without the program's name.

    Returns:
        The exit status.
    """
    try:
        app(args=arguments, prog_name="hil")
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else 0
    return 0
