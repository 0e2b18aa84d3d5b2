"""What verbs that read logs take: a log, where things go, what chunks may unpack to."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil import runs
from hil.cli import common

if TYPE_CHECKING:
    from rich.console import Console

LogArgument = Annotated[
    Path | None,
    typer.Argument(metavar="RUN|LOG", help="A run's folder or a log (.mcap); the newest run if left out."),
]
OutLogOption = Annotated[Path, typer.Option("--out", "-o", metavar="FILE.mcap", help="Where the new log goes.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace one that exists, when the new one is whole.")]
MaxChunkOption = Annotated[
    int | None,
    typer.Option(
        "--max-chunk",
        metavar="MIB",
        min=1,
        max=2048,
        help="For a log that you trust: its chunks may unpack to so many MiB [default: 16], the whole to any size.",
    ),
]
SHOWN = 100
"""Letters of a value that are shown in a table."""


def find(log: Path | None, console: Console, *, quiet: bool) -> Path:
    """The log that a person names, and say which where that is not plain.

    Args:
        log: A run's folder, a file, None for the newest run.
        console: Where to say it.
        quiet: Don't.

    Raises:
        RunError: There is no such run.
        UsageError: There is no such file.
    """
    found = runs.file_of(log, runs.LOG)
    if found != log and not quiet:
        console.print(f"Log: {found}")
    if not found.is_file():
        raise common.UsageError(f"there is no log {found}")
    return found
