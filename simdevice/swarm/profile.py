"""The micro-robot's body and noise: every number of the device in one profile."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from simdevice.quantities import from_table

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class MicroProfile:
    """All parameters of the emulated micro-robots of a table; SI units.

    Attributes:
        radius: Of the body, a disc, in m.
        mass: In kg.
        track: Distance between the wheels, in m.
        traction: Greatest force of both wheels together on the ground, thrust and side force, in N.
        lag: Time constant with which a wheel takes up the speed that it is commanded, in s.
        full_speed: Speed of a wheel at full command, in m/s.
        body_friction: Coefficient between two robots, and between a robot and a wall.
        box_friction: Coefficient between a robot and the box.
        box_mass: In kg.
        box_ground_friction: Coefficient between the box and the ground.
        box_half: Radius of the box, or half of its side, in m.
        slip_sd: Standard deviation of the factor between a wheel's way and that over the ground, drawn for each way.
        drift_sd: Standard deviation of the angle between nose and way, in rad, drawn for each way.
        fix_interval: Between two position fixes, in s.
        fix_sd: Standard deviation of a fix in x and in y, in m.
        fix_angle_sd: Standard deviation of its heading, in rad.
        dropout: Probability that the fixes drop out within a second.
        dropout_time: How long they are out then, in s.
        range_share_sd: Standard deviation of a range, as a share of it.
        range_sd: Standard deviation that is added to that, in m.
        box_bearing_sd: In rad.
        box_distance_sd: In m.
        goal_bearing_sd: In rad.

    Raises:
        ValueError: A quantity that must be positive is not, or one that may be 0 is less.
    """

    radius: float = 0.02
    mass: float = 0.05
    track: float = 0.03
    traction: float = 0.6
    lag: float = 0.03
    full_speed: float = 0.4
    body_friction: float = 0.3
    box_friction: float = 0.6
    box_mass: float = 0.15
    box_ground_friction: float = 0.3
    box_half: float = 0.08
    slip_sd: float = 0.02
    drift_sd: float = math.radians(1.0)
    fix_interval: float = 0.05
    fix_sd: float = 0.001
    fix_angle_sd: float = math.radians(0.5)
    dropout: float = 0.0
    dropout_time: float = 0.5
    range_share_sd: float = 0.02
    range_sd: float = 0.001
    box_bearing_sd: float = math.radians(1.0)
    box_distance_sd: float = 0.002
    goal_bearing_sd: float = math.radians(1.0)

    def __post_init__(self) -> None:
        for name in _POSITIVE:
            if not 0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)}")
        for name in ("body_friction", "box_ground_friction", "dropout", *DEVIATIONS):
            if not 0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must not be negative, but is {getattr(self, name)}")
        if self.dropout > 1:
            raise ValueError(f"dropout is a probability, 0 to 1, not {self.dropout}")

    @classmethod
    def from_table(cls, table: Mapping[str, object]) -> MicroProfile:
        """Make a profile from a table of a TOML file; what it does not name keeps its default.

        Args:
            table: Values by name.

        Returns:
            The profile.

        Raises:
            ValueError: A name is unknown, or a value is of the wrong kind.
        """
        return from_table(cls, table)


_POSITIVE: Final = (
    "radius",
    "mass",
    "track",
    "traction",
    "lag",
    "full_speed",
    "box_friction",
    "box_mass",
    "box_half",
    "fix_interval",
    "dropout_time",
)
DEVIATIONS: Final = (
    "slip_sd",
    "drift_sd",
    "fix_sd",
    "fix_angle_sd",
    "range_share_sd",
    "range_sd",
    "box_bearing_sd",
    "box_distance_sd",
    "goal_bearing_sd",
)
"""Standard deviations by name."""
PROFILES: Final[Mapping[str, MicroProfile]] = {
    "default": MicroProfile(),
    "none": MicroProfile(**dict.fromkeys(DEVIATIONS, 0.0)),
}
"""Profiles by name."""
