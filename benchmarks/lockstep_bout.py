"""Lock-step bouts with everything on: firmware, codec both ways, sensors, peer, referee; with the recorder off and on.

Prints simulated seconds per wall second. The floor is the same pymunk world stepped with nothing around it; between the
two stands what a pymunk sumo needs in any case: motors and friction set for each step.

    python benchmarks/lockstep_bout.py [--bouts 60] [--opponent flat-light] [--profile]
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import tempfile
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import hil
from firmware_protocol.vocabulary import Action, Maneuver, Stimulus
from hil.recording.recorder import Recorder
from hil.sumo.bouts import play
from hil.sumo.ring import open_ring
from simdevice.period import PERIOD
from simdevice.sumo import Table

if TYPE_CHECKING:
    from collections.abc import Callable

FLOOR = "floor: the pymunk world, nothing around it"
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


def bouts(opponent: str, count: int, log: Path | None) -> tuple[float, float]:
    """Play bouts.

    Returns:
        Simulated seconds, wall seconds.
    """
    url = f"sim://junior?opponent={opponent}&seed=1"
    taps = [Recorder(log, run={}, config={}, link=url, lockstep=True)] if log else []
    with hil.connect(url, taps=taps) as junior:
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


def fastest(run: Callable[[], tuple[float, float]], rounds: int) -> float:
    """Simulated seconds per wall second, the best of some rounds."""
    return max(seconds / wall for seconds, wall in (run() for _ in range(rounds)))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bouts", type=int, default=60, help="bouts a round")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--opponent", default="flat-light")
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    options = parser.parse_args()
    opponent, count = options.opponent, options.bouts
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.mcap"
        figures = {
            "everything, recorder off": fastest(lambda: bouts(opponent, count, None), options.rounds),
            "everything, recorder on": fastest(lambda: bouts(opponent, count, log), options.rounds),
            "bodies, motors and friction alone": max(physics(opponent, 100.0, bare=False) for _ in range(options.rounds)),
            "floor: the pymunk world, nothing around it": max(
                physics(opponent, 100.0, bare=True) for _ in range(options.rounds)
            ),
        }
    floor = figures[FLOOR]
    print(f"{opponent}: {count} bouts a round, best of {options.rounds}; control period {PERIOD * 1e3:g} ms")
    for name, speed in figures.items():
        print(f"  {name:44} {speed:6.0f} x real time  {PERIOD / speed * 1e6:6.1f} us a step  {speed / floor:5.2f} of the floor")
    if options.profile:
        profile = cProfile.Profile()
        profile.runcall(bouts, opponent, count, None)
        pstats.Stats(profile).sort_stats("tottime").print_stats(25)


if __name__ == "__main__":
    main()
