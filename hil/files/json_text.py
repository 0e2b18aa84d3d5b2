"""JSON that every reader takes: it has no word for NaN and infinity, so they are null."""

from __future__ import annotations

import json
import math
from typing import Any


def json_text(document: Any, *, indent: int | None = 2) -> str:  # noqa: ANN401 - whatever JSON holds
    """One document with a new line at its end; what JSON does not know is written as text.

    Args:
        document: What it holds.
        indent: Columns by which what is inside is indented; None: all is on one line.
    """
    return json.dumps(_finite(document), indent=indent, allow_nan=False, default=str) + "\n"


def _finite(value: Any) -> Any:  # noqa: ANN401 - whatever JSON holds
    """The same, with None for every number that is none."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
