"""A peer on the bench: messages in by hand, messages out into a list, and a clock that is moved."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any, TypeVar

from firmware_protocol.clock import ManualClock
from firmware_protocol.events import Received
from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    Heartbeat,
    RobotAck,
    RobotSession,
    RobotStatus,
    State,
)
from firmware_protocol.peer.peer import Peer
from firmware_protocol.roles.known import ROLES
from firmware_protocol.vocabulary import Action, Maneuver

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.events import Event
    from firmware_protocol.peer.connection import PeerState
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.fields import Message

M = TypeVar("M", bound="Message")

HOST_NUMBER = 4321
"""Number of the host that the peer belongs to."""
QUICK = Maneuver((Action.F, Action.R), period=0.1, floor_reflex=False)
"""A maneuver of two actions."""


class Bench:
    """A peer, and a robot played by the test.

    Attributes:
        peer: What is tested.
        sent: Everything it has sent.
        events: Everything it has reported but the messages themselves.
        shown: The messages it has passed on.
    """

    def __init__(self, *, open_session: bool = True, roles: Sequence[Role] = ROLES) -> None:
        self.clock = ManualClock(10.0)
        sessions = count(701)
        self.peer = Peer(1, host=HOST_NUMBER, session=lambda: next(sessions), now=10.0, roles=roles, open_session=open_session)
        self.sent: list[Message] = []
        self.events: list[Event] = []
        self.shown: list[Message] = []
        self._sequences: dict[int, int] = {}
        self._session = 0

    def state(self) -> PeerState:
        """Where the connection stands now."""
        return self.peer.state

    def heard(self, message: Message, component: int = 1, step: int = 1, raw: bytes | None = None) -> None:
        """The robot says something; `step` is how far its frame sequence goes on."""
        sequence = self._sequences[component] = (self._sequences.get(component, -1) + step) & 255
        raw = raw if raw is not None else repr((sequence, message)).encode()
        self._report(self.peer.handle(Received(message, 1, component, sequence, self.clock.now(), raw)))
        self._send()

    def wait(self, time: float) -> None:
        """Let time pass, in ticks of 5 ms."""
        end = self.clock.now() + time
        while self.clock.now() < end - 1e-9:
            self.clock.advance(0.005)
            self._send()

    def _send(self) -> None:
        while self.peer.next_due() <= self.clock.now():
            self.sent += self.peer.due(self.clock.now())
            self._report(self.peer.events())

    def _report(self, events: object) -> None:
        for event in events:  # type: ignore[attr-defined]
            if isinstance(event, Received):
                self.shown.append(event.message)
            else:
                self.events.append(event)

    def take(self, kind: type[M]) -> list[M]:
        """Messages of one kind sent so far; forgets all that was sent."""
        self._send()
        found = [message for message in self.sent if isinstance(message, kind)]
        self.sent.clear()
        return found

    # --- What a robot says -------------------------------------------------------------------------------------------

    def heartbeat(self, *, armed: bool = False, state: State = State.READY) -> None:
        self.heard(Heartbeat(10, 0, 128 * armed, int(state), 3))

    def version(self, major: int = 2, minor: int = 0, uid: int = 0, product: int = 0) -> None:
        self.heard(AutopilotVersion(0, 1, major << 24 | minor << 16, uid=uid, product_id=product))

    def answer_to(self, message: type[Message], sequence: int, result: int = 0, reason: int = 0) -> RobotAck:
        session = self.last(RobotSession).session if message is RobotSession else self.peer.session
        assert session is not None
        return RobotAck(message.ID, session, sequence, 255, 190, result, reason)

    def ack(
        self,
        message: type[Message] = RobotSession,
        sequence: int = 0,
        result: int = 0,
        reason: int = 0,
        component: int = 1,
    ) -> None:
        self.heard(self.answer_to(message, sequence, result, reason), component)

    def status(self, *, boots: int = 1, time: float | None = None, state: int = 1, sequence: int = 0) -> None:
        own = self.clock.now() if time is None else time
        self._session = self.peer.session or self._session
        self.heard(RobotStatus(own, 0, 0, 0, 0, 0, boots, self._session, sequence, state))

    def command_ack(self, command: int, result: int = 0, component: int = 1) -> None:
        self.heard(CommandAck(command, result), component)

    def last(self, kind: type[M]) -> M:
        """The last message of a kind that was sent."""
        return [message for message in self.sent if isinstance(message, kind)][-1]

    def requests(self) -> list[int]:
        """Ids of the messages asked for so far; forgets all that was sent."""
        asked = [message for message in self.take(CommandLong) if message.command == Command.REQUEST_MESSAGE]
        return [int(message.param1) for message in asked]

    @classmethod
    def connected(cls) -> Bench:
        """A bench after the whole handshake."""
        bench = cls()
        bench.connect()
        return bench

    def connect(self, uid: int = 0) -> None:
        """The whole handshake."""
        self.heartbeat()
        self.version(uid=uid)
        self.ack()
        self.status()
        self.command_ack(Command.REQUEST_MESSAGE)
        for _ in self.peer.streams.intervals:
            self.command_ack(Command.SET_MESSAGE_INTERVAL)
        assert self.peer.ready
        self.sent.clear()


def failed(ticket: Ticket[Any]) -> str:
    """Why a ticket has failed, in words."""
    assert ticket.done
    assert ticket.error is not None
    return str(ticket.error)
