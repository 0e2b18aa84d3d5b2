"""The machine's clock, for runs in real time; and the last reading of a clock, for all that is above the bridge."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firmware_protocol.clock import Clock


class MonotonicClock:
    """Time since this clock was made, in s; unaffected by changes of the wall clock."""

    def __init__(self) -> None:
        self._origin = time.monotonic_ns()

    def now(self) -> float:
        """Time in s."""
        return (time.monotonic_ns() - self._origin) * 1e-9


class LastReading:
    """A clock that stands still between two steps of a bridge: what a log tells of the time.

    Args:
        clock: What is read.
    """

    def __init__(self, clock: Clock) -> None:
        self._read = clock.now
        self._now = clock.now()

    def read(self) -> float:
        """Read the clock, in s: once in every step, by the bridge alone."""
        self._now = self._read()
        return self._now

    def now(self) -> float:
        """The last reading, in s."""
        return self._now
