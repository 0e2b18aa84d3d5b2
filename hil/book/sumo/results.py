"""Stored results of chapter 10: where they are, and what makes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from hil.book.places import ROOT
from hil.book.results import StoredResults
from hil.book.sumo.methods import METHODS, OPPONENTS, SQUARE

if TYPE_CHECKING:
    from pathlib import Path

RESULTS: Final = ROOT / "docs" / "results" / "sumo"
PAGE: Final = ROOT / "docs" / "chapter-10.md"
FIGURES: Final = ROOT / "docs" / "figures"
COMMAND: Final = "python benchmarks/chapter10.py"
"""Makes them all."""
NAMES: Final = (*(f"{method}-{opponent}" for method in METHODS for opponent in OPPONENTS), f"book-{SQUARE}")
"""Names of the results: a method and an opponent each."""


def stored(folder: Path = RESULTS) -> StoredResults:
    """The results of a folder.

    Args:
        folder: The folder.
    """
    return StoredResults(folder, dict.fromkeys(NAMES, COMMAND))
