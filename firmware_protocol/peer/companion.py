"""What stands beside robots under a system id of its own, as the table of emulated micro-robots. No I/O, no clock.

It is asked by numbered messages and standard commands. There is no handshake: it takes numbered messages of any session, and
does each of them once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM
from firmware_protocol.peer.exchanges.answers import for_another
from firmware_protocol.peer.exchanges.commands import Numbering
from firmware_protocol.peer.exchanges.exchange import Exchanges, Retry
from firmware_protocol.peer.quality import Counters
from firmware_protocol.peer.requests import Requests
from firmware_protocol.peer.timetable import NOW, Timetable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.errors import HilError
    from firmware_protocol.events import Received
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.fields import Message


class Companion(Requests):
    """One of them, as the host sees it.

    Args:
        system: Its system id.
        component: Its component id.
        role: What it is.
        session: Number that tells this host's numbered messages from another's, 1..65535, at random.
        host: Number of the host's program, 1..65535.
        host_system: System id of the host.
        host_component: Its component id.
        retry: When to ask again.

    Attributes:
        component: Its component id.
        counters: How well it is heard.
    """

    def __init__(
        self,
        system: int,
        component: int,
        *,
        role: Role,
        session: int,
        host: int,
        host_system: int = HOST_SYSTEM,
        host_component: int = HOST_COMPONENT,
        retry: Retry = Retry(),  # noqa: B008 - frozen
    ) -> None:
        self.counters = Counters()
        exchanges = Exchanges(f"the {role.name}", self.counters, retry)
        super().__init__(system, host_system, host, exchanges, Numbering(), timetable=Timetable(), role=role, open_session=True)
        self.component = component
        self.numbering.open(session)
        self.unavailable = None
        self._us = (host_system, host_component)

    def handle(self, received: Received) -> None:
        """Take a message of its system.

        Args:
            received: A good message.
        """
        if received.component == self.component and not for_another(received.message, *self._us):
            self._exchanges.answer(received)

    def next_due(self) -> float:
        """When `due` must be called next, in s; it may be called earlier."""
        return NOW if self._outbox else self._exchanges.next_due

    def due(self, now: float) -> Sequence[Message]:
        """What must be sent now.

        Args:
            now: Time in s.

        Returns:
            Messages in order; they count as sent.
        """
        out, self._outbox = self._outbox, []
        return out + self._exchanges.due(now)

    def gone(self, error: HilError) -> None:
        """It can't be reached any more: everything open fails, and so does what is asked from now on.

        Args:
            error: Why.
        """
        self.unavailable = self._exchanges.shut = error
        self._exchanges.fail_all(error)
