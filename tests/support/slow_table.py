"""A slow table of micro-robots: pymunk's ordinary calls and numpy, everybody looked at by everybody, as the kernel's oracle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pymunk

from simdevice.swarm.bodies import ITERATIONS, SLOP

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from simdevice.swarm.profile import MicroProfile

STANDING = 1e-7
SLIP, FIX, RANGE, BOX, GOAL = range(5)


class SlowTable:
    """A table with everything on it.

    Args:
        groups: Class of each robot.
        profile: Numbers of the robots and the box.
        seed: Of the noise.
        period: In s.
        walls: Segments.
        box: None, "cylinder" or "cube".
        occlusion: Who stands behind something is not seen.
    """

    def __init__(
        self,
        groups: Sequence[int],
        profile: MicroProfile,
        *,
        seed: int,
        period: float,
        walls: Sequence[tuple[float, float, float, float]],
        box: str | None,
        occlusion: bool,
    ) -> None:
        count = len(groups)
        self.groups, self.profile, self.period, self.walls, self.occlusion = np.array(groups), profile, period, walls, occlusion
        self.form = box
        self.space = pymunk.Space()
        self.space.iterations, self.space.collision_slop = ITERATIONS, SLOP
        grip = math.sqrt(profile.body_friction)
        for x, y, to_x, to_y in walls:
            wall = pymunk.Segment(self.space.static_body, (x, y), (to_x, to_y), 0.0)
            wall.friction = grip
            self.space.add(wall)
        self.bodies = []
        for _ in range(count):
            body = pymunk.Body(profile.mass, profile.mass * profile.radius**2 / 2)
            shape = pymunk.Circle(body, profile.radius)
            shape.friction = grip
            self.space.add(body, shape)
            self.bodies.append(body)
        self.box = self._box(box) if box is not None else None
        self.goal: tuple[float, float] | None = None
        self.streams = {
            (row, kind): np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(row, kind))))
            for row in range(count)
            for kind in range(5)
        }
        self.command = [[0.0, 0.0] for _ in range(count)]
        self.rim = [[0.0, 0.0] for _ in range(count)]
        self.gain = [[1.0, 1.0] for _ in range(count)]
        self.travel = [[0.0, 0.0] for _ in range(count)]
        self.effort = [1.0] * count
        self.gap = [0.002] * count
        self.way = [(1.0, 1.0, 0.0)] * count
        self.rolling = [False] * count
        self.fix: list[tuple[float, float, float] | None] = [None] * count
        self.fix_age = [0] * count
        self.lost = [0] * count
        self.periods = 0

    def _box(self, form: str) -> pymunk.Body:
        mass, half = self.profile.box_mass, self.profile.box_half
        shape: pymunk.Shape
        if form == "cylinder":
            body = pymunk.Body(mass, mass * half**2 / 2)
            shape, lever = pymunk.Circle(body, half), 2 / 3 * half
        else:
            body = pymunk.Body(mass, pymunk.moment_for_box(mass, (2 * half, 2 * half)))
            shape, lever = pymunk.Poly.create_box(body, (2 * half, 2 * half)), 0.383 * 2 * half
        shape.friction = self.profile.box_friction / math.sqrt(self.profile.body_friction)
        slide = pymunk.PivotJoint(self.space.static_body, body, (0.0, 0.0), (0.0, 0.0))
        turn = pymunk.GearJoint(self.space.static_body, body, 0.0, 1.0)
        slide.max_force = self.profile.box_ground_friction * mass * 9.81
        turn.max_force = slide.max_force * lever
        slide.max_bias = turn.max_bias = 0.0
        self.space.add(body, shape, slide, turn)
        return body

    def draw(self, row: int, kind: int, count: int) -> list[float]:
        return [float(self.streams[row, kind].standard_normal()) for _ in range(count)]

    def place(self, row: int, x: float, y: float, heading: float) -> None:
        self.put(self.bodies[row], x, y, heading)
        self.command[row], self.rim[row], self.rolling[row] = [0.0, 0.0], [0.0, 0.0], False

    @staticmethod
    def put(body: pymunk.Body, x: float, y: float, heading: float) -> None:
        pymunk.Body.update_position(body, 0.0)
        body.position, body.angle, body.velocity, body.angular_velocity = (x, y), heading, (0.0, 0.0), 0.0
        body.force, body.torque = (0.0, 0.0), 0.0

    # physics

    def step(self) -> None:
        """One control period: fixes, wheels, bodies."""
        profile = self.profile
        self.fix_age = [age + 1 for age in self.fix_age]
        if self.periods % round(profile.fix_interval / self.period) == 0:
            for row in range(len(self.bodies)):
                self._fix(row)
        for row in range(len(self.bodies)):
            self._drive(row)
        self.space.step(self.period)
        self.periods += 1

    def _fix(self, row: int) -> None:
        profile, body = self.profile, self.bodies[row]
        a, b, c, d = self.draw(row, FIX, 4)
        begins = 0.5 * math.erfc(-d / math.sqrt(2)) < 1 - (1 - profile.dropout) ** profile.fix_interval
        if self.lost[row]:
            self.lost[row] -= 1
        elif begins:
            self.lost[row] = round(profile.dropout_time / profile.fix_interval) - 1
        else:
            heading = math.remainder(body.angle + profile.fix_angle_sd * c, math.tau)
            self.fix[row] = (body.position.x + profile.fix_sd * a, body.position.y + profile.fix_sd * b, heading)
            self.fix_age[row] = 0

    def _drive(self, row: int) -> None:
        profile, body, rim = self.profile, self.bodies[row], self.rim[row]
        rolling = any(self.command[row])
        if rolling and not self.rolling[row]:
            slip, drift = self.draw(row, SLIP, 2)
            drift *= profile.drift_sd
            self.way[row] = (1.0 + profile.slip_sd * slip, math.cos(drift), math.sin(drift))
        self.rolling[row] = rolling
        for side in range(2):
            wanted = self.command[row][side] * self.gain[row][side]
            rim[side] += (wanted - rim[side]) * -math.expm1(-self.period / profile.lag)
            if wanted == 0.0 and abs(rim[side]) < STANDING:
                rim[side] = 0.0
            self.travel[row][side] += rim[side] * self.period
        slip, way_cos, way_sin = self.way[row]
        ahead = slip * (rim[0] + rim[1]) * 0.5
        lead = slip * (rim[1] - rim[0]) / profile.track
        c, s = body.rotation_vector
        velocity = body.velocity
        thrust = ahead * way_cos - (velocity.x * c + velocity.y * s)
        side_force = ahead * way_sin - (velocity.y * c - velocity.x * s)
        torque = lead - body.angular_velocity
        if max(abs(thrust), abs(side_force), abs(torque)) < STANDING:
            return
        thrust *= profile.mass / self.period
        side_force *= profile.mass / self.period
        torque *= profile.mass * profile.radius**2 / 2 / self.period
        most = profile.traction * self.effort[row]
        thrust = min(most, max(-most, thrust))
        square = thrust * thrust + side_force * side_force
        if square > profile.traction * profile.traction:
            share = profile.traction / math.sqrt(square)
            thrust *= share
            side_force *= share
        most = profile.traction * profile.track / 2
        body.force = (thrust * c - side_force * s, thrust * s + side_force * c)
        body.torque = min(most, max(-most, torque))

    # sensing

    def poses(self) -> NDArray[np.float64]:
        """x, y, heading; shape (count, 3)."""
        return np.array([(*body.position, body.angle) for body in self.bodies])

    def _in_frame(self, row: int, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points in a robot's frame."""
        x, y, heading = self.poses()[row]
        c, s = math.cos(heading), math.sin(heading)
        moved: NDArray[np.float64] = (points - (x, y)) @ np.array([[c, -s], [s, c]])
        return moved

    def bumps(self) -> tuple[list[int], list[bool]]:
        """Contacts of the 8 sectors, and who touches the box."""
        bits, touches = [], []
        poses = self.poses()
        for row, (x, y, _) in enumerate(poses):
            points = [pose[:2] for other, pose in enumerate(poses) if other != row]
            edges = [self.profile.radius] * len(points)
            points += [_on_segment(wall, x, y) for wall in self.walls]
            touch = False
            if self.box is not None:
                nearest, gap = self._on_box(x, y)
                touch = gap < self.profile.radius + self.gap[row]
            edges += [0.0] * (len(points) - len(edges))
            value = 0
            for point, edge in zip(points, edges, strict=True):
                if np.hypot(*(point - (x, y))) < self.profile.radius + edge + self.gap[row]:
                    value |= self._bumper(row, point)
            if touch:
                value |= self._bumper(row, nearest)
            bits.append(value)
            touches.append(touch)
        return bits, touches

    def _bumper(self, row: int, point: NDArray[np.float64]) -> int:
        """The bit of the sector that a point lies in."""
        ahead, left = self._in_frame(row, np.array([point]))[0]
        return 0x80 >> math.floor(math.atan2(left, ahead) % math.tau / (math.pi / 4)) % 8

    def _on_box(self, x: float, y: float) -> tuple[NDArray[np.float64], float]:
        """The point of the box's outline that is nearest, and how far it is; negative inside."""
        assert self.box is not None
        middle, half = np.array(self.box.position), self.profile.box_half
        away = np.array([x, y]) - middle
        distance = float(np.hypot(*away))
        if self.form == "cylinder":
            return middle + away * half / distance, distance - half
        faces = [_on_segment(side, x, y) for side in self._sides()]
        gaps = [float(np.hypot(*(face - (x, y)))) for face in faces]
        nearest = int(np.argmin(gaps))
        inside = max(abs(np.array(self.box.world_to_local((x, y))))) < half
        return faces[nearest], -gaps[nearest] if inside else gaps[nearest]

    def _sides(self) -> list[tuple[float, float, float, float]]:
        """The sides of a cube."""
        assert self.box is not None
        half = self.profile.box_half
        places = ((-half, -half), (half, -half), (half, half), (-half, half))
        corners = [self.box.local_to_world(place) for place in places]
        return [(*corners[i - 1], *corners[i]) for i in range(4)]

    def _outlines(self, row: int) -> tuple[list[tuple[float, float, float]], list[tuple[float, float, float, float]]]:
        """All discs but a robot's own, those of the other robots first, and all segments: walls and the sides of a cube."""
        discs = [(x, y, self.profile.radius) for x, y, _ in self.poses()]
        x, y, _ = discs.pop(row)
        segments = list(self.walls)
        half = self.profile.box_half
        if self.box is not None and self.form == "cylinder":
            discs.append((*self.box.position, half))
        elif self.box is not None:
            segments += self._sides()
            if max(abs(np.array(self.box.world_to_local((x, y))))) <= half:
                discs.append((x, y, half))  # within it, it begins at once
        return discs, segments

    def ranges(self, row: int, directions: int, farthest: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Distances to what is hit, and where it is a robot."""
        x, y, heading = self.poses()[row]
        discs, segments = self._outlines(row)
        noise = np.array(self.draw(row, RANGE, 2 * directions)).reshape(-1, 2)
        found, robots = np.full(directions, math.inf), np.zeros(directions, bool)
        for ray in range(directions):
            bearing = heading + ray * math.tau / directions
            ways = [_to_disc((x, y), bearing, disc) for disc in discs] + [_to_wall((x, y), bearing, wall) for wall in segments]
            nearest = min(ways, default=math.inf)
            if nearest <= farthest:
                factor = 1 + self.profile.range_share_sd * noise[ray, 0]
                found[ray] = max(0.0, nearest * factor + self.profile.range_sd * noise[ray, 1])
                robots[ray] = ways.index(nearest) < len(self.bodies) - 1
        return found, robots

    def ring(self, row: int, radius: float, step: float, limit: float) -> tuple[list[int], list[float], list[float]]:
        """Rows, bearings and distances of the robots around."""
        poses = self.poses()
        inside = self._in_frame(row, poses[:, :2])
        distance, bearing = np.hypot(*inside.T), np.arctan2(inside[:, 1], inside[:, 0])
        others = distance[self.groups != self.groups[row]]
        if step and not (others < radius - 2e-6).any():
            radius = max(radius, min(limit, others.min(initial=math.inf) + step + 2e-6))
        rows = [other for other in range(len(poses)) if other != row and distance[other] < radius]
        if self.occlusion:
            rows = [other for other in rows if not self._hidden(row, other, float(distance[other]))]
        return rows, bearing[rows].tolist(), distance[rows].tolist()

    def _hidden(self, row: int, other: int, distance: float) -> bool:
        poses = self.poses()
        x, y = poses[row, :2]
        bearing = math.atan2(poses[other, 1] - y, poses[other, 0] - x)
        discs, segments = self._outlines(row)
        robots = len(self.bodies) - 1
        rest = discs[robots:]
        del discs[robots:], discs[other - (other > row)]
        nearer = [disc for disc in discs if math.hypot(disc[0] - x, disc[1] - y) < distance]
        return any(_to_disc((x, y), bearing, disc) < distance for disc in nearer + rest) or any(
            _to_wall((x, y), bearing, wall) < distance for wall in segments
        )

    def box_bearing(self, row: int) -> tuple[float, float]:
        assert self.box is not None
        a, b = self.draw(row, BOX, 2)
        x, y, _ = self.poses()[row]
        bearing = self._bearing(row, self.box.position) + self.profile.box_bearing_sd * a
        return math.remainder(bearing, math.tau), max(0.0, self._on_box(x, y)[1] + self.profile.box_distance_sd * b)

    def goal_bearing(self, row: int) -> float:
        assert self.goal is not None
        (a,) = self.draw(row, GOAL, 1)
        return math.remainder(self._bearing(row, self.goal) + self.profile.goal_bearing_sd * a, math.tau)

    def _bearing(self, row: int, point: tuple[float, float]) -> float:
        ahead, left = self._in_frame(row, np.array([point]))[0]
        return math.atan2(left, ahead)


def _on_segment(wall: tuple[float, float, float, float], x: float, y: float) -> NDArray[np.float64]:
    end, along = np.array(wall[:2]), np.array(wall[2:]) - wall[:2]
    share = float(np.clip((np.array([x, y]) - end) @ along / (along @ along), 0.0, 1.0))
    point: NDArray[np.float64] = end + share * along
    return point


def _to_disc(place: tuple[float, float], bearing: float, disc: tuple[float, float, float]) -> float:
    """Way along a ray until it meets a disc: the least root of a quadratic equation that is not behind."""
    dx, dy = disc[0] - place[0], disc[1] - place[1]
    roots = np.roots([1.0, -2 * (dx * math.cos(bearing) + dy * math.sin(bearing)), dx * dx + dy * dy - disc[2] ** 2])
    if np.iscomplex(roots).any() or roots.real.max() < 0:
        return math.inf
    return max(0.0, float(roots.real.min()))


def _to_wall(place: tuple[float, float], bearing: float, wall: tuple[float, float, float, float]) -> float:
    """Likewise until it meets a segment: two linear equations."""
    ray = np.array([math.cos(bearing), math.sin(bearing)])
    end, along = np.array(wall[:2]), np.array(wall[2:]) - wall[:2]
    equations = np.stack((ray, -along), axis=1)
    if abs(np.linalg.det(equations)) < 1e-14:
        return math.inf
    way, share = np.linalg.solve(equations, end - place)
    return float(way) if way >= 0 and 0 <= share <= 1 else math.inf
