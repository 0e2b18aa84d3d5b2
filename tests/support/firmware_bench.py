"""The firmware on a bench: a robot made of memory, messages in by hand, messages out into a list, time in ticks."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, TypeVar

from fastcrc.crc16 import mcrf4xx

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    AckResult,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    ContestCommand,
    Heartbeat,
    JuniorContest,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorMemoryRead,
    JuniorMemoryWrite,
    JuniorWheels,
    ManeuverOption,
    Reason,
    RobotAck,
    RobotAlive,
    RobotSession,
    State,
)
from firmware_protocol.peer.pacing import by_itself
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.vocabulary import ANY_STIMULUS, Action
from firmware_protocol.wire.fields import wire_order
from firmware_protocol.wire.mavlink import MavlinkCodec
from firmware_protocol.wire.mavlink_layout import crc_extra
from simdevice._host import ffi, lib

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.codec import Codec
    from firmware_protocol.wire.fields import Message

M = TypeVar("M", bound="Message")

TICK = 5
"""Control period in ms."""
HOST_NUMBER = 1234
HOST = RobotAlive(HOST_NUMBER)
"""What keeps a robot moving that the bench has armed."""
HEARTBEAT = Heartbeat(type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4)
BLANK = b"\xff" * 1024
SESSION = 4711


FORMATS = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "u64": "Q", "i64": "q", "f32": "f"}


def forge(message: Message, **changes: object) -> bytes:
    """A frame with values that the codec refuses to encode, as one in 65,536 damaged frames has.

    Args:
        message: What to begin with.
        changes: Fields that are to have other values.
    """
    payload = b""
    for name, wire in wire_order(type(message)):
        value = changes.get(name, getattr(message, name))
        if wire.type == "char":
            payload += struct.pack(f"{wire.count}s", str(value).encode())
            continue
        numbers = value if isinstance(value, tuple) else (value,)
        if wire.type != "f32":
            numbers = tuple(round(number / wire.scale) for number in numbers)
        payload += struct.pack(f"<{len(numbers)}{FORMATS[wire.type]}", *numbers)
    body = struct.pack("<BBBBBBHB", len(payload), 0, 0, 0, 255, 190, message.ID, 0) + payload
    return b"\xfd" + body + struct.pack("<H", mcrf4xx(body + bytes([crc_extra(type(message))])))


class FirmwareBench:
    """One robot.

    Attributes:
        io: What its drivers read and write.
        now: Time since power-on in ms.
        session: Session of the numbered messages made here.
        sent: Everything it has sent since the last call of `clear`, but its streams.
        streamed: Its streams: heartbeats, sensors, status.
    """

    STREAMS: tuple[str, ...] = tuple(message.__name__ for message in by_itself(JUNIOR))

    def __init__(self, nvm: bytes = BLANK, *, ground: bool = True, encoders: bool = True, start: bool = False) -> None:
        robot: Any = ffi.new("host_robot *")
        self.robot = robot
        self.io = self.robot.io
        self.io.has_ground = ground
        self.io.has_encoders = encoders
        self.io.battery_mv = 7400
        self.io.uid = 0x1122334455667788
        self.io.start = start
        self.host: Codec = MavlinkCodec(system=255, component=190)
        self.power_on(nvm)

    def power_on(self, nvm: bytes | None = None) -> None:
        """Cut the power and give it back; the EEPROM holds what it held, or `nvm`."""
        if nvm is not None:
            ffi.buffer(self.io.nvm)[:] = nvm
        self.now = 0
        self.sequence = 0
        self.session = SESSION
        self.opened = False
        self.sent: list[Message] = []
        self.streamed: list[Message] = []
        self._codec: Codec = MavlinkCodec(system=255, component=190)
        lib.host_power_on(self.robot, 0)

    @property
    def nvm(self) -> bytes:
        """Image of the EEPROM."""
        return bytes(ffi.buffer(self.io.nvm))

    def state(self) -> State:
        """State of the firmware."""
        return State(lib.host_state(self.robot))

    @property
    def wheels(self) -> tuple[int, int]:
        """Commanded effort, left and right, in permille."""
        return self.io.wheel[0], self.io.wheel[1]

    def eyes(self, *, left: bool, right: bool) -> None:
        """Let the eyes see, or not."""
        self.io.eye = [600 if left else 20, 600 if right else 20]

    def floor(self, *, left: bool, right: bool) -> None:
        """Put the floor sensors off the ring, or on it."""
        self.io.floor = [900 if left else 50, 900 if right else 50]

    def tick(self, *messages: Message, raw: bytes = b"") -> list[Message]:
        """One control period in which these messages, then these bytes, arrive. Returns what is sent but for streams."""
        data = b"".join(self.host.encode(message) for message in messages) + raw
        self.now += TICK
        length = lib.host_tick(self.robot, self.now * 1000, data, len(data))
        answers: list[Message] = []
        for event in self._codec.receive(bytes(ffi.buffer(self.io.tx, length)), self.now / 1000):
            assert isinstance(event, Received), event
            assert event.component == 1
            (self.streamed if type(event.message).__name__ in self.STREAMS else answers).append(event.message)
        self.sent += answers
        return answers

    def run(self, ms: int, *, alive: bool = True) -> None:
        """Let time pass; `alive`: the host is heard every 40 ms."""
        for i in range(ms // TICK):
            self.tick(*([HOST] if alive and i % 8 == 0 else []))

    def clear(self) -> None:
        """Forget what was sent."""
        self.sent.clear()
        self.streamed.clear()

    def got(self, kind: type[M]) -> list[M]:
        """What was sent of one kind."""
        return [message for message in [*self.sent, *self.streamed] if isinstance(message, kind)]

    def latest(self, kind: type[M]) -> M:
        """The last one of a kind."""
        return self.got(kind)[-1]

    def answers_to(self, message: Message) -> list[Message]:
        """What comes back when a message is sent."""
        return self.tick(message)

    # --- what a host says -------------------------------------------------------------------------------------------

    def command(
        self, command: int, param1: float = 0.0, param2: float = 0.0, param3: float = 0.0, *, system: int = 1
    ) -> CommandResult | None:
        """Send a standard command; returns the answer, None where there is none."""
        message = CommandLong(
            target_system=system, target_component=1, command=command, param1=param1, param2=param2, param3=param3
        )
        acks = [answer for answer in self.answers_to(message) if isinstance(answer, CommandAck)]
        assert all(ack.command == command for ack in acks)
        return CommandResult(acks[0].result) if acks else None

    def arm(self) -> None:
        """Arm, as the host whose session is open, where one is."""
        assert self.command(Command.ARM_DISARM, 1.0, param3=HOST_NUMBER if self.opened else 0) is CommandResult.ACCEPTED

    def disarm(self) -> None:
        """Disarm."""
        assert self.command(Command.ARM_DISARM, 0.0) is CommandResult.ACCEPTED

    def stop(self) -> None:
        """Press the emergency stop."""
        assert self.command(Command.FLIGHT_TERMINATION, 1.0) is CommandResult.ACCEPTED

    def open(self, session: int = SESSION) -> None:
        """Open a session."""
        message = RobotSession(
            session=session, sequence=0, host=HOST_NUMBER, target_system=1, target_component=1, major=2, minor=0
        )
        assert self.ask(message) is Reason.NONE
        self.opened = True

    def ask(self, message: Message) -> Reason | None:
        """Send a numbered message; returns the reason in the answer (NONE: accepted), None where there is no answer."""
        acks = [answer for answer in self.tick(message) if isinstance(answer, RobotAck)]
        if not acks:
            return None
        (ack,) = acks
        assert ack.message == message.ID
        assert (ack.result == AckResult.ACCEPTED) == (ack.reason == Reason.NONE)
        return Reason(ack.reason)

    def next(self) -> int:
        """The next sequence number."""
        self.sequence = (self.sequence + 1) & 0xFFFF
        return self.sequence

    def wheels_message(self, left: float, right: float, duration: float, sequence: int | None = None) -> JuniorWheels:
        """Drive."""
        sequence = self.next() if sequence is None else sequence
        return JuniorWheels(self.session, sequence, speed=(left, right), duration=duration, target_system=1, target_component=1)

    def maneuver_message(
        self,
        actions: Sequence[Action],
        period: float = 0.25,
        options: int = ManeuverOption.EYES,
        sequence: int | None = None,
        session: int | None = None,
    ) -> JuniorManeuver:
        """Perform."""
        return JuniorManeuver(
            session=self.session if session is None else session,
            sequence=self.next() if sequence is None else sequence,
            period=period,
            options=int(options),
            target_system=1,
            target_component=1,
            count=len(actions),
            actions=(*(int(action) for action in actions), *(0,) * (8 - len(actions))),
        )

    def write_message(
        self,
        actions: Sequence[Action],
        current: int,
        previous: int = ANY_STIMULUS,
        period: float = 0.25,
        options: int = ManeuverOption.EYES,
    ) -> JuniorMemoryWrite:
        """Store a maneuver; no actions erase."""
        return JuniorMemoryWrite(
            session=self.session,
            sequence=self.next(),
            period=period if actions else 0.0,
            options=int(options),
            target_system=1,
            target_component=1,
            previous=previous,
            current=current,
            count=len(actions),
            actions=(*(int(action) for action in actions), *(0,) * (8 - len(actions))),
        )

    def read_message(self, index: int, previous: int = ANY_STIMULUS, current: int = 0) -> JuniorMemoryRead:
        """Ask for a slot."""
        return JuniorMemoryRead(self.session, self.next(), 1, 1, index=index, previous=previous, current=current)

    def contest_message(self, command: ContestCommand, countdown: float = 5.0) -> JuniorContest:
        """Start or stop a contest."""
        return JuniorContest(
            self.session, self.next(), countdown=countdown, target_system=1, target_component=1, command=int(command)
        )

    def armed(self) -> FirmwareBench:
        """Open a session and arm."""
        self.tick()
        self.open()
        self.arm()
        return self

    def perform(self, actions: Sequence[Action], period: float = 0.25, options: int = ManeuverOption.EYES) -> None:
        """Begin a maneuver."""
        assert self.ask(self.maneuver_message(actions, period, options)) is Reason.NONE

    def result(self) -> JuniorManeuverResult:
        """The last result."""
        return self.latest(JuniorManeuverResult)
