"""Measures over many seeds, in the kinematic world, what chapters 6 to 8 of Liu & Wu 2001 claim of the surround task.

    PYTHONPATH=. python tests/support/surround_figures.py [SEEDS]

Prints means with 95 % intervals: of 40 seeds in some minutes.
"""

from __future__ import annotations

import sys
from collections import Counter
from math import radians, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from surround_world import Conditions, History, run

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.surround import Sensing, rules
from pal_advisor.surround.measures import dominance, settle_step, stimuli_met

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

STEPS = 50
NOISE = Conditions(distance_noise=0.03, heading_noise=radians(3))
ROUGH = Conditions(distance_noise=0.10, heading_noise=radians(10))
CONVERGING: list[tuple[str, str, Conditions, dict[str, Any]]] = [
    ("B2D3", "", Conditions(), {}),
    ("B2D3", "no learning", Conditions(), {"learning": False}),
    ("B2D3", "noise 3 %, 3 degrees", NOISE, {}),
    ("B2D3", "noise 10 %, 10 degrees", ROUGH, {}),
    ("B2D3", "30 % lost", Conditions(loss=0.3), {}),
    ("B2D3", "noise 3 %, 5 % lost", Conditions(distance_noise=0.03, heading_noise=radians(3), loss=0.05), {}),
    ("B2D3", "headings fixed", Conditions(rigid=True), {}),
    ("B2D3", "order all", Conditions(order="all"), {}),
    ("B2D3", "order sequential", Conditions(order="sequential"), {}),
    ("B2D3", "sensing adjustable", Conditions(), {"sensing": Sensing.ADJUSTABLE}),
    ("B2D3", "sensing fixed", Conditions(), {"sensing": Sensing.FIXED}),
    ("B1D3", "", Conditions(), {}),
    ("B1D3", "no learning", Conditions(), {"learning": False}),
    ("B1D3", "order all", Conditions(order="all"), {}),
    ("B3D3", "", Conditions(), {}),
    ("B1D1", "", Conditions(), {}),
    ("B2D1", "", Conditions(), {}),
    ("B2D4", "wall", Conditions(), {}),
    ("B1D4", "wall", Conditions(), {}),
    ("B1D2", "wall", Conditions(), {}),
    ("B1D1S2", "long range", Conditions(), {}),
    ("B1D3S2", "long range", Conditions(), {}),
]


def interval(values: Sequence[float] | NDArray[np.float64], digits: int = 2) -> str:
    """Mean and half of its 95 % interval."""
    data = np.array(values, dtype=np.float64)
    half = 1.96 * data.std(ddof=1) / sqrt(len(data)) if len(data) > 1 else 0.0
    return f"{data.mean():.{digits}f} ±{half:.{digits}f}"


def say(line: str = "") -> None:
    """Print a line as soon as it is known."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def converging(seeds: int) -> None:
    """D at steps 0, 20 and 50, and who is surrounded."""
    say("case    conditions              D0          D20         D50         D50/D0 (worst)     3-share     outside")
    for name, what, conditions, options in CONVERGING:
        histories = [run(name, seed, STEPS, conditions, **options) for seed in range(1, seeds + 1)]
        distance = np.array([history.distance for history in histories])
        ratio = distance[:, -1] / distance[:, 0]
        cells = [interval(distance[:, step]) for step in (0, 20, 50)]
        cells += [f"{interval(ratio)} ({ratio.max():.2f})"]
        cells += [interval([history.surrounded[-1] for history in histories])]
        cells += [interval([history.outside[-1] for history in histories])]
        say(f"{name:7} {what:22}  " + "  ".join(cells))
        if "S2" in name:
            same = all((history.weights == history.weights[0]).all() for history in histories)
            say(f"{'':31} weights stay exactly uniform: {same}")


def smoothing(seeds: int, steps: int = 100) -> None:
    """Range of learnt weights, stimuli that lost a behaviour, and when D settles."""
    say(f"\nAfter {steps} steps: RANGERs' learnt weights, share of their vectors with a zero, step from which D stays within")
    say("10 % of its way, stimuli met, share of the two largest weights of STIMULUS2")
    for name in [f"{wild}D3L{learning}" for wild in ("B1", "B2") for learning in (1, 2, 3, 4)]:
        histories = [run(name, seed, steps) for seed in range(1, seeds + 1)]
        learnt = [vectors_learnt(history) for history in histories]
        cells = [f"{min(vectors.min() for vectors in learnt):.3f} to {max(vectors.max() for vectors in learnt):.3f}"]
        cells += [interval([(vectors == 0.0).any(axis=1).mean() for vectors in learnt])]
        cells += [interval([settle_step(history.distance) for history in histories], 0)]
        cells += [interval([stimuli_met(history.stimuli) for history in histories], 1)]
        cells += [interval([dominance(history.weights[-1, RobotClass.RANGER, 1]) or 0.0 for history in histories])]
        say(f"{name}  " + "  ".join(f"{cell:15}" for cell in cells))


def vectors_learnt(history: History) -> NDArray[np.float64]:
    """RANGERs' weight vectors at the end that are others than at the start, shape (learnt, N)."""
    first, last = history.weights[0, RobotClass.RANGER], history.weights[-1, RobotClass.RANGER]
    changed: NDArray[np.bool_] = (last != first).any(axis=1)
    return np.compress(changed, last, axis=0)


def learnt_rules(seeds: int, steps: int = 100) -> None:
    """The behaviour of the largest weight, and in how many seeds, of each stimulus that the book has a rule for."""
    for name in ("B1D3", "B2D3"):
        best: dict[str, Counter[str]] = {}
        for seed in range(1, seeds + 1):
            tables = run(name, seed, steps).tables
            for rule in [rule for kind in RobotClass for rule in rules(tables, kind)]:
                if rule.book is not None and len(rule.behaviours) == 1:
                    key = f"{rule.kind.name} STIMULUS{rule.stimulus} ({rule.book.name} {rule.book.behaviour})"
                    best.setdefault(key, Counter())[f"B{rule.behaviours[0]}"] += 1
        say(f"\n{name} after {steps} steps: behaviour of the largest weight, in so many seeds")
        for key, counter in sorted(best.items()):
            say(f"  {key}: " + ", ".join(f"{behaviour} {count}" for behaviour, count in counter.most_common()))


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    converging(count)
    smoothing(count)
    learnt_rules(count)
