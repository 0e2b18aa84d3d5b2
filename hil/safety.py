"""What the host never asks of a robot: limits on what it is told to do, applied at one place, and reported.

The robot has its own watchdog and e-stop; these limits are for what a program or a person would send by mistake. How fast
the actions of a maneuver are is for the robot's parameters to say (`SPD_FAST` and its neighbours), not for the host.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firmware_protocol.vocabulary import Maneuver


@dataclass(frozen=True)
class Limits:
    """Bounds on motion commands.

    Attributes:
        speed: Greatest wheel speed of a drive command, share of full, 0..1.
        duration: Longest drive command, in s: its dead-man time.
        maneuver: Longest maneuver, in s, the floor reflex not counted. No action is made shorter than 0.02 s, the
            shortest that robots know.

    Raises:
        ValueError: A bound is not positive, or the speed is above 1.
    """

    speed: float = 1.0
    duration: float = 0.5
    maneuver: float = 10.0

    def __post_init__(self) -> None:
        if not 0 < self.speed <= 1:
            raise ValueError(f"the speed limit is a share of full, above 0 and up to 1, not {self.speed:g}")
        if not (self.duration > 0 and self.maneuver > 0):  # NaN is not either
            raise ValueError("time limits must be positive")

    def wheels(self, left: float, right: float, duration: float) -> tuple[float, float, float]:
        """Bound a wheel command, keeping the ratio of the wheels so that the path keeps its curve.

        Args:
            left: Left wheel, share of full, -1..1.
            right: Right wheel, likewise.
            duration: Time in s.

        Returns:
            What is really to be sent: left, right, duration.

        Raises:
            ValueError: A value is not a finite number (comparisons with NaN would let it through).
        """
        if not (isfinite(left) and isfinite(right) and isfinite(duration) and duration >= 0):
            raise ValueError(
                f"wheel speeds and duration must be finite, the duration not negative: {left}, {right}, {duration}"
            )
        largest = max(abs(left), abs(right))
        factor = self.speed / largest if largest > self.speed else 1.0
        return left * factor, right * factor, min(duration, self.duration)

    def bounded(self, maneuver: Maneuver) -> Maneuver:
        """Bound a maneuver's length by shortening its action period.

        Args:
            maneuver: What is asked for.

        Returns:
            What is really to be performed.
        """
        longest = self.maneuver / len(maneuver.actions)
        return maneuver if maneuver.period <= longest else replace(maneuver, period=max(0.02, longest))
