"""Two boards in one robot: the ATmega328P that it obeys, and the host build that is told the same and must do the same.

The rule of equality, which `Twins` holds both to in every control period:

- The host build is given, in each period, the bytes that the ATmega328P took from its buffer in that period, the counts that
  its converter reads, and the room that it had for what is to be sent when the period began. It stores a byte a period, as
  the ATmega328P does.
- Then both give the wheels the same effort in the same period, and their EEPROMs are equal after it.
- They send the same frames in the same order. SYS_STATUS.load, which is measured, is left out, and with it the checksum of
  that frame. Over the line frames come later than from the host build, by what the line takes.
- A reset loses what is still in the buffer.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from firmware_protocol.messages import SysStatus
from firmware_protocol.wire.mavlink import split_frames
from simdevice.avr.board import AvrBoard, battery_counts
from simdevice.boards import Board

if TYPE_CHECKING:
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


def comparable(frame: bytes) -> bytes:
    """A frame without what may differ."""
    if frame[AT_ID] == SysStatus.ID and not any(frame[AT_ID + 1 : HEADER]):
        return frame[:AT_LOAD] + frame[AT_LOAD + 2 : -2]
    return frame


class Twins:
    """A board of two; a `BoardInterface`.

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

    def __init__(self, *, uid: int, nvm: bytes | None = None, firmware: AvrFirmware | None = None) -> None:
        self.avr = AvrBoard(uid=uid, nvm=nvm, firmware=firmware)
        self.host = Board(uid=uid, nvm=nvm, encoders=False, ground_odometer=False)
        self.start = False
        self.periods = self.frames = self.short = self.turning = self.boots = 0
        self._battery = Divided()
        self._cut = b""
        self._due: deque[bytes] = deque()
        self._rx_out, self._tx_in, self._tx_seen = (self.avr.address(name) for name in ("rx_out", "tx_in", "tx_seen"))

    @property
    def wheel_left(self) -> int:
        return self.avr.wheel_left

    @property
    def wheel_right(self) -> int:
        return self.avr.wheel_right

    @property
    def reboot(self) -> bool:
        return self.avr.reboot

    @property
    def nvm(self) -> bytes:
        return self.avr.nvm

    def power_on(self) -> None:
        self._lose()
        self.avr.power_on()
        self._begin()

    def power_off(self) -> None:
        self.avr.power_off()
        self.host.power_off()

    def restart(self) -> None:
        assert self.host.reboot, "the watchdog bit, and nobody had asked for a reboot"
        self._lose()
        self.avr.restart()
        self._begin()

    def _lose(self) -> None:
        """A frame is cut short; the next one follows it at once."""
        self.avr.start = self.host.start = self.start
        self._cut += self.avr._unfinished
        assert not self._cut or self._cut[:AT_LOAD] == self._due[0][: min(AT_LOAD, len(self._cut))]

    def _begin(self) -> None:
        """The ATmega328P has booted; the host build boots."""
        self.host.power_on()
        assert self.avr.nvm == self.host.nvm
        self._offered = b""
        self._due.clear()
        self.boots += 1

    def tick(self, micros: int, rx: bytes, sensors: Readings, motors: Motors, ground: float) -> bytes:
        self.avr.start = self.host.start = self.start
        before, tx_in = self.avr.peek(self._rx_out), self.avr.peek(self._tx_in)
        self._offered += rx
        sent = self.avr.tick(micros, rx, sensors, motors, ground)
        count = (self.avr.peek(self._rx_out) - before) % RX_SIZE
        taken, self._offered = self._offered[:count], self._offered[count:]
        if not self.host.reboot:  # then it waits for the watchdog
            self._battery.voltage = (battery_counts(motors.voltage) * 10000 // 1024 + 0.5) / 1000
            room = (self.avr.peek(self._tx_seen) - tx_in - 1) % TX_SIZE
            self.short += room < SHORT
            self._slow_down(max(room, 1))  # 0 would be any room
            out = bytes(self.host.tick(micros, taken, sensors, self._battery, 0.0))  # type: ignore[arg-type]
            self._due.extend(split_frames(out))
            wheels = self.avr.wheel_left, self.avr.wheel_right
            assert wheels == (self.host.wheel_left, self.host.wheel_right), f"wheels, after {micros} us"
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
            assert self.avr.nvm == self.host.nvm, f"EEPROM, after {micros} us"
        return sent

    def _slow_down(self, room: int) -> None:
        host = self.host
        host._host.lib.host_slow_down(host._robot, STORED, room, 0)
