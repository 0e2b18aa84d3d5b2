"""The ring and what stands on it: a pymunk world seen from above, without gravity.

Frame: x right, y up, origin at the centre of the ring, angles counter-clockwise. The ring measures 65 cm along x and
42 cm along y. The table around it is larger and has a rim, so that nobody is lost.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import pymunk

from simdevice.junior.profile import JUNIOR_OUTLINE
from simdevice.quantities import GRAVITY
from simdevice.sumo.ring import SumoRing

if TYPE_CHECKING:
    from simdevice.junior.motors import Motors
    from simdevice.junior.profile import JuniorProfile
    from simdevice.outline import Outline
    from simdevice.sumo.opponents import OpponentSpec

CONTROL_PERIOD: Final = 0.005
"""Control period, firmware tick and step of the physics, where nobody asks for another one, in s."""
_ITERATIONS: Final = 10
_SLOP: Final = 2e-4
"""Overlap that the solver tolerates between bodies, in m."""
_FAR: Final = 10.0
"""Half length of the groove that stands for the wheels' axle line, in m: never reached."""
_HOLD: Final = 0.001
"""The point of the ground that holds the axle sideways follows it within this, in m."""
_WEAK: Final = 1e-6
"""A push below this is none, in N."""
_MOVING: Final = 0.002
"""A dummy that moves faster than this slides, in m/s: kinetic friction holds."""


class Piece:
    """A body in the arena, with its pose at hand.

    Args:
        outline: Its shape.
        mass: In kg.
        friction: Coefficient with Junior's body.

    Attributes:
        x: Position of the centre of mass in m, as of the last step.
        y: Likewise.
        angle: Heading in rad, not wrapped.
        cos: Of the heading.
        sin: Of the heading.
        period: Step of the physics that it is in, in s; 0 while it is in none.
    """

    def __init__(self, outline: Outline, mass: float, friction: float) -> None:
        self.outline = outline
        vertices = list(outline.vertices)
        self.body = pymunk.Body(mass, pymunk.moment_for_poly(mass, vertices))
        self.shape = pymunk.Poly(self.body, vertices)
        # pymunk multiplies the friction of the two shapes.
        self.shape.friction = math.sqrt(friction)
        self.x = self.y = self.angle = 0.0
        self.cos, self.sin = 1.0, 0.0
        self.period = 0.0

    def place(self, x: float, y: float, angle: float) -> None:
        """Put it down, at rest; position in m, heading in rad."""
        pymunk.Body.update_position(self.body, 0.0)  # forgets how the solver was about to part it from what it touched
        self.body.position = (x, y)
        self.body.angle = angle
        self.body.velocity = (0.0, 0.0)
        self.body.angular_velocity = 0.0
        self.refresh()

    def refresh(self) -> None:
        """Read the pose back from the physics."""
        self.x, self.y = self.body.position
        angle = self.body.angle
        if angle != self.angle:
            self.angle = angle
            self.cos = math.cos(angle)
            self.sin = math.sin(angle)

    def join(self, space: pymunk.Space, period: float) -> None:
        """Enter the physics, whose steps have this length in s."""
        self.period = period
        space.add(self.body, self.shape)

    def drive(self) -> None:
        """Apply what moves it, before a step."""

    def weigh(self, mass: float) -> None:
        """Have another mass, in kg, spread as before."""
        self.body.mass, self.body.moment = mass, pymunk.moment_for_poly(mass, list(self.outline.vertices))

    def leave(self, space: pymunk.Space) -> None:
        """Leave the physics."""
        space.remove(self.shape, self.body)


