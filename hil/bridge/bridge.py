"""Link, pump, codec and peers behind one single-threaded `step()`: all that a program has to call."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Self, TypeVar

from firmware_protocol.errors import LinkClosedError, LinkError, LinkTimeoutError, WrongRobotError
from firmware_protocol.events import LinkNews, PeerBack, PeerFound, PeerLost, Received
from firmware_protocol.messages import (
    HOST_COMPONENT,
    HOST_SYSTEM,
    RobotAlive,
    Statustext,
)
from firmware_protocol.peer.peer import Peer
from firmware_protocol.peer.timetable import NEVER, NOW, Timetable
from firmware_protocol.peer.timing import HEARTBEAT_PERIOD, HOST_HEARTBEAT, KEEP_ALIVE
from firmware_protocol.roles.known import ROLES
from firmware_protocol.wire.codec import open_codec
from hil.bridge.acquaintances import Acquaintances
from hil.bridge.clock import LastReading
from hil.bridge.farewell import Farewell
from hil.bridge.operator import INTERRUPT, Operator
from hil.bridge.outlet import Outlet
from hil.bridge.pump import SLICE, Lost, Pump, open_pump
from hil.bridge.reopening import Outage
from hil.bridge.sessions import random_session
from hil.bridge.surroundings import Surroundings
from hil.bridge.taps import NOTHING, Opening
from hil.bridge.witness import Witness
from hil.signing.redaction import Redaction

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from types import TracebackType

    from firmware_protocol.clock import Clock
    from firmware_protocol.events import Event, Rejected, RejectReason
    from firmware_protocol.link import Link
    from firmware_protocol.peer.pacing import Pace
    from firmware_protocol.wire.codec import Codec
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.signing import Signing
    from hil.bridge.pump import Chunk, Turn
    from hil.bridge.reopening import Reopening
    from hil.bridge.taps import Circumstances, Tap

P = TypeVar("P", bound=Peer)

_GAP: Final = 0.1
"""A longer gap in front of a backlog is what was dropped of it, as like as not: it is nobody's silence. In s."""


