"""The page on `hil check` shows the checks there are."""

from __future__ import annotations

import pytest
from can_mutants import CAN_MUTANTS
from host_mutants import HOST_MUTANTS
from mutants import MUTANTS

from hil.conformance.page import PAGE, renewed


def test_the_table_of_checks_is_up_to_date() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == renewed(page), "run python -m hil.conformance.page"
    assert f"against {len(MUTANTS) + len(CAN_MUTANTS) + len(HOST_MUTANTS)} firmwares" in page


def test_a_page_without_a_place_for_the_table_is_refused() -> None:
    with pytest.raises(ValueError, match="lacks"):
        renewed("# A page\n")
