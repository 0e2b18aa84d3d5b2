"""The referee of a ring in the kernel: it watches and reports in C, and answers here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import REFEREE_COMPONENT, BoutOutcome
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.sumo.referee import IDENTIFIERS, REPORT_PERIODS, Referee

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.wire.signing import Signing
    from simdevice.kernel.arrays import Arrays
    from simdevice.sumo.match import Match

_NONE: Final = 2**32 - 1
"""Number of no bout."""


class KernelReferee(Referee):
    """Resets, judges and reports; see `Referee`.

    Args:
        arrays: The kernel's arrays.
        number: Which of their rings it is at.
        match: What it watches.
        on_reset: Called after everybody has been placed.
        look: Has the table show where everybody is.
        wire: What it speaks.
        signing: Signs what it says, and tells whom to believe; None: nothing is signed.
    """

    def __init__(
        self,
        arrays: Arrays,
        number: int,
        match: Match,
        on_reset: Callable[[], None],
        look: Callable[[], None],
        *,
        wire: str,
        signing: Signing | None,
    ) -> None:
        super().__init__(match, on_reset, look=look, wire=wire, signing=signing)
        self._referees = referees = arrays.referees
        self._number = number
        referees.can, referees.speaks = wire == CAN, wire == MAVLINK and signing is None
        referees.component, referees.longest = REFEREE_COMPONENT, self.longest
        referees.first, referees.beyond = IDENTIFIERS.start, IDENTIFIERS.stop
        referees.there[number], referees.every[number] = 1, REPORT_PERIODS
        self._give()

    def _take(self) -> None:
        """Take over how things stand from the kernel."""
        referees, number = self._referees, self._number
        self.follow(referees.system[number])
        if isinstance(self._codec, MavlinkCodec):
            self._codec.sequence = referees.sequence[number]
        self._countdown = referees.countdown[number]
        self._reported, self._decided = referees.reported[number], BoutOutcome(referees.decided[number])

    def _give(self) -> None:
        """Tell the kernel how things stand."""
        referees, number = self._referees, self._number
        referees.system[number] = self._system
        if isinstance(self._codec, MavlinkCodec):
            referees.sequence[number] = self._codec.sequence
        referees.countdown[number], referees.every[number] = self._countdown, self._periods
        referees.reported[number] = self._reported if self._reported >= 0 else _NONE
        referees.decided[number], referees.bout[number] = self._decided, self.bout
        referees.whole[number] = self._whole

    def receive(self, data: bytes, now: float) -> bytes:
        """Take bytes from the host; see `Referee.receive`."""
        self._take()
        answers = super().receive(data, now)
        self._give()
        return answers

    def say(self, now: float) -> bytes:
        """Report what the kernel does not: it is due, and there is room for it.

        Args:
            now: Time of the emulation in s.
        """
        self._take()
        self._look()
        said = self._say(now, None)
        self._give()
        return said
