"""The emulated ATmega328P on a bench: as `FirmwareBench`, but over a serial line, with sensors that are voltages and levels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

from firmware_bench import HOST, SESSION, TICK, FirmwareBench
from micro_bench import MicroBench

from firmware_protocol.events import Received
from firmware_protocol.messages import Reason, RobotAck
from firmware_protocol.wire.mavlink import MavlinkCodec
from simdevice.avr.board import AvrBoard, AvrProcessor
from simdevice.avr.micro_board import AvrMicroBoard, MicroInputs

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message
    from simdevice.avr.build import AvrFirmware
    from simdevice.junior.faults import Readings
    from simdevice.junior.motors import Motors

UID = 0x1122334455667788
ROUND_TRIP = 6
"""Control periods in which a question and its answer are through the line: 53 bytes go through in one."""


@dataclass
class Inputs:
    """What the board's sensors say; it stands for `Sensors` and `Motors` alike."""

    eye_left: int = 60
    eye_right: int = 61
    floor_left: int = 120
    floor_right: int = 121
    arm_left: int = 0
    arm_right: int = 0
    voltage: float = 7.5
    travel_left: float = 0.0
    travel_right: float = 0.0


class AvrBench(FirmwareBench):
    """One board.

    Attributes:
        board: The board.
        inputs: What its sensors say.
        raw: Every byte since power-on.
        busiest: Most clock cycles that a control period's work has taken.
    """

    def __init__(self, nvm: bytes | None = None, firmware: AvrFirmware | None = None, *, start: bool = False) -> None:
        self._junior = AvrBoard(uid=UID, nvm=nvm, firmware=firmware)
        self.board: AvrProcessor = self._junior
        self.board.start = start
        self.inputs = Inputs()
        self.host = MavlinkCodec(system=255, component=190)
        self.busiest = 0
        self.power_on()

    def power_on(self, nvm: bytes | None = None, *, torn: int | None = None) -> None:
        """Cut the power and give it back; the EEPROM holds what it held."""
        assert nvm is None, "an EEPROM is soldered in: make another bench"
        self.now = -TICK
        self.sequence = 0
        self.session = SESSION
        self.sent: list[Message] = []
        self.streamed: list[Message] = []
        self.raw = b""
        self._codec = MavlinkCodec(system=255, component=190)
        self.board.power_on(torn)

    @property
    def nvm(self) -> bytes:
        """Image of the EEPROM."""
        return self.board.nvm

    @property
    def wheels(self) -> tuple[int, int]:
        """Effort of the motors in permille, left and right."""
        return self.board.wheel_left, self.board.wheel_right

    def eyes(self, *, left: bool, right: bool) -> None:
        """Let the eyes see, or not."""
        self.inputs.eye_left, self.inputs.eye_right = 600 if left else 20, 600 if right else 20

    def floor(self, *, left: bool, right: bool) -> None:
        """Put the floor sensors off the ring, or on it."""
        self.inputs.floor_left, self.inputs.floor_right = 900 if left else 50, 900 if right else 50

    def tick(self, *messages: Message, raw: bytes = b"") -> list[Message]:
        """One control period, in which these messages, then these bytes, set out. Returns what came but for streams."""
        data = b"".join(self.host.encode(message) for message in messages) + raw
        self.now += TICK
        out = self.period(data)
        self.raw += out
        self.busiest = max(self.busiest, self.board.busy)
        answers: list[Message] = []
        for event in self._codec.receive(out, self.now / 1000):
            assert isinstance(event, Received), event
            (self.streamed if type(event.message).__name__ in self.STREAMS else answers).append(event.message)
        self.sent += answers
        return answers

    def period(self, data: bytes) -> bytes:
        """One control period of the board, in which these bytes set out; returns what it has sent."""
        sensors, motors = cast("Readings", self.inputs), cast("Motors", self.inputs)
        return self._junior.tick(self.now * 1000, data, sensors, motors, 0.0)

    def answers_to(self, message: Message) -> list[Message]:
        """What comes while a message goes there and an answer back."""
        return self.tick(message) + [answer for _ in range(ROUND_TRIP) for answer in self.tick(HOST)]

    def ask(self, message: Message) -> Reason | None:
        """Send a numbered message; returns the reason in the answer (NONE: accepted), None where there is no answer."""
        acks = [answer for answer in self.answers_to(message) if isinstance(answer, RobotAck)]
        return Reason(acks[0].reason) if acks else None


class AvrMicroBench(AvrBench):
    """One micro-robot's board.

    Attributes:
        around: What it reads.
    """

    STREAMS = MicroBench.STREAMS

    def __init__(self, nvm: bytes | None = None, firmware: AvrFirmware | None = None) -> None:
        self._micro = AvrMicroBoard(uid=UID, nvm=nvm, firmware=firmware)
        self.board = self._micro
        self.around = MicroInputs()
        self.host = MavlinkCodec(system=255, component=190)
        self.busiest = 0
        self.power_on()

    def period(self, data: bytes) -> bytes:
        """One control period of the board, in which these bytes set out; returns what it has sent."""
        return self._micro.tick(data, self.around)
