"""`hil view`: a page that plays what a log holds; of a link, what happens there now."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil.cli import common, links
from hil.cli import live as live_options
from hil.cli.browsing import browse, on_a_desktop
from hil.cli.completion import link_words
from hil.cli.log_arguments import MaxChunkOption, find
from hil.mcaplog.limits import lifted

if TYPE_CHECKING:
    from rich.console import Console

LOG_ONLY = ("robot", "gif", "bout", "max_chunk")
LINK_ONLY = ("duration", "public", "yes", "signing_key", "reconnect", "log")
"""Options that say something of a log, and of a link, alone."""


def view(
    context: typer.Context,
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="RUN|LOG|LINK",
            autocompletion=link_words,
            help="A run's folder or a log (.mcap), or the address of a robot, as /dev/ttyACM0, or auto, to see what it does "
            "now. The newest run if left out.",
        ),
    ] = None,
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE.html|DIR",
            help="Where the page goes; view.html in the run's folder if left out. Of a LINK the run's folder, made by it.",
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
    duration: Annotated[
        float | None,
        typer.Option("--duration", min=0.1, help="Of a LINK: stop after this time, in s; left out, when Ctrl-C is pressed."),
    ] = None,
    public: Annotated[
        bool,
        typer.Option("--public", help="Of a LINK: whoever knows its address may look on, and stop, from other machines."),
    ] = False,
    yes: links.YesOption = False,
    signing_key: common.SigningKeyOption = None,
    reconnect: common.ReconnectOption = common.RECONNECT,
    log: common.LogOption = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a file that exists.")] = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,
) -> int:
    """Make one HTML page that plays a log: the arena, curves, events, lessons. Of a LINK, show what happens there now.

    The page of a log needs no server and no network, and may be sent to anybody.

    At a LINK robots are watched: whoever controls them goes on, and none is stopped but by the page's stop. It is served, and
    a log is written, until Ctrl-C.

    Examples: hil view runs/20261128-130501-coach-flat-light; hil view --gif bout.gif --bout advice:3; hil view /dev/ttyACM0
    """
    linked = what is not None and links.is_link(what)
    for name in LOG_ONLY if linked else LINK_ONLY:
        if common.was_given(context, name):
            raise common.UsageError(f"--{name.replace('_', '-')} goes with a {'log' if linked else 'LINK'}")
    console = common.consoles(as_json=as_json, quiet=quiet)
    if what is not None and linked:
        from hil.cli.watching import watched  # noqa: PLC0415 - what serves links takes a while to load

        return watched(
            links.settled(what, yes=yes, quiet=quiet, signing_key=signing_key),
            live_options.LivePage(opened=on_a_desktop() if open_page is None else open_page, public=public),
            console,
            duration=duration,
            signing_key=signing_key,
            reconnect=reconnect,
            out=out,
            log=log,
            overwrite=overwrite,
            as_json=as_json,
            quiet=quiet,
            config=config,
        )
    if bout and gif is None:
        raise common.UsageError("--bout goes with --gif; a page has all bouts")
    if gif is not None and out is not None:
        raise common.UsageError("--gif makes no page, so that --out has nothing to name: give one of the two")
    found = find(None if what is None else Path(what), console, quiet=quiet)
    limits = lifted(max_chunk)
    if gif is None:
        from hil.look.writing import write_view  # noqa: PLC0415 - what gathers and writes takes a while to load

        made, scene = write_view(found, out, limits=limits, overwrite=overwrite, robot=robot)
        kind, title = "Page", scene.title
    else:
        from hil.look.film.writing import write_film  # noqa: PLC0415 - likewise

        film, scene = write_film(found, gif, which=bout, limits=limits, overwrite=overwrite, robot=robot)
        made, kind, title = gif, "Picture", film.title
    if not quiet:
        for note in scene.notes:
            common.plain_console(stderr=True).print(note)
    if on_a_desktop() if open_page is None else open_page:
        browse(made.resolve().as_uri(), str(made))
    _say(made, kind, title, scene.notes, console, as_json=as_json, quiet=quiet)
    return common.EXIT_DONE


def _say(made: Path, kind: str, title: str, notes: list[str], console: Console, *, as_json: bool, quiet: bool) -> None:
    """What was made of a log."""
    if as_json:
        common.print_json({kind.lower(): str(made), "title": title, "notes": notes})
    elif quiet:
        typer.echo(str(made))
    else:
        console.print(f"{kind}: {made}", markup=False)
