"""Ctrl-C, a polite kill, and a terminal that is closed: they end a run with the robot stopped and the files closed."""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from hil.bridge.operator import INTERRUPT

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

    from hil.bridge.operator import Operator

SIGNALS: Final = ("SIGINT", "SIGTERM", "SIGHUP")
"""Signals that ask a program to end, as far as the system has them."""


@contextmanager
def interrupts(operator: Operator | None = None) -> Iterator[None]:
    """Let all of these signals end the run as a KeyboardInterrupt.

    While a bridge is open, its next step takes the signal in and raises, so that a log tells of it. Where none is, and when
    one more signal comes, it is raised at once. Signals that are ignored (as under nohup) stay ignored. In another thread than
    the main one, which no signal comes to, nothing is changed: so it is where a cluster's worker does this.

    Args:
        operator: Whose bridges take it in; None: it is raised at once.
    """
    asked = False

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        nonlocal asked
        if asked or operator is None or not operator.serving:
            raise KeyboardInterrupt
        asked = True
        operator.ask(INTERRUPT)

    here = threading.current_thread() is threading.main_thread()
    names = [name for name in SIGNALS if here and hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in (getattr(signal, name) for name in names)}
    caught = [number for number, handler in before.items() if handler is not signal.SIG_IGN]
    for number in caught:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number in caught:
            signal.signal(number, before[number])
