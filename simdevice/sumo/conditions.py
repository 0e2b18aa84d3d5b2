"""How a ring, its Junior and its opponent differ from the nominal ones: told once for all, or drawn anew for each bout."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import numpy as np

    from simdevice.junior.profile import JuniorProfile
    from simdevice.sumo.opponents import OpponentSpec

LEAST: Final = 0.1
"""Least factor."""
MOST: Final = 10.0
"""Greatest factor."""
MOST_VARY: Final = 0.9
MOST_DELAY: Final = 0.5
"""Greatest delay, in s."""
DELAY_UNIT: Final = 0.1
"""A share that is drawn of a delay, whose nominal value is none, is one of this, in s."""


@dataclass(frozen=True)
class Conditions:
    """Factors on the nominal, and a delay.

    Attributes:
        mass: Of Junior's mass.
        friction: Of the friction of Junior's tyres.
        speed: Of the no-load speed of its motors.
        force: Of the stall force of its motors.
        left: Of the effort that its left motor gives.
        right: Of its right motor's.
        eyes: Of the distances at which its eyes see.
        battery: Of its battery's voltage: a robot is slower and weaker by it.
        opponent_mass: Of the opponent's mass.
        opponent_friction: Of the opponent's friction on the ring, static and kinetic.
        delay: What the host says arrives this much later, in s.

    Raises:
        ValueError: A factor or the delay is out of its range.
    """

    mass: float = 1.0
    friction: float = 1.0
    speed: float = 1.0
    force: float = 1.0
    left: float = 1.0
    right: float = 1.0
    eyes: float = 1.0
    battery: float = 1.0
    opponent_mass: float = 1.0
    opponent_friction: float = 1.0
    delay: float = 0.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if name == "delay" and not 0 <= value <= MOST_DELAY:
                raise ValueError(f"delay is 0 to {MOST_DELAY:g} s, not {value:g}")
            if name != "delay" and not LEAST <= value <= MOST:
                raise ValueError(f"{name} is a factor, {LEAST:g} to {MOST:g}, not {value:g}")

    def drawn(self, vary: float, random: np.random.Generator) -> Conditions:
        """Conditions about these.

        Args:
            vary: Every factor is multiplied by one between 1 - this and 1 + this; to the delay comes one between 0 and
                this share of 0.1 s. All are uniform, and drawn apart.
            random: Source of chance.
        """
        *names, delay = (field.name for field in fields(self))
        shares = random.uniform(-vary, vary, len(names)).tolist()
        late = self.delay + DELAY_UNIT * float(random.uniform(0.0, vary))
        drawn = {name: getattr(self, name) * (1.0 + share) for name, share in zip(names, shares, strict=True)}
        return Conditions(**{name: min(max(value, LEAST), MOST) for name, value in drawn.items()}, **{delay: late})

    def junior(self, profile: JuniorProfile) -> JuniorProfile:
        """Junior's numbers under these conditions; the very same object where they are nominal.

        Args:
            profile: Its nominal numbers.
        """
        if self == NOMINAL:
            return profile
        left, right = profile.wheel_gain
        return replace(
            profile,
            mass=profile.mass * self.mass,
            tyre_friction=profile.tyre_friction * self.friction,
            free_speed=profile.free_speed * self.speed,
            stall_force=profile.stall_force * self.force,
            wheel_gain=(left * self.left, right * self.right),
            eye_range=profile.eye_range * self.eyes,
            eye_reach=profile.eye_reach * self.eyes,
            full_voltage=profile.full_voltage * self.battery,
            empty_voltage=profile.empty_voltage * self.battery,
        )

    def second(self, profile: JuniorProfile) -> JuniorProfile:
        """Numbers of an opponent that is a second Junior.

        Args:
            profile: Its nominal numbers.
        """
        return Conditions(mass=self.opponent_mass, friction=self.opponent_friction).junior(profile)

    def dummy(self, spec: OpponentSpec) -> OpponentSpec:
        """What another opponent is made of under these conditions.

        Args:
            spec: What it is made of nominally.
        """
        if self == NOMINAL:
            return spec
        return replace(
            spec,
            mass=spec.mass * self.opponent_mass,
            static=spec.static * self.opponent_friction,
            kinetic=spec.kinetic * self.opponent_friction,
        )


NOMINAL: Final = Conditions()
"""Nothing differs."""
CONDITIONS: Final = tuple(field.name for field in fields(Conditions))
"""What may differ, as an address names it."""
