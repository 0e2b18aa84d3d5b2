"""A robot made of Python, small enough to read: answers what a Junior answers, and can be told to misbehave."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    AckResult,
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    JuniorSensors,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Ping,
    Reason,
    RefereeReset,
    RefereeState,
    RobotAck,
    RobotResultAck,
    RobotSession,
    RobotStatus,
    State,
    Timesync,
)
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.payload import PAYLOADS

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.wire.fields import Message

PERIOD = 0.005
FURTHER = tuple(message for message in JUNIOR.streams if message not in {JuniorSensors, RobotStatus})
"""What else a Junior says by itself; here it says it ten times a second, with nothing in it."""


def result(session: int, sequence: int) -> JuniorManeuverResult:
    """A maneuver's result with nothing in it."""
    none = (0,) * 8
    return JuniorManeuverResult(
        session=session,
        sequence=sequence,
        samples=none,
        eye_left=none,
        eye_right=none,
        press_left=(0.0,) * 8,
        press_right=(0.0,) * 8,
        travel=(None,) * 8,
        edges_left=none,
        edges_right=none,
        target_system=255,
        target_component=190,
        outcome=0,
        reason=0,
        done=1,
        stimulus_before=0,
        stimulus_after=0,
    )


def sensors(time: float) -> JuniorSensors:
    """A sensor reading with nothing in it."""
    return JuniorSensors(time=time, travel=(0.0, 0.0), eye=(0, 0), floor=(0, 0), battery=7.4, flags=0)


