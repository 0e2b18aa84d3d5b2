"""The kernel is the Python world, byte for byte: whatever is done to an emulated robot, both say the same at the same time."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kernel_twins import Player, Twins

from firmware_protocol.messages import OpponentCode

OPPONENTS = [code.label for code in OpponentCode if code is not OpponentCode.KEEP]


@settings(deadline=None, max_examples=25, derandomize=True)
@given(st.integers(0, 2**32))
def test_whatever_is_done_both_say_the_same(seed: int) -> None:
    Player(random.Random(seed)).play(20)


@pytest.mark.slow
@pytest.mark.nightly
@settings(deadline=None, max_examples=2000)
@given(st.integers(0, 2**32))
def test_whatever_is_done_both_say_the_same_in_many_runs(seed: int) -> None:
    Player(random.Random(seed)).play(60)


@pytest.mark.parametrize("opponent", OPPONENTS)
def test_left_alone_both_report_the_same(opponent: str) -> None:
    twins = Twins({"opponent": opponent, "seed": 11})
    twins.live(b"", 400)
    assert len(twins.heard) > 40
