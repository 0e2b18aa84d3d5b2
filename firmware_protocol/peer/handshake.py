"""The questions by which a connection with a robot comes about, one at a time, and by which a doubt about it is settled."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import (
    PROTOCOL_MAJOR,
    ROBOT_COMPONENT,
    AutopilotVersion,
    RobotAck,
    RobotSession,
    RobotStatus,
)
from firmware_protocol.peer.exchanges.commands import RequestExchange, SessionExchange
from firmware_protocol.versions import spoken_minor

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.peer.exchanges.commands import Numbering
    from firmware_protocol.peer.exchanges.exchange import Exchanges, Ticket

    Answer = Ticket[AutopilotVersion] | Ticket[RobotAck] | Ticket[RobotStatus]
    """To the question of a state."""


class Handshake:
    """What is asked of a robot before it can be used; which question comes when is told by the table of the connection.

    Args:
        system: System id of the robot.
        host: Number of the host's program, 1..65535.
        exchanges: Where questions are kept until they are answered.
        numbering: Session and sequence of numbered messages.
        session: Gives the number of a new session, 1..65535, at random.
    """

    def __init__(self, system: int, host: int, exchanges: Exchanges, numbering: Numbering, session: Callable[[], int]) -> None:
        self._system = system
        self._host = host
        self._exchanges = exchanges
        self._numbering = numbering
        self._new_session = session
        self._candidate = 0
        self._open: Answer | None = None
        self._doubt: Ticket[RobotStatus] | None = None

    def ask_version(self) -> None:
        """Ask the robot what it is, and what it speaks."""
        self._open = self._exchanges.add(RequestExchange(AutopilotVersion, self._system, ROBOT_COMPONENT, need_ack=False))

    def ask_session(self, version: AutopilotVersion | None) -> None:
        """Ask it to open a session, under a number that is drawn for it.

        Args:
            version: What it said about itself.
        """
        self._candidate = self._new_session()
        minor = spoken_minor(0 if version is None else version.middleware_sw_version)
        target = (self._system, ROBOT_COMPONENT)
        opening = RobotSession(self._candidate, 0, self._host, *target, major=PROTOCOL_MAJOR, minor=minor)
        self._open = self._exchanges.add(SessionExchange(opening, self._numbering))

    def ask_status(self) -> None:
        """Ask it for its count of starts, and whether it still knows a session."""
        self._open = self.count_starts()

    def count_starts(self, *, need_ack: bool = False) -> Ticket[RobotStatus]:
        """Ask it for its count of starts, while something else goes on.

        Args:
            need_ack: A status that it sends by itself is no answer.

        Returns:
            The ticket.
        """
        return self._exchanges.add(RequestExchange(RobotStatus, self._system, ROBOT_COMPONENT, need_ack=need_ack))

    def answered(self) -> Answer | None:
        """The question of the present state, once it has been answered, or has failed; after that there is none."""
        answer = self._open
        if answer is None or not answer.done:
            return None
        self._open = None
        return answer

    def drop(self) -> None:
        """Nobody waits any more for the answer to the question of the present state."""
        self._open = None

    def opened(self) -> None:
        """The session that was asked for is open."""
        self._numbering.open(self._candidate)

    def trust(self) -> None:
        """The robot knows our session, as far as is known."""
        self._doubt = None

    def doubtful(self) -> bool:
        """Whether a refusal of our session has to wait: the robot may have restarted a moment ago.

        Its count of starts is asked for; the message that was refused is repeated meanwhile.
        """
        if self._doubt is None:
            self._doubt = self.count_starts(need_ack=True)
        return not self._doubt.done
