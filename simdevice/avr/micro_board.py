"""A micro-robot's board as an ATmega328P: encoders on both wheels, two bumpers, no ring and no position system."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from simdevice.avr.board import AvrProcessor, battery_counts

if TYPE_CHECKING:
    from simdevice.avr.build import AvrFirmware

UM_PER_COUNT: Final = 100
"""Way of a wheel between two changes of its encoder's outputs, in um: BOARD_UM_PER_COUNT of the firmware's board_micro.h."""
FASTEST: Final = 40
"""Changes that an encoder shows in a control period: 0.8 m/s. What is beyond comes in the next one."""


@dataclass
class MicroInputs:
    """What surrounds a micro-robot's board.

    Attributes:
        travel_left: Way of the left wheel since power-on, in m, forward positive.
        travel_right: Likewise.
        bumper_left: The left bumper is pressed.
        bumper_right: Likewise.
        voltage: Of the battery, in V.
    """

    travel_left: float = 0.0
    travel_right: float = 0.0
    bumper_left: bool = False
    bumper_right: bool = False
    voltage: float = 7.5


class AvrMicroBoard(AvrProcessor):
    """An ATmega328P that runs a micro-robot's firmware.

    What a wheel has turned is known when a step of the world is over. Its encoder shows it in the first 0.8 ms of the next
    control period, while the converter scans, so that this period's work knows of it.

    Args:
        uid: Unique id burnt into it, as its serial number.
        nvm: Image of its EEPROM; None is blank.
        firmware: What it runs; None builds the micro-robot's firmware that comes with the package.

    Attributes:
        counts: Changes that the encoders, left and right, have shown since the board was made; forward counts up.
    """

    _ROLE = "micro"

    def __init__(self, *, uid: int, nvm: bytes | None = None, firmware: AvrFirmware | None = None) -> None:
        super().__init__(uid=uid, nvm=nvm, firmware=firmware)
        self.counts = (0, 0)

    def tick(self, rx: bytes, inputs: MicroInputs) -> bytes:
        """Run one control period.

        Args:
            rx: Bytes from the host; they set out on the line one after the other, 53 in a control period.
            inputs: Of this period.

        Returns:
            What the firmware has sent: whole frames, and what a reset has cut short. Of a frame that is still on its way at
            the end of the period the bytes come with the rest of it.

        Raises:
            RuntimeError: The processor has crashed.
        """
        left = self._turned(inputs.travel_left, self.counts[0])
        right = self._turned(inputs.travel_right, self.counts[1])
        self._io.turned = (left, right)
        self.counts = (self.counts[0] + left, self.counts[1] + right)
        self._io.counts = (0, 0, 0, 0, battery_counts(inputs.voltage))
        self._io.closed = (inputs.bumper_left, inputs.bumper_right)
        return self._period(rx)

    @staticmethod
    def _turned(travel: float, count: int) -> int:
        return max(-FASTEST, min(FASTEST, int(travel * 1e6 // UM_PER_COUNT) - count))
