"""`hil view`: a page that plays what a log holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil.cli import common
from hil.cli.browsing import browse, on_a_desktop
from hil.cli.log_arguments import LogArgument, MaxChunkOption, find
from hil.mcaplog.limits import lifted


def view(
    log: LogArgument = None,
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE.html", help="Where the page goes; view.html in the run's folder if left out."
        ),
    ] = None,
    robot: Annotated[
        int | None,
        typer.Option("--robot", metavar="ID", min=1, max=254, help="Of several sumo robots in a log, the one to show."),
    ] = None,
    open_page: Annotated[
        bool | None,
        typer.Option("--open/--no-open", help="Show it in the web browser [default: on a terminal of a desktop]."),
    ] = None,
    max_chunk: MaxChunkOption = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a file that exists.")] = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """Make one HTML page that plays a log: the arena, curves, events, lessons.

    It needs no server and no network, and may be sent to anybody.

    Example: hil view runs/20261128-130501-coach-flat-light
    """
    from hil.look.writing import write_view  # noqa: PLC0415 - what gathers and writes takes a while to load

    console = common.consoles(as_json=as_json, quiet=quiet)
    found = find(log, console, quiet=quiet)
    page, scene = write_view(found, out, limits=lifted(max_chunk), overwrite=overwrite, robot=robot)
    if not quiet:
        for note in scene.notes:
            common.plain_console(stderr=True).print(note)
    if on_a_desktop() if open_page is None else open_page:
        browse(page.resolve().as_uri(), str(page))
    if as_json:
        common.print_json({"page": str(page), "title": scene.title, "notes": scene.notes})
    elif quiet:
        typer.echo(str(page))
    else:
        console.print(f"Page: {page}", markup=False)
