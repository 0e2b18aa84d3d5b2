"""Micro-robots made of Python, small enough to read, several on a line: they answer what a swarm asks, and can misbehave."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, cos, pi, sin
from typing import TYPE_CHECKING

from scripted_robot import PERIOD

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    AckResult,
    AutopilotVersion,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    ParamRequestRead,
    ParamValue,
    Reason,
    RobotAck,
    RobotResultAck,
    RobotSession,
    RobotStatus,
    State,
    SwarmFix,
    SwarmMove,
    SwarmObservation,
    SwarmRanges,
    SwarmSense,
    SysStatus,
    TablePlace,
    TableReset,
    TableState,
)
from firmware_protocol.vocabulary import MoveOption, SwarmOutcome
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import MAVLINK

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from firmware_protocol.wire.fields import Message

BATTERY = 0x2000000
"""MAV_SYS_STATUS_SENSOR_BATTERY."""


@dataclass
class ScriptedMicroRobot:
    """One robot, which drives where it is told without turning, at 0.2 m/s.

    Attributes:
        system: System id.
        uid: Its unique id.
        kind: Its class.
        x: Where it is, in m.
        y: Likewise.
        heading: Likewise, in rad.
        silent: It sends nothing, and hears nothing.
        deaf: Messages for which this says True are ignored.
        mute: Messages of its own for which this says True are not sent.
        heard: Every message it has accepted from the wire.
        performed: (session, sequence) of the moves performed.
        refuse: Reason for refusing numbered messages, by class.
        flat: Its battery is.
    """

    system: int
    wire: str = MAVLINK
    uid: int = 0
    kind: int = 0
    ring: int = 1
    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    boots: int = 1
    silent: bool = False
    flat: bool = False
    deaf: Callable[[Message], bool] = lambda _: False
    mute: Callable[[Message], bool] = lambda _: False
    heard: list[Message] = field(default_factory=list)
    performed: list[tuple[int, int]] = field(default_factory=list)
    refuse: dict[type[Message], Reason] = field(default_factory=dict)
    radius: float = 0.2
    before: float = 0.2
    armed: bool = False
    stopped: bool = False

    def __post_init__(self) -> None:
        self.time = 0.0
        self._booted = 0.0
        self._ticks = 0
        self._codec = open_codec(self.wire, system=self.system, component=1)
        self._session = 0
        self._last: tuple[int, int, int] = (0, 0, 0)
        self._answer: RobotAck | None = None
        self._move: tuple[SwarmMove, float, float] | None = None
        self._result: SwarmObservation | None = None
        self._again = 0.0
        self._wait = 0.25
        self._out: list[bytes] = []

    def reboot(self) -> None:
        """Lose power and get it back."""
        self.boots += 1
        self._booted = self.time
        self._session, self.armed, self.stopped = 0, False, False
        self._last, self._answer, self._move, self._result = (0, 0, 0), None, None, None

    def step(self, messages: Iterable[Message]) -> bytes:
        """Live for one control period."""
        self._ticks += 1
        self.time = self._ticks * PERIOD
        for message in messages:
            if not self.silent and not self.deaf(message):
                self.heard.append(message)
                self._take(message)
        self._drive()
        if self._result is not None and self.time >= self._again - 1e-9:
            self._say(self._result)
            self._again, self._wait = self.time + self._wait, min(2 * self._wait, 1.0)
        if self._ticks % 200 == 1 + self.system % 50:
            self._say(self.heartbeat())
            self._say(self.status())
            self._say(SysStatus(onboard_control_sensors_health=0 if self.flat else BATTERY, voltage_battery=3900))
        out, self._out = b"".join(self._out), []
        return out

    def heartbeat(self) -> Heartbeat:
        """That it is there, and in which state."""
        state = State.STOPPED if self.stopped else State.READY if self.armed else State.DISARMED
        return Heartbeat(10, 0, 128 * self.armed, int(state), 3)

    def status(self) -> RobotStatus:
        """Its counters."""
        own = self.time - self._booted
        return RobotStatus(own, len(self.performed), 0, 0, 0, 0, self.boots, self._session, self._last[2], 1)

    def observation(self, sequence: int, outcome: SwarmOutcome = SwarmOutcome.NONE) -> SwarmObservation:
        """What it observes now."""
        return SwarmObservation(
            self.time - self._booted, self._session, sequence, (self.x, self.y), self.heading, 0.0, self.radius, self.before,
            (0, 0x81), (0, 0x81), None, None, None, 0.01, (self.system % 7, 2), (1, 2), 0, outcome, 0,
        )  # fmt: skip

    def _say(self, message: Message) -> None:
        if not self.silent and not self.mute(message):
            self._out.append(self._codec.encode(message))

    def _take(self, message: Message) -> None:
        match message:
            case CommandLong():
                self._command(message)
            case ParamRequestRead():
                values = {"CLASS": float(self.kind), "RING": float(self.ring)}
                known = message.param_id in values
                self._say(ParamValue(message.param_id, values.get(message.param_id, 0.0), 9, 20, 4 if known else 0xFFFF))
            case RobotResultAck():
                if self._result is not None and (message.session, message.sequence) == (self._session, self._result.sequence):
                    self._result = None
            case SwarmFix():
                self.x, self.y = message.position
            case RobotSession() | SwarmMove() | SwarmSense():
                self._numbered(message)
            case _:
                pass

    def _command(self, command: CommandLong) -> None:
        outcome = CommandResult.ACCEPTED
        reply: Message | None = None
        match command.command, int(command.param1):
            case Command.REQUEST_MESSAGE, AutopilotVersion.ID:
                reply = AutopilotVersion(0, 1, 2 << 24 | 1 << 16, uid=self.uid, product_id=2)
            case Command.REQUEST_MESSAGE, Heartbeat.ID:
                reply = self.heartbeat()
            case Command.REQUEST_MESSAGE, RobotStatus.ID:
                reply = self.status()
            case Command.REQUEST_MESSAGE, SwarmObservation.ID:
                reply = self.observation(int(command.param2))
                if command.param3 and self._session:
                    self.before = self.radius
            case Command.REQUEST_MESSAGE, SwarmRanges.ID:
                reply = self._ranges(int(command.param2))
            case Command.ARM_DISARM, arm:
                self.armed, self.stopped = bool(arm), False
            case Command.FLIGHT_TERMINATION, _:
                self.armed, self.stopped = False, True
            case _:
                outcome = CommandResult.UNSUPPORTED
        if command.target_system:
            self._say(CommandAck(command.command, int(outcome), target_system=255, target_component=190))
        if reply is not None:
            self._say(reply)

    def _ranges(self, sequence: int) -> SwarmRanges:
        return SwarmRanges(self.time - self._booted, 0, self._session, sequence, (self.x, self.y), self.heading, (0.5,) * 32, 8)

    def _numbered(self, message: RobotSession | SwarmMove | SwarmSense) -> None:
        number = (message.ID, message.session, message.sequence)
        if number == self._last and self._answer is not None:
            self._say(self._answer)
            return
        reason = self.refuse.get(type(message), Reason.NONE)
        if isinstance(message, RobotSession):
            if not reason and message.session != self._session:
                self._session, self.armed, self._result, self._move = message.session, False, None, None
        elif not reason and message.session != self._session:
            reason = Reason.WRONG_SESSION
        elif not reason and message.sequence <= self._last[2]:
            reason = Reason.OLD_SEQUENCE
        elif not reason and isinstance(message, SwarmMove) and not self.armed:
            reason = Reason.DISARMED
        verdict = AckResult.REFUSED if reason else AckResult.ACCEPTED
        answer = RobotAck(message.ID, message.session, message.sequence, 255, 190, int(verdict), int(reason))
        if not reason:
            self._last, self._answer = number, answer
            if isinstance(message, SwarmMove):
                if self._move is not None:
                    self._end(SwarmOutcome.REPLACED)
                self.performed.append((message.session, message.sequence))
                self._move = (message, self.time + message.distance / 0.2 + 0.1, self._way(message))
            elif isinstance(message, SwarmSense):
                self.radius = self.before = message.radius
        self._say(answer)

    def _way(self, move: SwarmMove) -> float:
        if move.heading is not None:
            return move.heading + (self.heading if move.options & MoveOption.BODY else 0.0)
        return self.heading + (move.sector - 0.5) * 2 * pi / move.sectors

    def _drive(self) -> None:
        if self._move is None or self.time < self._move[1] - 1e-9:
            return
        move, _, way = self._move
        self.x, self.y = round(self.x + move.distance * cos(way), 6), round(self.y + move.distance * sin(way), 6)
        self.heading = atan2(sin(way), cos(way)) if move.face is None else move.face
        self._end(SwarmOutcome.ARRIVED)
        if move.options & MoveOption.RANGES:
            self._say(self._ranges(move.sequence))

    def _end(self, outcome: SwarmOutcome) -> None:
        move, self._move = self._move, None
        if move is not None:
            self._result = self.observation(move[0].sequence, outcome)
            self._again, self._wait = self.time, 0.25
            if outcome is not SwarmOutcome.REPLACED:
                self.before = self.radius


@dataclass
class ScriptedSwarm:
    """Robots on one line, and a table beside them: a `Steppable`.

    Attributes:
        robots: The robots; one that is taken out of here is off the line.
        table: There is a table.
        resets: How often it was set up anew.
        lose: Says of each frame, by its number and what it carries, whether it is lost; either way.
    """

    robots: list[ScriptedMicroRobot]
    wire: str = MAVLINK
    table: bool = True
    resets: list[TableReset] = field(default_factory=list)
    lose: Callable[[bytes], bool] = lambda _: False

    def __post_init__(self) -> None:
        self._ticks = 0
        self._input = open_codec(self.wire, system=250 if self.wire == MAVLINK else 100, component=1)
        self._table = open_codec(self.wire, system=254 if self.wire == MAVLINK else 127, component=25)

    def now(self) -> float:
        """Time in s."""
        return self._ticks * PERIOD

    def step(self, inbound: bytes) -> bytes:
        """Live for one control period."""
        self._ticks += 1
        events = self._input.receive(inbound, self.now())
        messages = [event.message for event in events if isinstance(event, Received) and not self.lose(event.raw)]
        out = []
        for robot in self.robots:
            meant = [one for one in messages if getattr(one, "target_system", 0) in {0, robot.system}]
            said = robot.step(meant)
            if said and not self.lose(said):
                out.append(said)
        if self.table:
            out += [self._table.encode(answer) for message in messages for answer in self._tabled(message)]
            if self._ticks % 40 == 1:
                state = TableState(self.now(), (0.0, 0.0), 0.0, (0.0, 0.0), 0, len(self.resets))
                out.append(self._table.encode(state))
        return b"".join(out)

    def _tabled(self, message: Message) -> Iterable[Message]:
        if isinstance(message, TableReset):
            self.resets.append(message)
        elif isinstance(message, TablePlace):
            for robot in self.robots:
                if robot.system == message.system:
                    (robot.x, robot.y), robot.heading = message.position, message.heading
        else:
            return
        yield RobotAck(message.ID, message.session, message.sequence, 255, 190, AckResult.ACCEPTED, 0)


def swarm_of(rangers: int, wilds: int = 0, *, wire: str = MAVLINK, uid: int = 100) -> ScriptedSwarm:
    """A swarm with ids from 1: RANGERs first."""
    robots = [
        ScriptedMicroRobot(system, wire, uid + system, kind=int(system > rangers)) for system in range(1, rangers + wilds + 1)
    ]
    return ScriptedSwarm(robots, wire)