class Dummy(Piece):
    """An opponent that only resists: dry friction holds it, more while at rest than while sliding.

    Args:
        spec: What it is made of.
        friction: Coefficient with Junior's body.

    Attributes:
        spec: What it is made of.
        still: Greatest force in N and torque in N m of its friction at rest.
        kinetic: Those of its friction while it slides.
        moving: Square of the way in a step from which on it slides, in m^2.
        sliding: It slides.
        slide: The joint that holds it in place; None while it is not in the arena.
        turn: The joint that holds its heading; likewise.
    """

    def __init__(self, spec: OpponentSpec, friction: float) -> None:
        super().__init__(spec.outline, spec.mass, friction)
        self.spec = spec
        weight = spec.mass * GRAVITY
        self.still = (spec.static * weight, spec.static * weight * spec.grip)
        self.kinetic = (spec.kinetic * weight, spec.kinetic * weight * spec.grip)
        self.slide: pymunk.PivotJoint | None = None
        self.turn: pymunk.GearJoint | None = None
        self.sliding = False
        self.moving = 0.0

    def join(self, space: pymunk.Space, period: float) -> None:
        """Enter the physics, whose steps have this length in s, held by friction joints to the ground."""
        super().join(space, period)
        self.moving = (_MOVING * period) ** 2
        self.slide = pymunk.PivotJoint(space.static_body, self.body, (0.0, 0.0), (0.0, 0.0))
        self.turn = pymunk.GearJoint(space.static_body, self.body, 0.0, 1.0)
        for joint in (self.slide, self.turn):
            joint.max_bias = 0.0  # friction resists motion and never pulls back
            space.add(joint)
        self._switch(sliding=False)

    def leave(self, space: pymunk.Space) -> None:
        """Leave the physics, joints and all."""
        if self.slide is not None and self.turn is not None:
            space.remove(self.slide, self.turn)
        super().leave(space)

    def place(self, x: float, y: float, angle: float) -> None:
        """Put it down, at rest; position in m, heading in rad."""
        super().place(x, y, angle)
        if self.slide is not None:
            self._switch(sliding=False)

    def _switch(self, *, sliding: bool) -> None:
        """Choose static or kinetic friction."""
        self.sliding = sliding
        if self.slide is not None and self.turn is not None:
            self.slide.max_force, self.turn.max_force = self.kinetic if sliding else self.still

    def refresh(self) -> None:
        """Read the pose back, and see by the way made whether it slides."""
        x, y = self.body.position
        angle = self.body.angle
        turn = angle - self.angle
        grip = self.spec.grip
        way_x = x - self.x
        way_y = y - self.y
        square = way_x * way_x + way_y * way_y + turn * turn * grip * grip
        self.x = x
        self.y = y
        if turn:
            self.angle = angle
            self.cos = math.cos(angle)
            self.sin = math.sin(angle)
        if (square > self.moving) is not self.sliding:
            self._switch(sliding=not self.sliding)


