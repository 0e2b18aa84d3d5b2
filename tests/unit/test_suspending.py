"""A program that is asked to stop while it is stopping its robots."""

from __future__ import annotations

import signal
import threading
from typing import TYPE_CHECKING, cast

import pytest

from firmware_protocol.exchange import Ticket
from hil.suspending import STUCK, Suspension

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.bridge import Bridge
    from hil.junior import Junior

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGTSTP"), reason="this system has no such signals")


class Dumb:
    """A robot that never acknowledges the stop; a bridge whose link is not in lock-step, and the link itself."""

    lockstep = False
    begun = 0

    @property
    def link(self) -> Dumb:
        return self

    def ask_to_end(self) -> Ticket[object]:
        return Ticket("the stop")

    def begin_anew(self, _cause: str) -> None:
        self.begun += 1


class Noting(Suspension):
    """Notes what would have stopped this process.

    Attributes:
        log: What has happened, in order.
    """

    def __init__(self, step: Callable[[float], object]) -> None:
        dumb = Dumb()
        self.log: list[str] = []
        self.time = 0.0

        def serve(duration: float) -> None:
            self.log.append("step")
            self.time += duration
            step(duration)

        super().__init__(
            lambda: [cast("Junior", dumb)], lambda: [cast("Bridge", dumb)], serve, lambda: self.time, self.log.append
        )

    def _stop(self) -> None:
        self.log.append("stopped")


@pytest.mark.slow
def test_a_second_signal_stops_a_program_that_is_stuck_in_stopping_its_robots() -> None:
    def step(_duration: float) -> None:
        if suspension.log.count("step") == 1:
            signal.raise_signal(signal.SIGTSTP)
            threading.Event().wait(STUCK + 0.2)

    suspension = Noting(step)
    with suspension:
        signal.raise_signal(signal.SIGTSTP)
        suspension.attend()
    assert suspension.log[:3] == ["SIGTSTP", "step", "stopped"]
    assert suspension.log.count("stopped") == 1
    assert suspension.log[-1] == "SIGCONT"


def test_two_signals_before_it_is_stopped_stop_it_once() -> None:
    def step(_duration: float) -> None:
        signal.raise_signal(signal.SIGTSTP)

    suspension = Noting(step)
    with suspension:
        signal.raise_signal(signal.SIGTSTP)
        suspension.attend()
        suspension.attend()
        assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    assert suspension.log.count("stopped") == 1
