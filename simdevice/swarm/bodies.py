"""What stands on a table of micro-robots, as bodies of pymunk: robots, a box, walls."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import pymunk

from simdevice.quantities import GRAVITY

if TYPE_CHECKING:
    from collections.abc import Iterable

    from simdevice.swarm.profile import MicroProfile

Point = tuple[float, float]
"""x, y, in m."""
Segment = tuple[float, float, float, float]
"""x, y of one end and x, y of the other, in m."""
ITERATIONS: Final = 5
SLOP: Final = 2e-4
"""Overlap that the solver tolerates between bodies, in m."""
_SOLID: Final = pymunk.ShapeFilter()
_NOBODY: Final = pymunk.ShapeFilter(mask=0)
CUBE_LEVER: Final = 0.383
"""Mean distance of a square's points from its middle, as a share of its side."""


class Bodies:
    """The physics of a table; the bodies are added in the order of their rows, and nothing remembers what was there before.

    Args:
        profile: The numbers of the robots and the box.
        places: Where each robot stands, x and y in m; who enters the physics elsewhere and is then put in its place costs much.
        walls: Segments that nobody gets through.
        box: There is no box, or of which form it is: None, "cylinder" or "cube".

    Attributes:
        space: All of it.
        robots: The robots' bodies by row.
        box: The box's body, or None.
    """

    def __init__(self, profile: MicroProfile, places: Iterable[Point], walls: Iterable[Segment], box: str | None) -> None:
        self.space = pymunk.Space()
        self.space.iterations = ITERATIONS
        self.space.collision_slop = SLOP
        self._friction = math.sqrt(profile.body_friction)  # pymunk multiplies the friction of the two shapes
        for x, y, to_x, to_y in walls:
            wall = pymunk.Segment(self.space.static_body, (x, y), (to_x, to_y), 0.0)
            wall.friction = self._friction
            self.space.add(wall)
        self.robots = [self._robot(profile, place) for place in places]
        self.box = None if box is None else self._box(profile, box)

    def enter_anew(self) -> None:
        """Take all robots out and let them enter, solid, in the order of their rows.

        Chipmunk solves contacts in an order that comes from how everybody got where he is: that is forgotten.
        """
        shapes = [shape for body in self.robots for shape in body.shapes]
        self.space.remove(*shapes)
        for shape in shapes:
            shape.filter = _SOLID
        self.space.add(*shapes)

    def _robot(self, profile: MicroProfile, place: Point) -> pymunk.Body:
        body = pymunk.Body(profile.mass, pymunk.moment_for_circle(profile.mass, 0.0, profile.radius))
        body.position = place
        shape = pymunk.Circle(body, profile.radius)
        shape.friction = self._friction
        self.space.add(body, shape)
        return body

    def _box(self, profile: MicroProfile, form: str) -> pymunk.Body:
        """A box that dry friction holds to the ground, in its place and in its heading."""
        mass, half = profile.box_mass, profile.box_half
        shape: pymunk.Shape
        if form == "cylinder":
            body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0.0, half))
            shape, lever = pymunk.Circle(body, half), 2 / 3 * half
        else:
            body = pymunk.Body(mass, pymunk.moment_for_box(mass, (2 * half, 2 * half)))
            shape, lever = pymunk.Poly.create_box(body, (2 * half, 2 * half)), CUBE_LEVER * 2 * half
        shape.friction = profile.box_friction / self._friction if self._friction else 0.0
        slide = pymunk.PivotJoint(self.space.static_body, body, (0.0, 0.0), (0.0, 0.0))
        turn = pymunk.GearJoint(self.space.static_body, body, 0.0, 1.0)
        slide.max_force = profile.box_ground_friction * mass * GRAVITY
        turn.max_force = slide.max_force * lever
        slide.max_bias = turn.max_bias = 0.0  # friction resists motion and never pulls back
        self.space.add(body, shape, slide, turn)
        return body


def make_way(body: pymunk.Body, *, gives_way: bool) -> None:
    """Have a robot be in nobody's way, or be solid again.

    Args:
        body: Of the robot.
        gives_way: Nothing touches it.
    """
    for shape in body.shapes:
        shape.filter = _NOBODY if gives_way else _SOLID


def put(body: pymunk.Body, x: float, y: float, heading: float) -> None:
    """Pick a body up and put it down, at rest.

    Args:
        body: Of a robot or of the box.
        x: In m.
        y: In m.
        heading: In rad.
    """
    pymunk.Body.update_position(body, 0.0)  # forgets how the solver was about to part it from what it touched
    body.position = (x, y)
    body.angle = heading
    body.velocity = (0.0, 0.0)
    body.angular_velocity = 0.0
    body.force = (0.0, 0.0)
    body.torque = 0.0
