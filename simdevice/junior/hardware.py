"""Junior's hardware as the world has it: a body with motors and sensors, and no board yet."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simdevice.arena import Rover
from simdevice.junior.motors import Motors
from simdevice.junior.sensors import Sensors

if TYPE_CHECKING:
    import numpy as np

    from simdevice.junior.profile import JuniorProfile
    from simdevice.sumo.ring import SumoRing


class JuniorHardware:
    """Junior's hardware on the table: body, motors, sensors.

    Args:
        profile: The device's numbers.
        ring: What its floor sensors look at.
        motor_noise: Source of the wheel commands' errors.
        sensor_noise: Source of the sensors' noise.
    """

    def __init__(
        self, profile: JuniorProfile, ring: SumoRing, motor_noise: np.random.Generator, sensor_noise: np.random.Generator
    ) -> None:
        self.profile = profile
        self.motors = Motors(profile, motor_noise)
        self.body = Rover(profile, self.motors)
        self.sensors = Sensors(profile, self.body, ring, sensor_noise)

    def begin(self, motor_noise: np.random.Generator, sensor_noise: np.random.Generator) -> None:
        """Begin a bout; see `Motors.begin` and `Sensors.begin`."""
        self.motors.begin(motor_noise)
        self.sensors.begin(sensor_noise)

    def fit(self, profile: JuniorProfile) -> None:
        """Be a robot of these numbers from now on; it is off the table."""
        if profile is not self.profile:
            self.profile = profile
            self.motors.fit(profile)
            self.body.fit(profile)
            self.sensors.fit(profile)