class Bridge:
    """One link and the robots on it.

    Call `step` again and again; it returns as soon as there is something to see or to do, so waits are loops:
    `while not ticket.done: bridge.step(0.1)`.

    A step takes in `SLICE` bytes of the pump's at most. If there were as many, more may be waiting: then what is due is sent
    before any of them is decoded, urgent questions first, and how long a robot has been silent goes by the stamps of what was
    taken in. More than the pump's `LIMIT` never wait: the oldest are dropped, counted, and told of by LinkNews.

    When the link ends, that step returns what had come before, and a PeerLost for every robot that was there; all open
    tickets fail with the link's error. Every later `step` or `send` raises that error.

    With `reopening` the link is opened again meanwhile: open tickets and new questions fail with a
    PeerLostError, `step` goes on as if nobody spoke, LinkNews tell what happens, and the handshake is done anew when the
    link is back. A robot is known by its unique id; PeerBack says that it can be used again, disarmed and with a new
    session. Only when the patience is over has the link ended as above.

    Args:
        link: An open link; closed with the bridge.
        clock: Tells the time; for a lock-step link, the device's own. Who is to see its last reading passes a `LastReading`.
        taps: What sees everything.
        system: Own system id.
        component: Own component id.
        robots: System ids of the robots to speak with; None are all that answer. Messages of others are passed on.
        open_sessions: False watches only, and neither stops nor disarms the robots, until one is taken: see `Peer`.
        session: Gives numbers, 1..65535: the first is the host's own, the others are of sessions. A run that must be
            repeatable passes a seeded source.
        reopening: How the link is opened again when it is gone, and how long that is tried; None does not.
        arrived: Called whenever something has come, in another thread where the link is read by one.
        pump: Hands over what the link brings; None makes the one that suits it.
        operator: Whose keys and signals are taken in by the steps; None: nobody's.
        network: Name of the network; None is the address of the link.
        signing: Signs what is sent, and refuses what others have not signed; None: nothing is signed.
        pace: What to ask of the robots on a slow line; None: it carries all that they say.

    Attributes:
        pace: Likewise.
        link: The link in use; another one after a loss.
        network: Name of the network.
        host: Number of this program, by which robots know who keeps them moving (ROBOT_ALIVE).
        now: The clock as the last step read it, in s.
        peers: Robots heard so far that are spoken with, by system id.
        acquaintances: Who has been heard.
        unsent: Writes that the other end did not take in time; what they carried is lost, and asked for again.
        lost: Why there is no link at present; None while there is one.
        patience: How long it is tried to have link and robot back, in s; 0 where it is not tried.
        operator: Whose keys and signals are taken in by the steps.
        witness: What was seen while no robot could be used: since the bridge began, or since one was lost.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        *,
        taps: Sequence[Tap] = (),
        system: int = HOST_SYSTEM,
        component: int = HOST_COMPONENT,
        robots: Collection[int] | None = None,
        open_sessions: bool = True,
        session: Callable[[], int] = random_session,
        reopening: Reopening | None = None,
        arrived: Callable[[], None] | None = None,
        pump: Pump | None = None,
        operator: Operator | None = None,
        network: str | None = None,
        signing: Signing | None = None,
        pace: Pace | None = None,
    ) -> None:
        self.link = link
        self.network = link.url if network is None else network
        self.pace = self._pace_untold = pace
        reading = clock if isinstance(clock, LastReading) else LastReading(clock)
        self.now = reading.now()
        self.acquaintances = Acquaintances(system, robots)
        self.peers = self.acquaintances.peers
        self._timetable = Timetable()
        self.unsent = 0
        self.lost: LinkError | None = None
        self.patience = 0.0 if reopening is None else reopening.patience
        self._read_clock = reading.read
        self._taps = tuple(taps)
        signed = 0 if signing is None else signing.clock()
        for tap in self._taps:
            tap.opened(Opening(self.network, link.url, link.wire, link.lockstep, self.now, signed))
        self._system = system
        self._component = component
        self._open_sessions = open_sessions
        self._draw = session
        self.host = self._session()
        self._alive = (RobotAlive(self.host),)
        self.signing = signing
        self._codec = self._open_codec(link.wire)
        self._redaction = Redaction(link.wire)
        self._outlet = Outlet(self._codec.encode, self._taps)
        self._hello_due = self._alive_due = self._taken_in = self.now
        self._ended: LinkError | None = None
        self._told = self._closed = self._failed = False
        self._outage = Outage(link.url)
        self._farewell = Farewell()
        self.witness = Witness(system, self.now)
        self._looking = True
        self._untold: list[Event] = []
        self._anew: str | None = None
        self._reopening = reopening
        self._arrived = arrived
        self._pump = open_pump(link, clock, self._reopening, arrived) if pump is None else pump
        self.operator = Operator() if operator is None else operator
        self._around = Surroundings(self.operator, self._pump)
        self.operator.attach(self._wake)

    def _open_codec(self, wire: str) -> Codec:
        """The codec of our wire."""
        return open_codec(wire, system=self._system, component=self._component, signing=self.signing)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    @property
    def strangers(self) -> set[int]:
        """System ids of robots heard that are not spoken with."""
        return self.acquaintances.strangers

    @property
    def unclaimed(self) -> int:
        """Rejected pieces of wire input of which nobody can tell whose they were."""
        return self.acquaintances.unclaimed

    @property
    def rejected(self) -> dict[RejectReason, int]:
        """Pieces of wire input that were no good message, by reason."""
        return self._codec.rejected

    @property
    def farewell(self) -> str:
        """What was said at the other end when the link ended last, as by a server that turns us away; else empty."""
        return self._farewell.said

    @property
    def overrun(self) -> int:
        """Bytes that came and were dropped, since they came faster than they were taken in, as far as that has been told."""
        return self._around.told

    @property
    def signed(self) -> int:
        """Good messages with a signature; without `signing`, it was not looked at."""
        return self._codec.signed

    def step(self, wait: float) -> list[Event]:
        """Wait for bytes, take them in, and send what is due.

        The clock is read once, after the wait; chunks carry their own stamps. A step that has something to send at once
        (a question just asked) does not wait.

        Args:
            wait: Longest wait in s, in the link's time; it ends early when bytes come or something is due to be sent.

        Returns:
            What has happened, in order.

        In lock-step, a step that is given no time, and in which nothing is to be taken in or sent, is none.

        Raises:
            LinkError: The link had ended before this step (LinkClosedError, also after `close`).
            KeyboardInterrupt: The operator asked for it; what has happened is returned by the next step.
        """
        if self._told or self._closed:
            raise self._ended or LinkClosedError(self.link.url, "the bridge is closed")
        until = self.next_due()
        if wait <= 0 and self.link.lockstep and until > self.now and self._nothing_waits:
            return []
        chunks = self._pump.take(wait if until > self.now and not self.operator.waiting else 0.0, until)
        now = self.now = self._read_clock()
        events, self._untold = self._untold, []
        met = self._around.look(self.link)
        for tap in self._taps:
            tap.step(now, chunks, met)
        if self._anew is not None:
            self._forget_sessions(self._anew, now, events)
        self._take_in(chunks, now, events)
        if met is not NOTHING or self._pace_untold is not None or self._around.dropped != self._around.told:
            self._hear_of_link(met, now, events)
        if self._reopening is not None:
            self._turn(self._reopening, self._around.turn, now, events)
        if now >= self.next_due() and self._ended is None:
            self._service(now, events)
        if (ended := self._ended or met.ended) is not None:
            self._end(ended, now, events)
        if met.inputs and any(one.what == INTERRUPT for one in met.inputs):
            self._untold = events
            raise KeyboardInterrupt
        return events

    @property
    def _nothing_waits(self) -> bool:
        """A step would find nothing to take in, to see to or to tell, if time has not moved."""
        return self._ended is None and not self._untold and self._anew is None and not self._around.changed

    def _take_in(self, chunks: Sequence[Chunk], now: float, events: list[Event]) -> None:
        """Decode what has come; where more may be waiting, see first to what is due."""
        if sum([len(data) for _, data in chunks]) >= SLICE:
            self._fall_behind(chunks, now, events)
        else:
            self._taken_in = now
        for stamp, data in chunks:
            if self._looking:
                self.witness.came(data, stamp)
            self._take_chunk(stamp, data, events)
        if not chunks and (rest := self._codec.flush(now)):
            self._pass(self._redaction.judged(rest))
            self._take(rest, events)

    def _take_chunk(self, stamp: float, data: bytes, events: list[Event]) -> None:
        """Decode a chunk, and tell taps and peers of what is in it."""
        found = self._codec.receive(data, stamp)
        passed = self._redaction.received(stamp, data, found)
        if self._taps:
            self._pass(passed)
        self._take(found, events)

    def _wake(self) -> None:
        """Have a step that waits return at once, since the operator asks for something."""
        self._pump.wake()
        if self._arrived is not None:
            self._arrived()

    def _session(self) -> int:
        """Draw a number."""
        number = self._draw()
        for tap in self._taps:
            tap.session_drawn(number)
        return number

    def send(self, message: Message) -> None:
        """Send a message outside all questions and answers.

        Args:
            message: What to say.

        Raises:
            EncodeError: The wire can't carry it.
            LinkClosedError: The link has ended, or is gone for the moment.
        """
        if self._ended is not None or self._closed:
            raise self._ended or LinkClosedError(self.link.url, "the bridge is closed")
        if self._failed:
            raise LinkClosedError(self.link.url, "the link is gone for the moment")
        self._write([message], self.now)
        if self._ended is not None:
            raise self._ended

    def keep(self, robots: Collection[int]) -> None:
        """Speak with these robots only from now on; nothing is said to the others any more, and what comes is passed on.

        Args:
            robots: Their system ids.
        """
        for system in self.acquaintances.keep(robots):
            self._timetable.leave(system)

    def begin_anew(self, cause: str) -> None:
        """Treat the robots that are ours as if their link had been lost and were back, since nobody has seen to them for long.

        With the next step everything open fails with a PeerLostError, before that takes anything in or sends anything; then the
        handshake is done anew, by which they are stopped and disarmed.

        Args:
            cause: Why, in words.
        """
        if not (self._failed or self._ended is not None or self._closed):
            self._anew = cause

    def _forget_sessions(self, cause: str, now: float, events: list[Event]) -> None:
        """Do what `begin_anew` asked for, before anything else is done."""
        self._anew = None
        error = LinkClosedError(self.link.url, cause)
        for peer in self.peers.values():
            if peer.taken:
                for event in (*peer.unplugged(error, now), *peer.plugged_in(now)):
                    events.append(event)
                    self._tell(event)

    def close(self) -> None:
        """Stop reading and close the link. Repeating it does nothing."""
        if self._closed:
            return
        self._closed = True
        self.operator.detach(self._wake)
        try:
            self._pump.close()
        finally:
            self.link.close()
            self._pass(self._redaction.ended(self._codec.flush(self.now, ended=True)))

    @property
    def pending(self) -> bool:
        """More has come than the last step took in: the next one need not wait."""
        return self._pump.pending

    @property
    def urgent(self) -> bool:
        """Something is to be sent that nothing else may hold up: an emergency stop, a stop."""
        return self._timetable.soonest == NOW and any(peer.urgent for peer in self.peers.values())

    def next_due(self) -> float:
        """When something must be sent next."""
        if self._failed:
            return NEVER
        if not self.peers:
            return self._hello_due
        timetable = self._timetable
        return self._alive_due if timetable.kept and self._alive_due < timetable.soonest else timetable.soonest

    def _pass(self, chunks: Sequence[Chunk]) -> None:
        """Tell the taps of bytes that came."""
        for stamp, data in chunks:
            for tap in self._taps:
                tap.wire_rx(stamp, data)

    def _give_up(self, now: float, events: list[Event]) -> None:
        """Nothing more comes: what has come in part is no message."""
        rest = self._codec.flush(now, ended=True)
        self._pass(self._redaction.ended(rest))
        self._take(rest, events)

    def _take(self, items: list[Received | Rejected], events: list[Event]) -> None:
        """Tell taps and peers of what the codec has found."""
        taps, witness, shunned = self._taps, self.witness if self._looking else None, self.acquaintances.shunned
        for item in items:
            if witness is not None:
                witness.saw(item)
            if taps and (item.system not in shunned or not isinstance(item, Received)):  # of others there are the bytes
                for tap in taps:
                    tap.received(item)
            if isinstance(item, Received):
                self._hear(item, events)
            else:
                events.append(item)
                self.acquaintances.blame(item)

    def _hear(self, item: Received, events: list[Event]) -> None:
        """Have the peer of a robot hear what it has said."""
        message = item.message
        if type(message) is Statustext:
            self._farewell.heard(message, item.time)
        peer = self.peers.get(item.system) or self._meet(item)
        if peer is None:
            events.append(item)
            return
        for event in peer.handle(item):
            events.append(event)
            if event is not item:
                self._tell(event)

    def _meet(self, received: Received) -> Peer | None:
        """A new robot, if this is the heartbeat of one that is to be spoken with."""
        if not self.acquaintances.admits(received):
            return None
        system = received.system
        self._timetable.enter(system)
        self.peers[system] = peer = self._make_peer(system, received.time)
        return peer

    def _make_peer(self, system: int, now: float) -> Peer:
        """A peer for a robot that is heard for the first time."""
        return self._introduce(Peer, system, now)

    def _introduce(self, make: Callable[..., P], system: int, now: float) -> P:
        """A peer of a certain kind."""
        return make(
            system,
            session=self._session,
            now=now,
            host=self.host,
            roles=ROLES,
            open_session=self._open_sessions,
            host_system=self._system,
            host_component=self._component,
            pace=self.pace,
            timetable=self._timetable,
        )

    def _turn(self, reopening: Reopening, turn: Turn | None, now: float, events: list[Event]) -> None:
        """See to a link that was lost or is back, and to who is at its other end."""
        if isinstance(turn, Lost):
            self._lose(turn.error, now, events)
        elif turn is not None:
            self._return(turn.link, now, events)
        elif self._outage.lasts and not self._failed:
            if any(peer.ready for peer in self.peers.values()):
                self._outage.over()
                reopening.settle()
            elif len(self.peers) == 1 and isinstance(failure := next(iter(self.peers.values())).failure, WrongRobotError):
                self._failed = True
                self._pump.drop(LinkClosedError(self.link.url, str(failure)), refused=True)

    def _lose(self, error: LinkError, now: float, events: list[Event]) -> None:
        """The link is gone and will be opened again."""
        error = self._farewell.explained(error, now)
        if self._outage.lost(error, now):
            self._report(f"{error}; trying for {self.patience:g} s to open it again", now, events)
        self._give_up(now, events)
        self.lost = error
        self._failed = True
        for peer in self.peers.values():
            for event in peer.unplugged(error, now):
                events.append(event)
                self._tell(event)
        self._pump.let_go()

    def _return(self, link: Link, now: float, events: list[Event]) -> None:
        """The link is there again, perhaps under another name."""
        if text := self._outage.back(link.url, now):
            self._report(text, now, events)
        self.link = link
        self.lost, self._failed = None, False
        self._codec.reset()
        self._hello_due = now
        for peer in self.peers.values():
            events.extend(peer.plugged_in(now))

    def _report(self, text: str, now: float, events: list[Event]) -> None:
        """Tell of the link."""
        news = LinkNews(text, now)
        events.append(news)
        self._tell(news)

    def _hear_of_link(self, met: Circumstances, now: float, events: list[Event]) -> None:
        """Tell what has happened to the link, of bytes that were dropped, and that robots on a slow line are asked for less."""
        if self._pace_untold is not None and self.peers:
            self._report(self._pace_untold.text, now, events)
            self._pace_untold = None
        for text in met.news:
            self._report(text, now, events)
        if text := self._around.dropped_news(now):
            self._report(text, now, events)

    def _tell(self, event: Event) -> None:
        if isinstance(event, PeerFound | PeerBack):
            self._looking = False
        elif isinstance(event, PeerLost) and not any(peer.ready for peer in self.peers.values()):
            self._looking, self.witness = True, Witness(self._system, self.now)
        for tap in self._taps:
            tap.event(event)

    def _fall_behind(self, chunks: Sequence[Chunk], now: float, events: list[Event]) -> None:
        """More may be waiting than these chunks: send what is due before they are decoded.

        All that is decided here follows from the step's clock reading and chunks, which a log has.
        """
        gap = chunks[0][0] - self._taken_in
        if gap > _GAP:
            self._missed(gap)
        self._taken_in = chunks[-1][0]
        if now >= self.next_due():
            self._service(now, events)

    def _missed(self, gap: float) -> None:
        """Nobody has listened for so long, in s."""
        for peer in self.peers.values():
            peer.missed(gap)

    def _service(self, now: float, events: list[Event]) -> None:
        """Send what is due."""
        if not self.peers:
            self._hello_due = now + HEARTBEAT_PERIOD
            self._write([HOST_HEARTBEAT], now)
            return
        urgent = self.urgent
        peers = [self.peers[system] for system in self._timetable.take(now)]
        if urgent:
            peers.sort(key=lambda peer: not peer.urgent)
        elif now >= self._alive_due:
            self._keep(now)
        for peer in peers:
            messages = peer.due(now, self._taken_in)
            if messages:
                self._write(messages, now)
                if len(self.peers) > 1 and HOST_HEARTBEAT in messages:
                    for other in self.peers.values():
                        other.heartbeat_sent(now)
            for event in peer.events():
                events.append(event)
                self._tell(event)
        if urgent and now >= self._alive_due:
            self._keep(now)

    def _keep(self, now: float) -> None:
        """Tell the robots that are ours and armed that we are there, since that is due: one message for all of them."""
        if self._timetable.kept:
            self._alive_due = now + KEEP_ALIVE
            self._write(self._alive, now)

    def _write(self, messages: Sequence[Message], now: float) -> None:
        """Encode, send, and tell the taps. A link that fails is noted."""
        if self._failed:
            return
        self._sent(self._outlet.write(self.link, messages, now))

    def _sent(self, sent: bytes | LinkError) -> None:
        """Note what went out, or a link that failed."""
        if isinstance(sent, bytes):
            if self._looking:
                self.witness.sent(sent)
        elif isinstance(sent, LinkTimeoutError):
            self.unsent += 1
        elif self._reopening is None:
            self._ended = sent
        else:
            self._failed = True
            self._pump.drop(sent)

    def _end(self, error: LinkError, now: float, events: list[Event]) -> None:
        """The link is gone: tell everybody, once."""
        self._ended = error = self._farewell.explained(error, now)
        self._told = True
        self._give_up(now, events)
        for peer in self.peers.values():
            for event in peer.closed(error, now):
                events.append(event)
                self._tell(event)
