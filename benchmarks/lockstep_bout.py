"""Lock-step bouts with everything on: firmware, codec both ways, sensors, peer, referee; with the recorder off and on.

Prints simulated seconds per wall second. The floor is the same pymunk world stepped from Python with nothing around it. The
device alone is the emulated robot, its ring and its referee without a host: what the host sent in such bouts is given to it
again, in the same control periods.

With another checkout of this project, whose extension is built, its bouts take turns with these, each in a process of its
own, and their ratio is printed.

    python benchmarks/lockstep_bout.py [CHECKOUT] [--bouts 60] [--opponent flat-light] [--profile]
"""

from __future__ import annotations

import argparse
import contextlib
import cProfile
import os
import pstats
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter, process_time
from typing import TYPE_CHECKING

import hil
from firmware_protocol.links.memory import MemoryLink
from firmware_protocol.vocabulary import Action, Maneuver, Stimulus
from hil.bouts import play
from hil.bridge import Bridge
from hil.junior import Junior
from hil.recorder import Recorder
from hil.ring import open_ring
from simdevice.period import PERIOD
from simdevice.sumo import Table
from simdevice.world import junior_world

if TYPE_CHECKING:
    from collections.abc import Callable

    from simdevice.world import World

FLOOR = "floor: the pymunk world, nothing around it"
DEVICE = "device alone: kernel and referee, no host"
REACTIONS = {
    0: (Action.LBRF, Action.LBRF, Action.MF, Action.S),
    1: (Action.LBRF, Action.MF, Action.MF, Action.FF),
    2: (Action.LFRB, Action.MF, Action.MF, Action.FF),
    3: (Action.FF, Action.FF, Action.FF, Action.FF),
}


class FourActions:
    """Plays as a coached robot does: maneuvers of four actions of 200 ms each."""

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:  # noqa: ARG002
        """The same maneuver for the same eyes."""
        return Maneuver(REACTIONS[current & 3], period=0.2)


def bouts(opponent: str, count: int, *, recorded: bool) -> tuple[float, float]:
    """Play bouts.

    Returns:
        Simulated seconds, wall seconds.
    """
    url = f"sim://junior?opponent={opponent}&seed=1"
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        log = Path(folder) / "log.mcap"
        taps = [Recorder(log, run={}, config={}, link=url, lockstep=True)] if recorded else []
        junior = stack.enter_context(hil.connect(url, taps=taps))
        junior.arm()
        ring, player = open_ring(junior), FourActions()
        since, start = junior.now(), perf_counter()
        for _ in play(ring, player, range(1, count + 1)):
            pass
        return junior.now() - since, perf_counter() - start


def physics(opponent: str, seconds: float, *, bare: bool) -> float:
    """Step the bodies alone.

    Returns:
        Simulated seconds per wall second.
    """
    table = Table(opponent)
    start = perf_counter()
    for step in range(round(seconds / PERIOD)):
        if step % 800 == 0:
            table.reset(step)
            table.robot.motors.command(700, 700)
        if bare:
            table.arena.space.step(PERIOD)
        else:
            table.arena.step()
    return seconds / (perf_counter() - start)


class Overheard:
    """A world that remembers what came from its host, and for how many control periods it was to live.

    Args:
        world: The world.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self.period = PERIOD
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
    overheard = Overheard(junior_world(opponent=opponent))
    sessions = iter(range(1, 0xFFFF))
    with Bridge(MemoryLink(overheard), overheard, session=sessions.__next__) as bridge, Junior(bridge) as junior:
        junior.find()
        junior.arm()
        for _ in play(open_ring(junior), FourActions(), range(1, count + 1)):
            pass
    return overheard.calls


def device(opponent: str, calls: list[tuple[bytes, int]]) -> float:
    """Let a robot live through what a host said.

    Returns:
        Simulated seconds per second of this process.
    """
    world = junior_world(opponent=opponent)
    start = process_time()
    for inbound, periods in calls:
        world.run(inbound, periods)
    return world.now() / (process_time() - start)


def beside(checkout: Path, opponent: str, count: int, rounds: int) -> None:
    """Print how much faster bouts are here than in another checkout.

    Args:
        checkout: The other one's folder.
        opponent: Name of the opponent.
        count: Bouts a round.
        rounds: How often each is measured, in turns.
    """
    here = Path(__file__).resolve().parents[1]
    speeds: dict[Path, list[float]] = {here: [], checkout.resolve(): []}
    for _ in range(rounds):
        for folder, measured in speeds.items():
            command = [
                sys.executable,
                str(Path(__file__).resolve()),
                "--measure",
                "--bouts",
                str(count),
                "--opponent",
                opponent,
            ]
            environment = {**os.environ, "PYTHONPATH": str(folder)}
            done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)  # noqa: S603
            measured.append(float(done.stdout))
    ratios = [one / other for one, other in zip(*speeds.values(), strict=True)]
    for folder, measured in speeds.items():
        print(f"  {folder!s:60} {statistics.median(measured):6.0f} x real time by CPU (median of {rounds})")
    print(f"  here / there: {statistics.median(ratios):.2f} (median), {min(ratios):.2f} to {max(ratios):.2f}")


def fastest(run: Callable[[], tuple[float, float]], rounds: int) -> float:
    """Simulated seconds per wall second, the best of some rounds."""
    return max(seconds / wall for seconds, wall in (run() for _ in range(rounds)))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkout", nargs="?", type=Path, help="another checkout, to be compared with")
    parser.add_argument("--measure", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--bouts", type=int, default=60, help="bouts a round")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--opponent", default="flat-light")
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    options = parser.parse_args()
    opponent, count = options.opponent, options.bouts
    if options.measure:
        since = process_time()
        seconds, _ = bouts(opponent, count, recorded=False)
        print(seconds / (process_time() - since))
        return
    if options.checkout is not None:
        beside(options.checkout, opponent, count, options.rounds)
        return
    figures = {
        "everything, recorder off": fastest(lambda: bouts(opponent, count, recorded=False), options.rounds),
        "everything, recorder on": fastest(lambda: bouts(opponent, count, recorded=True), options.rounds),
        DEVICE: max(device(opponent, said) for said in [said_by_host(opponent, count)] for _ in range(options.rounds)),
        "bodies, motors and friction in Python": max(physics(opponent, 100.0, bare=False) for _ in range(options.rounds)),
        FLOOR: max(physics(opponent, 100.0, bare=True) for _ in range(options.rounds)),
    }
    floor = figures[FLOOR]
    print(f"{opponent}: {count} bouts a round, best of {options.rounds}; control period {PERIOD * 1e3:g} ms")
    for name, speed in figures.items():
        print(f"  {name:44} {speed:6.0f} x real time  {PERIOD / speed * 1e6:6.1f} us a step  {speed / floor:5.2f} of the floor")
    print(f"A control period of the device alone takes {floor / figures[DEVICE]:.2f} of the floor's time.")
    if options.profile:
        profile = cProfile.Profile()
        profile.runcall(bouts, opponent, count, recorded=False)
        pstats.Stats(profile).sort_stats("tottime").print_stats(25)


if __name__ == "__main__":
    main()
