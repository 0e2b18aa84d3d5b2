"""The table of micro-robots without their firmware, against pymunk's own step of the same bodies called from Python.

Sparse: robots drive about on a table with a wall, whose area grows with their number (2 x 2 m for 33), and turn away from what
they meet. Heap: all drive to the middle and push. Each robot's ring is read twice in 1.7 s, as in a mission. The bare world has
the same bodies and walls; its robots got a velocity once, and nobody drives, senses or reads them.

    python benchmarks/swarm_table.py [--counts 1 20 33 100 500 1000] [--heaps 33 100 1000] [--period 5] [--rounds 5]
"""

from __future__ import annotations

import argparse
import math
import statistics
from time import process_time
from typing import TYPE_CHECKING

import numpy as np

from simdevice.swarm.table import SwarmTable

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Commands = Callable[[SwarmTable], NDArray[np.float64]]

AREA = 0.12
"""Of a sparse table for each robot, in m^2."""
PACKED = 0.05
"""Between robots that are to become a heap, in m."""
SPEED = 0.15
"""Of the robots, in m/s."""
CHANGE = 0.1
"""Commands change so often, in s."""
RADIUS = 0.2
STEP = 0.05
"""Of the rings: least radius, and by how much they grow beyond the nearest one of the other class, in m."""
BETWEEN = 0.85
"""Between two readings of a ring, in s."""
ROBOT_PERIODS = 200_000
"""Least number of control periods that are measured at once, of all robots together."""


def sparse(count: int, period: float) -> SwarmTable:
    """Robots in some disorder; one of four is of the other class."""
    side = math.sqrt(AREA * max(count, 33))
    table = SwarmTable([int(row % 4 == 3) for row in range(count)], period=period)
    table.reset(1, size=(side, side), wall=True)
    chance = np.random.default_rng(1)
    columns = math.ceil(math.sqrt(count))
    space = (side - 0.1) / columns
    for row in range(count):
        x, y = ((number + 0.5) * space - (side - 0.1) / 2 + chance.uniform(-0.05, 0.05) for number in divmod(row, columns))
        table.place(row, x, y, chance.uniform(-math.pi, math.pi))
    return table


def heap(count: int, period: float) -> SwarmTable:
    """Robots side by side, that have pushed towards the middle for ten seconds."""
    table = sparse(count, period)
    columns = math.ceil(math.sqrt(count))
    for row in range(count):
        x, y = ((number - columns / 2) * PACKED for number in divmod(row, columns))
        table.place(row, x, y, 0.0)
    for _ in range(round(10 / CHANGE)):
        table.arrays.command[:] = gather(table)
        table.run(round(CHANGE / period))
    return table


def roam(table: SwarmTable) -> NDArray[np.float64]:
    """Commands of robots that drive on until they meet something, then back off and turn."""
    bump = table.arrays.bump
    ahead = np.where(bump & 0xC3, -SPEED, SPEED)
    turn = np.where(bump, 0.04, 0.0)
    return np.stack((ahead - turn, ahead + turn), axis=1).reshape(-1)


def gather(table: SwarmTable) -> NDArray[np.float64]:
    """Commands of robots that all drive to the middle."""
    arrays = table.arrays
    wrong = np.arctan2(-arrays.y, -arrays.x) - arrays.angle
    turn = np.clip((wrong + math.pi) % math.tau - math.pi, -1.0, 1.0) * 0.05
    ahead = np.where(abs(turn) < 0.03, SPEED, 0.0)
    return np.stack((ahead - turn, ahead + turn), axis=1).reshape(-1)


def driven(table: SwarmTable, commands: Commands, *, rings: bool) -> float:
    """Let a table live.

    Returns:
        Processor time of a robot's control period, in s; commands are not counted.
    """
    arrays, read, periods = table.arrays, table.arrays.lib.table_ring, round(CHANGE / table.period)
    changes = math.ceil(ROBOT_PERIODS / periods / table.count)
    spent, due, row = 0.0, 0.0, 0
    for _ in range(changes):
        arrays.command[:] = commands(table)
        start = process_time()
        table.run(periods)
        if rings:
            due += table.count * CHANGE / BETWEEN
            while due >= 1.0:
                due -= 1.0
                row = (row + 1) % table.count
                read(arrays.struct, row, RADIUS, STEP, math.inf)
        spent += process_time() - start
    return spent / changes / periods / table.count


def bare(table: SwarmTable) -> float:
    """Step the bodies of a table by pymunk alone, from Python.

    Returns:
        Processor time of a robot's control period, in s.
    """
    space = table.bodies.space
    for body in table.bodies.robots:
        body.velocity = SPEED * body.rotation_vector
    steps = math.ceil(ROBOT_PERIODS / table.count)
    start = process_time()
    for _ in range(steps):
        space.step(table.period)
    return (process_time() - start) / steps / table.count


def measured(rows: dict[str, Callable[[], float]], rounds: int) -> dict[str, float]:
    """Medians of all rows, in turn."""
    times: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(rounds):
        for name, row in rows.items():
            times[name].append(row())
    return {name: statistics.median(values) for name, values in times.items()}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--counts", type=int, nargs="*", default=[1, 20, 33, 100, 500, 1000])
    parser.add_argument("--heaps", type=int, nargs="*", default=[33, 100, 1000])
    parser.add_argument("--period", type=int, choices=(5, 10), default=5, help="ms")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    period = options.period * 1e-3
    print(f"us of a robot's control period of {options.period} ms, median of {options.rounds} rounds; times real time for all")
    for count in options.counts:
        one, other = sparse(count, period), sparse(count, period)
        rows: dict[str, Callable[[], float]] = {
            "table": lambda one=one: driven(one, roam, rings=False),  # type: ignore[misc]
            "and rings": lambda one=one: driven(one, roam, rings=True),  # type: ignore[misc]
            "bare": lambda other=other: bare(other),  # type: ignore[misc]
        }
        show(f"{count} sparse", count, period, measured(rows, options.rounds))
    for count in options.heaps:
        one = heap(count, period)
        rows = {
            "table": lambda one=one: driven(one, gather, rings=False),  # type: ignore[misc]
            "and rings": lambda one=one: driven(one, gather, rings=True),  # type: ignore[misc]
        }
        show(f"{count} in a heap", count, period, measured(rows, options.rounds))


def show(what: str, count: int, period: float, times: dict[str, float]) -> None:
    """Print a line."""
    cells = [f"{name} {time * 1e6:6.3f} us {period / time / count:8.1f} x" for name, time in times.items()]
    print(f"  {what:15} {'   '.join(cells)}")


if __name__ == "__main__":
    main()
