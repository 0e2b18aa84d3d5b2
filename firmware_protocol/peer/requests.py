"""What can be asked of any robot, by name. Each returns a ticket at once; the answer comes with time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

from firmware_protocol.errors import HilError, PeerError
from firmware_protocol.faults.failures import failing_part
from firmware_protocol.messages import (
    ARMED_FLAG,
    ROBOT_COMPONENT,
    Command,
    CommandAck,
    CommandLong,
    Heartbeat,
    Ping,
    State,
    SysStatus,
)
from firmware_protocol.peer.exchanges.commands import (
    STATE_WAIT,
    ArmExchange,
    CommandExchange,
    NumberedExchange,
    Numbering,
    PingExchange,
    RequestExchange,
    StateExchange,
)
from firmware_protocol.peer.exchanges.parameter_exchanges import (
    ParameterListExchange,
    ParameterReadExchange,
    ParameterSetExchange,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.faults.failures import FailureType
    from firmware_protocol.peer.exchanges.exchange import Exchange, Exchanges, Ticket
    from firmware_protocol.peer.pacing import Pace
    from firmware_protocol.peer.role import Role
    from firmware_protocol.peer.timetable import Timetable
    from firmware_protocol.wire.fields import Message

M = TypeVar("M", bound="Message")
T = TypeVar("T")

_ARM_SLACK: Final = 0.1
"""A heartbeat that says "disarmed" may have been overtaken by the answer to arming by less than this, in s."""


class Requests:
    """The questions that a `Peer` can ask of any robot; what only a role understands is in `firmware_protocol.roles`.

    Standard commands and parameters may be asked for at any time; numbered messages need the handshake, and fail at
    once without it.

    Args:
        system: System id of the robot.
        host_system: System id of the host.
        host: Number of the host's program: which robots are its own to keep alive, 1..65535.
        open_session: The robot is to be ours to command, not only watched.
        exchanges: Where questions are kept until they are answered.
        numbering: Session and sequence of numbered messages.
        timetable: Is told whether the robot is to be kept moving.
        role: What kind of robot it is.
        pace: On a slow line, what to ask of the robot.

    Attributes:
        system: System id of the robot.
        role: What kind of robot it is, as far as is known.
        numbering: Session and sequence of numbered messages.
        unavailable: Why numbered messages can't be sent now; None when they can.
    """

    def __init__(
        self,
        system: int,
        host_system: int,
        host: int,
        exchanges: Exchanges,
        numbering: Numbering,
        *,
        timetable: Timetable,
        role: Role,
        open_session: bool,
        pace: Pace | None = None,
    ) -> None:
        self.system = system
        self.role = role
        self.numbering = numbering
        self.unavailable: HilError | None = PeerError("no handshake")
        self._host_system = host_system
        self._host = host
        self._open_session = open_session
        self._exchanges = exchanges
        self._timetable = timetable
        self._pace = pace
        self._armed: bool | None = None
        self._eased: Ticket[CommandAck] | None = None
        self._eased_companions: set[int] = set()
        self._arming: tuple[Ticket[CommandAck], bool] | None = None
        self._armed_at = float("-inf")
        self._pings = 0
        self._outbox: list[Message] = []

    @property
    def session(self) -> int | None:
        """The open session."""
        return self.numbering.session

    @property
    def host(self) -> int:
        """Number of the host's program as the robot is to take it: 0 where no session is open."""
        return self._host if self.numbering.session is not None else 0

    def tell(self, message: Message) -> None:
        """Say something that is not answered.

        Args:
            message: What to say.
        """
        self._outbox.append(message)

    @property
    def taken(self) -> bool:
        """It is ours to command, not only to watch."""
        return self._open_session

    @property
    def armed(self) -> bool | None:
        """Its wheels may turn, as far as is known; None while nothing is: it has not been heard, or is lost."""
        return self._armed

    @property
    def kept(self) -> bool:
        """It is armed, and ours to keep moving by ROBOT_ALIVE."""
        return bool(self._armed) and self._open_session

    def _set_armed(self, armed: bool | None) -> None:  # noqa: FBT001 - None is a third one
        """Note whether it is armed."""
        self._armed = armed
        self._timetable.keep(self.system, moving=self.kept)

    def _armed_said(self, time: float, *, armed: bool) -> None:
        """Take what the robot says itself, unless it was said before it was armed."""
        if armed or time >= self._armed_at + _ARM_SLACK:
            self._set_armed(armed)

    def _follow_arming(self, now: float) -> None:
        """Take the answer to arming or disarming, when it has come."""
        if self._arming is not None and self._arming[0].done:
            arming, armed = self._arming
            self._arming = None
            if arming.error is None:
                self._set_armed(armed)
                self._armed_at = now if armed else float("-inf")

    def command(self, name: str, command: int, *parameters: float, component: int = ROBOT_COMPONENT) -> Ticket[CommandAck]:
        """Send any standard command.

        Args:
            name: What it asks, in words.
            command: MAV_CMD.
            *parameters: Up to seven.
            component: Who is asked.
        """
        return self._exchanges.add(CommandExchange(name, CommandLong(self.system, component, command, 0, *parameters)))

    def arm(self, beside: float = 0.0) -> Ticket[CommandAck]:
        """Let the wheels turn from now on, and keep it moving as the host whose session is open, where one is.

        Answered when the robot itself says that it is armed. A robot that is ours is not armed before its session is open,
        which would disarm it again.

        Args:
            beside: What the line needs for the others that are armed at the same time, in s: it is repeated so much later, by
                `STATE_WAIT / 4` at most.
        """
        question = CommandLong(self.system, ROBOT_COMPONENT, Command.ARM_DISARM, param1=1.0, param3=float(self.host))
        exchange = ArmExchange("arming", question, lambda said: bool(said.base_mode & ARMED_FLAG))
        if self._open_session and self.unavailable is not None:
            exchange.fail(self.unavailable)
            return exchange.ticket
        exchange.beside = min(beside, STATE_WAIT / 4)
        ticket = self._exchanges.add(exchange)
        self._arming = (ticket, True)
        return ticket

    def disarm(self) -> Ticket[CommandAck]:
        """Stop, and let no wheel turn from now on; answered when the robot itself says so."""
        self._exchanges.drop(ArmExchange, ROBOT_COMPONENT, PeerError("disarming has replaced arming"))
        ticket = self._stop("disarming", lambda said: not said.base_mode & ARMED_FLAG, Command.ARM_DISARM, 0.0)
        self._arming = (ticket, False)
        return ticket

    def emergency_stop(self) -> Ticket[CommandAck]:
        """Stop at once and stay stopped until disarmed and armed again; answered when the robot itself says so."""
        ticket = self._stop(
            "the emergency stop", lambda said: said.custom_mode == State.STOPPED, Command.FLIGHT_TERMINATION, 1.0
        )
        self._arming = (ticket, False)
        return ticket

    def reboot(self) -> Ticket[CommandAck]:
        """Restart the robot's program."""
        return self.command("restarting", Command.PREFLIGHT_REBOOT, 1.0)

    def inject_failure(self, part: str, how: FailureType) -> Ticket[CommandAck]:
        """Have a part of the robot fail, or be well again.

        Args:
            part: As `eye_left`, `wheel_right`, `battery`, `host`: see `firmware_protocol.faults.failures.INSTANCES`.
            how: How it fails; OK ends it.

        Raises:
            ValueError: There is no such part.
        """
        unit, instance = failing_part(part)
        name = f"to have {part.replace('_', ' ')} be {how.name.lower()}"
        return self.command(name, Command.INJECT_FAILURE, float(unit), float(how), float(instance))

    def message_interval(self, message: type[Message], period: float) -> Ticket[CommandAck]:
        """Have a message streamed.

        Args:
            message: Its class.
            period: Time between two, in s; negative turns it off, 0 is the default rate.
        """
        self._wish(message, period)
        return self._ask_for_stream(message, period)

    def request(self, message: type[M], component: int = ROBOT_COMPONENT) -> Ticket[M]:
        """Have a message sent once, with what is true now.

        Args:
            message: Its class.
            component: Who is asked.
        """
        return self._exchanges.add(RequestExchange(message, self.system, component))

    def ping(self, component: int = ROBOT_COMPONENT) -> Ticket[Ping]:
        """Ask whether it is there."""
        self._pings = (self._pings + 1) & 0xFFFFFF
        number = self.system << 24 | self._pings  # every robot on the link answers: it is only ours that counts
        return self._exchanges.add(PingExchange(number, component, self._host_system))

    # --- Parameters --------------------------------------------------------------------------------------------------

    def read_parameter(self, name: str) -> Ticket[float]:
        """Read one parameter."""
        return self._exchanges.add(ParameterReadExchange(self.system, ROBOT_COMPONENT, name))

    def set_parameter(self, name: str, value: float) -> Ticket[float]:
        """Set one parameter; refused if the robot keeps another value."""
        return self._exchanges.add(ParameterSetExchange(self.system, ROBOT_COMPONENT, name, value))

    def list_parameters(self) -> Ticket[dict[str, float]]:
        """Read all parameters, in the robot's order."""
        return self._exchanges.add(ParameterListExchange(self.system, ROBOT_COMPONENT))

    # --- Numbered messages -------------------------------------------------------------------------------------------

    def ask(self, exchange: Exchange[T], role: Role) -> Ticket[T]:
        """Ask what only one role understands. A numbered message needs a session.

        Args:
            exchange: The question.
            role: Who understands it.

        Returns:
            Its ticket; it has failed already where there is no session, or the robot has another role.
        """
        unavailable = self.unavailable if isinstance(exchange, NumberedExchange) else None
        if unavailable is None and self.role is not role:
            unavailable = PeerError(f"{exchange.name} takes a {role.name}, and robot {self.system} is a {self.role.name}")
        if unavailable is not None:
            exchange.fail(unavailable)
            return exchange.ticket
        return self._exchanges.add(exchange)

    def drop(self, kind: type[Exchange[T]], error: HilError) -> None:
        """Give up every question of a kind that the robot has not answered yet.

        Args:
            kind: Class of the exchanges.
            error: Why.
        """
        self._exchanges.drop(kind, ROBOT_COMPONENT, error)

    def _stop(self, name: str, reached: Callable[[Heartbeat], bool], command: int, param1: float) -> Ticket[CommandAck]:
        question = CommandLong(self.system, ROBOT_COMPONENT, command, param1=param1)
        return self._exchanges.add(StateExchange(name, question, reached))

    def _wish(self, message: type[Message], period: float) -> None:
        """Somebody wants a stream at another rate; for who watches over them."""

    def _ask_for_stream(self, message: type[Message], period: float, component: int = ROBOT_COMPONENT) -> Ticket[CommandAck]:
        if self._pace is not None and period == 0:  # its own would fill the line
            period = self._pace.streams.get(message, 0.0)
        interval = -1.0 if period < 0 else period * 1e6
        name = f"streaming {message.NAME}"
        return self.command(name, Command.SET_MESSAGE_INTERVAL, float(message.ID), interval, component=component)

    def _ease_readings(self) -> None:
        """On a slow line, ask for fewer readings: before anything else, or no answer would get through.

        No other vehicle has any, so it may be asked before it is known who it is.
        """
        if self._pace is not None and (self._eased is None or self._eased.done):
            readings = self._pace.role.readings
            self._eased = self._ask_for_stream(readings, self._pace.streams[readings])

    def _ease_rest(self) -> None:
        """On a slow line, ask a robot that is ours for less of what we do without."""
        if self._pace is not None:
            self._ask_for_stream(SysStatus, self._pace.sys_status)

    def _ease_companion(self, component: int) -> None:
        """On a slow line, ask a component beside a robot that is ours for less, once a session."""
        slow = self.role.companions.get(component)
        if self._pace is not None and slow is not None and self._open_session and component not in self._eased_companions:
            self._eased_companions.add(component)
            for message, interval in slow.items():
                self._ask_for_stream(message, interval, component)
