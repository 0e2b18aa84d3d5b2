"""`hil report`: pages and pictures of what a log holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil import runs
from hil.cli import common
from hil.cli.browsing import show_page
from hil.cli.log_arguments import MaxChunkOption, find

if TYPE_CHECKING:
    from hil.report import ReportFiles


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
    png: Annotated[bool, typer.Option("--png", help="Each picture as pixels (PNG), too, besides the drawing (SVG).")] = False,
    open_page: Annotated[
        bool, typer.Option("--open/--no-open", help="Then show the page in the web browser, where there is a desktop.")
    ] = False,
    max_chunk: MaxChunkOption = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a report that is there.")] = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """Say what happened in a run, on one self-contained HTML page with pictures.

    What happened comes first, then what was learnt, how it played, and how good the link was.

    Examples: hil report --open; hil report runs/20261128-130501-coach-flat-light; hil report --from 0 --to 20
    """
    from hil.report import PAGE, write_report  # noqa: PLC0415 - drawing takes a second to load

    console = common.consoles(as_json=as_json, quiet=quiet)
    found = find(log, console, quiet=quiet)
    within = found.name == runs.LOG and (found.parent / runs.RECORD).exists()
    if first is not None and last is not None and last < first:
        raise common.UsageError(f"--to {last} comes before --from {first}")
    steps = None if first is None and last is None else (first or 0, last)
    part = "" if steps is None else f"-{steps[0]}-{'end' if last is None else last}"
    folder = out or (found.parent / f"{runs.REPORT}{part}" if within else found.with_name(f"{found.stem}-report{part}"))
    page = folder / PAGE
    there = page.exists() and page.stat().st_size and not overwrite  # an empty one is none
    if there and (out is not None or page.stat().st_mtime < found.stat().st_mtime):
        raise common.UsageError(f"{page} is there already: --overwrite draws it anew, --out FOLDER elsewhere")
    if there and not png:
        pictures = sorted(path for path in folder.iterdir() if path.suffix in {".svg", ".png"})
        said = f"Report: {page} is there already; --overwrite draws it anew"
    else:
        files = write_report(found, folder, max_chunk=max_chunk, steps=steps, png=png)
        pictures = list(files.pictures)
        said = "\n        ".join([f"Report: {page}", *map(str, pictures)])
        _warn(found, files, quiet=quiet)
    if open_page:
        show_page(page)
    if as_json:
        common.print_json({"page": str(page), "pictures": list(map(str, pictures))})
    elif quiet:
        typer.echo(str(page))
    else:
        console.print(said, markup=False)


def _warn(log: Path, files: ReportFiles, *, quiet: bool) -> None:
    """Say what a report lacks."""
    from hil.report.style import INSTALL, can_draw  # noqa: PLC0415 - drawing takes a second to load

    console = common.plain_console(stderr=True)
    if files.health and not quiet:
        console.print(f"{log} is {files.health}")
    if not quiet and not can_draw():
        console.print(f"There are no pictures: {INSTALL} and hil report --overwrite add them.")
