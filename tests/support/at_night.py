"""Which of several values a test tries by day, and which at night alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Container, Iterable


def all_by_day_but(night: Container[str], values: Iterable[str]) -> list[Any]:
    """Parameters of a test.

    Args:
        night: Those to be marked `nightly`.
        values: All, in order.
    """
    return [pytest.param(value, marks=[pytest.mark.nightly] if value in night else []) for value in values]


def all_at_night_but(day: Container[str], values: Iterable[str]) -> list[Any]:
    """Parameters of a test.

    Args:
        day: Those that are not to be marked `nightly`.
        values: All, in order.
    """
    return [pytest.param(value, marks=[] if value in day else [pytest.mark.nightly]) for value in values]
