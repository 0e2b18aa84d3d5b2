"""Many idle Juniors in lock-step on one line: simulated seconds per second of processor time, everything on, recorder off.

Each robot streams its sensors, its heartbeat and its status, is compared in time once a second, and has a referee that reports.
With another checkout of this project, whose extension is built, its runs take turns with these, each in a process of its own.

    python benchmarks/idle_crowd.py [CHECKOUT] [--count 100] [--seconds 10] [--rounds 3]
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path
from time import process_time

import hil

HERE = Path(__file__).resolve()


def measure(count: int, seconds: float) -> float:
    """Connect to so many and let time pass.

    Returns:
        Simulated seconds per second of this process.
    """
    with hil.connect_all(f"sim://junior?count={count}", expect=count, timeout=20.0) as robots:
        robots.wait(1.0)
        since, start = robots.now(), process_time()
        robots.wait(seconds)
        return (robots.now() - since) / (process_time() - start)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkout", nargs="?", type=Path, help="another checkout, to be compared with")
    parser.add_argument("--count", type=int, default=100, help="robots on the line")
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated seconds a round")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--once", action="store_true", help="measure in this process, and print the figure alone")
    options = parser.parse_args()
    if options.once:
        print(measure(options.count, options.seconds))
        return
    folders = [HERE.parents[1], *([options.checkout.resolve()] if options.checkout is not None else [])]
    command = [sys.executable, str(HERE), "--once", "--count", str(options.count), "--seconds", str(options.seconds)]
    speeds: dict[Path, list[float]] = {folder: [] for folder in folders}
    for _ in range(options.rounds):
        for folder, measured in speeds.items():
            environment = {**os.environ, "PYTHONPATH": str(folder)}
            done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)  # noqa: S603
            measured.append(float(done.stdout))
    print(f"{options.count} idle robots on one line")
    for folder, measured in speeds.items():
        print(f"  {folder!s:60} {statistics.median(measured):6.2f} x real time by CPU (median of {options.rounds})")
    if len(folders) > 1:
        ratios = [one / other for one, other in zip(*speeds.values(), strict=True)]
        print(f"  here / there: {statistics.median(ratios):.2f} (median), {min(ratios):.2f} to {max(ratios):.2f}")


if __name__ == "__main__":
    main()
