"""`hil replay --to viewer`: a log is streamed to Foxglove, which plays it."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from hil.bridge.clock import MonotonicClock
from hil.cli import common
from hil.look.viewers.foxglove_server import check_installed
from hil.look.viewers.layouts import layout_for
from hil.look.viewers.recorded import RecordedEntries
from hil.terminal.interrupts import interrupts

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

    from hil.mcaplog.limits import ReadLimits


def stream(log: Path, limits: ReadLimits, console: Console, *, port: int, as_json: bool, quiet: bool) -> None:
    """Serve a log to viewers, until the program is interrupted.

    Args:
        log: The log.
        limits: What it may unpack to.
        console: Where to say where it is.
        port: TCP port; 0: any that is free.
        as_json: Say it as JSON.
        quiet: Say nothing but the address.

    Raises:
        ViewerError: What serves is not installed, or the port can't be listened on.
        LogError: The log can't be read.
        KeyboardInterrupt: The program is interrupted, which ends it.
    """
    check_installed()
    from hil.look.viewers.streaming import LogStream  # noqa: PLC0415 - of an extra

    with interrupts(), RecordedEntries(log, limits) as entries:
        if entries.health:
            common.complain(f"{log} is {entries.health}")
        layout = layout_for(one.topic for one in entries.channels.values())
        with LogStream(entries, f"{log.parent.name}/{log.name}", MonotonicClock(), port=port) as served:
            if as_json:
                common.print_json_line({"log": str(log), "url": served.url, "app_url": served.app_url, "layout": str(layout)})
            elif quiet:
                console.print(served.url, markup=False, soft_wrap=True)
            else:
                console.print(f"Log: {log}, {len(entries):,} entries", markup=False, soft_wrap=True)
                console.print(f"Foxglove: open a connection to {served.url}, or", markup=False)
                console.print(f"          {served.app_url}", markup=False, soft_wrap=True)
                console.print(f"Layout to import there: {layout}", markup=False, soft_wrap=True)
                console.print("Play it there. Ctrl-C ends this.", markup=False)
            common.flush()
            threading.Event().wait()
