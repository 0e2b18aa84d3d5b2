"""Lock-step bouts with everything on: firmware, codec both ways, sensors, peer, referee; with the recorder off and on.

Prints simulated seconds per wall second. The floor is the same pymunk world stepped from Python with nothing around it, and
nothing moving in it. What the emulated robot takes of it, `device_alone.py` tells.

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
from time import perf_counter
from typing import TYPE_CHECKING

from any_checkout import FourActions

import hil
from hil.recording.recorder import Recorder
from hil.sumo.bouts import play
from hil.sumo.ring import open_ring
from simdevice.sumo.match import Match
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Callable

FLOOR = "floor: the pymunk world, nothing around it"


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
    match = Match(opponent)
    start = perf_counter()
    for step in range(round(seconds / match.period)):
        if step % 800 == 0:
            match.reset(step)
            match.robot.motors.command(700, 700)
        if bare:
            match.arena.space.step(match.period)
        else:
            match.arena.step()
    return seconds / (perf_counter() - start)


def beside(checkout: Path, opponent: str, count: int, rounds: int) -> None:
    """Print how much faster bouts are here than in another checkout.

    Args:
        checkout: The other one's folder.
        opponent: Name of the opponent.
        count: Bouts a round.
        rounds: How often each is measured, in turns.
    """
    here = Path(__file__).resolve().parents[1]
    program = here / "benchmarks" / "any_checkout.py"
    speeds: dict[Path, list[float]] = {here: [], checkout.resolve(): []}
    for _ in range(rounds):
        for folder, measured in speeds.items():
            command = [sys.executable, str(program), opponent, str(count)]
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
    parser.add_argument("--bouts", type=int, default=60, help="bouts a round")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--opponent", default="flat-light")
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    options = parser.parse_args()
    period = WorldSettings().period
    opponent, count = options.opponent, options.bouts
    if options.checkout is not None:
        beside(options.checkout, opponent, count, options.rounds)
        return
    figures = {
        "everything, recorder off": fastest(lambda: bouts(opponent, count, recorded=False), options.rounds),
        "everything, recorder on": fastest(lambda: bouts(opponent, count, recorded=True), options.rounds),
        "bodies, motors and friction in Python": max(physics(opponent, 100.0, bare=False) for _ in range(options.rounds)),
        FLOOR: max(physics(opponent, 100.0, bare=True) for _ in range(options.rounds)),
    }
    floor = figures[FLOOR]
    print(f"{opponent}: {count} bouts a round, best of {options.rounds}; control period {period * 1e3:g} ms")
    for name, speed in figures.items():
        print(f"  {name:44} {speed:6.0f} x real time  {period / speed * 1e6:6.1f} us a step  {speed / floor:5.2f} of the floor")
    if options.profile:
        profile = cProfile.Profile()
        profile.runcall(bouts, opponent, count, recorded=False)
        pstats.Stats(profile).sort_stats("tottime").print_stats(25)


if __name__ == "__main__":
    main()
