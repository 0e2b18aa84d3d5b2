"""What coaching is worth: coach with several seeds, then play held-out bouts with each advice.

The bouts have seeds that no coaching uses. Settings come as `--set NAME=VALUE` (see `PalSettings`), so that one lever can be
judged at a time; tune on some seeds, judge on others.

    python benchmarks/coaching.py [--opponents flat-light,flat-heavy] [--seeds 1-8] [--bouts 500] [--set phases=basic]
"""

from __future__ import annotations

import argparse
import json
from statistics import mean, stdev

import hil
from hil.seeds import Branch, bout_seed
from hil.sumo.bouts import Tally, play
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.controllers import AdviceController
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import PalSettings

DUMMIES = "flat-light,flat-heavy,curved-light,corner-light,point-light"
JUDGE = 77
"""Seed of the held-out bouts."""


def coached(opponent: str, seed: int, settings: PalSettings, bouts: int) -> Tally:
    """Coach once, and play.

    Args:
        opponent: Against whom.
        seed: Seed of the coaching.
        settings: How to coach.
        bouts: Held-out bouts.
    """
    with hil.connect(f"sim://junior?opponent={opponent}&seed={seed}") as junior:
        junior.arm()
        ring = open_ring(junior)
        coaching = Coaching(ring, new_pal(settings, seed), seed=seed)
        coaching.run()
        player = AdviceController(coaching.pal.advice())
        seeds = [bout_seed(JUDGE, Branch.BOUTS, number) for number in range(1, bouts + 1)]
        return Tally.of(opponent, list(play(ring, player, seeds)))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--opponents", default=DUMMIES)
    parser.add_argument("--seeds", default="1-8", help="first-last")
    parser.add_argument("--bouts", type=int, default=500, help="held-out bouts for each seed")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of Pal's")
    options = parser.parse_args()
    changes = dict(change.split("=", 1) for change in options.set)
    plain = {name: value if name in {"phases", "objective"} else json.loads(value) for name, value in changes.items()}
    settings = PalSettings.from_dict(plain)
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    print(f"{settings.budget} maneuvers, objective {settings.objective}, changed: {plain or 'nothing'}")
    print(f"{options.bouts} held-out bouts each, seeds {options.seeds}")
    for opponent in options.opponents.split(","):
        tallies = [coached(opponent, seed, settings, options.bouts) for seed in seeds]
        rates = [tally.win_rate.value for tally in tallies]
        spread = stdev(rates) if len(rates) > 1 else 0.0
        times = [tally.median_time_to_win for tally in tallies if tally.median_time_to_win is not None]
        time = f"{mean(times):.1f} s" if times else "-"
        each = " ".join(f"{rate:.3f}" for rate in rates)
        print(f"  {opponent:13} {mean(rates):.3f} +- {spread:.3f}, won in {time} by the median; each: {each}", flush=True)


if __name__ == "__main__":
    main()
