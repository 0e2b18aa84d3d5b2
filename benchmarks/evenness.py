"""How surely wheels are found to be even: emulated robots whose left wheel is weaker, each measured as before a coaching.

python benchmarks/evenness.py [--robots 60] [--gains 1,0.98,0.95,0.93,0.9,0.85] [--noises 0.05,0.02]
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from itertools import product

import numpy as np

from firmware_protocol.links.memory import MemoryLink
from hil.bridge.bridge import Bridge
from hil.sumo.attended.evenness import WheelVerdict, measure_wheels
from hil.sumo.junior import Junior
from simdevice.junior.profile import JuniorProfile
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.settings import WorldSettings

TOLD = (WheelVerdict.EVEN, WheelVerdict.UNCLEAR, WheelVerdict.UNEVEN)


def measured(profile: JuniorProfile, seed: int) -> tuple[WheelVerdict, float]:
    """Measure one robot.

    Args:
        profile: Its numbers.
        seed: Of everything random.

    Returns:
        What was found, and how long it took, in s of the robot's time.
    """
    world = junior_world(WorldSettings(seed=seed, referee=False, profile=profile))
    with Junior(Bridge(MemoryLink(world), world)) as junior:
        junior.find()
        junior.arm()
        begun = junior.now()
        return measure_wheels(junior).verdict, junior.now() - begun


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=60)
    parser.add_argument("--gains", default="1,0.98,0.95,0.93,0.9,0.85", help="effort of the left wheel; the right one's is 1")
    parser.add_argument("--noises", default="0.05,0.02", help="standard deviation of a wheel's effort from drive to drive")
    options = parser.parse_args()
    sys.stdout.write(f"| noise | left wheel | {' | '.join(TOLD)} | median time, s |\n|---|---|{'---|' * len(TOLD)}---|\n")
    for noise, gain in product(map(float, options.noises.split(",")), map(float, options.gains.split(","))):
        profile = JuniorProfile(wheel_gain=(gain, 1.0), command_noise=noise)
        verdicts, times = zip(*(measured(profile, seed) for seed in range(options.robots)), strict=True)
        counts = Counter(verdicts)
        told = " | ".join(str(counts[verdict]) for verdict in TOLD)
        sys.stdout.write(f"| {noise:g} | {gain:g} | {told} | {np.median(times):.1f} |\n")
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
