"""What can be asked of a robot, one class per kind of question. No I/O, no clock."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast

from firmware_protocol.errors import PeerError
from firmware_protocol.messages import (
    AckResult,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    Ping,
    Reason,
    RobotAck,
    RobotSession,
    State,
)
from firmware_protocol.peer.exchanges.exchange import Exchange
from firmware_protocol.peer.timetable import NEVER

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.events import Received
    from firmware_protocol.peer.exchanges.exchange import Retry
    from firmware_protocol.wire.fields import Message

T = TypeVar("T")
M = TypeVar("M", bound="Message")

PROGRESS_WAIT: Final = 2.0
"""A robot that says IN_PROGRESS is given so long to say more before it is asked again, in s."""
LONGEST_PROGRESS: Final = 30.0
"""After so long IN_PROGRESS prolongs nothing any more, in s."""
STATE_WAIT: Final = 2.0
"""A robot that has not said within this that it is stopped, or disarmed, is not taken to be, in s."""

REASONS: Final[dict[int, str]] = {
    Reason.NONE: "it gave no reason",
    Reason.DISARMED: "it is not armed",
    Reason.EMERGENCY_STOP: "its emergency stop is engaged (disarm, then arm it)",
    Reason.WRONG_SESSION: "another host has taken it over, or it has restarted",
    Reason.BAD_VALUE: "a value is out of range",
    Reason.BUSY: "it is busy",
    Reason.MEMORY_FULL: "its memory is full",
    Reason.NOT_FOUND: "there is no such entry",
    Reason.WATCHDOG: "it had not heard the host for too long",
    Reason.BY_COMMAND: "it was told to stop",
    Reason.STORAGE_FAILED: "its memory could not be written",
    Reason.OLD_SEQUENCE: "a later command has overtaken this one",
    Reason.NO_REFEREE: "there is no referee",
}
"""Reasons in words."""

RESULTS: Final[dict[int, str]] = {
    CommandResult.TEMPORARILY_REJECTED: "not in its present state",
    CommandResult.DENIED: "it is not allowed or a value is out of range",
    CommandResult.UNSUPPORTED: "it does not know this command",
    CommandResult.FAILED: "it failed",
}
"""Results of standard commands in words."""


def reason_in_words(code: int) -> tuple[str, Reason]:
    """A reason in words, and as itself where it is known."""
    if code in REASONS:
        return REASONS[code], Reason(code)
    return f"reason {code}, which this software does not know", Reason.NONE


@dataclass
class Numbering:
    """Session and sequence of numbered messages.

    Attributes:
        session: The open session; None before the handshake.
        sequence: The last sequence used; 0 is the one that opens the session.
        asking: The last count used of a request whose answer names it (`param2` of REQUEST_MESSAGE). It begins far from the
            sequences, which other messages of the same kind may name.
    """

    session: int | None = None
    sequence: int = 0
    asking: int = 0x8000

    def open(self, session: int) -> None:
        """Begin a session."""
        self.session, self.sequence = session, 0

    def take(self) -> tuple[int, int]:
        """The next number: session, sequence."""
        if self.session is None:
            raise PeerError("there is no session with the robot yet")
        self.sequence = (self.sequence + 1) & 0xFFFF
        return self.session, self.sequence

    def take_asking(self) -> int:
        """The next count of such a request, 1..65535."""
        self.asking = self.asking % 0xFFFF + 1
        return self.asking


def in_progress(exchange: Exchange[T], ack: CommandAck, time: float) -> bool:
    """Let an exchange wait on where the robot says that it is at work.

    Args:
        exchange: What was asked.
        ack: The answer.
        time: When it came, in s.

    Returns:
        True where that is what it said.
    """
    if ack.result != CommandResult.IN_PROGRESS:
        return False
    if time < exchange.sent_first + LONGEST_PROGRESS:
        exchange.rest(time + PROGRESS_WAIT)
    return True


def _confirmed(command: CommandLong, tries: int) -> CommandLong:
    """A command as it is said at its first, second... try: counted up, as MAVLink wants it."""
    return command if tries == 1 else replace(command, confirmation=min(tries - 1, 255))


class CommandExchange(Exchange[CommandAck]):
    """COMMAND_LONG, answered by COMMAND_ACK, which names the command and whom it is for: so one of a kind at a time.

    Args:
        name: What is asked, in words.
        command: The message, confirmation 0.
    """

    holds = True

    def __init__(self, name: str, command: CommandLong) -> None:
        super().__init__(name, ("command", command.target_component, command.command), command.target_component, command)
        self._command = command
        if command.command == Command.FLIGHT_TERMINATION:
            self.holds = False  # repeating it does no harm, waiting might
        disarms = command.command == Command.ARM_DISARM and command.param1 == 0
        self.urgent = disarms or command.command == Command.FLIGHT_TERMINATION

    def messages(self) -> Sequence[Message]:
        """The command, with its confirmation counted up."""
        return [_confirmed(self._command, self.tries)]

    def answer(self, received: Received) -> bool:
        """Take the acknowledgement."""
        message = received.message
        if type(message) is not CommandAck or message.command != self._command.command:
            return False
        if message.result == CommandResult.ACCEPTED:
            self.accepted(message, received.time)
        elif not in_progress(self, message, received.time):
            self.refuse(RESULTS.get(message.result, f"result {message.result}"))
        return True

    def accepted(self, ack: CommandAck, time: float) -> None:  # noqa: ARG002 - `time` is for those that wait for more
        """It was accepted: that is the answer, unless more is to come."""
        self.finish(ack)


class StateExchange(CommandExchange):
    """Arming, disarming, the emergency stop: answered when the robot has accepted it *and* says that it is in that state.

    Its HEARTBEAT is asked for together with the command, so that it takes no longer; what it said before it accepted does
    not count. Both are repeated, and after `STATE_WAIT` it is an error. Whether that request was acknowledged matters to
    nobody, and acknowledgements don't say which request they are for: they are left to who waits for one.

    Args:
        name: What is asked, in words.
        command: The message, confirmation 0.
        reached: Whether a heartbeat says that it is so.
    """

    def __init__(self, name: str, command: CommandLong, reached: Callable[[Heartbeat], bool]) -> None:
        super().__init__(name, command)
        self._reached = reached
        self._request = CommandLong(
            command.target_system, command.target_component, Command.REQUEST_MESSAGE, param1=float(Heartbeat.ID)
        )
        self._ack: CommandAck | None = None
        self._accepted_at = NEVER
        self._said: Heartbeat | None = None

    @property
    def waits_for(self) -> str:
        """What has not come."""
        if self._ack is None:
            return super().waits_for
        said = "" if self._said is None else f"; it says that it is {state_in_words(self._said)}"
        return f"has accepted {self.name}, but has not said that it has come to that{said}"

    def messages(self) -> Sequence[Message]:
        """The command, and the question for the state."""
        return [*super().messages(), self._request]

    def ask(self, now: float, retry: Retry) -> Sequence[Message]:
        """As any exchange, but for `STATE_WAIT` at most."""
        messages = super().ask(now, retry)
        self.due = min(self.due, self.sent_first + STATE_WAIT)
        return messages

    def over(self, now: float, retry: Retry) -> bool:
        """It has been asked for long enough."""
        return super().over(now, retry) or (self.repeated and now >= self.sent_first + STATE_WAIT)

    def answer(self, received: Received) -> bool:
        """Take the acknowledgement, and then the state."""
        message = received.message
        if type(message) is Heartbeat:
            self._said = message
            if self._ack is not None and received.time >= self._accepted_at and self._reached(message):
                self.finish(self._ack)
            return False  # others look at heartbeats, too
        return super().answer(received)

    def accepted(self, ack: CommandAck, time: float) -> None:
        """The state is still to come."""
        self._ack = ack
        self._accepted_at = min(self._accepted_at, time)


class ArmExchange(StateExchange):
    """Arming: disarming makes it pointless.

    A robot denies it to a host that names its number, and whose session is not the one that is open.
    """

    def answer(self, received: Received) -> bool:
        """Take the acknowledgement, and then the state."""
        message, command = received.message, self._command
        denied = type(message) is CommandAck and message.command == command.command and message.result == CommandResult.DENIED
        if denied and command.param3 > 0:
            self.refuse(*reason_in_words(Reason.WRONG_SESSION))
            return True
        return super().answer(received)


def state_in_words(heartbeat: Heartbeat) -> str:
    """What a heartbeat says the robot is doing."""
    known = heartbeat.custom_mode in set(State)
    return State(heartbeat.custom_mode).name.lower() if known else f"in state {heartbeat.custom_mode}"


class RequestExchange(Exchange[M], Generic[M]):
    """REQUEST_MESSAGE (512), answered by COMMAND_ACK and the message itself.

    Of a message that is also streamed, the answer is the first that comes with or after the acknowledgement.

    Args:
        message: Class of the message wanted.
        system: Robot asked.
        component: Its component.
        need_ack: False takes any such message that comes after the question.
    """

    def __init__(self, message: type[M], system: int, component: int, *, need_ack: bool = True) -> None:
        self._command = CommandLong(system, component, Command.REQUEST_MESSAGE, param1=float(message.ID))
        lane = ("command", component, Command.REQUEST_MESSAGE)
        super().__init__(f"the request for {message.NAME}", lane, component, self._command)
        self._wanted = message
        self._acknowledged = not need_ack
        self._came: Received | None = None

    def messages(self) -> Sequence[Message]:
        """The request."""
        return [_confirmed(self._command, self.tries)]

    def answer(self, received: Received) -> bool:
        """Take the acknowledgement, and the message."""
        message = received.message
        if type(message) is self._wanted:
            self._came = received
            if self._acknowledged:
                self.finish(message)
            return self._acknowledged
        if type(message) is not CommandAck or message.command != Command.REQUEST_MESSAGE:
            return False
        if in_progress(self, message, received.time):
            return True
        if message.result != CommandResult.ACCEPTED:
            self.refuse(RESULTS.get(message.result, f"result {message.result}"))
        else:
            self._acknowledged = True
            if self._came is not None and self._came.time >= received.time:
                self.finish(cast("M", self._came.message))
        return True


class NumberedExchange(Exchange[T]):
    """A numbered message, the same bytes at every try, so that it is never performed twice.

    A robot refuses what is older than what it has accepted, so these go strictly one after the other.

    Args:
        name: What is asked, in words.
        message: The message; session and sequence are filled in when its turn comes.
        numbering: Gives them.
    """

    def __init__(self, name: str, message: Message, numbering: Numbering) -> None:
        component: int = cast("Any", message).target_component
        super().__init__(name, ("numbered", component), component, message)
        self._numbering = numbering
        self.session = -1
        self.sequence = -1

    def messages(self) -> Sequence[Message]:
        """The message, numbered at the first call."""
        if self.session < 0:
            self.session, self.sequence = self._numbering.take()
            numbers = {"session": self.session, "sequence": self.sequence}
            self.question = type(self.question)(**vars(self.question) | numbers)  # in half of the time that `replace` takes
        return [self.question]

    def answer(self, received: Received) -> bool:
        """Take ROBOT_ACK."""
        message = received.message
        if type(message) is not RobotAck or not self._mine(message):
            return False
        if message.result == AckResult.ACCEPTED:
            self.accepted(message, received.time)
        else:
            self.refuse(*reason_in_words(message.reason))
        return True

    def accepted(self, ack: RobotAck, time: float) -> None:  # noqa: ARG002 - `time` is for those that wait for more
        """It was accepted: that is the answer, unless more is to come."""
        self.finish(cast("T", ack))

    def _mine(self, ack: RobotAck) -> bool:
        return ack.sequence == self.sequence and ack.session == self.session and ack.message == self.question.ID


class SessionExchange(NumberedExchange[RobotAck]):
    """ROBOT_SESSION, which brings its own number.

    Args:
        message: The message.
        numbering: Not used before the session is open.
    """

    def __init__(self, message: RobotSession, numbering: Numbering) -> None:
        super().__init__("opening a session", message, numbering)
        self.lane = ("session", message.target_component)
        self.session, self.sequence = message.session, message.sequence


class PingExchange(Exchange[Ping]):
    """PING, answered by the same number.

    Args:
        number: Told apart by this.
        component: Who is asked.
        host: System id of the asker.
    """

    def __init__(self, number: int, component: int, host: int) -> None:
        super().__init__("a ping", ("ping", component), component, Ping(time_usec=0, seq=number))
        self._number = number
        self._host = host

    def messages(self) -> Sequence[Message]:
        """The question."""
        return [Ping(time_usec=max(0, round(self.sent_last * 1e6)), seq=self._number)]

    def answer(self, received: Received) -> bool:
        """Take the answer."""
        message = received.message
        if type(message) is not Ping or message.seq != self._number or message.target_system != self._host:
            return False
        self.finish(message)
        return True
