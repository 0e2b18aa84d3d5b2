"""Emulated time does not run ahead of ours, and does not catch up with what was missed for long."""

from __future__ import annotations

import pytest

from hil.terminal.pacing import BEHIND, Pacer


class Ours:
    """Our clock, that goes on when somebody waits.

    Attributes:
        time: What it tells, in s.
        waits: How long was waited, in s.
    """

    def __init__(self) -> None:
        self.time = 100.0
        self.waits: list[float] = []

    def now(self) -> float:
        return self.time

    def wait(self, duration: float) -> None:
        self.waits.append(duration)
        self.time += duration


def test_each_step_takes_as_long_as_it_is_for_the_robot() -> None:
    ours = Ours()
    pacer = Pacer(ours, ours.wait)
    for step in range(1, 11):
        pacer.keep(7.0 + step * 0.02)
        ours.time += 0.005
    assert ours.time - 0.005 == pytest.approx(100.0 + 9 * 0.02)


def test_who_is_woken_is_on_time_again_with_the_next_step() -> None:
    ours = Ours()
    pacer = Pacer(ours, lambda _: ours.wait(0.001))
    pacer.keep(0.0)
    pacer.keep(0.05)
    ours.time += 0.02
    pacer.keep(0.06)
    assert ours.waits == [0.001, 0.001]


def test_what_was_missed_for_long_is_not_caught_up_with() -> None:
    ours = Ours()
    pacer = Pacer(ours, ours.wait)
    pacer.keep(0.0)
    ours.time += 60.0  # stopped by Ctrl-Z
    pacer.keep(0.02)
    pacer.keep(0.04)
    assert ours.waits == [pytest.approx(0.02)]
    ours.time += BEHIND / 2  # a hiccup: that is
    pacer.keep(0.06)
    assert len(ours.waits) == 1


def test_a_wait_ends_when_somebody_wakes_it() -> None:
    ours = Ours()
    pacer = Pacer(ours)
    pacer.keep(0.0)
    pacer.wake()
    pacer.wake()
    pacer.keep(1000.0)
