"""The page on `hil check` shows the checks there are."""

from __future__ import annotations

import pytest
from can_mutants import CAN_MUTANTS
from host_mutants import HOST_MUTANTS, NEED_SOURCES
from micro_mutants import MICRO_MUTANTS
from mutants import MUTANTS

from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.conformance import CHECKS, on_wire
from hil.conformance.page import PAGE, renewed


def test_the_table_of_checks_is_up_to_date() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == renewed(page), "run python -m hil.conformance.page"
    all_mutants = (*MUTANTS, *CAN_MUTANTS, *HOST_MUTANTS, *MICRO_MUTANTS)
    assert f"against {len(all_mutants)} firmwares" in page
    assert f"{len(MICRO_MUTANTS)} of them are micro-robots" in page


@pytest.mark.parametrize(("wire", "alone"), [(MAVLINK, set()), (CAN, NEED_SOURCES)])
def test_what_keeps_programs_out_of_each_other_s_way_is_proven_on_a_broken_firmware(wire: str, alone: set[str]) -> None:
    broken = {mutant.caught_by for mutant in HOST_MUTANTS if mutant.wire == wire}
    checks = {check.name for check in on_wire(CHECKS, wire) if check.group in {"answers", "who may drive"}}
    assert checks - broken == checks & alone


def test_a_page_without_a_place_for_the_table_is_refused() -> None:
    with pytest.raises(ValueError, match="lacks"):
        renewed("# A page\n")
