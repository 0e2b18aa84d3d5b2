"""`hil report`: pages and pictures of what a log holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil import runs
from hil.cli import common
from hil.cli.log_arguments import MaxChunkOption, find


def report(
    log: Annotated[
        Path | None,
        typer.Argument(
            metavar="RUN|LOG", help="A run's folder or a log (.mcap), read up to its damage; the newest run if left out."
        ),
    ] = None,
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FOLDER",
            help="Where to; in the run's folder, or beside the log.",
        ),
    ] = None,
    first: Annotated[
        int | None,
        typer.Option("--from", min=0, metavar="STEP", help="Of a run of the surround task: show steps from this one on."),
    ] = None,
    last: Annotated[int | None, typer.Option("--to", min=0, metavar="STEP", help="Likewise: up to this one.")] = None,
    max_chunk: MaxChunkOption = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Draw one anew that is there.")] = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """Make one self-contained HTML page and PNG pictures of a log.

    Examples: hil report runs/20261128-130501-coach-flat-light; hil report --from 0 --to 20
    """
    from hil.report import PAGE, write_report  # noqa: PLC0415 - drawing takes a second to load
    from hil.report.style import INSTALL, can_draw  # noqa: PLC0415 - likewise

    console = common.consoles(as_json=as_json, quiet=quiet)
    found = find(log, console, quiet=quiet)
    within = found.name == runs.LOG and (found.parent / runs.RECORD).exists()
    if first is not None and last is not None and last < first:
        raise common.UsageError(f"--to {last} comes before --from {first}")
    steps = None if first is None and last is None else (first or 0, last)
    part = "" if steps is None else f"-{steps[0]}-{'end' if last is None else last}"
    folder = out or (found.parent / f"{runs.REPORT}{part}" if within else found.with_name(f"{found.stem}-report{part}"))
    page = folder / PAGE
    if page.exists() and page.stat().st_size and not overwrite:  # an empty one is none
        if out is not None or page.stat().st_mtime < found.stat().st_mtime:
            raise common.UsageError(f"{page} is there already: --overwrite draws it anew, --out FOLDER elsewhere")
        if as_json:
            common.print_json({"page": str(page), "pictures": sorted(map(str, folder.glob("*.png")))})
        elif quiet:
            typer.echo(str(page))
        else:
            console.print(f"Report: {page} is there already; --overwrite draws it anew", markup=False)
        return
    files = write_report(found, folder, max_chunk=max_chunk, steps=steps)
    if files.health and not quiet:
        common.plain_console(stderr=True).print(f"{found} is {files.health}")
    if not quiet and not can_draw():
        common.plain_console(stderr=True).print(f"There are no pictures: {INSTALL} and hil report --overwrite add them.")
    if as_json:
        common.print_json({"page": str(files.page), "pictures": [str(path) for path in files.pictures]})
    elif quiet:
        typer.echo(str(files.page))
    else:
        console.print(f"Report: {files.page}", markup=False)
        for path in files.pictures:
            console.print(f"        {path}", markup=False)
