"""The emulated robot, its ring and its referee without a host, against pymunk's own step called from Python.

What a host sent in some bouts is given to the robot again, in the same control periods. Within that, the kernel is what runs
in C. Beside it stand a step of pymunk's world with nothing moving in it, the steps of pymunk that the readable Python world
makes in those bouts, and that world as a whole.

    python benchmarks/device_alone.py [--bouts 20] [--opponent flat-light] [--rounds 5]
"""

from __future__ import annotations

import argparse
import statistics
from time import perf_counter
from typing import TYPE_CHECKING, Any

import pymunk
from any_checkout import FourActions
from lockstep_bout import physics

from firmware_protocol.links.memory import MemoryLink
from hil.bridge.bridge import Bridge
from hil.sumo.bouts import play
from hil.sumo.junior import Junior
from hil.sumo.ring import open_ring
from simdevice.kernel.world import KernelWorld
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.world import World

if TYPE_CHECKING:
    from collections.abc import Callable

DEVICE = "device alone: kernel and referee"
KERNEL = "  of this the kernel"
PYTHON = "device alone in Python"
STEPS = "  of this pymunk's step"
FLOOR = "pymunk's step with nothing moving"


class Overheard:
    """A world that remembers what came from its host, and for how many control periods it was to live.

    Args:
        world: The world.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self.period = world.period
        self.calls: list[tuple[bytes, int]] = []

    def now(self) -> float:
        """Time of the world, in s."""
        return self._world.now()

    def step(self, inbound: bytes) -> bytes:
        """One control period."""
        return b"".join([data for _, data in self.run(inbound, 1)])

    def run(self, inbound: bytes, periods: int) -> list[tuple[float, bytes]]:
        """As many as the host lets pass."""
        self.calls.append((inbound, periods))
        return self._world.run(inbound, periods)


def said_by_host(opponent: str, count: int) -> list[tuple[bytes, int]]:
    """What a host says in some bouts, and for how many control periods it waits then."""
    overheard = Overheard(junior_world(WorldSettings(opponent=opponent)))
    sessions = iter(range(1, 0xFFFF))
    with Bridge(MemoryLink(overheard), overheard, session=sessions.__next__) as bridge, Junior(bridge) as junior:
        junior.find()
        junior.arm()
        for _ in play(open_ring(junior), FourActions(), range(1, count + 1)):
            pass
    return overheard.calls


def device(world: World, calls: list[tuple[bytes, int]]) -> float:
    """Let a robot live through what a host said.

    Returns:
        Simulated seconds per second of this process.
    """
    start = perf_counter()
    for inbound, periods in calls:
        end = world.now() + (periods - 0.5) * world.period
        while not world.run(inbound, round((end - world.now()) / world.period + 0.5)) and world.now() < end:
            inbound = b""  # noqa: PLW2901 - received by now
    return world.now() / (perf_counter() - start)


def part(owner: Any, name: str, world: World, calls: list[tuple[bytes, int]]) -> float:  # noqa: ANN401 - any class
    """Let a robot live through what a host said, and time one function within.

    Returns:
        Simulated seconds per second within that function.
    """
    spent = 0.0
    function = getattr(owner, name)

    def timed(*arguments: object) -> object:
        nonlocal spent
        start = perf_counter()
        result = function(*arguments)
        spent += perf_counter() - start
        return result

    setattr(owner, name, timed)
    try:
        device(world, calls)
    finally:
        setattr(owner, name, function)
    return world.now() / spent


def in_kernel(world: KernelWorld, calls: list[tuple[bytes, int]]) -> float:
    """The same, of what runs in C."""
    return part(world.arrays, "run", world, calls)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bouts", type=int, default=20, help="bouts a round")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--opponent", default="flat-light")
    options = parser.parse_args()
    opponent = options.opponent
    period = WorldSettings().period
    said = said_by_host(opponent, options.bouts)
    rows: dict[str, Callable[[], float]] = {
        DEVICE: lambda: device(junior_world(WorldSettings(opponent=opponent)), said),
        KERNEL: lambda: in_kernel(KernelWorld(WorldSettings(opponent=opponent)), said),
        PYTHON: lambda: device(World(WorldSettings(opponent=opponent)), said),
        STEPS: lambda: part(pymunk.Space, "step", World(WorldSettings(opponent=opponent)), said),
        FLOOR: lambda: physics(opponent, 100.0, bare=True),
    }
    measured: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(options.rounds):
        for name, row in rows.items():
            measured[name].append(period / row())
    times = {name: statistics.median(values) for name, values in measured.items()}
    print(f"{opponent}: {options.bouts} bouts, median of {options.rounds} rounds; control period {period * 1e3:g} ms")
    for name, time in times.items():
        print(
            f"  {name:36} {time * 1e6:6.2f} us a period {time / times[FLOOR]:6.2f} of a step with nothing moving, "
            f"{time / times[STEPS]:5.2f} of one in these bouts"
        )


if __name__ == "__main__":
    main()
