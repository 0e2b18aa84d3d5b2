"""What faults do to an emulated robot's hardware: sensors that are stuck, wheels that are weak, power that fails.

They befall what the board's drivers read and set, and nothing above: the firmware does not know that it is being tested.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.faults.spells import SENSORS, SIDES

if TYPE_CHECKING:
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.faults.spells import StuckSensor

_NEVER: Final = 1e9
"""Later than anything happens, in s."""
_SLACK: Final = 5e-6
"""A fault begins in the first control period that is not before its time, whatever products of periods round to, in s."""


class Readings(Protocol):
    """What the board's drivers read of the sensors."""

    @property
    def eye_left(self) -> int:
        """ADC counts."""
        ...

    @property
    def eye_right(self) -> int:
        """ADC counts."""
        ...

    @property
    def floor_left(self) -> int:
        """ADC counts."""
        ...

    @property
    def floor_right(self) -> int:
        """ADC counts."""
        ...

    @property
    def arm_left(self) -> int:
        """1 while the switch is closed."""
        ...

    @property
    def arm_right(self) -> int:
        """Likewise."""
        ...


@dataclass(slots=True)
class FaultyReadings:
    """What the drivers read where sensors may be stuck; attributes as of `Readings`."""

    eye_left: int = 0
    eye_right: int = 0
    floor_left: int = 0
    floor_right: int = 0
    arm_left: int = 0
    arm_right: int = 0


class Battery(Protocol):
    """What may give another voltage."""

    def feed(self, voltage: float | None) -> None:
        """Give this voltage, in V, without load; None is its own again."""
        ...


class DeviceFaults:
    """The faults of one robot, as its time goes on.

    Call `advance` in every control period, powered or not, before anything else is asked.

    Args:
        spec: What goes wrong; what befalls lines is left alone.
        battery: Its battery.
        period: One control period, in s.

    Attributes:
        effort: Share of a commanded effort that the left, right motor gives.
        dark: The robot has no power.
        restored: Its power has come back in this control period.
    """

    def __init__(self, spec: FaultSpec, battery: Battery, period: float) -> None:
        self._spec = spec
        self._battery = battery
        self._period = period
        self._ticks = 0
        self._readings = FaultyReadings()
        self._stuck: dict[str, StuckSensor] = {}
        self.effort = [1.0, 1.0]
        self._voltage: float | None = None
        self._brownouts = sorted(spec.brownouts, key=lambda spell: spell.at)
        self._dark_until = -inf
        spells = (*spec.stuck, *spec.wheels, *spec.batteries)
        self._changes = sorted({time for spell in spells for time in (spell.at, spell.ends)}, reverse=True)
        self.dark = False
        self.restored = False

    def anew(self) -> DeviceFaults:
        """The same faults, before any time has passed."""
        return DeviceFaults(self._spec, self._battery, self._period)

    def advance(self) -> None:
        """A control period begins."""
        now = self._ticks * self._period + _SLACK
        self._ticks += 1
        while self._changes and now >= self._changes[-1]:
            self._changes.pop()
            self._change(now)
        self.restored = False
        while self._brownouts and now >= self._brownouts[0].at:
            self._dark_until = max(self._dark_until, self._brownouts.pop(0).ends)
            self.dark = True
        if self.dark and now >= self._dark_until:
            self.dark, self.restored = False, True

    def quiet(self) -> int:
        """How many control periods at least may begin with nothing changing: `skip` may pass over that many."""
        times = [*self._changes[-1:], *(spell.at for spell in self._brownouts[:1]), *([self._dark_until] if self.dark else ())]
        if self.restored:
            return 0
        return max(0, int(min([*times, _NEVER]) / self._period) - self._ticks - 1)

    def skip(self, periods: int) -> None:
        """Let control periods pass in which nothing changes.

        Args:
            periods: How many; at most as `quiet` said.
        """
        self._ticks += periods

    @property
    def stuck(self) -> list[tuple[bool, int | None]]:
        """For each of `SENSORS`: it is stuck, and what at; None is what it told last."""
        spells = [self._stuck.get(name) for name in SENSORS]
        return [(spell is not None, None if spell is None else spell.value) for spell in spells]

    def _change(self, now: float) -> None:
        """Something begins or ends: of several spells the last one counts."""
        spec = self._spec
        self._stuck = {spell.sensor: spell for spell in spec.stuck if spell.on(now)}
        effort = {spell.side: spell.effort for spell in spec.wheels if spell.on(now)}
        self.effort = [effort.get(side, 1.0) for side in SIDES]
        voltage = next((spell.voltage for spell in reversed(spec.batteries) if spell.on(now)), None)
        if voltage != self._voltage:
            self._voltage = voltage
            self._battery.feed(voltage)

    def read(self, sensors: Readings) -> Readings:
        """What the drivers read.

        Args:
            sensors: What the sensors would tell.
        """
        readings = self._readings
        for name in SENSORS:
            spell = self._stuck.get(name)
            if spell is None:
                setattr(readings, name, getattr(sensors, name))
            elif spell.value is not None:
                setattr(readings, name, spell.value)
        return readings

    def wheels(self, left: int, right: int) -> tuple[int, int]:
        """What reaches the motors.

        Args:
            left: Effort that the firmware commands, in permille.
            right: Likewise.
        """
        return round(left * self.effort[0]), round(right * self.effort[1])
