"""Ctrl-Z: the robots are stopped and disarmed, then the program is; when it goes on, it begins with them anew.

A program that is stopped sends nothing, so the robots' own watchdogs stop their wheels after 250 ms. But they stay armed, and
when the program went on it would keep them alive where it had left off. So robots are told before the program stops.

Signals arrive between any two instructions, also in the middle of a message that is being sent. So what they ask for is done
between two steps of the link (`Suspension.attend`), which is at most 50 ms later, and comes in by a step as all that an
operator asks for (`hil.bridge.operator`): a log tells of it, and a replay of that log goes the same way. A program that is
stuck does not step, and its robots have been stopped by their watchdogs: it is stopped all the same, after a second.

Windows has no such signals: there nothing of this happens.
"""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, Self

from firmware_protocol.errors import HilError
from hil.bridge.operator import CONTINUE, SUSPEND

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from types import FrameType

    from hil.bridge.bridge import Bridge
    from hil.bridge.operator import Operator
    from hil.connecting.handle import RobotHandle

STOP_WAIT: Final = 0.5
"""How long the robots are given to acknowledge the stop, in s."""
STUCK: Final = 1.0
"""A program that has not come to stopping its robots by then is stopped without, in s."""
GAP: Final = 0.25
"""A program that went on after no more than this was not stopped for long enough for a watchdog to notice, in s."""
_STEP: Final = 0.05
_READING: Final = 0.1
"""What robots have said lately is read within this time, in s; else they would seem to have been silent."""
CAUSE: Final = "this program was stopped"

_around: list[tuple[Callable[[], None], Callable[[], None]]] = []


@contextmanager
def around_stop(give_back: Callable[[], None], take_again: Callable[[], None]) -> Iterator[None]:
    """Have something be as it was while the program is stopped: a terminal's mode.

    Args:
        give_back: Called before it stops, innermost first.
        take_again: Called when it goes on; also where it was stopped without `give_back`, by SIGSTOP, or not stopped at all.
    """
    pair = (give_back, take_again)
    _around.append(pair)
    try:
        yield
    finally:
        _around.remove(pair)


class Suspension:
    """Sees to Ctrl-Z while robots are connected; a context manager. In another thread than the main one it does nothing.

    Args:
        operator: Whom the signals are told to, and whose steps tell of them.
        robots: Gives those to be stopped; those that are only watched are left alone.
        bridges: Gives what speaks with them.
        step: Serves the links once, for so long in s, and calls `attend`.
        now: Time of the last step, in s.
        replayed: The signals are those of a log: this process is neither stopped nor waits.

    Attributes:
        plays_on: The robots play a contest, which needs no host: they are left alone.
    """

    def __init__(
        self,
        operator: Operator,
        robots: Callable[[], Collection[RobotHandle]],
        bridges: Callable[[], Collection[Bridge]],
        step: Callable[[float], object],
        now: Callable[[], float],
        *,
        replayed: bool = False,
    ) -> None:
        self.plays_on = False
        self._operator = operator
        self._robots = robots
        self._bridges = bridges
        self._step = step
        self._now = now
        self._replayed = replayed
        self._asked = False
        self._given_up = False
        self._continued = False
        self._resumed = False
        self._attending = False
        self._attended = now()
        self._before: dict[signal.Signals, signal.Handlers | Callable[[int, FrameType | None], object] | int | None] = {}

    def __enter__(self) -> Self:
        main = threading.current_thread() is threading.main_thread()  # a cluster's worker is in another
        here = main and not self._replayed and hasattr(signal, "SIGTSTP")
        if here and signal.getsignal(signal.SIGTSTP) is not signal.SIG_IGN:
            handlers = {signal.SIGTSTP: self._ask, signal.SIGCONT: self._continue, signal.SIGALRM: self._give_up}
            self._before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
        return self

    def __exit__(self, *_: object) -> None:
        self._set_timer(0.0)
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}

    def attend(self) -> None:
        """Do what was asked for by a signal; called between two steps of the links, often."""
        if self._attending:  # stopping the robots takes steps too
            return
        if signals := self._operator.signals():
            self._attending = True
            try:
                self._see_to_it(signals)
            finally:
                self._attending = False
        self._attended = self._now()

    def _see_to_it(self, signals: list[str]) -> None:
        self._continued = False
        if SUSPEND in signals:
            self._set_timer(0.0)
            self._given_up = self._given_up and not self._asked  # it was stuck after a step had taken the signal in
            self._asked = False  # now: who asks again meanwhile has a program that is stuck stopped
            self._stop_robots()
            self._operator.signals()  # what was asked for meanwhile is done now
            self._operator.withdraw(SUSPEND)
            self._asked = False
            self._set_timer(0.0)
            if not self._given_up:
                self._stop()
            self._given_up = False
            self._resumed = True
            self._begin_anew()
        elif self._resumed:  # that it goes on is told after it has gone on
            self._resumed = False
        elif self._now() - self._attended > GAP:
            self._begin_anew()

    def _set_timer(self, duration: float) -> None:
        """Be told after a time, in s; 0 is never."""
        if self._before:
            signal.setitimer(signal.ITIMER_REAL, duration)

    def _ask(self, _number: int, _frame: FrameType | None) -> None:
        if not self._asked:
            self._asked = True
            self._set_timer(STUCK)
            self._operator.ask(SUSPEND)

    def _give_up(self, _number: int, _frame: FrameType | None) -> None:
        """It is stuck. What was going on goes on afterwards, so nothing may be said to the robots here."""
        if self._asked:
            self._asked = False
            self._given_up = True
            self._operator.withdraw(SUSPEND)
            self._stop()

    def _continue(self, _number: int, _frame: FrameType | None) -> None:
        for _, take_again in _around:
            take_again()
        if not self._continued:
            self._continued = True
            self._operator.ask(CONTINUE)

    @property
    def _in_charge(self) -> bool:
        """The robots run by themselves, and need a host; those in lock-step stop when the program does."""
        return not self.plays_on and not all(bridge.link.lockstep for bridge in self._bridges())

    def _stop_robots(self) -> None:
        """Stop and disarm all, and see that it has arrived, if they answer."""
        if not self._in_charge:
            return
        try:
            tickets = [ticket for robot in self._robots() if (ticket := robot.ask_to_end()) is not None]
            deadline = self._now() + STOP_WAIT
            while not all(ticket.done for ticket in tickets) and (left := deadline - self._now()) > 0:
                self._step(min(_STEP, left))
        except (HilError, OSError):
            return  # their watchdogs stop them

    def _stop(self) -> None:
        """Stop this process, as if nobody had caught the signal; returns when it goes on."""
        if self._replayed:
            return
        for give_back, _ in reversed(_around):
            give_back()
        caught = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
        try:
            signal.raise_signal(signal.SIGTSTP)
        finally:
            signal.signal(signal.SIGTSTP, caught)
        self._continue(signal.SIGCONT, None)  # where nobody could have woken us, the system has not stopped us either

    def _begin_anew(self) -> None:
        """Open new sessions: whoever had the robots meanwhile, and whatever was under way, they are stopped and disarmed."""
        if not self._in_charge:
            return
        if not self._replayed:
            threading.Event().wait(_READING)
        for bridge in self._bridges():
            bridge.begin_anew(CAUSE)
