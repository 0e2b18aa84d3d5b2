"""What a policy is told: the fields of JUNIOR_SENSORS as numbers about 1, of one robot's messages or of many rings at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import SensorFlag

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from firmware_protocol.messages import JuniorSensors

NAMES: Final = (
    *(f"{field}.{side}" for field in ("eye", "floor", "travel") for side in ("left", "right")),
    "battery",
    *(f"flags.{flag.name.lower()}" for flag in SensorFlag if flag.name is not None),
    "time",
)
"""Of the numbers, in their order: fields of JUNIOR_SENSORS."""
_FLAGS: Final = len(SensorFlag)
_FARTHEST: Final = 32
"""The most that a wheel's way counts, in mm."""
SCALE: Final = np.array([1 / 1023] * 4 + [1 / 8] * 2 + [1e-4] + [1.0] * _FLAGS + [1 / 15_000], np.float32)
"""By which the wire's counts are multiplied: ADC counts of 10 bits, mm in a step (8 are full speed), mV (1 is 10 V), flags, ms
of a bout (1 is its time limit)."""
LOW: Final = np.array([0.0] * 4 + [-4.0] * 2 + [0.0] * (_FLAGS + 2), np.float32)
"""The least that each can be."""
HIGH: Final = np.array([1.0] * 4 + [4.0] * 2 + [6.5535] + [1.0] * (_FLAGS + 1), np.float32)
"""The greatest."""


def scaled(counts: NDArray[np.float32]) -> NDArray[np.float32]:
    """Observations of counts.

    Args:
        counts: As the wire has them, shape (..., len(NAMES)).

    Returns:
        New array of the same shape.
    """
    return counts * SCALE


class Perception:
    """Makes observations of one robot's readings, as they come over the wire.

    The way of a wheel is that since the reading before, and time is counted from the first reading of the bout. A robot that
    has booted in between goes on: its clock and its encoders have begun anew.
    """

    def __init__(self) -> None:
        self._time = self._began = 0
        self._way: tuple[int, ...] = (0, 0)
        self._open = False

    def begin(self) -> None:
        """A bout begins: the next reading is its first."""
        self._open = False

    def observe(self, sensors: JuniorSensors) -> NDArray[np.float32]:
        """What a policy is told of a reading.

        Args:
            sensors: The reading; each is given once.

        Returns:
            Shape (len(NAMES),).
        """
        time, way = round(sensors.time * 1e6), tuple(round(side * 1e3) for side in sensors.travel)
        if not self._open:
            self._open, self._began, self._way = True, time, way
        elif time < self._time:
            self._began, self._way = time - (self._time - self._began), (0, 0)
        moved = [max(-_FARTHEST, min(_FARTHEST, now - before)) for now, before in zip(way, self._way, strict=True)]
        self._time, self._way = time, way
        flags = [sensors.flags >> bit & 1 for bit in range(_FLAGS)]
        battery, elapsed = round(sensors.battery * 1e3), (time - self._began) // 1000
        return scaled(np.array([*sensors.eye, *sensors.floor, *moved, battery, *flags, elapsed], np.float32))
