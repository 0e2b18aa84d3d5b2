"""How long searches among the conditions of chapter 9 take, table by table, with default noise, contacts and real messages.

Each is one command, timed from its first word to its last, process starts and all: the genetic search of 7 x 40, all 96
conditions ten times each, and single evaluations of 20 steps in this process. A kinematic prototype without wire and physics
took 4 s for 280 evaluations in one thread.

    python benchmarks/evolution.py [--workers 2] [--rounds 3] [--without ga exhaustive]
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from statistics import median
from time import perf_counter
from typing import Any

from hil.swarm.missions.evolving.evaluation import EvaluationTask, evaluate
from hil.swarm.missions.surround_settings import SurroundSettings
from pal_advisor.surround import Case

SEARCHES = {
    "ga": (["--repeats", "1"], 180.0),
    "exhaustive": (["--search", "exhaustive", "--repeats", "10"], 600.0),
}
"""Options, and the time that is aimed at on two cores, in s."""
EVALUATION = 1.0
"""The same for an evaluation."""
CASES = ("B1D3", "B2D1", "B3D2", "B1D4S2")


def searched(options: list[str], workers: int) -> tuple[float, dict[str, Any]]:
    """How long a search took, in s, and what it said."""
    command = [
        "swarm",
        "surround",
        "--evolve",
        "contact",
        "--workers",
        str(workers),
        *options,
        "--json",
        "--quiet",
        "--no-report",
    ]
    with tempfile.TemporaryDirectory() as folder:
        begun = perf_counter()
        done = subprocess.run(  # noqa: S603 - our own program
            [sys.executable, "-m", "hil", *command], cwd=folder, check=True, capture_output=True, text=True
        )
        taken = perf_counter() - begun
    return taken, json.loads(done.stdout)


def main() -> int:
    """Measure, print; exit status 1 where something takes longer than is aimed at."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3, help="of single evaluations")
    parser.add_argument("--without", nargs="*", default=[], choices=list(SEARCHES))
    options = parser.parse_args()
    slow = False
    settings = SurroundSettings(steps=20)
    evaluate(EvaluationTask(settings, Case(), 1))  # what is loaded once
    for name in CASES:
        times = []
        for seed in range(1, options.rounds + 1):
            begun = perf_counter()
            evaluate(EvaluationTask(settings, Case.parse(name), seed))
            times.append(perf_counter() - begun)
        slow = slow or median(times) > EVALUATION
        print(f"an evaluation of 20 steps, {name}: {median(times):.2f} s (aim {EVALUATION:g})")
    for name, (more, aim) in SEARCHES.items():
        if name in options.without:
            continue
        taken, found = searched(more, options.workers)
        slow = slow or taken > aim
        rate = found["evaluations"] / taken
        print(
            f"{name}: {found['evaluations']} evaluations by {options.workers} workers in {taken:.1f} s (aim {aim:g}), "
            f"{rate:.1f} a second; best {found['best']['case']}"
        )
    return int(slow)


if __name__ == "__main__":
    sys.exit(main())
