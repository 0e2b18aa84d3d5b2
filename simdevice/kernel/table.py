"""The kernel's arrays of a table of micro-robots, owned by numpy: see `table.h`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Protocol, cast

import numpy as np

from simdevice.kernel.chipmunk import FUNCTIONS, body_address, space_address

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pymunk
    from numpy.typing import NDArray

    from simdevice.boards import Host

_CELLS: Final = 4
"""Most cells of the robots' grid, for each robot."""
_LEAST_CELL: Final = 0.1
"""Side of a cell where there is room for so many, in m."""
_SKIN: Final = 0.03
"""Robots that are farther apart than contact by this are looked at again when one has moved by half of it, in m."""
_WALL_CELL: Final = 0.05
"""Side of a cell of the obstacles' grid, in m, where that gives no more than so many."""
_WALL_CELLS: Final = 1 << 16
MOST_GAP: Final = 0.02
"""Greatest contact gap, in m."""

_EACH: Final[Mapping[str, tuple[type, int]]] = {
    **dict.fromkeys(
        ("x", "y", "angle", "cos", "sin", "vx", "vy", "spin", "effort", "slip", "way_cos", "way_sin"), (np.float64, 1)
    ),
    **dict.fromkeys(("command", "gain", "rim", "travel"), (np.float64, 2)),
    **dict.fromkeys(("gap", "fix_x", "fix_y", "fix_angle", "seen_x", "seen_y"), (np.float64, 1)),
    **dict.fromkeys(("found_bearing", "found_distance"), (np.float64, 1)),
    **dict.fromkeys(("rolling", "group", "bump", "touch"), (np.uint8, 1)),
    "counted": (np.uint32, 2),
    **dict.fromkeys(("fix_age", "lost", "cell_item", "cell_of", "found_row", "near_row"), (np.uint32, 1)),
}
"""Type and number of the values that each robot has in an array."""


class TableLibrary(Protocol):
    """What the kernel can do with a table; `table.h` tells."""

    def table_run(self, table: object, periods: int) -> int:
        """Drive for at most so many control periods, until noise runs short."""
        ...

    def table_contacts(self, table: object) -> None:
        """Find what touches the robots."""
        ...

    def table_ring(self, table: object, row: int, least: float, step: float, limit: float) -> None:
        """Read a ring."""
        ...

    def table_ranges(self, table: object, row: int, directions: int, farthest: float) -> None:
        """Read ranges."""
        ...

    def table_box(self, table: object, row: int) -> None:
        """Read bearing and distance of the box."""
        ...

    def table_goal(self, table: object, row: int) -> None:
        """Read the bearing of the goal."""
        ...

    def table_physics_alone(self, table: object, periods: int) -> None:
        """Step the physics and nothing else."""
        ...


