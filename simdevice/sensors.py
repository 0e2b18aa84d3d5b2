"""What Junior's sensors measure, as the board's drivers would read it: ADC counts and switch contacts.

Everything above the drivers (thresholds, debounce, hysteresis of the eyes, tallies) is the firmware's business.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from simdevice.outline import NOTHING

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np

    from simdevice.arena import Piece, Ring
    from simdevice.junior import JuniorProfile

ADC_MAX: Final = 1023
"""Greatest reading of a 10-bit converter."""
_DEEP: Final = -0.03
"""What seems further behind the front face than this, in m, is behind the robot and not at its arms."""
_BLOCK: Final = 4096
"""Random numbers drawn at a time."""


def normals(generator: np.random.Generator) -> Iterator[float]:
    """Standard normal numbers without end, drawn in blocks.

    Args:
        generator: Where they come from.

    Yields:
        One number.
    """
    while True:
        yield from generator.standard_normal(_BLOCK).tolist()


class Sensors:
    """Eyes, arms and floor sensors of one Junior.

    Args:
        profile: The device's numbers.
        body: Where the sensors sit.
        ring: What the floor sensors look at.
        noise: Source of the converter's noise.

    Attributes:
        eye_left: ADC counts; they rise as something comes nearer.
        eye_right: Likewise.
        floor_left: ADC counts; high off the ring.
        floor_right: Likewise.
        arm_left: 1 while the switch is closed.
        arm_right: Likewise.
        distance_left: What the left eye really sees, in m; infinite for nothing.
        distance_right: Likewise.
    """

    def __init__(self, profile: JuniorProfile, body: Piece, ring: Ring, noise: np.random.Generator) -> None:
        self._profile = profile
        self._body = body
        self._noise = normals(noise)
        eye_x, eye_y = profile.eye_position
        self._eye_x, self._eye_y = eye_x, eye_y
        # The outer border of the left eye's cone, and its inner one; the right eye mirrors them.
        outer = profile.eye_angle + profile.eye_half_cone
        inner = profile.eye_angle - profile.eye_half_cone
        self._cone = (math.cos(outer), math.sin(outer), math.cos(inner), math.sin(inner))
        self._scale = (profile.eye_threshold - profile.eye_ambient) * (profile.eye_range + profile.eye_offset)
        self._floor_inside = (
            ring.width / 2 - math.hypot(*profile.floor_position) - profile.floor_spot,
            ring.height / 2 - math.hypot(*profile.floor_position) - profile.floor_spot,
        )
        self._ring = ring
        self.eye_left = self.eye_right = profile.eye_ambient
        self.floor_left = self.floor_right = profile.floor_on
        self.arm_left = self.arm_right = 0
        self.distance_left = self.distance_right = NOTHING

    def sample(self, other: Piece | None) -> None:
        """Take a reading of everything.

        Args:
            other: What stands on the table besides this robot.
        """
        profile = self._profile
        body = self._body
        noise = self._noise
        if other is None:
            self.distance_left = self.distance_right = NOTHING
            self.arm_left = self.arm_right = 0
        else:
            self._look(other)
        ambient = profile.eye_ambient + profile.eye_noise * next(noise)
        distance = self.distance_left
        count = ambient if distance == NOTHING else ambient + self._scale / (distance + profile.eye_offset)
        self.eye_left = 0 if count < 0.0 else ADC_MAX if count > ADC_MAX else int(count + 0.5)
        ambient = profile.eye_ambient + profile.eye_noise * next(noise)
        distance = self.distance_right
        count = ambient if distance == NOTHING else ambient + self._scale / (distance + profile.eye_offset)
        self.eye_right = 0 if count < 0.0 else ADC_MAX if count > ADC_MAX else int(count + 0.5)
        limit_x, limit_y = self._floor_inside
        if -limit_x < body.x < limit_x and -limit_y < body.y < limit_y:
            self.floor_left = int(profile.floor_on + profile.floor_noise * next(noise))
            self.floor_right = int(profile.floor_on + profile.floor_noise * next(noise))
        else:
            forward, side = profile.floor_position
            self.floor_left = self._floor(forward, side)
            self.floor_right = self._floor(forward, -side)

    def _floor(self, forward: float, side: float) -> int:
        """Reading of the floor sensor at a place of the robot's frame, in m."""
        body = self._body
        profile = self._profile
        x = body.x + forward * body.cos - side * body.sin
        y = body.y + forward * body.sin + side * body.cos
        share = max(0.0, min(1.0, 0.5 - self._ring.clearance(x, y) / profile.floor_spot))
        count = profile.floor_on + share * (profile.floor_off - profile.floor_on) + profile.floor_noise * next(self._noise)
        return max(0, min(ADC_MAX, int(count)))

    def _look(self, other: Piece) -> None:
        """Measure the other body: distances of the eyes, contacts of the arms."""
        profile = self._profile
        body = self._body
        outline = other.outline
        dx = body.x - other.x
        dy = body.y - other.y
        # This robot's place and heading in the other's frame.
        x = dx * other.cos + dy * other.sin
        y = dy * other.cos - dx * other.sin
        cos = body.cos * other.cos + body.sin * other.sin
        sin = body.sin * other.cos - body.cos * other.sin
        ahead = -(x * cos + y * sin)
        reach = outline.radius
        self.distance_left = self.distance_right = NOTHING
        if ahead < -reach:  # the other is wholly behind the axle: out of sight and of reach
            self.arm_left = self.arm_right = 0
            return
        outer_cos, outer_sin, inner_cos, inner_sin = self._cone
        eye_x = x + cos * self._eye_x
        eye_y = y + sin * self._eye_x
        farthest = profile.eye_reach + reach
        if eye_x * eye_x + eye_y * eye_y < farthest * farthest:
            side_x = -sin * self._eye_y
            side_y = cos * self._eye_y
            steepest = profile.eye_steepest
            outline_seen = outline.nearest_seen
            a, b, c, d = cos * outer_cos, sin * outer_sin, sin * outer_cos, cos * outer_sin
            e, f, g, h = cos * inner_cos, sin * inner_sin, sin * inner_cos, cos * inner_sin
            distance = outline_seen(eye_x + side_x, eye_y + side_y, (a - b, c + d, e - f, g + h), steepest)
            self.distance_left = distance if distance <= profile.eye_reach else NOTHING
            distance = outline_seen(eye_x - side_x, eye_y - side_y, (e + f, g - h, a + b, c - d), steepest)
            self.distance_right = distance if distance <= profile.eye_reach else NOTHING
        front = profile.front
        if ahead - reach > front + profile.arm_release:
            self.arm_left = self.arm_right = 0
            return
        near, far = profile.arm_span
        gap = outline.gap(x, y, cos, sin, (near, far)) - front
        self.arm_left = 1 if _DEEP < gap <= (profile.arm_release if self.arm_left else profile.arm_press) else 0
        gap = outline.gap(x, y, cos, sin, (-far, -near)) - front
        self.arm_right = 1 if _DEEP < gap <= (profile.arm_release if self.arm_right else profile.arm_press) else 0
