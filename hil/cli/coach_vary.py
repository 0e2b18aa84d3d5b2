"""`hil coach --vary`: worlds that differ from bout to bout."""

from __future__ import annotations

from typing import Annotated

import typer

from firmware_protocol.address import parse_address
from hil.cli import common
from simdevice.sumo.conditions import MOST_VARY

VaryOption = Annotated[
    float | None,
    typer.Option(
        "--vary",
        min=0.0,
        max=MOST_VARY,
        metavar="SHARE",
        help="Of an emulated robot: each bout in a world of its own. Masses, friction, motors, wheels, eyes and battery are "
        "off by up to this share (0.15), and what the host says is late by up to this share of 0.1 s.",
    ),
]


def varied(url: str, vary: float | None) -> str:
    """The address of a robot whose world differs from bout to bout.

    Args:
        url: Its address.
        vary: By up to this share; None or 0 leaves the address as it is.

    Raises:
        UsageError: It is not emulated in this process, or its address says already how its world varies.
    """
    if not vary:
        return url
    address = parse_address(url)
    if address.scheme != "sim":
        raise common.UsageError(
            f"--vary changes the world of a robot emulated in this process, and {url} is none: leave it out"
        )
    if "vary" in address.options:
        raise common.UsageError(f"{url} says already how its world varies: leave --vary out")
    return f"{url}{'&' if address.options else '?'}vary={vary:g}"
