"""One micro-robot of a swarm: who it is. What it does, it does in the rounds of the swarm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.vocabulary import RobotClass
from hil.connecting.handle import RobotHandle

if TYPE_CHECKING:
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.peer.role import Role

READ: tuple[str, ...] = ("CLASS", "RING")
"""The parameters that a swarm reads of each robot: no others, for a slow line's sake."""


class MicroRobot(RobotHandle):
    """One robot of a swarm."""

    ROLE: ClassVar[Role | None] = MICRO_ROBOT

    def __init__(self, *args: Any, **options: Any) -> None:  # noqa: ANN401 - as of `RobotHandle`
        super().__init__(*args, **options)
        self._read: dict[str, Ticket[float]] = {}

    def adopt(self, peer: Peer, network: str | None = None) -> None:
        """Be the handle of this robot, and read what a swarm has to know of it."""
        super().adopt(peer, network)
        self.read()

    def read(self) -> None:
        """Ask for what a swarm has to know of it."""
        self._read = {name: self.peer.read_parameter(name) for name in READ}

    @property
    def reading(self) -> list[Ticket[float]]:
        """What it was asked to say."""
        return list(self._read.values())

    @property
    def complete(self) -> bool:
        """It has said what a swarm has to know of it, or will not."""
        return all(ticket.done for ticket in self._read.values())

    @property
    def kind(self) -> RobotClass | None:
        """Its class; None where it has not said any."""
        value = self._value("CLASS")
        return None if value is None or value not in set(RobotClass) else RobotClass(int(value))

    @property
    def ring(self) -> bool:
        """A ring of sensors is fitted."""
        return bool(self._value("RING"))

    def _value(self, name: str) -> float | None:
        ticket = self._read.get(name)
        return ticket.result if ticket is not None and ticket.error is None else None
