"""`--live`: a run is shown in a browser while it goes on."""

from __future__ import annotations

import atexit
import tempfile
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from hil.cli import common
from hil.cli.browsing import browse, on_a_desktop
from hil.cli.qr import show_qr
from hil.look.viewers.foxglove_server import check_installed
from hil.recording.pipe import FOXGLOVE
from hil.recording.process import Live, RecorderProcess

if TYPE_CHECKING:
    from rich.console import Console

    from hil.bridge.operator import Operator
    from hil.recording.recorder import Recorder


class ViewerName(StrEnum):
    """What shows a run while it goes on."""

    PAGE = "page"
    FOXGLOVE = FOXGLOVE


LiveOption = Annotated[bool, typer.Option("--live", help="Show the run in a web browser while it goes on, with a stop button.")]
OpenOption = Annotated[
    bool | None, typer.Option("--open/--no-open", help="With --live: start the browser [default: on a terminal of a desktop].")
]
PublicOption = Annotated[
    bool, typer.Option("--public", help="With --live: whoever knows its address may look on, and stop, from other machines.")
]
ViewerOption = Annotated[
    ViewerName | None,
    typer.Option(
        "--viewer",
        help="With --live: what shows it. foxglove: whatever connects as Foxglove does [default: a page of our own].",
    ),
]
DOOR: Final = """<!DOCTYPE html>
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={0}">
<title>hil</title>
<a href="{0}">The live page</a>
"""


class LivePage:
    """The page of a run that goes on.

    Args:
        opened: The browser is started.
        public: Others on the network may look on.
        viewer: What shows it.

    Attributes:
        opened: As given.
        public: As given.
    """

    def __init__(self, *, opened: bool, public: bool, viewer: ViewerName = ViewerName.PAGE) -> None:
        self.opened = opened
        self.public = public
        self._viewer = viewer

    def served(self, operator: Operator) -> Live:
        """How the process that writes the log shows it.

        Args:
            operator: Asks for what is asked for on the page.
        """
        return Live(operator.ask, public=self.public, viewer=self._viewer.value)

    def announce(self, recorder: Recorder, console: Console) -> None:
        """Say where it is, and start the browser.

        Args:
            recorder: Writes the log.
            console: Where to say so.
        """
        if not isinstance(recorder, RecorderProcess) or not recorder.page:
            why = recorder.unseen if isinstance(recorder, RecorderProcess) else "this Python can't be started once more"
            common.complain(f"the run can't be shown while it goes on: {why}; hil view shows it afterwards")
            return
        page = recorder.page
        console.print(f"Live: {page}", markup=False, soft_wrap=True)
        if self._viewer is ViewerName.FOXGLOVE:
            console.print("Open a connection to it in Foxglove; docs/viewers.md says how, and how to stop from there.")
        elif self.public:
            show_qr(page, console)
        if self.opened:
            recorder.await_browser()
            browse(_door(page).as_uri(), page)


def _door(page: str) -> Path:
    """A file of the user's own that leads to the page: its address has a token in it, which no command line may show."""
    with tempfile.NamedTemporaryFile("w", prefix="hil-live-", suffix=".html", delete=False, encoding="utf-8") as file:
        file.write(DOOR.format(page))
    path = Path(file.name)
    atexit.register(path.unlink, missing_ok=True)
    return path


def live_page(
    live: bool,  # noqa: FBT001 - an option
    open_page: bool | None,  # noqa: FBT001 - likewise
    *,
    public: bool,
    no_log: bool,
    viewer: ViewerName | None = None,
) -> LivePage | None:
    """What the options ask for; None: the run is not shown.

    Args:
        live: `--live`.
        open_page: `--open`, or `--no-open`; None: neither.
        public: `--public`.
        no_log: `--no-log`.
        viewer: `--viewer`.

    Raises:
        UsageError: Options exclude each other.
        ViewerError: What serves Foxglove is not installed.
    """
    if not live:
        if viewer is not None:
            raise common.UsageError("--viewer goes with --live")
        if public or open_page is not None:
            raise common.UsageError("--open, --no-open and --public go with --live")
        return None
    if no_log:
        raise common.UsageError("--live shows what is recorded: leave out --no-log")
    if viewer is ViewerName.FOXGLOVE:
        if public:
            raise common.UsageError("--public does not go with --viewer foxglove: its server asks nobody who they are")
        if open_page:
            raise common.UsageError("--open does not go with --viewer foxglove: start it yourself")
        check_installed()
        return LivePage(opened=False, public=False, viewer=viewer)
    return LivePage(opened=on_a_desktop() if open_page is None else open_page, public=public)
