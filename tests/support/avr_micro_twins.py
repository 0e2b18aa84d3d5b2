"""A micro-robot with two boards (`avr_twins`) on a floor: wheels that roll as the ATmega328P drives them, encoders, bumpers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from avr_twins import TwinBoards, battery_millivolts

from simdevice.avr.micro_board import UM_PER_COUNT, AvrMicroBoard, MicroInputs
from simdevice.boards import Board

if TYPE_CHECKING:
    from simdevice.avr.build import AvrFirmware

PERIOD: Final = 0.005
PRODUCT: Final = 2
BUMPER_LEFT, BUMPER_RIGHT = 0x80, 0x01
"""Sectors 1 and 8 of the body."""
TRACK: Final = 0.03
FULL_SPEED: Final = 0.4
LAG: Final = 0.03
"""Of the wheels: m, m/s at full effort, s."""


class HostMicroBoard(Board):
    """The host build as the micro-robot's board has it: encoders, bumpers, no ring, fixes by SWARM_FIX."""

    def __init__(self, *, uid: int, nvm: bytes | None = None) -> None:
        super().__init__(uid=uid, nvm=nvm, ground_odometer=False)
        self.robot.io.role = PRODUCT

    def run(self, micros: int, rx: bytes, counts: tuple[int, int], inputs: MicroInputs) -> bytes:
        """Run a control period; `counts` are those of the encoders."""
        io = self.robot.io
        io.travel_um = [count * UM_PER_COUNT for count in counts]
        io.bump = BUMPER_LEFT * inputs.bumper_left | BUMPER_RIGHT * inputs.bumper_right
        io.battery_mv = battery_millivolts(inputs.voltage)
        io.ready = 1
        length = self.host.lib.host_tick(self.robot, micros, rx, len(rx))
        self.wheel_left, self.wheel_right = io.wheel
        self.reboot = bool(io.reboot)
        return bytes(self.host.ffi.buffer(io.tx, length))


class MicroTwins(TwinBoards):
    """The micro-robot, and where it is.

    Args:
        firmware: What the ATmega328P runs; None: that of the package.

    Attributes:
        inputs: What its board reads.
        held: Something holds the wheels.
        x: Where it is, in m.
        y: Likewise.
        angle: Its heading, in rad.
    """

    def __init__(self, firmware: AvrFirmware | None = None) -> None:
        self.avr = AvrMicroBoard(uid=0x1122334455667788, firmware=firmware)
        self.host = HostMicroBoard(uid=0x1122334455667788)
        super().__init__(self.avr, self.host)
        self.inputs = MicroInputs()
        self.held = False
        self.x = self.y = self.angle = 0.0
        self._rims = [0.0, 0.0]
        self.power_on()

    def step(self, rx: bytes) -> bytes:
        """A control period: wheels roll, then both boards do what they do."""
        self._roll()
        sent = self._both(
            self._micros,
            rx,
            lambda line: self.avr.tick(line, self.inputs),
            lambda taken: self.host.run(self._micros, taken, self._counts(), self.inputs),
        )
        self._micros += round(PERIOD * 1e6)
        if self.reboot:
            self.restart()
        return sent

    def _begin(self) -> None:
        super()._begin()
        self._micros = 0
        self._at_boot = self.avr.counts

    def _counts(self) -> tuple[int, int]:
        """What the encoders have counted since power-on."""
        (left, right), (left_then, right_then) = self.avr.counts, self._at_boot
        return left - left_then, right - right_then

    def _roll(self) -> None:
        efforts = self.wheel_left, self.wheel_right
        self._rims = [
            0.0 if self.held else rim + (effort / 1000 * FULL_SPEED - rim) * PERIOD / LAG
            for rim, effort in zip(self._rims, efforts, strict=True)
        ]
        left, right = (rim * PERIOD for rim in self._rims)
        self.inputs.travel_left += left
        self.inputs.travel_right += right
        middle = self.angle + (right - left) / TRACK / 2
        self.x += (left + right) / 2 * math.cos(middle)
        self.y += (left + right) / 2 * math.sin(middle)
        self.angle = math.remainder(self.angle + (right - left) / TRACK, math.tau)
