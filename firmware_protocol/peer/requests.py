"""Everything that can be asked of a robot, by name. Each returns a ticket at once; the answer comes with time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

from firmware_protocol.errors import HilError, PeerError
from firmware_protocol.faults.failures import failing_part
from firmware_protocol.maneuver_fields import ManeuverFields, to_fields
from firmware_protocol.messages import (
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    Command,
    CommandAck,
    CommandLong,
    ContestCommand,
    Heartbeat,
    JuniorContest,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    JuniorMemoryWrite,
    JuniorSensors,
    JuniorWheels,
    OpponentCode,
    Ping,
    RefereeReset,
    RefereeState,
    RobotAck,
    State,
    SysStatus,
)
from firmware_protocol.parameters import PARAMETERS
from firmware_protocol.peer.commands import (
    ArmExchange,
    CommandExchange,
    DriveExchange,
    ManeuverExchange,
    MemoryReadExchange,
    NumberedExchange,
    Numbering,
    PingExchange,
    RequestExchange,
    StateExchange,
)
from firmware_protocol.peer.parameter_exchanges import ParameterListExchange, ParameterReadExchange, ParameterSetExchange
from firmware_protocol.vocabulary import ANY_STIMULUS, MAX_ACTIONS, Maneuver

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.faults.failures import FailureType
    from firmware_protocol.peer.exchange import Exchange, Exchanges, Ticket
    from firmware_protocol.peer.pacing import Pace
    from firmware_protocol.wire.fields import Message

M = TypeVar("M", bound="Message")
T = TypeVar("T")

_REFLEX_TIMES = ("REFLEX_BACK", "REFLEX_TURN")
LONGEST_REFLEX = sum(parameter.maximum * 1e-3 for parameter in PARAMETERS if parameter.name in _REFLEX_TIMES)
"""How long the floor reflex may prolong a maneuver, whatever its parameters are set to, in s."""
ARMED_FLAG: Final = 128
"""MAV_MODE_FLAG_SAFETY_ARMED, of HEARTBEAT.base_mode."""
EMPTY = ManeuverFields(period=0.0, options=0, count=0, actions=(0,) * MAX_ACTIONS)


class Requests:
    """The questions that a `Peer` can ask.

    Standard commands and parameters may be asked for at any time; numbered messages need the handshake, and fail at
    once without it.

    Args:
        system: System id of the robot.
        host_system: System id of the host.
        host: Number of the host's program: which robots are its own to keep alive, 1..65535.
        open_session: The robot is to be ours to command, not only watched.
        exchanges: Where questions are kept until they are answered.
        numbering: Session and sequence of numbered messages.
        pace: On a slow line, what to ask of the robot.

    Attributes:
        system: System id of the robot.
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
        open_session: bool,
        pace: Pace | None = None,
    ) -> None:
        self.system = system
        self.unavailable: HilError | None = PeerError("no handshake")
        self._host_system = host_system
        self._host = host
        self._open_session = open_session
        self._exchanges = exchanges
        self._numbering = numbering
        self._pace = pace
        self._eased: Ticket[CommandAck] | None = None
        self._referee_eased = False
        self._arming: tuple[Ticket[CommandAck], bool] | None = None
        self._pings = 0

    def command(self, name: str, command: int, *parameters: float, component: int = ROBOT_COMPONENT) -> Ticket[CommandAck]:
        """Send any standard command.

        Args:
            name: What it asks, in words.
            command: MAV_CMD.
            *parameters: Up to seven.
            component: Who is asked.
        """
        return self._exchanges.add(CommandExchange(name, CommandLong(self.system, component, command, 0, *parameters)))

    def arm(self) -> Ticket[CommandAck]:
        """Let the wheels turn from now on, and keep it moving as the host whose session is open, where one is.

        Answered when the robot itself says that it is armed. A robot that is ours is not armed before its session is open,
        which would disarm it again.
        """
        host = self._host if self._numbering.session is not None else 0
        question = CommandLong(self.system, ROBOT_COMPONENT, Command.ARM_DISARM, param1=1.0, param3=float(host))
        exchange = ArmExchange("arming", question, lambda said: bool(said.base_mode & ARMED_FLAG))
        if self._open_session and self.unavailable is not None:
            exchange.fail(self.unavailable)
            return exchange.ticket
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

    def perform(self, maneuver: Maneuver) -> Ticket[JuniorManeuverResult]:
        """Perform a maneuver; it replaces one that is being performed."""
        message = JuniorManeuver(0, 0, **to_fields(maneuver), target_system=self.system, target_component=ROBOT_COMPONENT)
        extra = LONGEST_REFLEX if maneuver.floor_reflex else 0.0
        return self._ask(ManeuverExchange(message, self._numbering, extra))

    def drive(self, left: float, right: float, duration: float) -> Ticket[RobotAck]:
        """Turn the wheels; an earlier drive command that is still unanswered is given up.

        Args:
            left: Left wheel, share of full, -1..1.
            right: Right wheel, likewise.
            duration: The wheels stop after this time, in s.
        """
        message = JuniorWheels(0, 0, (left, right), duration, self.system, ROBOT_COMPONENT)
        self._exchanges.drop(DriveExchange, ROBOT_COMPONENT, PeerError("a newer drive command has replaced this one"))
        return self._ask(DriveExchange("driving", message, self._numbering))

    def write_memory(self, previous: int, current: int, maneuver: Maneuver) -> Ticket[RobotAck]:
        """Store a maneuver on the robot.

        Args:
            previous: Previous stimulus, or `ANY_STIMULUS`.
            current: Present stimulus.
            maneuver: What to perform then.
        """
        return self._write("writing to its memory", previous, current, to_fields(maneuver))

    def erase_memory(self, previous: int = ANY_STIMULUS, current: int = ANY_STIMULUS) -> Ticket[RobotAck]:
        """Erase one slot, or (by default) all.

        Args:
            previous: Previous stimulus of the slot.
            current: Present stimulus of the slot.
        """
        return self._write("erasing its memory", previous, current, EMPTY)

    def read_memory(self, index: int = 255, previous: int = ANY_STIMULUS, current: int = 0) -> Ticket[JuniorMemoryEntry]:
        """Read one slot; refused with `Reason.NOT_FOUND` where there is none.

        Args:
            index: Number of the used slot, from 0; 255 looks it up by the two stimuli.
            previous: Previous stimulus.
            current: Present stimulus.
        """
        message = JuniorMemoryRead(0, 0, self.system, ROBOT_COMPONENT, index, previous, current)
        return self._ask(MemoryReadExchange("reading its memory", message, self._numbering))

    def contest(self, command: ContestCommand, countdown: float = 5.0) -> Ticket[RobotAck]:
        """Start or stop autonomous play from memory.

        Args:
            command: Start or stop.
            countdown: Time to the first move, in s.
        """
        name = "starting a contest" if command is ContestCommand.START else "stopping the contest"
        message = JuniorContest(0, 0, countdown, self.system, ROBOT_COMPONENT, command)
        return self._ask(NumberedExchange(name, message, self._numbering))

    def reset_bout(self, seed: int, opponent: OpponentCode = OpponentCode.KEEP) -> Ticket[RobotAck]:
        """Have the referee begin a new bout.

        Args:
            seed: Start poses are drawn from it, 0..2^32 - 1.
            opponent: Who plays against Junior.
        """
        message = RefereeReset(seed, 0, 0, self.system, REFEREE_COMPONENT, opponent)
        return self._ask(NumberedExchange("a new bout", message, self._numbering))

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

    def _ease_sensors(self) -> None:
        """On a slow line, ask for fewer sensor readings: before anything else, or no answer would get through.

        No vehicle but a Junior has any, so it may be asked before it is known who it is.
        """
        if self._pace is not None and (self._eased is None or self._eased.done):
            self._eased = self._ask_for_stream(JuniorSensors, self._pace.streams[JuniorSensors])

    def _ease_rest(self) -> None:
        """On a slow line, ask a robot that is ours for less of what we do without."""
        if self._pace is not None:
            self._ask_for_stream(SysStatus, self._pace.sys_status)

    def _ease_referee(self) -> None:
        """On a slow line, ask the referee of a robot that is ours for fewer reports, once a session."""
        if self._pace is not None and self._open_session and not self._referee_eased:
            self._referee_eased = True
            self._ask_for_stream(RefereeState, self._pace.referee, REFEREE_COMPONENT)

    def _write(self, name: str, previous: int, current: int, fields: ManeuverFields) -> Ticket[RobotAck]:
        target = {"target_system": self.system, "target_component": ROBOT_COMPONENT}
        message = JuniorMemoryWrite(0, 0, **fields, **target, previous=previous, current=current)
        return self._ask(NumberedExchange(name, message, self._numbering))

    def _ask(self, exchange: Exchange[T]) -> Ticket[T]:
        """Ask by a numbered message, which needs a session."""
        if self.unavailable is not None:
            exchange.fail(self.unavailable)
            return exchange.ticket
        return self._exchanges.add(exchange)