class TableArrays:
    """A table in the kernel: the struct, and arrays of it by row; m, rad, m/s.

    Args:
        host: The build of the firmware and the kernel.
        count: Number of robots, 1 or more.
        period: Control period, in s.

    Attributes:
        struct: The struct `kernel_table`.
        lib: The kernel's functions.
        x: Positions as of the last step, shape (count,); so are `y`, `angle`, `vx`, `vy` and `spin`.
        command: What the wheels are commanded, in m/s, shape (2 count,): left and right of row 0, of row 1, ...
        effort: Share of the traction that a robot's thrust may use, 0..1.
        gain: Share of a command that a wheel turns, shape (2 count,).
        travel: Way of each wheel's rim since the reset, in m, shape (2 count,).
        counted: What encoders had counted before, in um, modulo 2**32, likewise.
        rim: Its speed, in m/s, shape (2 count,).
        group: Each robot's class.
        gap: Contact is what is nearer to the robot's edge than this, in m.
        bump: Contacts: a bit for each of 8 sectors of the body, the first one in the highest bit.
        touch: It touches the box.
        fix_x: The last position fix, in m; so is `fix_y`.
        fix_angle: Its heading, -pi..pi.
        fix_age: Its age in control periods; 2**32-1: never.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    angle: NDArray[np.float64]
    cos: NDArray[np.float64]
    sin: NDArray[np.float64]
    vx: NDArray[np.float64]
    vy: NDArray[np.float64]
    spin: NDArray[np.float64]
    command: NDArray[np.float64]
    effort: NDArray[np.float64]
    gain: NDArray[np.float64]
    rim: NDArray[np.float64]
    travel: NDArray[np.float64]
    counted: NDArray[np.uint32]
    slip: NDArray[np.float64]
    way_cos: NDArray[np.float64]
    way_sin: NDArray[np.float64]
    rolling: NDArray[np.uint8]
    group: NDArray[np.uint8]
    gap: NDArray[np.float64]
    bump: NDArray[np.uint8]
    touch: NDArray[np.uint8]
    fix_x: NDArray[np.float64]
    fix_y: NDArray[np.float64]
    fix_angle: NDArray[np.float64]
    fix_age: NDArray[np.uint32]
    lost: NDArray[np.uint32]
    found_row: NDArray[np.uint32]
    found_bearing: NDArray[np.float64]
    found_distance: NDArray[np.float64]

    def __init__(self, host: Host, count: int, period: float) -> None:
        self.lib = cast("TableLibrary", host.lib)
        self._ffi = ffi = host.ffi
        self._kept: dict[str, Any] = {}
        self.struct: Any = ffi.new("kernel_table *")
        for field, address in FUNCTIONS.items():
            function = ffi.cast(ffi.typeof(getattr(self.struct.physics, field)), address)
            setattr(self.struct.physics, field, function)
        self.struct.period, self.struct.count = period, count
        self.struct.most_gap, self.struct.skin, self.struct.least_cell = MOST_GAP, _SKIN, _LEAST_CELL
        for name, (kind, number) in _EACH.items():
            array: NDArray[Any] = np.zeros(number * count, kind)
            setattr(self, name, array)
            self.lend(name, array)
        self.struct.most_cells = _CELLS * count + 4
        self.lend("cell_start", np.zeros(self.struct.most_cells + 1, np.uint32))
        self.lend("pair", np.empty(count * (count - 1) + 2, np.uint32))
        self.gain[:] = self.effort[:] = self.slip[:] = self.way_cos[:] = self.cos[:] = 1.0

    def lend(self, name: str, array: NDArray[Any]) -> None:
        """Have a pointer of the struct point to an array, which is kept."""
        self._kept[name] = array
        setattr(self.struct, name, self._pointer(array))

    def lend_noise(self, kind: int, deviates: NDArray[np.float64], at: NDArray[np.uint32]) -> None:
        """Hand over the noise of one kind: deviates of shape (count, size), and which is each robot's next one."""
        self._kept[f"noise {kind}"] = deviates, at
        noise = self.struct.noise[kind]
        noise.deviate, noise.at, noise.size = self._pointer(deviates), self._pointer(at), deviates.shape[1]

    def _pointer(self, array: NDArray[Any]) -> Any:  # noqa: ANN401 - a pointer of cffi
        kinds = {np.dtype(np.float64): "double[]", np.dtype(np.uint32): "uint32_t[]", np.dtype(np.uint8): "uint8_t[]"}
        return self._ffi.from_buffer(kinds[array.dtype], array.reshape(-1))

    def take_bodies(self, space: pymunk.Space, robots: Sequence[pymunk.Body], box: pymunk.Body | None) -> None:
        """Take over the bodies of pymunk that stand on the table; whoever calls keeps them alive."""
        ffi, cast_to = self._ffi, self._ffi.cast
        self.struct.space = cast_to("void *", space_address(space))
        self._kept["body"] = ffi.new("void *[]", [cast_to("void *", body_address(body)) for body in robots])
        self.struct.body = self._kept["body"]
        self.struct.box = ffi.NULL if box is None else cast_to("void *", body_address(box))

    def take_walls(self, walls: NDArray[np.float64], reach: float) -> None:
        """Take over the obstacles.

        Args:
            walls: Segments: x, y of one end and x, y of the other, in m, shape (n, 4).
            reach: What is nearer to a robot's centre than this may touch it, in m.
        """
        struct = self.struct
        self.lend("wall", np.ascontiguousarray(walls, np.float64))
        struct.walls = len(walls)
        if not len(walls):
            return
        ends = walls.reshape(-1, 2)
        low, high = ends.min(axis=0) - reach, ends.max(axis=0) + reach
        cell = max(_WALL_CELL, float(np.sqrt(np.prod(high - low) / _WALL_CELLS)))
        columns, rows = (np.floor((high - low) / cell).astype(int) + 1).tolist()
        struct.wall_x, struct.wall_y = low.tolist()
        struct.wall_cell, struct.wall_columns, struct.wall_rows = cell, columns, rows
        middle_x = low[0] + (np.arange(columns) + 0.5) * cell
        middle_y = low[1] + (np.arange(rows) + 0.5) * cell
        near = [_distance(wall, middle_x, middle_y) < reach + cell for wall in walls]
        cells, items = np.nonzero(np.stack(near, axis=-1).reshape(columns * rows, len(walls)))
        self.lend("wall_start", np.searchsorted(cells, np.arange(columns * rows + 1)).astype(np.uint32))
        self.lend("wall_item", items.astype(np.uint32))


def _distance(wall: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances of all points of a lattice to a segment, shape (len(y), len(x))."""
    end, along = wall[:2], wall[2:] - wall[:2]
    dx, dy = np.meshgrid(x - end[0], y - end[1])
    square = float(along @ along)
    share = np.clip((dx * along[0] + dy * along[1]) / square, 0.0, 1.0) if square > 0 else np.zeros_like(dx)
    distance: NDArray[np.float64] = np.hypot(dx - share * along[0], dy - share * along[1])
    return distance
