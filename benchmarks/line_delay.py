"""What the way to the robot and back costs: advice played over a line that delays every message.

Coaches over a line without delay, with and without the option that lets a maneuver's last action go on until the next command
has come (`PalSettings.hold`), then plays the same held-out bouts with each advice at each delay.

    python benchmarks/line_delay.py [--opponent flat-heavy] [--seeds 1-4] [--bouts 100] [--delays 0,5,10,20]
"""

from __future__ import annotations

import argparse
from statistics import mean, stdev

from coaching import JUDGE, seeds_in

import hil
from hil.seeds import Branch, bout_seed
from hil.sumo.bouts import Tally, play
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.controllers import AdviceController
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import Advice, PalSettings


def learnt(opponent: str, seed: int, settings: PalSettings) -> Advice:
    """Coach over a line without delay.

    Args:
        opponent: Against whom.
        seed: Seed of the coaching.
        settings: How to coach.
    """
    with hil.connect(f"sim://junior?opponent={opponent}&seed={seed}") as junior:
        junior.arm()
        coaching = Coaching(open_ring(junior), new_pal(settings, seed), seed=seed)
        coaching.run()
        return coaching.pal.advice()


def rate(advice: Advice, opponent: str, delay: float, bouts: int) -> float:
    """Share of held-out bouts won.

    Args:
        advice: What was learnt.
        opponent: Against whom.
        delay: Delay each way, in s.
        bouts: How many.
    """
    faults = f"&faults=delay:{delay:g}" if delay else ""
    with hil.connect(f"sim://junior?opponent={opponent}{faults}") as junior:
        junior.arm()
        seeds = [bout_seed(JUDGE, Branch.BOUTS, number) for number in range(1, bouts + 1)]
        return Tally.of(opponent, list(play(open_ring(junior), AdviceController(advice), seeds))).win_rate.value


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--opponent", default="flat-heavy")
    parser.add_argument("--seeds", default="1-4", help="first-last")
    parser.add_argument("--bouts", type=int, default=100, help="held-out bouts for each seed and delay")
    parser.add_argument("--delays", default="0,5,10,20", help="in ms, each way")
    options = parser.parse_args()
    seeds = seeds_in(options.seeds)
    print(f"{options.opponent}, {options.bouts} held-out bouts each, seeds {options.seeds}")
    for hold in (False, True):
        advices = [learnt(options.opponent, seed, PalSettings(hold=hold)) for seed in seeds]
        for delay in options.delays.split(","):
            rates = [rate(advice, options.opponent, float(delay) * 1e-3, options.bouts) for advice in advices]
            spread = stdev(rates) if len(rates) > 1 else 0.0
            each = " ".join(f"{one:.2f}" for one in rates)
            name = "hold" if hold else "no hold"
            print(f"  {name:8} {delay:>3} ms each way: {mean(rates):.2f} +- {spread:.2f}; each: {each}", flush=True)


if __name__ == "__main__":
    main()
