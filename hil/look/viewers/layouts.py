"""Layouts that come with the package: which panel of a viewer shows what of a log."""

from __future__ import annotations

from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

JUNIOR: Final = "junior"
SWARM: Final = "swarm"


def kind_of(topics: Iterable[str]) -> str:
    """Whose log it is, as far as what is shown of it goes.

    Args:
        topics: The log's topics.
    """
    return SWARM if any(topic.startswith("/swarm/") for topic in topics) else JUNIOR


def layout_for(topics: Iterable[str]) -> Path:
    """The file of a layout for Foxglove, which Lichtblick takes too.

    Args:
        topics: The log's topics.
    """
    return layout_of(kind_of(topics))


def layout_of(kind: str) -> Path:
    """Likewise, of whoever's log it is.

    Args:
        kind: `JUNIOR` or `SWARM`.
    """
    return _file(f"{kind}.layout.json")


def blueprint_for(topics: Iterable[str]) -> Path:
    """The file of a blueprint for Rerun.

    Args:
        topics: The log's topics.
    """
    return _file(f"{kind_of(topics)}.rbl")


def _file(name: str) -> Path:
    with as_file(files("hil.look.viewers").joinpath("layouts", name)) as path:
        return path
