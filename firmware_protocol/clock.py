"""Time as an argument: nobody below `hil` reads the machine's clock."""

from __future__ import annotations

from typing import Protocol


class Clock(Protocol):
    """A source of time."""

    def now(self) -> float:
        """Time since an arbitrary origin, in s; never goes back."""
        ...


class ManualClock:
    """A clock that moves only when told to: for tests and for lock-step.

    Args:
        start: First reading, in s.
    """

    def __init__(self, start: float = 0.0) -> None:
        self._now = start

    def now(self) -> float:
        """Time in s."""
        return self._now

    def advance(self, dt: float) -> None:
        """Move on.

        Args:
            dt: How far, in s; not negative.

        Raises:
            ValueError: dt is negative.
        """
        if dt < 0:
            raise ValueError(f"time cannot go back by {-dt:g} s")
        self._now += dt
