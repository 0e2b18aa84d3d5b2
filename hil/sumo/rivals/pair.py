"""Two Juniors in one ring: the program has the first, and whoever steps the links for it lets a rival play the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.connecting.serving import WAIT
from hil.sumo.ring import RingError
from hil.sumo.robots import Robots

if TYPE_CHECKING:
    from firmware_protocol.events import Event
    from hil.sumo.junior import Junior
    from hil.sumo.referee import RefereeHandle
    from hil.sumo.tournament.players import Player


class Pair(Robots):
    """Two Juniors in one ring, each on a network of its own.

    Whatever waits for the first robot serves both links, as with all robots that are held together; here the player of the
    other is attended after every step as well. So it does not matter to it what the first one's program waits for, nor to
    that program that somebody plays.

    `connect_all_as(Pair, "sim://junior?networks=2")` makes one; see `Robots`.
    """

    _player: Player | None = None
    _attending: bool = False

    @property
    def home(self) -> Junior:
        """The first, which the referee belongs to."""
        return self._both()[0]

    @property
    def away(self) -> Junior:
        """The other."""
        return self._both()[1]

    @property
    def referee(self) -> RefereeHandle:
        """The referee.

        Raises:
            RingError: There is none, or there are not two robots.
        """
        referee = self.home.referee
        if referee is None:
            raise RingError("there is no referee with the first robot, and nobody else says who has won")
        return referee

    def _both(self) -> list[Junior]:
        both = [handle for _, handle in sorted(self.members.items())]  # one that is lost for a while is one of them
        if len(both) != 2:
            raise RingError(f"a bout against a robot needs two in one ring, and there are {len(both)}")
        return both

    def play(self, player: Player | None) -> None:
        """Have somebody play the other robot from now on.

        Args:
            player: Who has begun to; None: nobody.
        """
        self._player = player

    def step(self, wait: float = WAIT) -> list[Event]:
        """Serve both links once, and attend to the player; see `Robots.step`.

        Raises:
            RefusedError: The other robot refuses to go on.
            PeerError: It is gone or does not answer.
        """
        events = super().step(wait)
        if self._player is not None and not self._attending:  # a player may wait for something, too
            self._attending = True
            try:
                self._player.attend(self.away)
            finally:
                self._attending = False
        return events
