"""Puts a scene on one HTML page that needs nothing else: no server, no network, no other file.

A log is not trusted. All that comes from it stands in one block of JSON in which no character means anything to HTML, and
the page's script puts it in place as text. The page's content security policy allows its own two scripts and its style sheet,
by their hashes, and nothing else: no request, no picture, no frame.
"""

from __future__ import annotations

import json
import re
from base64 import b64encode
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from hil.look.document import text_of
from hil.look.thinning import thinned

if TYPE_CHECKING:
    from hil.look.scene import Scene

SCRIPTS: Final = ("model.js", "ground.js", "arena.js", "timeline.js", "panels.js", "player.js", "main.js")
"""In the order in which they are put together."""
LIVE: Final = "live.js"
"""What the page of a run that goes on has besides: it alone asks for anything."""
LARGEST: Final = 5_000_000
"""A page has no more bytes."""
_PLACE: Final = re.compile(r"\{\{(\w+)\}\}")


def page_of(scene: Scene, largest: int = LARGEST) -> bytes:
    """The page.

    Args:
        scene: What is to be shown.
        largest: Bytes that it may have; what there is too much of is left out, and the page says so.

    Returns:
        HTML in UTF-8.
    """
    room = largest - len(_filled(""))
    return _filled(thinned(scene, text_of, room)).encode()


def live_page(*, lockstep: bool, robot_side: bool = False) -> bytes:
    """The page of a run that goes on: it is told everything by the server that it comes from, and asks nobody else.

    Args:
        lockstep: The run goes as fast as the machine can, and what is over is shown at a speed to watch.
        robot_side: It is emulated robots that are served, which have no stop.
    """
    return _filled(json.dumps({"live": {"lockstep": lockstep, "robotSide": robot_side}}), live=True).encode()


def _filled(scene: str, *, live: bool = False) -> str:
    style, vendor, script = _style(), _read("vendor", "uPlot.iife.min.js"), _script(live=live)
    asks = "connect-src 'self'; " if live else ""
    policy = (
        f"default-src 'none'; {asks}script-src {_hash(vendor)} {_hash(script)}; style-src {_hash(style)}; "
        "base-uri 'none'; form-action 'none'"
    )
    bar = _read("page", "live.html") if live else ""
    parts = {"policy": policy, "style": style, "vendor": vendor, "script": script, "scene": scene, "live": bar}
    return _PLACE.sub(lambda place: parts[place[1]], _read("page", "page.html"))


@cache
def _read(folder: str, name: str) -> str:
    return files(__package__).joinpath(folder, name).read_text("utf-8")


@cache
def _script(*, live: bool) -> str:
    names = (*SCRIPTS[:-1], LIVE, SCRIPTS[-1]) if live else SCRIPTS
    parts = "\n".join(_read("page", name) for name in names)
    return f'(() => {{\n"use strict";\n{parts}}})();\n'


@cache
def _style() -> str:
    return _read("vendor", "uPlot.min.css") + "\n" + _read("page", "view.css")


def _hash(text: str) -> str:
    """A content security policy's word for a script or a style sheet of this text."""
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode('ascii')}'"
