"""A budget as it is given on the command line."""

from __future__ import annotations

import pytest

from hil.cli.coach_team import budget_of
from hil.cli.common import UsageError
from pal_advisor.maneuvers.settings import MOST_BUDGET


@pytest.mark.parametrize(
    ("text", "budget"),
    [("1600", (1600, 0.0)), ("15min", (MOST_BUDGET, 900.0)), ("2000s", (MOST_BUDGET, 2000.0)), ("1", (1, 0.0))],
)
def test_maneuvers_or_robot_time(text: str, budget: tuple[int, float]) -> None:
    assert budget_of(text) == budget


@pytest.mark.parametrize("text", ["", "0", "0s", "-5", "5h", "1.5min", "min", "5 min", "99999999999", "9999999s", "١٥"])
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="expected maneuvers"):
        budget_of(text)