class Rover(Piece):
    """Junior's body: two driven wheels on one axle through the centre.

    Lengthwise each tyre pushes with what its motor gives, up to its friction. Sideways the axle is held by a groove joint
    whose greatest force is the tyres' friction: it lets the body move along its heading only, until pushed harder.

    Args:
        profile: The device's numbers.
        motors: What turns the wheels.

    Attributes:
        motors: What turns the wheels.
        ground: Way of the centre along its heading since power-on, in m.
        axle: The joint that holds the axle sideways; None while it is not in the arena.
        last: x, y in m and heading in rad one step ago.
        held: The point of the ground that the axle is held at, in m.
    """

    def __init__(self, profile: JuniorProfile, motors: Motors) -> None:
        super().__init__(JUNIOR_OUTLINE, profile.mass, profile.body_friction)
        self.motors = motors
        self.ground = 0.0
        self._rate = 0.0
        self.axle: pymunk.GrooveJoint | None = None
        self.last = (0.0, 0.0, 0.0)
        self.held = (0.0, 0.0)
        self.fit(profile)

    def fit(self, profile: JuniorProfile) -> None:
        """Have another mass and other wheels, from when it enters the physics the next time."""
        self.weigh(profile.mass)
        self._half = profile.track / 2
        self._sideways = 2 * profile.tyre_limit

    def place(self, x: float, y: float, angle: float) -> None:
        """Put it down, at rest; position in m, heading in rad."""
        super().place(x, y, angle)
        self.last = (self.x, self.y, self.angle)

    def join(self, space: pymunk.Space, period: float) -> None:
        """Enter the physics, whose steps have this length in s, on its wheels."""
        super().join(space, period)
        self._rate = 1 / period
        self.axle = pymunk.GrooveJoint(self.body, space.static_body, (-_FAR, 0.0), (_FAR, 0.0), (self.x, self.y))
        self.held = (self.x, self.y)
        self.axle.max_bias = 0.0
        self.axle.max_force = self._sideways
        space.add(self.axle)

    def leave(self, space: pymunk.Space) -> None:
        """Leave the physics, joint and all."""
        if self.axle is not None:
            space.remove(self.axle)
        super().leave(space)

    def drive(self) -> None:
        """Let the motors push for one period."""
        cos = self.cos
        sin = self.sin
        x = self.x
        y = self.y
        # Where it has come since the last step tells its speed, for less than asking the physics. It is the speed of one
        # period ago: the current in a motor's winding lags about as much.
        last_x, last_y, last_angle = self.last
        ahead = (x - last_x) * cos + (y - last_y) * sin
        lead = (self.angle - last_angle) * self._half
        self.last = (x, y, self.angle)
        self.ground += ahead
        motors = self.motors
        motors.turn((ahead - lead) * self._rate, (ahead + lead) * self._rate, self.period)
        left = motors.force_left
        right = motors.force_right
        push = left + right
        if -_WEAK < push < _WEAK:
            self.body.torque = (right - left) * self._half
        else:  # one force off the middle line is both push and torque
            self.body.apply_force_at_local_point((push, 0.0), (0.0, (left - right) * self._half / push))
        held_x, held_y = self.held
        if not (-_HOLD < x - held_x < _HOLD and -_HOLD < y - held_y < _HOLD) and self.axle is not None:
            self.held = self.axle.anchor_b = (x, y)


class Arena:
    """The physics of everything on the table.

    Args:
        ring: The ring.
        period: Step of the physics, in s.

    Attributes:
        ring: The ring.
        period: Step of the physics, in s.
        pieces: Everything in it, in the order of entry.
    """

    def __init__(self, ring: SumoRing | None = None, period: float = CONTROL_PERIOD) -> None:
        self.period = period
        self.ring = ring if ring is not None else SumoRing()
        self.pieces: list[Piece] = []
        self.space = self._empty()

    def _empty(self) -> pymunk.Space:
        """A table with nothing on it but the walls around."""
        space = pymunk.Space()
        space.iterations = _ITERATIONS
        space.collision_slop = _SLOP
        x = self.ring.width / 2 + self.ring.rim
        y = self.ring.height / 2 + self.ring.rim
        corners = [(-x, -y), (x, -y), (x, y), (-x, y)]
        walls = [pymunk.Segment(space.static_body, corners[i - 1], corners[i], 0.01) for i in range(4)]
        for wall in walls:
            wall.friction = 1.0
        space.add(*walls)
        return space

    def clear_memory(self) -> None:
        """Begin with a physics that remembers nothing: solvers start from the impulses and contacts of the step before."""
        for piece in self.pieces:
            piece.leave(self.space)
        self.space = self._empty()
        for piece in self.pieces:
            piece.join(self.space, self.period)

    def add(self, piece: Piece) -> None:
        """Put a piece on the table."""
        piece.join(self.space, self.period)
        self.pieces.append(piece)

    def others(self, piece: Piece) -> tuple[Piece, ...]:
        """Everything in it but this piece, in the order of entry."""
        return tuple(other for other in self.pieces if other is not piece)

    def remove(self, piece: Piece) -> None:
        """Take a piece away."""
        piece.leave(self.space)
        self.pieces.remove(piece)

    def step(self) -> None:
        """Advance by one period: motors push, bodies move, friction takes note."""
        pieces = self.pieces
        for piece in pieces:
            piece.drive()
        self.space.step(self.period)
        for piece in pieces:
            piece.refresh()
