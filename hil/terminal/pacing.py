"""An emulated robot in this process in real time: whoever steps it waits until as much time has passed for people."""

from __future__ import annotations

import queue
from contextlib import suppress
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.clock import Clock

BEHIND: Final = 0.25
"""Who is further behind than this, in s, does not catch up: the machine is too slow, or the program was stopped."""


class Pacer:
    """Keeps emulated time from running ahead of ours.

    Args:
        clock: Ours.
        wait: Waits for somebody to call `wake`, for so long in s; None: by a queue.
    """

    def __init__(self, clock: Clock, wait: Callable[[float], object] | None = None) -> None:
        self._clock = clock
        self._bell: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._wait = self._await_bell if wait is None else wait
        self._ahead: float | None = None

    def wake(self) -> None:
        """Have a wait end at once; for any thread, and for signal handlers."""
        if self._bell.empty():
            self._bell.put(None)

    def keep(self, now: float) -> None:
        """Wait until it is so late for us too, or somebody calls `wake`.

        Args:
            now: Emulated time, in s.
        """
        ours = self._clock.now()
        if self._ahead is None or now - ours < self._ahead - BEHIND:
            self._ahead = now - ours
        left = now - ours - self._ahead
        if left > 0:
            self._wait(left)

    def _await_bell(self, longest: float) -> None:
        with suppress(queue.Empty):
            self._bell.get(timeout=longest)
