"""Who has been heard on a network, and which of them are spoken with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    GROUND_STATION,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    SEVERITY_ERROR,
    SHARE_COMPONENT,
    Heartbeat,
    Statustext,
)
from firmware_protocol.roles.known import SIGNS

if TYPE_CHECKING:
    from collections.abc import Collection

    from firmware_protocol.events import Received, Rejected
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.wire.fields import Message

WATCHING: Final = "watching"
"""What is said of a shared link as long as it is not known who drives."""


class Acquaintances:
    """The robots of one network.

    Args:
        system: Own system id.
        wanted: System ids of the robots to speak with; None are all that answer.

    Attributes:
        peers: Robots heard so far that are spoken with, by system id.
        shunned: System ids of those heard that are not to be spoken with.
        unclaimed: Rejected pieces of wire input of which nobody can tell whose they were.
        shared: What was said of who drives, where another host has the link and shares it: we look on only. Empty where it
            is ours.
    """

    def __init__(self, system: int, wanted: Collection[int] | None) -> None:
        self.peers: dict[int, Peer] = {}
        self.shunned: set[int] = set()
        self.unclaimed = 0
        self.shared = ""
        self._system = system
        self._wanted = wanted
        self._heard: set[int] = set()

    @property
    def strangers(self) -> set[int]:
        """System ids of robots heard that are not spoken with."""
        return self._heard - self.peers.keys()

    @property
    def only(self) -> int | None:
        """System id of the only robot that is to be spoken with; None where that may be another, too."""
        return next(iter(self._wanted)) if self._wanted is not None and len(self._wanted) == 1 else None

    def admits(self, received: Received) -> bool:
        """Take note of who has said something.

        Args:
            received: A message of somebody who is not among `peers`.

        Returns:
            It is the heartbeat of a robot that is to be spoken with.
        """
        message, system = received.message, received.system
        if (system, received.component) == (HOST_SYSTEM, SHARE_COMPONENT):
            self._see_shared(message)
            return False
        if system in self.shunned or system in {0, self._system} or received.component != ROBOT_COMPONENT:
            return False
        heartbeat = isinstance(message, Heartbeat) and message.type != GROUND_STATION
        if not heartbeat and type(message) not in SIGNS:
            return False
        self._heard.add(system)
        if self._wanted is not None and system not in self._wanted:
            self.shunned.add(system)
            return False
        return heartbeat

    def _see_shared(self, message: Message) -> None:
        """The host that has the link, and shares it, has said something."""
        if isinstance(message, Statustext) and message.severity > SEVERITY_ERROR:
            self.shared = message.text
        self.shared = self.shared or WATCHING

    def keep(self, robots: Collection[int]) -> set[int]:
        """Only these are to be spoken with from now on.

        Args:
            robots: Their system ids.

        Returns:
            System ids of those that were spoken with until now.
        """
        self._wanted = robots
        self.shunned |= self._heard - set(robots)
        left = self.peers.keys() - set(robots)
        for system in left:
            del self.peers[system]
        return left

    def blame(self, rejected: Rejected) -> None:
        """Count rejected input on the robot that it came from, or on the link.

        Args:
            rejected: The input.
        """
        system = rejected.system
        if system is None and len(self.peers) == len(self._heard) == 1:  # nobody else is there
            system = next(iter(self.peers))
        if system in self.peers:
            self.peers[system].reject()
        elif system not in self.shunned:
            self.unclaimed += 1
