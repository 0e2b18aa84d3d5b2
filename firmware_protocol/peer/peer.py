"""What the host knows of one robot, and how it speaks with it: a transition table plus data. No I/O, no clock.

Messages go in through `handle`; what must be sent comes out of `due`; what happened comes out of both as events. The life
of a connection is the table in `connection.py`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from firmware_protocol.errors import HilError, LinkError, PeerError, PeerLostError, RefusedError, WrongRobotError
from firmware_protocol.events import StreamBack, StreamStopped
from firmware_protocol.messages import (
    ARMED_FLAG,
    HOST_COMPONENT,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    AutopilotVersion,
    Heartbeat,
    Ping,
    Reason,
    RobotAck,
    RobotResultAck,
    RobotStatus,
    Timesync,
)
from firmware_protocol.peer.connection import TRANSITIONS, USABLE, Input, PeerState
from firmware_protocol.peer.exchanges.answers import ANSWERS, for_another
from firmware_protocol.peer.exchanges.commands import Numbering
from firmware_protocol.peer.exchanges.exchange import Exchanges, Retry
from firmware_protocol.peer.handshake import Handshake
from firmware_protocol.peer.presence import Presence
from firmware_protocol.peer.quality import ClockComparison, Counters, FrameStreams, RobotClock
from firmware_protocol.peer.requests import Requests
from firmware_protocol.peer.role import role_of
from firmware_protocol.peer.streams import MOST_REQUESTS, Streams
from firmware_protocol.peer.timetable import NEVER, NOW, Timetable
from firmware_protocol.peer.timing import HEARTBEAT_PERIOD, HOST_HEARTBEAT, SILENCE, TIMESYNC_PERIOD
from firmware_protocol.versions import unfit

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from firmware_protocol.events import Event, Received
    from firmware_protocol.peer.pacing import Pace
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.fields import Message


class Peer(Requests):
    """One robot, as the host sees it.

    Args:
        system: System id of the robot.
        session: Gives the number of a new session, 1..65535, at random.
        now: Time in s.
        open_session: False watches only: no session is opened, which would stop and disarm the robot, numbered messages
            fail, and an armed robot is not kept alive, which is for the host that armed it to do. `take` changes that.
        host: Number of the host's program, 1..65535: robots tell by it who keeps them moving.
        host_system: System id of the host.
        host_component: Its component id. An answer that is for another system or component is none to us.
        roles: What kinds of robots there are; it is taken for the first until it has said what it is (`product_id`).
        retry: When to ask again.
        pace: On a slow line, what to ask of the robot, instead of its role's streams and `retry`; None: it need not be spared.
        timetable: Is told when `due` must be called next, and whether the robot is to be kept moving; None: nobody's.
        numbering: Where session and sequence of numbered messages are kept; None: here.

    Attributes:
        role: What kind of robot it is, as far as is known.
        state: Where the connection stands.
        failure: Why it can't be spoken to, in state REFUSED.
        version: What the robot said about itself.
        heartbeat: Its last heartbeat.
        status: Its last status.
        streams: Whether what it is to send by itself comes.
        counters: How well it is heard.
        clock: Comparison of its clock with ours.
    """

    def __init__(
        self,
        system: int,
        *,
        session: Callable[[], int],
        now: float,
        host: int,
        roles: Sequence[Role],
        open_session: bool = True,
        host_system: int = HOST_SYSTEM,
        host_component: int = HOST_COMPONENT,
        retry: Retry = Retry(),  # noqa: B008 - frozen
        pace: Pace | None = None,
        timetable: Timetable | None = None,
        numbering: Numbering | None = None,
    ) -> None:
        role = roles[0]
        if pace is not None:
            retry = pace.retry
        self.counters = Counters()
        label = f"robot {system}"
        exchanges = Exchanges(label, self.counters, retry, self._plan)
        table = Timetable() if timetable is None else timetable
        numbering = Numbering() if numbering is None else numbering
        super().__init__(
            system, host_system, host, exchanges, numbering, timetable=table, role=role, open_session=open_session, pace=pace
        )
        self.unavailable = PeerError(f"{label} has not answered the handshake yet")
        self.state = PeerState.SILENT
        self.failure: HilError | None = None
        self.version: AutopilotVersion | None = None
        self.heartbeat: Heartbeat | None = None
        self.status: RobotStatus | None = None
        self.clock = ClockComparison()
        self._label = label
        self._roles = roles
        self._play(role)
        self._us = (host_system, host_component)
        self._handshake = Handshake(system, host, exchanges, numbering, session)
        self._presence = Presence(system)
        self._uid = 0
        self._had_session = False
        self._events: list[Event] = []
        self._frames = FrameStreams(self.counters)
        self._robot_clock = RobotClock()
        self._heard = now
        self._heartbeat_due = self._timesync_due = NEVER
        self._silence_due = now + SILENCE
        self._timer_due = NOW
        self._begin_heartbeats()
        self._plan()

    @property
    def ready(self) -> bool:
        """The handshake is done and the robot is there."""
        return self.state in USABLE

    @property
    def components(self) -> set[int]:
        """Component ids heard of this system (25 is a referee)."""
        return self._frames.components

    def take(self, now: float) -> None:
        """Open a session with a robot that was only being watched: it is stopped and disarmed by that.

        Args:
            now: Time in s.
        """
        if not self._open_session:
            self._open_session = True
            self._set_armed(self._armed)
            self._move(Input.TAKEN, now)

    # --- In ----------------------------------------------------------------------------------------------------------

    def handle(self, received: Received) -> Sequence[Event]:
        """Take a message from this robot's system.

        Args:
            received: A good message.

        Returns:
            What the user should see: the message, unless it is a repetition, and what has followed from it.
        """
        message, time = received.message, received.time
        kind = type(message)
        from_robot = received.component == ROBOT_COMPONENT
        if from_robot:
            self._heard = time
            if self.state is PeerState.LOST:
                self._move(Input.HEARD, time)
        elif self._pace is not None and self.ready:
            self._ease_companion(received.component)
        if not self._frames.count(received):
            return self._take()
        if kind in ANSWERS and for_another(message, *self._us):
            return [received, *self._take()]
        show = True
        if from_robot:
            if self.streams.heard(kind, time):
                self._events.append(StreamBack(self.system, time, message.NAME))
            if kind is self._readings:
                reading: Any = message
                self._watch_clock(reading.time, time)
            else:
                self._note(message, received)
        if self._exchanges.active and not (kind is RobotAck and self._doubtful(message)):
            wanted = self._exchanges.answer(received)
            self._follow(time)
            show = wanted or not (kind in self.role.results and self.role.ends(message, self.session))
        elif kind in self.role.results and self.role.ends(message, self.session):
            show = False
        if not self._events:
            return (received,) if show else ()
        return [received, *self._take()] if show else self._take()

    def missed(self, duration: float) -> None:
        """Nobody has listened for a while: that is no silence of the robot's.

        Args:
            duration: How long, in s.
        """
        self._heard += duration
        self._silence_due += duration
        self.streams.missed(duration)

    def reject(self) -> None:
        """Count a piece of wire input that was no good message."""
        self.counters.rejected += 1

    def closed(self, error: LinkError, now: float) -> Sequence[Event]:
        """The link is gone for good, and everything open fails with its error.

        Args:
            error: Why.
            now: Time in s.

        Returns:
            PeerLost, unless it was lost before or never found.
        """
        return self._cut(error, error, now)

    def unplugged(self, error: LinkError, now: float) -> Sequence[Event]:
        """The link is gone for the moment; everything open fails, and so does what is asked before it is back.

        Args:
            error: Why.
            now: Time in s.

        Returns:
            PeerLost, unless it was lost before or never found.
        """
        words = f"{self._label} is out of reach, and nobody knows whether it has done what was asked last ({error})"
        return self._cut(error, PeerLostError(words), now)

    def plugged_in(self, now: float) -> Sequence[Event]:
        """The link is back: look who is there, and do the handshake anew.

        Args:
            now: Time in s.

        Returns:
            Nothing yet: PeerBack comes with the answers.
        """
        self._exchanges.shut = None
        self.unavailable = PeerLostError(f"{self._label} has not answered yet, since its link is back")
        self._frames.clear()
        self._heard, self._silence_due = now, now + SILENCE
        self._timer_due = NOW
        self._begin_heartbeats()
        self._move(Input.LINK_BACK, now)
        self._plan()
        return self._take()

    # --- Out ---------------------------------------------------------------------------------------------------------

    def next_due(self) -> float:
        """When `due` must be called next, in s; it may be called earlier."""
        if self._outbox:
            return NOW
        return min(self._timer_due, self._exchanges.next_due)

    def _plan(self) -> None:
        """Tell when `due` must be called next, since that may have changed."""
        self._timetable.plan(self.system, self.next_due())

    @property
    def urgent(self) -> bool:
        """Something is to be sent that nothing else may hold up."""
        return self._exchanges.urgent

    def due(self, now: float, taken_in: float | None = None) -> list[Message]:
        """What must be sent now. What has happened by mere time is told by `events`.

        Args:
            now: Time in s.
            taken_in: What had come by this time has been handled, in s: a robot is silent only if it was by then. None: all.

        Returns:
            Messages in order; they count as sent.
        """
        heard_until = now if taken_in is None else taken_in
        if heard_until >= self._silence_due:
            self._watch_silence(heard_until)
        out, self._outbox = self._outbox, []
        if now >= self._exchanges.next_due:
            out += self._exchanges.due(now)
            self._follow(now)
        if now >= self._timer_due:
            out += self._timers(now)
        self._plan()
        return out

    def heartbeat_sent(self, now: float) -> None:
        """A heartbeat of ours, which is for all robots, has been sent on another peer's account.

        Args:
            now: Time in s.
        """
        self._heartbeat_due = now + HEARTBEAT_PERIOD
        self._set_timer()

    def events(self) -> Sequence[Event]:
        """What has happened by mere time since the last call."""
        return self._take() if self._events else ()

    def _wish(self, message: type[Message], period: float) -> None:
        """Expect a stream at another rate from now on."""
        self.streams.want(message, period, self._heard)
        self._timer_due = NOW
        self._plan()

    # --- Within ------------------------------------------------------------------------------------------------------

    def _timers(self, now: float) -> list[Message]:
        """Heartbeat, comparison of clocks and a look at the streams, when they are due."""
        out: list[Message] = []
        if self.ready and now >= self._timesync_due:
            self._timesync_due = now + TIMESYNC_PERIOD
            out.append(self.clock.question(now, self.system, ROBOT_COMPONENT))
        if now >= self.streams.next_due:
            self._watch_streams(now)
        if now >= self._heartbeat_due:
            self._heartbeat_due = now + HEARTBEAT_PERIOD
            out.append(HOST_HEARTBEAT)
        self._set_timer()
        return out

    def _set_timer(self) -> None:
        """Note when the next of the slow timers is due."""
        timesync_due = self._timesync_due if self.ready else NEVER
        self._timer_due = min(self._heartbeat_due, self._next_look(), self.streams.next_due, timesync_due)
        self._plan()

    def _begin_heartbeats(self) -> None:
        """Send heartbeats of ours from now on."""
        self._heartbeat_due = NOW

    def _keep_up(self, now: float) -> None:
        """Begin with what is done while the robot can be used, now that it can."""
        self._timesync_due = now
        if self.status is None:  # the count of its starts, to compare later ones with
            self._handshake.count_starts()

    def _next_look(self) -> float:
        """When to see next whether the robot has been heard, in s."""
        return self._silence_due

    def _watch_streams(self, now: float) -> None:
        """See whether what we need still comes, ask for it again where the robot is ours, and say so."""
        stopped, missing = self.streams.check(now, self._heard)
        for message in dict.fromkeys([*stopped, *missing]):  # what stops again soon is told of, and asked for later
            requests = 0
            if self._open_session and message in missing:
                requests = self.streams.asked(message, now)
                self._ask_for_stream(message, self.streams.intervals[message])
            last = requests == MOST_REQUESTS
            if last or message in stopped:
                self._events.append(StreamStopped(self.system, now, message.NAME, requests, last))

    def _watch_silence(self, now: float) -> None:
        """See whether the robot has been heard lately."""
        self._silence_due = self._heard + SILENCE
        if now >= self._silence_due:
            self._silence_due = now + SILENCE
            self._move(Input.SILENCE, now)
        self._set_timer()

    def _cut(self, cause: LinkError, told: HilError, now: float) -> Sequence[Event]:
        """There is no link.

        Args:
            cause: Why.
            told: What everything that is open fails with.
            now: Time in s.
        """
        self._events += self._presence.gone(str(cause), now)
        self.unavailable = told
        self._move(Input.LINK_GONE, now)
        return self._take()

    def _take(self) -> list[Event]:
        events, self._events = self._events, []
        return events

    def _doubtful(self, message: Message) -> bool:
        """Whether this is a refusal that has to wait: a robot that does not know our session may just have restarted."""
        if type(message) is not RobotAck or message.reason != Reason.WRONG_SESSION or self.state is not PeerState.READY:
            return False
        return message.session == self.session and self.status is not None and self._handshake.doubtful()

    def _note(self, message: Message, received: Received) -> None:
        """Messages from the robot that mean something to the connection itself."""
        match message:
            case Heartbeat():
                self.heartbeat = message
                self._armed_said(received.time, armed=bool(message.base_mode & ARMED_FLAG))
                self._move(Input.HEARD, received.time)
            case RobotStatus():
                self._on_status(message, received.time)
            case Timesync() if message.tc1 == 0:
                asked_by = (received.system, received.component)
                self.tell(Timesync(round(received.time * 1e9), message.ts1, *asked_by))
            case Timesync():
                self.clock.answer(message, received.time)
            case Ping() if message.target_system == 0:
                self.tell(Ping(message.time_usec, message.seq, received.system, received.component))
            case _ if self.role.ends(message, self.session):
                self._acknowledge(message)

    def _acknowledge(self, message: Message) -> None:
        """Say that we have a message which says how something ended."""
        result = cast("Any", message)
        self.tell(RobotResultAck(result.session, result.sequence, self.system, ROBOT_COMPONENT))

    def tell(self, message: Message) -> None:
        """Say something that is not answered, with what is due next, which is at once.

        Args:
            message: What to say.
        """
        super().tell(message)
        self._plan()

    def _on_status(self, status: RobotStatus, now: float) -> None:
        """Look whether the robot has restarted."""
        before, self.status = self.status, status
        if before is not None and before.boot_count != status.boot_count:
            self._robot_clock.begin(status.time)
            self._move(Input.RESTARTED, now)
            return
        self._watch_clock(status.time, now)
        if self.state is PeerState.CHECKING:
            forgotten = self.numbering.session is not None and status.session == 0
            same = Input.SAME_BOOT if self.session is not None else Input.NO_SESSION if self._open_session else Input.WATCH_ONLY
            self._move(Input.RESTARTED if before is None or forgotten else same, now)
        elif self.state is PeerState.COMPARING:
            same = Input.SAME_BOOT if self._open_session else Input.WATCH_ONLY
            self._move(Input.RESTARTED if self._had_session and status.session == 0 else same, now)

    def _watch_clock(self, time: float, now: float) -> None:
        """See whether the robot has restarted."""
        if self._robot_clock.went_back(time):
            self._move(Input.RESTARTED, now)

    def _follow(self, now: float) -> None:
        """Go on when the question of the present state has been answered, or arming has."""
        self._follow_arming(now)
        ticket = self._handshake.answered()
        if ticket is None:
            return
        if isinstance(ticket.error, RefusedError) and ticket.reason is not Reason.BUSY:
            if self.state is not PeerState.CHECKING:
                self.failure = ticket.error
            self._move(Input.TURNED_DOWN, now)
        elif ticket.error is not None:
            self._move(Input.NO_ANSWER, now)
        elif isinstance(ticket.result, AutopilotVersion):
            self._judge(ticket.result, now)
        elif isinstance(ticket.result, RobotAck):
            self._move(Input.OPENED, now)

    def _judge(self, version: AutopilotVersion, now: float) -> None:
        """Can we speak with it?"""
        self.version = version
        self.failure = unfit(version, self.system, self._uid, self.role.name)
        if self.failure is not None:
            self._move(Input.STRANGER if isinstance(self.failure, WrongRobotError) else Input.VERSION_BAD, now)
        else:
            role = role_of(version.product_id, self._roles)
            if role != self.role:
                self._play(role)
            self._uid = version.uid or self._uid
            if self.status is None or not self._move(Input.RECOGNISED, now):
                self._move(Input.VERSION_GOOD if self._open_session else Input.WATCH_ONLY, now)

    def _play(self, role: Role) -> None:
        """It is of this kind."""
        self.role = role
        self._readings = None if role.readings is RobotStatus else role.readings  # a status means more than its clock
        self.streams = Streams(self._watched(role))

    def _watched(self, role: Role) -> Mapping[type[Message], float]:
        """Which streams of such a robot are asked for and watched over, and the intervals in s."""
        return role.streams if self._pace is None or self._pace.role is not role else self._pace.streams

    def _move(self, happened: Input, now: float) -> bool:
        """Follow the table, and do what the new state begins with.

        Returns:
            The table has such a transition.
        """
        after = TRANSITIONS.get((self.state, happened))
        if after is None:
            return False
        self.state = after
        if happened is Input.RESTARTED:
            self._forget(now)
        match after:
            case PeerState.IDENTIFYING | PeerState.RECOGNISING:
                self.failure = None
                self._handshake.ask_version()
                self._ease_readings()
            case PeerState.OPENING | PeerState.REOPENING:
                self._handshake.ask_session(self.version)
            case PeerState.CHECKING | PeerState.COMPARING:
                self._handshake.ask_status()
            case PeerState.READY | PeerState.WATCHING:
                self._begin(happened, now)
            case PeerState.LOST:
                self._lose(now)
            case PeerState.SILENT | PeerState.AWAITED:
                self._break_off()
                self._events += self._presence.gone("it fell silent during the handshake", now)
                self._exchanges.fail_all(PeerLostError(f"{self._label} fell silent during the handshake"))
            case PeerState.REFUSED | PeerState.UNUSABLE:
                self.unavailable = self.failure
            case PeerState.UNPLUGGED:
                self._suspend()
        return True

    def _begin(self, happened: Input, now: float) -> None:
        """The robot can be used."""
        self.unavailable = None
        self._handshake.trust()
        self._had_session = False
        self._eased_companions.clear()
        if happened is Input.OPENED:
            self._handshake.opened()
            self._set_armed(self.heartbeat is not None and self.heartbeat.custom_mode in self.role.undisturbed)
            for message, interval in self.streams.intervals.items():
                self._ask_for_stream(message, interval)
            self._ease_rest()
        elif self.state is PeerState.WATCHING:
            self.unavailable = PeerError(f"{self._label} is only being watched: no session is open")
        self.streams.begin(now)
        self._timer_due = NOW
        self._plan()
        self._events += self._presence.usable(now)
        self._keep_up(now)

    def _break_off(self) -> None:
        """Nobody waits for the handshake any more, nor for arming; whether it is armed, nobody knows."""
        self._handshake.drop()
        self._arming = None
        self._set_armed(None)

    def _lose(self, now: float) -> None:
        """The robot fell silent."""
        self._events += self._presence.gone(f"nothing heard for {SILENCE:g} s", now)
        self._break_off()
        self.streams.end()
        self.unavailable = PeerLostError(f"{self._label} fell silent")
        self._exchanges.fail_all(self.unavailable)

    def _forget(self, now: float) -> None:
        """The robot has restarted: what it knew of us is gone."""
        self._events += self._presence.restarted(now)
        self._break_off()
        self.numbering.session = None
        self.streams.end()
        self.clock.reset()
        self.unavailable = PeerLostError(f"{self._label} has restarted")
        self._exchanges.fail_all(self.unavailable)

    def _suspend(self) -> None:
        """Nothing can be said, and nothing is heard."""
        self._break_off()
        self._had_session = self._had_session or self.numbering.session is not None
        self.numbering.session = None
        self.streams.end()
        self.clock.reset()
        self._outbox.clear()
        self._timer_due = self._silence_due = NEVER
        self._plan()
        self._exchanges.shut = self.unavailable
        if self.unavailable is not None:
            self._exchanges.fail_all(self.unavailable)
