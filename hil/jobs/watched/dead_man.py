"""Driving a Junior by a key that is held down: it stops when the key is let go, whatever is lost on the line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.roles.junior import drive

if TYPE_CHECKING:
    from firmware_protocol.errors import HilError
    from firmware_protocol.messages import RobotAck
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from hil.sumo.junior import Junior

HOLD: Final = 0.25
"""Driving ends so long after the last key, in s."""
_SLACK: Final = 0.05
"""A robot that may drive on for no longer than this beyond that ends by itself, in s."""


class DeadMan:
    """Drives while a key is repeated.

    The robot is told for how long to turn its wheels, and stops by itself. Where a command was repeated on a bad line, nobody
    knows when the robot began: then it is told to stop as well.

    Args:
        junior: The robot.
        hold: Driving ends so long after the last key, in s.
        measured: That is measured from the key; else every command drives for so long from its own beginning, as logs of
            before have it.
    """

    def __init__(self, junior: Junior, hold: float, *, measured: bool) -> None:
        self._junior = junior
        self._hold = hold
        self._measured = measured
        self._wheels: tuple[float, float] | None = None
        self._sent: tuple[float, float] | None = None
        self._fresh = False
        self._until = 0.0
        self._ends = 0.0
        self._duration = 0.0
        self._ticket: Ticket[RobotAck] | None = None

    @property
    def open(self) -> bool:
        """A command is under way."""
        return self._fresh or (self._ticket is not None and not self._ticket.done)

    def press(self, wheels: tuple[float, float]) -> None:
        """A key that drives was pressed, or repeats.

        Args:
            wheels: Left and right, share of full, -1..1.
        """
        self._wheels = wheels
        self._fresh = True
        self._until = self._junior.now() + self._hold

    def release(self) -> None:
        """The robot is stopped otherwise: nothing more is said of driving."""
        self._wheels = self._sent = self._ticket = None
        self._fresh = False

    def step(self, *, free: bool) -> list[HilError]:
        """Go on; called after every step of the links.

        Args:
            free: Nothing else is under way, as arming: it may be driven.

        Returns:
            Why it does not drive.
        """
        if self._wheels is None:
            return []
        now = self._junior.now()
        refused = self._hear(now)
        if refused:
            return refused
        if self._measured and now >= self._until:
            if self._ticket is not None or self._ends > self._until + _SLACK:
                drive(self._junior.peer, 0.0, 0.0, 0.0)
            self.release()
        elif free and self._fresh and (self._ticket is None or self._wheels != self._sent):
            self._fresh = False
            self._sent = self._wheels
            limited = self._junior.limits.wheels(*self._wheels, self._until - now if self._measured else self._hold)
            self._duration = limited[2]
            self._ticket = drive(self._junior.peer, *limited)
        return refused

    def _hear(self, now: float) -> list[HilError]:
        """Take the answer, when it has come."""
        ticket = self._ticket
        if ticket is None or not ticket.done:
            return []
        self._ticket = None
        if ticket.error is not None:
            self.release()
            return [ticket.error]
        self._ends = now + self._duration  # or sooner: it has begun before it answered
        return []
