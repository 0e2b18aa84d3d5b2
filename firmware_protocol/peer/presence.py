"""Whether a robot is there, as far as its user has been told: found, lost, back. No I/O, no clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.events import PeerBack, PeerFound, PeerLost

if TYPE_CHECKING:
    from firmware_protocol.events import Event


class Presence:
    """What is told of a robot's coming and going.

    Args:
        system: System id of the robot.
    """

    def __init__(self, system: int) -> None:
        self._system = system
        self._known = self._present = self._restarted = False

    def usable(self, now: float) -> list[Event]:
        """The robot can be used.

        Args:
            now: Time in s.

        Returns:
            That it was found, or is back; nothing, if it was there.
        """
        news: list[Event] = []
        if not self._known:
            news.append(PeerFound(self._system, now))
        elif not self._present:
            news.append(PeerBack(self._system, now, self._restarted))
        self._known = self._present = True
        self._restarted = False
        return news

    def gone(self, cause: str, now: float) -> list[Event]:
        """The robot can't be used any more.

        Args:
            cause: Why, in words.
            now: Time in s.

        Returns:
            That it is lost; nothing, if it was not there.
        """
        if not self._present:
            return []
        self._present = False
        return [PeerLost(self._system, now, cause)]

    def restarted(self, now: float) -> list[Event]:
        """The robot has restarted, which is told again when it is back.

        Args:
            now: Time in s.

        Returns:
            That it is lost; nothing, if it was not there.
        """
        self._restarted = self._known
        return self.gone("it has restarted", now)
