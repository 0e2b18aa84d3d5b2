"""Motors and battery: from a commanded effort to a force on the ground.

A small geared DC motor has a linear torque-speed curve: force = stall force x (effort - speed / free speed). The tyre
passes on no more than its friction; what is beyond makes the wheel slip, so that a wheel encoder runs ahead of the ground.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from simdevice.junior.profile import JuniorProfile


class Motors:
    """Both wheels and the battery that feeds them.

    Args:
        profile: The device's numbers.
        noise: Source of the command noise.

    Attributes:
        force: Force of the left, right tyre on the ground in the last period, in N.
        travel: Way of the left, right wheel's rim since power-on, in m; it includes slip.
        voltage: Battery voltage under the load of the last period, in V.
        charge: What has been taken from the battery, in A s.
        commanded: Effort set last for the left, right wheel, in permille.
        noise: Source of the command noise.
        slip: Speed that the wheel gains for each newton that the tyre does not pass on, in m/s/N.
        current_per_force: In A/N.
        fall: Of the battery's voltage, in V/(A s).
        per_volt: Share of the nominal voltage, in 1/V.
    """

    def __init__(self, profile: JuniorProfile, noise: np.random.Generator) -> None:
        self.noise = noise
        self.commanded = (0, 0)
        self._effort_left = 0.0
        self._effort_right = 0.0
        self.force_left = 0.0
        self.force_right = 0.0
        self.travel_left = 0.0
        self.travel_right = 0.0
        self.charge = 0.0
        self._share = 1.0
        self._fed: float | None = None
        self.fit(profile)

    def fit(self, profile: JuniorProfile) -> None:
        """Have other motors and another battery, whose numbers these are."""
        self._profile = profile
        self._free = profile.free_speed
        self._stall = profile.stall_force
        self._limit = profile.tyre_limit
        self.slip = profile.free_speed / profile.stall_force
        self._idle = profile.idle_current
        self.current_per_force = profile.stall_current / profile.stall_force
        self.fall = (profile.full_voltage - profile.empty_voltage) / profile.capacity
        self._resistance = profile.resistance
        self.per_volt = 1 / profile.nominal_voltage
        self.feed(self._fed)

    def command(self, left: int, right: int) -> None:
        """Set the effort; a change draws a new error for that wheel.

        Args:
            left: Effort in permille of full, -1000..1000.
            right: Likewise.
        """
        last_left, last_right = self.commanded
        if left != last_left:
            self._effort_left = left * 1e-3 * self._profile.wheel_gain[0] * self._error()
        if right != last_right:
            self._effort_right = right * 1e-3 * self._profile.wheel_gain[1] * self._error()
        self.commanded = (left, right)

    def _error(self) -> float:
        """A factor about 1."""
        return 1.0 + self._profile.command_noise * float(self.noise.standard_normal())

    def turn(self, left: float, right: float, period: float) -> None:
        """Work out the forces of one period.

        Args:
            left: Speed of the ground under the left wheel, in m/s, forward positive.
            right: Likewise.
            period: How long it is, in s.
        """
        free = self._free
        stall = self._stall
        limit = self._limit
        share = self._share
        wanted_left = stall * (self._effort_left * share - left / free)
        if wanted_left > limit:
            left += (wanted_left - limit) * self.slip
            wanted_left = limit
        elif wanted_left < -limit:
            left += (wanted_left + limit) * self.slip
            wanted_left = -limit
        wanted_right = stall * (self._effort_right * share - right / free)
        if wanted_right > limit:
            right += (wanted_right - limit) * self.slip
            wanted_right = limit
        elif wanted_right < -limit:
            right += (wanted_right + limit) * self.slip
            wanted_right = -limit
        self.force_left = wanted_left
        self.force_right = wanted_right
        self.travel_left += left * period
        self.travel_right += right * period
        current = self._idle + self.current_per_force * (abs(wanted_left) + abs(wanted_right))
        self.charge += current * period
        self.voltage = max(self._empty, self._full - self.charge * self.fall) - current * self._resistance
        self._share = self.voltage * self.per_volt

    def feed(self, voltage: float | None) -> None:
        """Have the battery give another voltage.

        Args:
            voltage: Without load, in V, whatever is taken from it; None is its own again.
        """
        profile = self._profile
        self._fed = voltage
        self._full = profile.full_voltage if voltage is None else voltage
        self._empty = profile.empty_voltage if voltage is None else voltage
        self.voltage = max(self._empty, self._full - self.charge * self.fall)
        self._share = self.voltage * self.per_volt

    def begin(self, noise: np.random.Generator) -> None:
        """Begin a bout: a full battery, no command, and errors that follow from the bout's own seed.

        Args:
            noise: Source of the command noise from now on.
        """
        self.noise = noise
        self.charge = 0.0
        self.voltage = self._full
        self._share = self.voltage * self.per_volt
        self.commanded = (0, 0)
        self._effort_left = self._effort_right = 0.0

    def power_on(self) -> None:
        """Encoders count from zero again and the drivers are off; the battery stays as it is."""
        self.commanded = (0, 0)
        self._effort_left = self._effort_right = 0.0
        self.travel_left = self.travel_right = 0.0
