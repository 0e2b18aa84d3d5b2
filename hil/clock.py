"""The machine's clock, for runs in real time."""

from __future__ import annotations

import time


class MonotonicClock:
    """Time since this clock was made, in s; unaffected by changes of the wall clock."""

    def __init__(self) -> None:
        self._origin = time.monotonic_ns()

    def now(self) -> float:
        """Time in s."""
        return (time.monotonic_ns() - self._origin) * 1e-9
