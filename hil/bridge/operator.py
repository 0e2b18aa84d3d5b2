"""What a person, or a signal, asks of a program that serves links: it comes in by the bridge's steps, and only so.

A key or a signal comes at any moment, between any two instructions. Were it acted on at that moment, no log could tell what
it has decided. So it waits for the next step of a bridge, which takes it in, tells the taps of it, and only then is it acted
on: by the bridge itself (an interrupt ends the step with a KeyboardInterrupt) or by the program, which asks for `pressed`.
"""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

INTERRUPT: Final = "interrupt"
"""The run is to end: Ctrl-C, SIGTERM or SIGHUP. The step that takes it in raises KeyboardInterrupt."""
INTERRUPTED: Final = "interrupted"
"""The program was interrupted between two steps, and ends: nothing is raised by this."""
SUSPEND: Final = "suspend"
"""The program is to be stopped for a while: Ctrl-Z."""
CONTINUE: Final = "continue"
"""It was stopped, and goes on."""
STOP: Final = "stop"
"""The robots are to stop at once, and to stay stopped: a button on a page that somebody looks on by."""
WON, LOST, DRAWN = "won", "lost", "drawn"
"""How a bout has ended for our robot, by the word of a person who saw it."""
READY: Final = "ready"
"""Everything stands where it is to stand: it may begin."""
PAUSE, RESUME = "pause", "resume"
"""Nothing further is to be begun; it is to go on."""
CHOICES: Final = frozenset((WON, LOST, DRAWN, READY, PAUSE, RESUME))
"""What a person may answer where a run asks for it."""
GUEST_STOP: Final = "guest stop"
"""Likewise the robots are to stop at once: asked for by a program that looks on at a shared link."""
PARAMETERS: Final = "parameters"
"""A robot's parameters are to be read, since a program that looks on at a shared link has asked for them."""
KEY: Final = "key "
"""What a pressed key begins with."""
POSE: Final = "pose "
"""What begins a line in which a camera's program says where a robot is."""


class OperatorInput(NamedTuple):
    """One thing that was asked for.

    Attributes:
        what: `interrupt`, `interrupted`, `suspend`, `continue`, `stop`, `guest stop`, `parameters`, one of `CHOICES`,
            `key X`, or `pose LINE`.
        robot: For which robot, as far as it is for one: its id, and its network where there are several; else empty.
    """

    what: str
    robot: str = ""


class Operator:
    """Takes in what is asked for, and hands it to the bridges' steps.

    Attributes:
        keys: Gives the keys that were pressed since it was last called, each with the robot that it is for; None: nobody
            presses any.
        feed: Gives what else has come since it was last called; None: nothing does.
    """

    def __init__(self) -> None:
        self.keys: Callable[[], Iterable[OperatorInput]] | None = None
        self.feed: Callable[[], Iterable[OperatorInput]] | None = None
        self._asked: deque[OperatorInput] = deque()
        self._taken: list[OperatorInput] = []
        self._wakers: list[Callable[[], None]] = []
        self._interrupting = False

    @property
    def serving(self) -> bool:
        """A bridge is open, whose next step takes in what is asked for."""
        return bool(self._wakers)

    @property
    def waiting(self) -> bool:
        """Something was asked for that no step has taken in: the next one need not wait."""
        return bool(self._asked)

    def attach(self, wake: Callable[[], None]) -> None:
        """A bridge is open.

        Args:
            wake: Has its step return at once; called in whatever thread, and by signal handlers.
        """
        self._wakers.append(wake)

    def detach(self, wake: Callable[[], None]) -> None:
        """A bridge is closed. Repeating it does nothing.

        Args:
            wake: As given to `attach`.
        """
        if wake in self._wakers:
            self._wakers.remove(wake)

    def ask(self, what: str, robot: str = "") -> None:
        """Ask for something; fit for signal handlers and other threads.

        Args:
            what: As in `OperatorInput`.
            robot: Likewise.
        """
        self._asked.append(OperatorInput(what, robot))
        self.wake()

    def wake(self) -> None:
        """Have the bridges' steps that wait return at once, since there is something to take in; for other threads, too."""
        for wake in self._wakers:
            wake()

    def interrupted(self) -> None:
        """The program has been interrupted, by a step or between two: what ends a run is taken in with its last steps."""
        if not self._interrupting:
            self._asked.append(OperatorInput(INTERRUPTED))

    def withdraw(self, what: str) -> None:
        """It has been seen to otherwise, should no step have taken it in.

        Args:
            what: As in `OperatorInput`.
        """
        with suppress(ValueError):
            self._asked.remove(OperatorInput(what))

    def take(self) -> tuple[OperatorInput, ...]:
        """What was asked for since the step before; called by every step of a bridge, once."""
        if self.keys is not None:
            self._asked.extend(self.keys())
        if self.feed is not None:
            self._asked.extend(self.feed())
        if not self._asked:
            return ()
        taken: list[OperatorInput] = []
        while self._asked:
            taken.append(self._asked.popleft())
        self._taken += [one for one in taken if one.what not in {INTERRUPT, INTERRUPTED}]
        self._interrupting = self._interrupting or any(one.what == INTERRUPT for one in taken)
        return tuple(taken)

    def pressed(self) -> list[OperatorInput]:
        """The keys that steps have taken in since this was last called, in order."""
        return self._done(lambda one: one.what.startswith(KEY))

    def poses(self) -> list[str]:
        """Likewise, what was said of where robots are, in order."""
        return [one.what.removeprefix(POSE) for one in self._done(lambda one: one.what.startswith(POSE))]

    def signals(self) -> list[str]:
        """Likewise, whether the program was to be stopped, or has gone on."""
        return [one.what for one in self._done(lambda one: one.what in {SUSPEND, CONTINUE})]

    def stops(self) -> bool:
        """Likewise, whether the robots are to stop."""
        return bool(self._done(lambda one: one.what in {STOP, GUEST_STOP}))

    def unread(self) -> frozenset[str]:
        """Likewise, the system ids of robots whose parameters are to be read."""
        return frozenset(one.robot for one in self._done(lambda one: one.what == PARAMETERS))

    def chosen(self) -> list[str]:
        """Likewise, what was answered of `CHOICES`, in order."""
        return [one.what for one in self._done(lambda one: one.what in CHOICES)]

    def _done(self, wanted: Callable[[OperatorInput], bool]) -> list[OperatorInput]:
        if not self._taken:
            return []
        found = [one for one in self._taken if wanted(one)]
        self._taken = [one for one in self._taken if not wanted(one)]
        return found