@dataclass
class ScriptedRobot:
    """One robot (component 1) with a referee (component 25), stepped by control periods of 5 ms.

    Attributes:
        system: System id.
        version: Protocol version, major and minor.
        boots: Times it has started.
        uid: Its unique id; 0 says none.
        product: Its kind, as product_id; 0 is a Junior.
        silent: It sends nothing.
        deaf: Messages for which this says True are ignored.
        mute: Messages of its own for which this says True are not sent.
        heard: Every message it has accepted from the wire.
        performed: (session, sequence) of the maneuvers performed.
        refuse: Reason for refusing numbered messages, by class.
    """

    period: float = field(default=PERIOD, init=False)
    system: int = 1
    version: tuple[int, int] = (2, 0)
    boots: int = 1
    uid: int = 0
    product: int = 0
    silent: bool = False
    deaf: Callable[[Message], bool] = lambda _: False
    mute: Callable[[Message], bool] = lambda _: False
    heard: list[Message] = field(default_factory=list)
    performed: list[tuple[int, int]] = field(default_factory=list)
    refuse: dict[type[Message], Reason] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=lambda: {"SPD_FAST": 1.0, "SPD_SLOW": 0.4, "EYE_L_ON": 250.0})
    armed: bool = False
    stopped: bool = False
    stream: bool = True

    def __post_init__(self) -> None:
        self._time = 0.0
        self._booted = 0.0
        self._ticks = 0
        self._codecs = {component: MavlinkCodec(system=self.system, component=component) for component in (1, 25)}
        self._input = MavlinkCodec(system=self.system, component=1)
        self._session: int | None = None
        self._recent: list[tuple[int, int, int]] = []
        self._busy_until = 0.0
        self._result: JuniorManeuverResult | None = None
        self._result_due = 0.0
        self._out: list[bytes] = []

    def now(self) -> float:
        """Time in s."""
        return self._time

    def reboot(self) -> None:
        """Lose power and get it back."""
        self.boots += 1
        self._booted = self._time
        self._session, self._result, self.armed, self.stopped = None, None, False, False
        self._recent.clear()

    def step(self, inbound: bytes) -> bytes:
        """Live for one control period."""
        self._ticks += 1
        self._time = self._ticks * PERIOD
        for event in self._input.receive(inbound, self._time):
            if isinstance(event, Received) and not self.deaf(event.message):
                self.heard.append(event.message)
                self._answer(event.message)
        if self._result is not None and self._time >= self._result_due:
            self._say(self._result)
            self._result_due = self._time + 0.1
        if self._ticks % 200 == 1:
            self._say(self.heartbeat())
            self._say(self.status())
        if self.stream and self._ticks % 4 == 0:
            self._say(sensors(self._time - self._booted))
        if self.stream and self._ticks % 20 == 0:
            for message in FURTHER:
                self._say(PAYLOADS[message.ID].unpack(b""))
        out, self._out = b"".join(self._out), []
        return out

    def state(self) -> State:
        """What it is doing."""
        if self.stopped:
            return State.STOPPED
        return State.PERFORMING if self._time < self._busy_until else State.READY if self.armed else State.DISARMED

    def heartbeat(self) -> Heartbeat:
        """That it is there, and in which state."""
        return Heartbeat(10, 0, 128 * self.armed, int(self.state()), 3)

    def status(self) -> RobotStatus:
        """Its counters."""
        sequence = self._recent[-1][2] if self._recent else 0
        time = self._time - self._booted
        return RobotStatus(time, len(self.performed), 0, 0, 0, 0, self.boots, self._session or 0, sequence, int(self.state()))

    def _say(self, message: Message, component: int = 1) -> None:
        if not self.silent and not self.mute(message):
            self._out.append(self._codecs[component].encode(message))

    def _answer(self, message: Message) -> None:  # noqa: C901, PLR0912 - a script is a list of cases
        match message:
            case CommandLong():
                self._command(message)
            case Ping() if message.target_system == 0:
                self._say(Ping(message.time_usec, message.seq, 255, 190))
            case Timesync() if message.tc1 == 0:
                self._say(Timesync(round((self._time - self._booted + 100) * 1e9), message.ts1, 255, 190))
            case ParamRequestList():
                for index in range(len(self.parameters)):
                    self._parameter(index)
            case ParamRequestRead():
                names = list(self.parameters)
                known = message.param_id in names
                index = message.param_index if message.param_index >= 0 else names.index(message.param_id) if known else -1
                self._parameter(index, message.param_id)
            case ParamSet():
                if message.param_id in self.parameters and 0 <= message.param_value <= 1023:
                    self.parameters[message.param_id] = message.param_value
                names = list(self.parameters)
                self._parameter(names.index(message.param_id) if message.param_id in names else -1, message.param_id)
            case RobotResultAck():
                if self._result is not None and message.sequence == self._result.sequence:
                    self._result = None
            case RefereeReset():
                self._say(RobotAck(message.ID, message.session, message.sequence, 255, 190, AckResult.ACCEPTED, 0), 25)
            case _ if message.NUMBERED:
                self._numbered(message)
            case _:
                pass

    def _command(self, command: CommandLong) -> None:
        component = command.target_component
        outcome = CommandResult.ACCEPTED
        reply: Message | None = None
        match command.command:
            case Command.REQUEST_MESSAGE:
                match int(command.param1):
                    case AutopilotVersion.ID:
                        major, minor = self.version
                        reply = AutopilotVersion(0, 1, major << 24 | minor << 16, uid=self.uid, product_id=self.product)
                    case RobotStatus.ID:
                        reply = self.status()
                    case Heartbeat.ID:
                        reply = self.heartbeat()
                    case JuniorSensors.ID:
                        reply = sensors(self._time - self._booted)
                    case RefereeState.ID:
                        pose = (0.0, 0.0)
                        reply = RefereeState(self._time, 1, 0.0, pose, 0.0, pose, 0.0, 0.7, 1, 0, 1)
                    case _:
                        outcome = CommandResult.DENIED
            case Command.ARM_DISARM:
                self.armed = command.param1 == 1
                self.stopped = False
            case Command.FLIGHT_TERMINATION:
                self.armed, self.stopped = False, True
            case Command.SET_MESSAGE_INTERVAL:
                pass
            case _:
                outcome = CommandResult.UNSUPPORTED
        self._say(CommandAck(command.command, int(outcome), target_system=255, target_component=190), component)
        if reply is not None:
            self._say(reply, component)

    def _parameter(self, index: int, name: str = "") -> None:
        if 0 <= index < len(self.parameters):
            name, value = list(self.parameters.items())[index]
            self._say(ParamValue(name, value, 9, len(self.parameters), index))
        else:
            self._say(ParamValue(name, 0.0, 9, len(self.parameters), 0xFFFF))

    def _numbered(self, message: Message) -> None:
        number = (message.ID, message.session, message.sequence)  # type: ignore[attr-defined]
        _, session, sequence = number
        reason = self.refuse.get(type(message), Reason.NONE)
        if isinstance(message, RobotSession) and not reason:
            if self._session != session:
                self._session, self.armed, self._result = session, False, None
                self._recent.clear()
        elif not reason and session != self._session:
            reason = Reason.WRONG_SESSION
        elif not reason and number not in self._recent:
            if self._recent and sequence <= self._recent[-1][2]:
                reason = Reason.OLD_SEQUENCE
            elif isinstance(message, JuniorManeuver):
                self._perform(message)
        if not reason and number not in self._recent:
            self._recent = [*self._recent[-3:], number]
        if isinstance(message, JuniorMemoryRead) and not reason:
            self._say(JuniorMemoryEntry(session, sequence, 0, 0.25, 1, 255, 190, 1, 0, 255, 0, 1, (1,) + (0,) * 7))
            return
        verdict = AckResult.REFUSED if reason else AckResult.ACCEPTED
        self._say(RobotAck(message.ID, session, sequence, 255, 190, int(verdict), int(reason)))

    def _perform(self, message: JuniorManeuver) -> None:
        self.performed.append((message.session, message.sequence))
        self._result = result(message.session, message.sequence)
        self._busy_until = self._result_due = self._time + message.period * message.count
