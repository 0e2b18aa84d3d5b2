"""What a host says in a robot's life: sense and nonsense in any order, and damage on the way."""

from __future__ import annotations

import random
import struct
from typing import TYPE_CHECKING, Final, Protocol

from firmware_bench import HOST, HOST_NUMBER, forge

from firmware_protocol.messages import (
    AutopilotVersion,
    Command,
    CommandLong,
    ManualControl,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    Ping,
    RobotResultAck,
    RobotSession,
    Timesync,
)
from firmware_protocol.peer.pacing import by_itself
from firmware_protocol.wire.mavlink import MavlinkCodec

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.parameters import Parameter
    from firmware_protocol.peer.role import Role
    from firmware_protocol.wire.fields import Message

KEPT: Final = ("SYS_ID", "MEM_SLOTS")
"""Parameters that are left as they are."""


class Numbering(Protocol):
    """Where numbered messages have their numbers from."""

    session: int
    sequence: int


class Life:
    """What any robot's host says; a role adds to `kinds`.

    Args:
        seed: Of everything random.
        numbering: Of numbered messages.
        role: The robot's.
        parameters: Of that role.

    Attributes:
        kinds: What may be said: how often, and what says it.
        said: Frames that were said.
    """

    def __init__(self, seed: int, numbering: Numbering, role: Role, parameters: Sequence[Parameter]) -> None:
        self.random = random.Random(seed)
        self.codec = MavlinkCodec(system=255, component=190)
        self.said: list[bytes] = []
        self.kinds: dict[str, tuple[float, Callable[[], Message | bytes]]] = {
            "question": (12, self.question),
            "parameter": (10, self.parameter),
            "damage": (8, self.damage),
            "arm": (12, self.arm),
            "session": (4, self.open),
            "stop": (1, lambda: self.command(Command.FLIGHT_TERMINATION, 1.0)),
            "list": (0.5, lambda: ParamRequestList(1, 1)),
            "alive": (10, lambda: HOST),
        }
        self._numbering = numbering
        self._parameters = parameters
        self._streams: tuple[type[Message], ...] = tuple(by_itself(role))

    def open(self) -> RobotSession:
        """Open another session."""
        self._numbering.session += 1
        self._numbering.sequence = 0
        return RobotSession(self._numbering.session, 0, HOST_NUMBER, 1, 1, 2, 0)

    def command(self, command: Command, param1: float, param2: float = 0.0, param3: float = 0.0) -> CommandLong:
        """A command to the robot."""
        return CommandLong(1, 1, command, param1=param1, param2=param2, param3=param3)

    def arm(self) -> Message:
        """Arm or disarm, now and then as a ground station or another host."""
        number = self.random.choice((*(float(HOST_NUMBER),) * 18, 0.0, 8.0))
        return self.command(Command.ARM_DISARM, self.random.choice((1.0, 1.0, 1.0, 0.0)), param3=number)

    def manual(self) -> Message:
        """The sticks of a ground station."""
        choose = self.random
        return ManualControl(1, x=choose.randint(-1000, 1000), y=0, z=0, r=choose.randint(-1000, 1000), buttons=0)

    def parameter(self) -> bytes:
        """Set one: to a value within its limits, at them, beyond them, or none."""
        choose = self.random
        row = choose.choice([row for row in self._parameters if row.name not in KEPT])
        value = choose.choice(
            (row.minimum, row.maximum, row.default, choose.uniform(row.minimum, row.maximum), 1e9, float("nan"))
        )
        value = round(value) if choose.random() < 0.5 and abs(value) < 1e6 else value
        return forge(ParamSet(1, 1, row.name, 0.0), param_value=struct.unpack("f", struct.pack("f", value))[0])

    def question(self) -> Message:
        """What any robot is asked, and a result's acknowledgement."""
        choose = self.random
        match choose.randrange(6):
            case 0:
                return Ping(time_usec=choose.getrandbits(60), seq=choose.getrandbits(32))
            case 1:
                return Timesync(tc1=0, ts1=choose.getrandbits(60))
            case 2:
                index = choose.choice((-1, choose.randrange(30)))
                return ParamRequestRead(1, 1, choose.choice(self._parameters).name, index)
            case 3:
                asked: tuple[type[Message], ...] = (*self._streams, AutopilotVersion)
                return self.command(Command.REQUEST_MESSAGE, float(choose.choice(asked).ID))
            case 4:
                interval = choose.choice((10_000.0, 20_000.0, 50_000.0, 0.0, -1.0))
                return self.command(Command.SET_MESSAGE_INTERVAL, float(choose.choice(self._streams).ID), interval)
            case _:
                return RobotResultAck(self._numbering.session, self._numbering.sequence, 1, 1)

    def damage(self) -> bytes:
        """A frame of before, late and perhaps damaged; or noise."""
        choose = self.random
        if not self.said or choose.random() < 0.2:
            return choose.randbytes(choose.randint(1, 40))
        frame = bytearray(choose.choice(self.said[-12:]))
        match choose.randrange(3):
            case 0:
                frame[choose.randrange(len(frame))] ^= 1 << choose.randrange(8)
            case 1:
                del frame[choose.randrange(len(frame)) :]
            case _:
                pass
        return bytes(frame)

    def say(self, message: Message) -> bytes:
        """The frame of a message, which may come again by damage."""
        frame = self.codec.encode(message)
        self.said.append(frame)
        return frame

    def next(self) -> bytes:
        """What is said now."""
        weights, speakers = zip(*self.kinds.values(), strict=True)
        said = self.random.choices(speakers, weights)[0]()
        return said if isinstance(said, bytes) else self.say(said)
