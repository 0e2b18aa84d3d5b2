"""What Junior's sensors measure, as the board's drivers would read it: ADC counts and switch contacts.

Everything above the drivers (thresholds, debounce, hysteresis of the eyes, tallies) is the firmware's business.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from simdevice.outline import NOTHING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from simdevice.arena import Piece
    from simdevice.junior.profile import JuniorProfile
    from simdevice.sumo.ring import SumoRing

ADC_MAX: Final = 1023
"""Greatest reading of a 10-bit converter."""
_DEEP: Final = -0.03
"""What seems further behind the front face than this, in m, is behind the robot and not at its arms."""
_BLOCK: Final = 1024
"""Readings drawn at a time."""
_STILL: Final = 2e-5
"""The eyes and arms are not measured anew before the other has moved by this, in m ..."""
_STEADY: Final = 2e-4
"""... or has turned by about this, in rad, as seen from the robot."""


class _Sight:
    """What was measured last of another piece.

    Attributes:
        seen_from: The robot's place in the frame of the other, in m, and its heading's cosine and sine there.
        distances: Of the left, right eye, in m; infinite where it does not see it.
        gaps: How far ahead of the axle it is in the strip of the left, right arm, in m; infinite where it is not.
    """

    __slots__ = ("distances", "gaps", "seen_from")

    def __init__(self) -> None:
        self.seen_from = (NOTHING, NOTHING, 0.0, 0.0)
        self.distances = self.gaps = (NOTHING, NOTHING)


def draw_noise(profile: JuniorProfile, generator: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A block of readings of an empty field and of the bare ring.

    Args:
        profile: Means and standard deviations.
        generator: Where the noise comes from.

    Returns:
        ADC counts, each of shape (2, readings) with the left sensor's first: eyes (not yet rounded), floor sensors.
    """
    eyes = profile.eye_ambient + profile.eye_noise * generator.standard_normal((2, _BLOCK))
    floor = profile.floor_on + profile.floor_noise * generator.standard_normal((2, _BLOCK))
    return eyes.clip(0, ADC_MAX), floor.clip(0, ADC_MAX).astype(np.int64)


