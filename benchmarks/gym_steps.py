"""Steps a second of the environments for reinforcement learning, and robot time against real time.

A policy that was drawn by chance plays, so that bouts are begun and ended as in training; the time of its network is not
counted. Beside a single environment stand vector environments of several sizes, and what Gymnasium makes of as many single
ones in one process. By processor time, the median of some rounds; a round below the aim makes it exit 1.

    python benchmarks/gym_steps.py [--opponent flat-light] [--rounds 5] [--steps 40000]
"""

from __future__ import annotations

import argparse
import statistics
import sys
from time import process_time
from typing import TYPE_CHECKING

import gymnasium
import numpy as np

from hil.gym import ENVIRONMENT, JuniorEnv
from simdevice.kernel.pilot import STEP

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

AIM = 50_000
"""Steps a second and core of a single environment."""
SIZES = (1, 16, 64, 256)


def drawn(steps: int, count: int) -> NDArray[np.float32]:
    """Actions that are held for a tenth of a second each, shape (steps, count, 2)."""
    random = np.random.default_rng(1)
    return random.normal((0.35, 0.3), 0.45, (steps // 5 + 1, count, 2)).clip(-1, 1).repeat(5, axis=0).astype(np.float32)


def single(opponent: str, steps: int) -> float:
    """Steps a second of one environment."""
    env, actions = JuniorEnv(opponent), drawn(steps, 1)[:, 0]
    env.reset(seed=1)
    begun = process_time()
    for action in actions[:steps]:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
    return steps / (process_time() - begun)


def vector(opponent: str, steps: int, count: int, mode: str) -> float:
    """Steps a second of many, each counted."""
    envs = gymnasium.make_vec(ENVIRONMENT, num_envs=count, vectorization_mode=mode, opponent=opponent)
    actions = drawn(steps // count, count)[: steps // count]
    envs.reset(seed=1)
    begun = process_time()
    for action in actions:
        envs.step(action)
    return len(actions) * count / (process_time() - begun)


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--opponent", default="flat-light")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=40_000)
    options = parser.parse_args()
    opponent, steps = options.opponent, options.steps
    rows: dict[str, Callable[[], float]] = {"one environment": lambda: single(opponent, steps)}
    for count in SIZES:
        rows[f"vector of {count}"] = lambda count=count: vector(opponent, steps, count, "vector_entry_point")  # type: ignore[misc]
    rows["16 single ones, by Gymnasium"] = lambda: vector(opponent, steps, 16, "sync")
    measured: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(options.rounds):
        for name, measure in rows.items():
            measured[name].append(measure())
    for name, rates in measured.items():
        middle = statistics.median(rates)
        spread = f"({min(rates):,.0f} to {max(rates):,.0f})"
        print(f"{name:30} {middle:9,.0f} steps a second {spread}, {middle * STEP:,.0f} times real time")
    if statistics.median(measured["one environment"]) < AIM:
        sys.exit(f"one environment makes fewer than {AIM:,} steps a second")


if __name__ == "__main__":
    main()
