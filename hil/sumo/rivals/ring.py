"""The ring where the opponent is a robot that somebody plays."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import OpponentCode
from hil.sumo.ring import SETTLE, RefereedRing

if TYPE_CHECKING:
    from firmware_protocol.vocabulary import Stimulus
    from hil.sumo.rivals.pair import Pair
    from hil.sumo.rivals.rivals import Rivals

AWAY_SEAT = 1
"""The rival has the second robot."""


class RivalRing(RefereedRing):
    """A ring with a referee in which the opponent is a second Junior that a rival plays.

    Junior has the home seat in every bout, and start poses are those of a bout against a dummy. Who the rival is, and what it
    leaves to chance, follows from the seed of the bout, and so does the bout: the other robot is disarmed and armed anew, and
    a bout begins when a reading of its sensors has come, so that a rival that acts on every reading gets the first one at the
    same time in all. One thing is left of the bouts before: odometers go on. A policy sees them in whole millimetres, so that
    one step of a wheel may round otherwise, and against a policy a bout that is begun again may be another one.

    Args:
        pair: The robots.
        rivals: Who is met.

    Raises:
        RingError: There are not two robots, or there is no referee.
        PeerError: The referee does not answer.
    """

    def __init__(self, pair: Pair, rivals: Rivals) -> None:
        super().__init__(pair.home, pair.referee, OpponentCode.JUNIOR.label)
        self._pair = pair
        self._rivals = rivals

    @property
    def opponent(self) -> str:
        """Who is met."""
        return self._rivals.name

    def begin(self, seed: int) -> Stimulus:
        """Begin a bout; see `Ring.begin`. Both robots stand still, whatever they were doing."""
        pair, away = self._pair, self._pair.away
        pair.play(None)
        player = self._rivals.drawn(seed).player(seed, AWAY_SEAT)
        away.disarm()  # also ends a contest
        player.prepare(away)
        away.arm()
        if self._junior.armed:
            self._junior.stop()
        self._wait_for_reading()
        pair.come_together()
        self._place(seed)
        pair.come_together()  # or the wait would begin when the one behind was read last, which depends on what was before
        self._junior.wait(SETTLE)
        pair.come_together()
        player.begin(away)
        pair.play(player)
        return self._junior.sense()

    def _wait_for_reading(self) -> None:
        """Wait for the next reading of the rival's sensors."""
        away = self._pair.away
        before = away.latest
        while away.latest is before:
            self._pair.step()
            if away.stale:
                away.read_sensors()  # is it still there?

    def recover(self) -> None:
        """Wait for whoever was lost, and arm Junior; see `Ring.recover`. The rival is armed when a bout begins."""
        self._pair.play(None)
        self._pair.away.wait_until_back()
        super().recover()
