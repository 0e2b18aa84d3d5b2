"""Shows a page in the web browser."""

from __future__ import annotations

import os
import sys
import webbrowser

from hil.cli import common


def on_a_desktop() -> bool:
    """Somebody sits at a terminal, and there is a screen for a browser."""
    if sys.stdout is None or not sys.stdout.isatty():
        return False
    return sys.platform in {"win32", "darwin"} or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def browse(url: str, named: str) -> None:
    """Show a page in the web browser; where none can be started, say so.

    Args:
        url: Address of the page. It is seen by others on this machine: a browser takes it from its command line.
        named: What to open instead, for a person.
    """
    if not webbrowser.open(url):
        common.complain(f"no web browser could be started: open {named} yourself")
