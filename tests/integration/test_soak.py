"""The soak in small: a few minutes of coaching on a bad day. `benchmarks/soak.py` does half an hour of it, and measures."""

from __future__ import annotations

import tracemalloc
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest
from soak import PATIENCE, bad_day, soak

from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.faults.spells import LineSpell
from pal_advisor.maneuvers import PalSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

DAY = 150.0
"""Simulated time over which faults are laid, in s."""
WARM = 30.0
"""Simulated time after which memory is to stay as it is, in s."""


@pytest.fixture
def traced() -> Iterator[None]:
    """Python's own memory is counted."""
    tracemalloc.start()
    yield
    tracemalloc.stop()


def test_a_bad_day_has_something_of_every_kind_and_is_the_same_again() -> None:
    day = bad_day(1, DAY)
    assert day == bad_day(1, DAY) == FaultSpec.parse(str(day))
    assert day != bad_day(2, DAY)
    kinds = {spell.fault if isinstance(spell, LineSpell) else spell.kind for spell in day.all_spells()}
    assert len(kinds) == 14
    begins = sorted(spell.at for spell in day.all_spells())
    assert len(begins) >= DAY / 5
    assert max(after - before for before, after in pairwise(begins)) <= 6.0
    assert sum(cut.lasts for cut in day.unplugs) < PATIENCE


@pytest.mark.slow
@pytest.mark.usefixtures("traced")
def test_coaching_lives_through_a_bad_day() -> None:
    settings = PalSettings(budget=160)
    run = soak(settings, bad_day(3, DAY, every=3.0), 3, every=10.0)
    assert sum(entry.evaluations for entry in run.advice.entries) > 0
    witness, meter = run.witness, run.meter
    assert witness.boots > 3
    assert meter.lost == meter.back > 4
    assert witness.reports > 80
    assert (witness.twice, witness.behind) == (0, 0)  # at every report of the robot's own counter
    assert meter.twice == 0
    assert witness.accepted >= settings.budget
    late = [traced for time, _, traced in meter.memory if time >= WARM]
    assert late[-1] - late[0] < 0.5, f"{late} MiB"
