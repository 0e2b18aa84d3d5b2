"""Shows a page in the web browser."""

from __future__ import annotations

import os
import sys
import webbrowser
from typing import TYPE_CHECKING

from hil.cli import common

if TYPE_CHECKING:
    from pathlib import Path


def has_a_screen() -> bool:
    """There is a screen for a browser."""
    return sys.platform in {"win32", "darwin"} or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def on_a_desktop() -> bool:
    """Somebody sits at a terminal, and there is a screen for a browser."""
    return sys.stdout is not None and sys.stdout.isatty() and has_a_screen()


def browse(url: str, named: str) -> None:
    """Show a page in the web browser; where none can be started, say so.

    Args:
        url: Address of the page. It is seen by others on this machine: a browser takes it from its command line.
        named: What to open instead, for a person.
    """
    if not webbrowser.open(url):
        common.complain(f"no web browser could be started: open {named} yourself")


def show_page(page: Path) -> None:
    """Show a page that is a file, or say why nobody sees it.

    Args:
        page: The page.
    """
    if has_a_screen():
        browse(page.resolve().as_uri(), str(page))
    else:
        common.complain(f"there is no desktop here to show a page on: open {page} yourself")