def _readings(profile: JuniorProfile, generator: np.random.Generator) -> Iterator[tuple[float, float, int, int]]:
    """Those readings one by one, without end.

    Args:
        profile: Means and standard deviations.
        generator: Where the noise comes from.

    Yields:
        ADC counts: left eye, right eye (not yet rounded), left floor, right floor.
    """
    while True:
        eyes, floor = draw_noise(profile, generator)
        yield from zip(*eyes.tolist(), *floor.tolist(), strict=True)


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
        noise: Source of the converter's noise.
        cone: Borders of the left eye's field of view in the robot's frame: cosine and sine of the outer one's angle, of the
            inner one's.
        steepest: Tangent of the greatest angle between ray and surface normal that still reflects.
        scale: Counts times metres by which an eye's reading rises with 1 / (distance + offset).
        press: An arm's switch closes when something is this near to the axle, in m.
        release: It opens when nothing is nearer than this.
        behind: What is nearer than this is behind the robot, in m.
        floor_step: From a reading on the ring to one off it, in counts.
        floor_beyond_x: No floor sensor is off the ring while the robot's centre is within this of the ring's, in m.
        floor_beyond_y: Likewise.
    """

    def __init__(self, profile: JuniorProfile, body: Piece, ring: SumoRing, noise: np.random.Generator) -> None:
        self._body = body
        self._ring = ring
        self.noise = noise
        self.fit(profile)
        self._sights: list[_Sight] = []
        self.eye_left = self.eye_right = profile.eye_ambient
        self.floor_left = self.floor_right = profile.floor_on
        self.arm_left = self.arm_right = 0
        self.distance_left = self.distance_right = NOTHING

    def fit(self, profile: JuniorProfile) -> None:
        """Have other sensors, whose numbers these are."""
        self._profile = profile
        self._readings = _readings(profile, self.noise)
        eye_x, self._eye_y = profile.eye_position
        self._eye_x = eye_x
        # The outer border of the left eye's cone, and its inner one; the right eye mirrors them.
        outer = profile.eye_angle + profile.eye_half_cone
        inner = profile.eye_angle - profile.eye_half_cone
        self.cone = (math.cos(outer), math.sin(outer), math.cos(inner), math.sin(inner))
        self.steepest = math.tan(profile.eye_steepest)
        self._reach = profile.eye_reach
        self._offset = profile.eye_offset
        self.scale = (profile.eye_threshold - profile.eye_ambient) * (profile.eye_range + profile.eye_offset)
        self._arm_span = profile.arm_span
        self.press = profile.front + profile.arm_press
        self.release = profile.front + profile.arm_release
        self.behind = profile.front + _DEEP
        self._floor_place = profile.floor_position
        self._floor_spot = profile.floor_spot
        self.floor_step = profile.floor_off - profile.floor_on
        edge = math.hypot(*profile.floor_position) + profile.floor_spot
        self.floor_beyond_x = self._ring.width / 2 - edge
        self.floor_beyond_y = self._ring.height / 2 - edge

    def begin(self, noise: np.random.Generator) -> None:
        """Begin a bout: arms open, and noise that follows from the bout's own seed.

        Args:
            noise: Source of the converter's noise from now on.
        """
        self.noise = noise
        self._readings = _readings(self._profile, noise)
        self._forget()

    def _forget(self) -> None:
        """Nothing is seen and nothing touched."""
        self._sights = []
        self.arm_left = self.arm_right = 0
        self.distance_left = self.distance_right = NOTHING

    def sample(self, others: Sequence[Piece]) -> None:
        """Take a reading of everything.

        Args:
            others: What stands on the table besides this robot, each time in the same order; nothing: what was seen is
                forgotten.
        """
        body = self._body
        if others:
            self._look(others)
        else:
            self._forget()
        left, right, floor_left, floor_right = next(self._readings)
        distance = self.distance_left
        if distance < NOTHING:
            left += self.scale / (distance + self._offset)
        self.eye_left = int(left) if left < ADC_MAX else ADC_MAX
        distance = self.distance_right
        if distance < NOTHING:
            right += self.scale / (distance + self._offset)
        self.eye_right = int(right) if right < ADC_MAX else ADC_MAX
        if abs(body.x) > self.floor_beyond_x or abs(body.y) > self.floor_beyond_y:
            forward, side = self._floor_place
            floor_left = self._floor(floor_left, forward, side)
            floor_right = self._floor(floor_right, forward, -side)
        self.floor_left = floor_left
        self.floor_right = floor_right

    def _floor(self, count: int, forward: float, side: float) -> int:
        """Reading of the floor sensor at a place of the robot's frame, in m, from its reading on the ring."""
        body = self._body
        x = body.x + forward * body.cos - side * body.sin
        y = body.y + forward * body.sin + side * body.cos
        share = max(0.0, min(1.0, 0.5 - self._ring.clearance(x, y) / self._floor_spot))
        return min(ADC_MAX, int(count + share * self.floor_step))

    def _look(self, others: Sequence[Piece]) -> None:
        """Measure the other bodies: distances of the eyes, contacts of the arms."""
        sights = self._sights
        while len(sights) < len(others):
            sights.append(_Sight())
        changed = False
        for other, sight in zip(others, sights, strict=True):
            changed |= self._measure(other, sight)
        if not changed:
            return
        self.distance_left = min([sight.distances[0] for sight in sights])
        self.distance_right = min([sight.distances[1] for sight in sights])
        left, right = self.release if self.arm_left else self.press, self.release if self.arm_right else self.press
        self.arm_left = int(any(self.behind < sight.gaps[0] <= left for sight in sights))
        self.arm_right = int(any(self.behind < sight.gaps[1] <= right for sight in sights))

    def _measure(self, other: Piece, sight: _Sight) -> bool:
        """Measure another body.

        Returns:
            False where it is as it was: at rest, or pushing.
        """
        body = self._body
        dx = body.x - other.x
        dy = body.y - other.y
        turn_cos = other.cos
        turn_sin = other.sin
        # This robot's place and heading in the other's frame.
        x = dx * turn_cos + dy * turn_sin
        y = dy * turn_cos - dx * turn_sin
        cos = body.cos * turn_cos + body.sin * turn_sin
        sin = body.sin * turn_cos - body.cos * turn_sin
        last_x, last_y, last_cos, last_sin = sight.seen_from
        if (
            -_STILL < x - last_x < _STILL
            and -_STILL < y - last_y < _STILL
            and -_STEADY < cos - last_cos < _STEADY
            and -_STEADY < sin - last_sin < _STEADY
        ):
            return False
        sight.seen_from = (x, y, cos, sin)
        outline = other.outline
        reach = outline.radius
        ahead = -(x * cos + y * sin)
        sight.distances = sight.gaps = (NOTHING, NOTHING)
        if ahead < -reach:  # the other is wholly behind the axle: out of sight and of reach
            return True
        eye_x = x + cos * self._eye_x
        eye_y = y + sin * self._eye_x
        farthest = self._reach + reach
        if eye_x * eye_x + eye_y * eye_y < farthest * farthest:
            outer_cos, outer_sin, inner_cos, inner_sin = self.cone
            side_x = -sin * self._eye_y
            side_y = cos * self._eye_y
            seen = outline.nearest_seen
            a, b, c, d = cos * outer_cos, sin * outer_sin, sin * outer_cos, cos * outer_sin
            e, f, g, h = cos * inner_cos, sin * inner_sin, sin * inner_cos, cos * inner_sin
            left = seen(eye_x + side_x, eye_y + side_y, (a - b, c + d, e - f, g + h), self.steepest)
            right = seen(eye_x - side_x, eye_y - side_y, (e + f, g - h, a + b, c - d), self.steepest)
            sight.distances = (
                left if left <= self._reach else NOTHING,
                right if right <= self._reach else NOTHING,
            )
        if ahead - reach <= self.release:
            sight.gaps = outline.gaps(x, y, cos, sin, self._arm_span)
        return True
