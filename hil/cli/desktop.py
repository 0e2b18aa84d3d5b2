"""Shows a page to who sits at a desktop."""

from __future__ import annotations

import os
import sys
import webbrowser
from typing import TYPE_CHECKING

from hil.cli import common

if TYPE_CHECKING:
    from pathlib import Path


def on_a_desktop() -> bool:
    """There is a screen for a browser."""
    return sys.platform in {"win32", "darwin"} or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def show_page(page: Path) -> None:
    """Open a page in the web browser, or say why nobody sees it.

    Args:
        page: The page.
    """
    if not on_a_desktop():
        common.complain(f"there is no desktop here to show a page on: open {page} yourself")
    elif not webbrowser.open(page.resolve().as_uri()):
        common.complain(f"no web browser could be started: open {page} yourself")
