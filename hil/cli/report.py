"""`hil report LOG`: pages and pictures of what a log holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli import common


def report(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log (.mcap); one broken off is read up to its damage.")],
    *,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FOLDER", help="Where to; beside the log if left out.")
    ] = None,
    max_chunk: Annotated[
        int | None,
        typer.Option(
            "--max-chunk",
            metavar="MIB",
            min=1,
            max=2048,
            help="The log is in order: let its chunks unpack to so many MiB [default: 16], the whole to whatever it does.",
        ),
    ] = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """Make one self-contained HTML page and PNG pictures of a log.

    Example: hil report logs/20260101-120000-coach.mcap
    """
    from hil.report import write_report  # noqa: PLC0415 - drawing takes a second to load

    console = common.consoles(as_json=as_json, quiet=quiet)
    if not log.is_file():
        raise common.UsageError(f"there is no log {log}")
    folder = out or log.with_name(f"{log.stem}-report")
    files = write_report(log, folder, max_chunk=max_chunk)
    if files.health and not quiet:
        common.plain_console(stderr=True).print(f"{log} is {files.health}")
    if as_json:
        common.print_json({"page": str(files.page), "pictures": [str(path) for path in files.pictures]})
    elif quiet:
        typer.echo(str(files.page))
    else:
        console.print(f"Report: {files.page}", markup=False)
        for path in files.pictures:
            console.print(f"        {path}", markup=False)
