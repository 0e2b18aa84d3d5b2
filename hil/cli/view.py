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
    gif: Annotated[
        Path | None,
        typer.Option(
            "--gif", metavar="FILE.gif", help="Instead of a page: a bout, or a swarm's run, as a short animation in this file."
        ),
    ] = None,
    bout: Annotated[
        str,
        typer.Option("--bout", metavar="N", help="With --gif: this bout, as 3 or coaching:3. [default: the last that was won]"),
    ] = "",
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

    Examples: hil view runs/20261128-130501-coach-flat-light; hil view --gif bout.gif --bout advice:3
    """
    from hil.look.film.writing import write_film  # noqa: PLC0415 - likewise
    from hil.look.writing import write_view  # noqa: PLC0415 - what gathers and writes takes a while to load

    console = common.consoles(as_json=as_json, quiet=quiet)
    if bout and gif is None:
        raise common.UsageError("--bout goes with --gif; a page has all bouts")
    if gif is not None and out is not None:
        raise common.UsageError("--gif makes no page, so that --out has nothing to name: give one of the two")
    found = find(log, console, quiet=quiet)
    limits = lifted(max_chunk)
    if gif is None:
        made, scene = write_view(found, out, limits=limits, overwrite=overwrite, robot=robot)
        kind, title = "Page", scene.title
    else:
        film, scene = write_film(found, gif, which=bout, limits=limits, overwrite=overwrite, robot=robot)
        made, kind, title = gif, "Picture", film.title
    if not quiet:
        for note in scene.notes:
            common.plain_console(stderr=True).print(note)
    if on_a_desktop() if open_page is None else open_page:
        browse(made.resolve().as_uri(), str(made))
    if as_json:
        common.print_json({kind.lower(): str(made), "title": title, "notes": scene.notes})
    elif quiet:
        typer.echo(str(made))
    else:
        console.print(f"{kind}: {made}", markup=False)
