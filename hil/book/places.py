"""Where the repository keeps what this package makes."""

from __future__ import annotations

from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2]
"""Root of the source tree."""
RESULTS: Final = ROOT / "docs" / "results" / "surround"
"""Stored results."""
PAGE: Final = ROOT / "docs" / "what-holds.md"
"""The page that is made of them."""
