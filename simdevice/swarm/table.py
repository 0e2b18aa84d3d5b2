"""A table of micro-robots without their firmware: what stands on it, how it is placed, and how it moves and is sensed.

Everything of a control period runs in the kernel, for all robots at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING, Final

import numpy as np

from simdevice.boards import board_host
from simdevice.kernel.table import MOST_GAP, TableArrays
from simdevice.swarm.bodies import Bodies, Segment, put
from simdevice.swarm.noise import Noise
from simdevice.swarm.places import free_places
from simdevice.swarm.profile import MicroProfile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from simdevice.swarm.rooms import Room

PERIODS: Final = (0.005, 0.01)
"""Control periods that a table may have, in s."""
NEVER: Final = 2**32 - 1
"""Age of a position fix that has never come, in control periods."""
_SIZES: Final = (64, 256, 1024, 64, 64)
"""Deviates in a block of noise, by kind: slip, fix, range, box, goal."""
_BOXES: Final = (None, "cylinder", "cube")
"""By their number in the kernel."""


@dataclass(frozen=True)
class TableSight:
    """What TABLE_STATE tells.

    Attributes:
        box: Position of the box in m and its heading in rad, -pi..pi; zeros where there is none.
        goal: Position of the goal, in m; zeros where there is none.
        contacts: A bit for each of the first 16 rows that touches the box; row 0 in the lowest.
        resets: How often the table has been reset.
    """

    box: tuple[float, float, float]
    goal: tuple[float, float]
    contacts: int
    resets: int


@dataclass(frozen=True)
class RingReading:
    """What a robot's ring has read: of each robot around, in the order of rows.

    Attributes:
        rows: Which one.
        groups: Its class.
        bearings: In the robot's frame, -pi..pi.
        distances: Between the centres, in m.
    """

    rows: NDArray[np.uint32]
    groups: NDArray[np.uint8]
    bearings: NDArray[np.float64]
    distances: NDArray[np.float64]


class SwarmTable:
    """Robots on a table, all of one profile.

    Args:
        groups: Class of each robot, by row; at least one.
        profile: The device's numbers.
        period: Control period, 0.005 or 0.01 s.
        occlusion: A robot that stands behind something is not seen by the ring.

    Attributes:
        profile: The device's numbers.
        period: Control period, in s.
        arrays: The kernel's arrays: commands to set, what is sensed to read.
        resets: How often it has been reset.

    Raises:
        ValueError: No robot, or another period.
    """

    def __init__(
        self,
        groups: Sequence[int],
        *,
        profile: MicroProfile | None = None,
        period: float = 0.005,
        occlusion: bool = False,
    ) -> None:
        if not groups:
            raise ValueError("a table has at least one robot")
        if period not in PERIODS:
            raise ValueError(f"the table's period is {' or '.join(map(str, PERIODS))} s, not {period}")
        self.profile = profile if profile is not None else MicroProfile()
        self.period = period
        self.resets = 0
        self._count = len(groups)
        self.arrays = TableArrays(board_host(), self._count, period)
        self.arrays.group[:] = groups
        self.arrays.gap[:] = 0.002
        self.arrays.struct.occlusion = occlusion
        self._describe()
        needed = self._needed()
        self._noise = [Noise(self._count, kind, size * needed[kind]) for kind, size in enumerate(_SIZES)]
        for kind, noise in enumerate(self._noise):
            self.arrays.lend_noise(kind, noise.deviates, noise.at)
        self._put_up(1, (2.0, 2.0))

    def _needed(self) -> tuple[bool, ...]:
        """Which kinds of noise there are."""
        profile = self.profile
        return (
            bool(profile.slip_sd or profile.drift_sd),
            bool(profile.fix_sd or profile.fix_angle_sd or profile.dropout),
            bool(profile.range_share_sd or profile.range_sd),
            bool(profile.box_bearing_sd or profile.box_distance_sd),
            bool(profile.goal_bearing_sd),
        )

    def _describe(self) -> None:
        """Hand over the numbers of the robots."""
        profile, to = self.profile, self.arrays.struct.profile
        for name in (
            "radius",
            "mass",
            "traction",
            "slip_sd",
            "drift_sd",
            "fix_sd",
            "fix_angle_sd",
            "range_share_sd",
            "range_sd",
        ):
            setattr(to, name, getattr(profile, name))
        for name in ("box_bearing_sd", "box_distance_sd", "goal_bearing_sd"):
            setattr(to, name, getattr(profile, name))
        to.half_track = profile.track / 2
        to.inertia = profile.mass * profile.radius**2 / 2
        to.grip_torque = profile.traction * profile.track / 2
        to.lag = -math.expm1(-self.period / profile.lag)
        to.fix_periods = max(1, round(profile.fix_interval / self.period))
        to.lost_fixes = max(1, round(profile.dropout_time / profile.fix_interval))
        share = 1.0 - (1.0 - profile.dropout) ** profile.fix_interval  # of the fixes, that a drop-out begins with
        to.lost_below = -math.inf if share <= 0 else math.inf if share >= 1 else NormalDist().inv_cdf(share)

    @property
    def count(self) -> int:
        """Number of robots."""
        return self._count

    @property
    def periods(self) -> int:
        """Control periods since the reset."""
        return int(self.arrays.struct.periods)

    def reset(
        self,
        seed: int,
        *,
        size: tuple[float, float] | None = None,
        wall: bool = False,
        box: str | None = None,
        room: Room | None = None,
    ) -> None:
        """Begin anew: other things on the table, noise from its beginning, all robots at rest in rows about the middle.

        Args:
            seed: The noise follows from it.
            size: Of the table, in m; None: as large as the room, else 2 x 2.
            wall: There is a wall around it.
            box: None, "cylinder" or "cube"; it stands in the middle.
            room: What else stands there.

        Raises:
            ValueError: No such box, no such size, or no room for so many robots within the wall.
        """
        if box not in _BOXES:
            raise ValueError(f"a box is a cylinder or a cube, not {box!r}")
        if size is None:
            size = (2.0, 2.0) if room is None else room.size
        if not all(0 < side < math.inf for side in size):
            raise ValueError(f"a table measures more than 0 m, not {size[0]} x {size[1]}")
        obstacles = () if room is None else room.walls
        self._put_up(seed, size, wall=wall, box=box, obstacles=obstacles, room=room)
        self.resets += 1

    def _put_up(
        self,
        seed: int,
        size: tuple[float, float],
        *,
        wall: bool = False,
        box: str | None = None,
        obstacles: Sequence[Segment] = (),
        room: Room | None = None,
        places: NDArray[np.float64] | None = None,
    ) -> None:
        """Put everything up, the robots in these places, shape (count, 2), or where there is room."""
        half_x, half_y = size[0] / 2, size[1] / 2
        corners = [(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)]
        border = [(*corners[number - 1], *corners[number]) for number in range(4)] if wall else []
        walls = [*border, *obstacles]
        segments = np.array(walls, np.float64).reshape(-1, 4)
        if places is None:
            places = free_places(
                self._count,
                self.profile.radius,
                walls=segments,
                within=(half_x, half_y) if wall else None,
                box_half=0.0 if box is None else self.profile.box_half,
                room=room,
            )
        arrays, struct = self.arrays, self.arrays.struct
        self.bodies = Bodies(self.profile, places.tolist(), walls, box)
        arrays.take_bodies(self.bodies.space, self.bodies.robots, self.bodies.box)
        arrays.take_walls(segments, self.profile.radius + MOST_GAP)
        struct.periods, struct.has_goal = 0, 0
        struct.box_kind, struct.box_half = _BOXES.index(box), self.profile.box_half
        struct.box_x = struct.box_y = struct.box_angle = struct.box_sin = struct.goal_x = struct.goal_y = 0.0
        struct.box_cos = 1.0
        arrays.effort[:] = 1.0
        arrays.travel[:] = arrays.rim[:] = 0.0
        arrays.fix_x[:] = arrays.fix_y[:] = arrays.fix_angle[:] = 0.0
        arrays.fix_age[:], arrays.lost[:] = NEVER, 0
        for noise in self._noise:
            noise.restart(seed)
        for row, (x, y) in enumerate(places.tolist()):
            self.place(row, x, y, 0.0)

    def place(self, row: int, x: float, y: float, heading: float) -> None:
        """Pick a robot up and put it there, its wheels at rest.

        Args:
            row: Which one.
            x: In m.
            y: In m.
            heading: In rad.

        Raises:
            ValueError: There is no such row, or no such place.
        """
        if not 0 <= row < self._count:
            raise ValueError(f"the table has rows 0 to {self._count - 1}, not {row}")
        _check(x, y, heading)
        arrays = self.arrays
        body = self.bodies.robots[row]
        put(body, x, y, heading)
        arrays.x[row], arrays.y[row], arrays.angle[row] = x, y, heading
        arrays.cos[row], arrays.sin[row] = body.rotation_vector
        arrays.vx[row] = arrays.vy[row] = arrays.spin[row] = 0.0
        arrays.command[2 * row : 2 * row + 2] = arrays.rim[2 * row : 2 * row + 2] = 0.0
        arrays.rolling[row] = 0
        arrays.struct.stale = 1

    def place_box(self, x: float, y: float, heading: float) -> None:
        """Put the box there; m, rad.

        Raises:
            ValueError: There is no box, or no such place.
        """
        if self.bodies.box is None:
            raise ValueError("there is no box on this table")
        _check(x, y, heading)
        put(self.bodies.box, x, y, heading)
        struct = self.arrays.struct
        struct.box_x, struct.box_y, struct.box_angle = x, y, heading
        struct.box_cos, struct.box_sin = self.bodies.box.rotation_vector

    def place_goal(self, x: float, y: float) -> None:
        """Put the goal's marker there; m.

        Raises:
            ValueError: There is no such place.
        """
        _check(x, y, 0.0)
        struct = self.arrays.struct
        struct.goal_x, struct.goal_y, struct.has_goal = x, y, 1

    def run(self, periods: int) -> None:
        """Let everybody drive as commanded.

        Args:
            periods: For so many control periods.
        """
        arrays = self.arrays
        while periods > 0:
            periods -= arrays.lib.table_run(arrays.struct, periods)
            if arrays.struct.wanting:
                self.refill()

    def refill(self) -> None:
        """Draw new noise where it runs short.

        Raises:
            RuntimeError: Somebody has read more than there was.
        """
        if self.arrays.struct.starved:
            raise RuntimeError("a robot has read its sensors more often than noise was drawn for")
        for noise in self._noise:
            noise.refill()
        self.arrays.struct.wanting = 0

    def ring(self, row: int, radius: float, *, step: float = 0.0, limit: float = math.inf) -> RingReading:
        """Read a robot's ring.

        Args:
            row: Which robot.
            radius: All robots that are nearer than this are found, in m.
            step: More than 0: where none of another class is so near, the radius grows to this beyond the nearest one of
                another class, in m.
            limit: How far it grows at most, in m.
        """
        arrays = self.arrays
        arrays.lib.table_ring(arrays.struct, row, radius, step, limit)
        found = arrays.struct.found
        rows = arrays.found_row[:found].copy()
        return RingReading(rows, arrays.group[rows], arrays.found_bearing[:found].copy(), arrays.found_distance[:found].copy())

    def ranges(self, row: int, directions: int, farthest: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Read the distances to whatever stands around a robot, from its centre.

        Args:
            row: Which robot.
            directions: In how many directions, 0..32; the first one is straight ahead, the others follow counter-clockwise.
            farthest: How far it sees, in m.

        Returns:
            Distances in m, infinite for nothing, and where it is a robot that is hit; shape (directions,) each.
        """
        arrays, struct = self.arrays, self.arrays.struct
        arrays.lib.table_ranges(struct, row, directions, farthest)
        self._look_after_noise()
        hits = np.array([bool(struct.range_robots >> ray & 1) for ray in range(directions)], np.bool_)
        return np.array(list(struct.range)[:directions]), hits

    def box_bearing(self, row: int) -> tuple[float, float]:
        """Bearing of the box in a robot's frame, -pi..pi, and distance from the robot's centre to its surface, in m.

        Not numbers where there is no box.
        """
        self.arrays.lib.table_box(self.arrays.struct, row)
        self._look_after_noise()
        return self.arrays.struct.box_bearing, self.arrays.struct.box_distance

    def goal_bearing(self, row: int) -> float:
        """Bearing of the goal in a robot's frame, -pi..pi; not a number where there is none."""
        self.arrays.lib.table_goal(self.arrays.struct, row)
        self._look_after_noise()
        return float(self.arrays.struct.goal_bearing)

    def _look_after_noise(self) -> None:
        if self.arrays.struct.wanting:
            self.refill()

    def contacts(self) -> NDArray[np.uint8]:
        """Contacts as of now: for each robot a bit for each of 8 sectors of its body, the first one in the highest bit."""
        self.arrays.lib.table_contacts(self.arrays.struct)
        return self.arrays.bump.copy()

    def state(self) -> TableSight:
        """What TABLE_STATE tells, as of now."""
        struct = self.arrays.struct
        self.contacts()
        touch = self.arrays.touch[:16] if struct.box_kind else np.zeros(16, np.uint8)
        heading = math.remainder(struct.box_angle, math.tau)
        contacts = int(np.packbits(touch.astype(bool), bitorder="little").astype(np.uint16) @ [1, 256][: (len(touch) + 7) // 8])
        return TableSight((struct.box_x, struct.box_y, heading), (struct.goal_x, struct.goal_y), contacts, self.resets)


def _check(x: float, y: float, heading: float) -> None:
    """Refuse what is no place."""
    if not all(map(math.isfinite, (x, y, heading))):
        raise ValueError(f"no place on a table: {x}, {y}, {heading}")
