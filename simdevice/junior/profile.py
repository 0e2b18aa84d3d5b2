"""Junior's body: every number of the device in one profile."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from simdevice.outline import Outline
from simdevice.quantities import GRAVITY, from_table

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class JuniorProfile:
    """All parameters of an emulated Junior; SI units. Lengths are in the robot's frame: x forward, y left.

    Attributes:
        mass: In kg.
        track: Distance between the wheels, in m.
        free_speed: Speed of an unloaded wheel at full command and nominal voltage, in m/s.
        stall_force: Force of a blocked wheel at full command and nominal voltage, in N.
        tyre_friction: Coefficient between tyres and ring, lengthwise and sideways.
        command_noise: Standard deviation of the factor on a wheel's command, drawn anew whenever the command changes.
        wheel_gain: Share of the commanded effort that the left, right motor gives; 0 is a dead motor.
        body_friction: Coefficient between Junior and whatever it touches.
        nominal_voltage: Battery voltage that the motor figures hold for, in V.
        full_voltage: Voltage of the full battery without load, in V.
        empty_voltage: Of the empty one; it goes no lower.
        capacity: Charge of the battery, in A s.
        resistance: Inner resistance of the battery, in ohm.
        stall_current: Current of a blocked motor at full command, in A.
        idle_current: Current of the rest, in A.
        front: Where the front face is, in m.
        arm_span: Least and greatest distance of an arm's face from the middle line, in m.
        arm_press: An arm's switch closes when something is this near to the front face, in m.
        arm_release: It opens when nothing is nearer than this.
        eye_position: Of the left eye; the right one mirrors it.
        eye_angle: Outward angle of the eyes' axes, in rad.
        eye_half_cone: Half of an eye's field of view, in rad.
        eye_range: Distance at which the reading passes the threshold of a new robot, in m.
        eye_reach: Distance beyond which the reading is that of an empty field, in m.
        eye_steepest: Greatest angle between ray and surface normal that still reflects, in rad.
        eye_threshold: ADC counts at `eye_range`.
        eye_ambient: ADC counts of an empty field.
        eye_offset: The reading falls with 1 / (distance + this), in m.
        eye_noise: Standard deviation, in ADC counts.
        floor_position: Of the left floor sensor; the right one mirrors it.
        floor_spot: Width of the spot that a floor sensor averages over, in m.
        floor_on: ADC counts on the ring.
        floor_off: ADC counts off the ring.
        floor_noise: Standard deviation, in ADC counts.
        encoders: Wheel encoders are fitted.
        ground_odometer: A ground odometer (such as an optical-flow sensor) is fitted.
        uid: Unique id of the robot; 0 takes one from the seed.

    Raises:
        ValueError: A quantity that must be positive is not.
    """

    mass: float = 0.5
    track: float = 0.09
    free_speed: float = 0.40
    stall_force: float = 3.0
    tyre_friction: float = 0.8
    command_noise: float = 0.05
    wheel_gain: tuple[float, float] = (1.0, 1.0)
    body_friction: float = 0.3
    nominal_voltage: float = 7.4
    full_voltage: float = 7.5
    empty_voltage: float = 7.0
    capacity: float = 7200.0
    resistance: float = 0.08
    stall_current: float = 0.8
    idle_current: float = 0.1
    front: float = 0.06
    arm_span: tuple[float, float] = (0.004, 0.045)
    arm_press: float = 0.001
    arm_release: float = 0.0025
    eye_position: tuple[float, float] = (0.045, 0.020)
    eye_angle: float = math.radians(20.0)
    eye_half_cone: float = math.radians(20.0)
    eye_range: float = 0.40
    eye_reach: float = 0.50
    eye_steepest: float = math.radians(45.0)
    eye_threshold: int = 250
    eye_ambient: int = 60
    eye_offset: float = 0.14
    eye_noise: float = 3.0
    floor_position: tuple[float, float] = (0.050, 0.035)
    floor_spot: float = 0.004
    floor_on: int = 120
    floor_off: int = 880
    floor_noise: float = 8.0
    encoders: bool = True
    ground_odometer: bool = True
    uid: int = 0

    def __post_init__(self) -> None:
        for name in _POSITIVE:
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)}")

    @classmethod
    def from_table(cls, table: Mapping[str, object]) -> JuniorProfile:
        """Make a profile from a table of a TOML file; what it does not name keeps its default.

        Args:
            table: Values by name; arrays stand for pairs.

        Returns:
            The profile.

        Raises:
            ValueError: A name is unknown, or a value is of the wrong kind.
        """
        return from_table(cls, table)

    @property
    def tyre_limit(self) -> float:
        """Greatest force of one tyre, in N; each carries half of the weight."""
        return self.tyre_friction * self.mass * GRAVITY / 2


_POSITIVE: Final = (
    "mass",
    "track",
    "free_speed",
    "stall_force",
    "tyre_friction",
    "nominal_voltage",
    "capacity",
    "eye_half_cone",
    "eye_steepest",
    "eye_offset",
    "floor_spot",
)


JUNIOR_OUTLINE: Final = Outline(
    (
        (0.060, -0.046),
        (0.060, 0.046),
        (0.042, 0.060),
        (-0.048, 0.060),
        (-0.060, 0.048),
        (-0.060, -0.048),
        (-0.048, -0.060),
        (0.042, -0.060),
    )
)
"""12 cm across; the flat front carries the arms, from 4 to 45 mm either side of the middle."""
