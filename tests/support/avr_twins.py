"""Two boards in one robot: the ATmega328P that it obeys, and the host build that is told the same and must do the same.

The rule of equality, which `TwinBoards` holds both to in every control period:

- The host build is given, in each period, the bytes that the ATmega328P took from its buffer in that period, the counts that
  its converter reads, and the room that it had for what is to be sent when the period began. It stores a byte a period, as
  the ATmega328P does.
- Then both give the wheels the same effort in the same period, and their EEPROMs are equal after it.
- They send the same frames in the same order, and as many bytes in the same period. SYS_STATUS.load, which is measured, is left
  out, and with it the checksum of that frame. Over the line frames come later than from the host build, by what the line takes.
- A reset loses what is still in the buffer.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from firmware_protocol.messages import SysStatus
from firmware_protocol.wire.mavlink import split_frames
from simdevice.avr.board import AvrBoard, AvrProcessor, battery_counts
from simdevice.boards import Board

if TYPE_CHECKING:
    from collections.abc import Callable

    from simdevice.avr.build import AvrFirmware
    from simdevice.junior.faults import Readings
    from simdevice.junior.motors import Motors

RX_SIZE, TX_SIZE = 128, 192
"""Buffers of the firmware's board.h."""
HEADER, AT_ID, AT_LOAD = 10, 7, 22
SHORT = 72
"""Bytes of a large message."""
STORED = 1
"""Bytes of the EEPROM that are written in a control period."""


@dataclass
class Divided:
    """The battery as the board's converter sees it, and no encoders; stands for `Motors`."""

    voltage: float = 0.0
    travel_left: float = 0.0
    travel_right: float = 0.0


def battery_millivolts(voltage: float) -> int:
    """What the board's firmware makes of a battery of so many V."""
    return battery_counts(voltage) * 10000 // 1024


def comparable(frame: bytes) -> bytes:
    """A frame without what may differ."""
    if frame[AT_ID] == SysStatus.ID and not any(frame[AT_ID + 1 : HEADER]):
        return frame[:AT_LOAD] + frame[AT_LOAD + 2 : -2]
    return frame


class TwinBoards:
    """A board of two, whatever the role.

    Args:
        avr: The ATmega328P.
        host: The host build, with the same EEPROM.

    Attributes:
        wheel_left: As of the ATmega328P, in permille.
        wheel_right: Likewise.
        start: The start module says go.
        reboot: The watchdog has bitten.
        periods: Control periods in which both did the same.
        frames: Frames that were equal.
        short: Periods that began with less room than a large message takes.
        turning: Periods in which a wheel had effort.
        boots: Times they have booted.
    """

    def __init__(self, avr: AvrProcessor, host: Board) -> None:
        self._chip, self._build = avr, host
        self.start = False
        self.periods = self.frames = self.short = self.turning = self.boots = 0
        self._cut = b""
        self._due: deque[bytes] = deque()
        self._rx_out, self._tx_in, self._tx_seen = (self._chip.address(name) for name in ("rx_out", "tx_in", "tx_seen"))

    @property
    def wheel_left(self) -> int:
        return self._chip.wheel_left

    @property
    def wheel_right(self) -> int:
        return self._chip.wheel_right

    @property
    def reboot(self) -> bool:
        return self._chip.reboot

    @property
    def nvm(self) -> bytes:
        return self._chip.nvm

    def power_on(self) -> None:
        self._lose()
        self._chip.power_on()
        self._begin()

    def power_off(self) -> None:
        self._chip.power_off()
        self._build.power_off()

    def restart(self) -> None:
        assert self._build.reboot, "the watchdog bit, and nobody had asked for a reboot"
        self._lose()
        self._chip.restart()
        self._begin()

    def _lose(self) -> None:
        """A frame is cut short; the next one follows it at once."""
        self._chip.start = self._build.start = self.start
        self._cut += self._chip._unfinished
        assert not self._cut or self._cut[:AT_LOAD] == self._due[0][: min(AT_LOAD, len(self._cut))]

    def _begin(self) -> None:
        """The ATmega328P has booted; the host build boots."""
        self._build.power_on()
        assert self._chip.nvm == self._build.nvm
        self._offered = b""
        self._due.clear()
        self.boots += 1

    def _both(
        self, micros: int, rx: bytes, run_chip: Callable[[bytes], bytes], run_build: Callable[[bytes], bytes | memoryview]
    ) -> bytes:
        """Run a control period of both.

        Args:
            micros: Time since power-on, in us.
            rx: Bytes that set out to the ATmega328P.
            run_chip: Runs its period with these bytes on the line.
            run_build: Runs one of the host build, which has got these bytes.

        Returns:
            What the ATmega328P has sent.
        """
        self._chip.start = self._build.start = self.start
        before, tx_in = self._chip.peek(self._rx_out), self._chip.peek(self._tx_in)
        self._offered += rx
        sent = run_chip(rx)
        count = (self._chip.peek(self._rx_out) - before) % RX_SIZE
        taken, self._offered = self._offered[:count], self._offered[count:]
        if not self._build.reboot:  # then it waits for the watchdog
            room = (self._chip.peek(self._tx_seen) - tx_in - 1) % TX_SIZE
            self.short += room < SHORT
            self._slow_down(max(room, 1))  # 0 would be any room
            out = bytes(run_build(taken))
            assert (self._chip.peek(self._tx_in) - tx_in) % TX_SIZE == len(out), f"bytes that are sent, after {micros} us"
            self._due.extend(split_frames(out))
            wheels = self._chip.wheel_left, self._chip.wheel_right
            assert wheels == (self._build.wheel_left, self._build.wheel_right), f"wheels, after {micros} us"
            self.turning += wheels != (0, 0)
            self.periods += 1
        if sent:
            assert sent.startswith(self._cut)
            frames, self._cut = split_frames(sent[len(self._cut) :]), b""
        else:
            frames = []
        for frame in frames:
            due = self._due.popleft()
            assert comparable(frame) == comparable(due), f"after {micros} us {frame.hex()} instead of {due.hex()}"
            self.frames += 1
        if self.periods % 50 == 0:
            assert self._chip.nvm == self._build.nvm, f"EEPROM, after {micros} us"
        return sent

    def _slow_down(self, room: int) -> None:
        host = self._build
        host._host.lib.host_slow_down(host._robot, STORED, room, 0)


class Twins(TwinBoards):
    """Junior's board of two; a `BoardInterface`."""

    def __init__(self, *, uid: int, nvm: bytes | None = None, firmware: AvrFirmware | None = None) -> None:
        self.avr = AvrBoard(uid=uid, nvm=nvm, firmware=firmware)
        self.host = Board(uid=uid, nvm=nvm, encoders=False, ground_odometer=False)
        super().__init__(self.avr, self.host)
        self._battery = Divided()

    def tick(self, micros: int, rx: bytes, sensors: Readings, motors: Motors, ground: float) -> bytes:
        self._battery.voltage = (battery_millivolts(motors.voltage) + 0.5) / 1000
        return self._both(
            micros,
            rx,
            lambda line: self.avr.tick(micros, line, sensors, motors, ground),
            lambda taken: self.host.tick(micros, taken, sensors, self._battery, 0.0),  # type: ignore[arg-type]
        )
