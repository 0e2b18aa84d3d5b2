"""Reinforcement learning without a framework: evolution strategies train a small recurrent network to play sumo.

Every generation draws networks around the present one, in mirrored pairs; all play the same bouts, many rings at a time, and
the present network moves towards those that did better (Salimans et al. 2017, with ranks and Adam). On two cores that takes a
few minutes, and the policy that comes out plays wherever advice does:

    python examples/train_policy.py flat-heavy --out heavy.json
    hil bout --controller heavy.json

`hil bout --help` names the opponents. It needs Gymnasium: pip install 'junior-hil[gym]'
"""

from __future__ import annotations

import argparse
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hil.gym import JuniorVectorEnv
from hil.policies import Policy, save_policy
from hil.policies.policy import act

if TYPE_CHECKING:
    from numpy.typing import NDArray

STEP = 0.02
"""Of the environment, in s of robot time."""
SHAPING = 10.0
"""Reward for a metre that the opponent comes nearer to the border; a win is worth 1."""
SIGMA = 0.1
"""Standard deviation of the weights that are tried."""
RATE = 0.05
"""Of learning, to begin with; it falls to nothing."""
MOMENTUM, SCALING = 0.9, 0.99
"""Adam's."""
HELD_OUT = 2**31
"""Seed of the first bout that judges; training draws its own from four billion."""


@dataclass(frozen=True)
class Plan:
    """What is trained, and for how long.

    Attributes:
        opponents: Whom it meets.
        generations: How many.
        population: Networks of a generation; an even number.
        steps: Steps that each plays, in one bout after the other.
        hidden: Numbers that a network remembers.
        seed: Of everything random.
    """

    opponents: tuple[str, ...]
    generations: int
    population: int
    steps: int
    hidden: int
    seed: int

    @property
    def robot_minutes(self) -> float:
        """Robot time that a generation takes."""
        return self.population * self.steps * STEP / 60

    def directions(self, generation: int) -> NDArray[np.float64]:
        """What half of a generation adds to the weights, and the other half takes away; shape (population / 2, weights)."""
        random = np.random.default_rng([self.seed, generation])
        return random.standard_normal((self.population // 2, Policy.size(self.hidden)))


@cache
def rings(count: int, opponents: tuple[str, ...], shaping: float) -> JuniorVectorEnv:
    """An environment; each process makes it once."""
    return JuniorVectorEnv(count, opponents, shaping=shaping)


def play(part: tuple[Plan, NDArray[np.float64], int, int, int]) -> NDArray[np.float64]:
    """Have a part of a generation play.

    Args:
        part: The plan, the weights that it is drawn around, the generation, and from which to which of its pairs.

    Returns:
        What each pair has earned, shape (2, pairs).
    """
    plan, weights, generation, first, end = part
    step = SIGMA * plan.directions(generation)[first:end]
    tried = np.concatenate([weights + step, weights - step])
    env = rings(len(tried), plan.opponents, SHAPING)
    memories, earned = np.zeros((len(tried), plan.hidden)), np.zeros(len(tried))
    observations, _ = env.reset(seed=[plan.seed * 100_000 + generation] * len(tried))  # the same bouts for all of them
    for _ in range(plan.steps):
        actions, memories = act(tried, observations, memories)
        observations, rewards, terminated, truncated, _ = env.step(actions.astype(np.float32))
        memories[terminated | truncated] = 0.0
        earned += rewards
    return earned.reshape(2, -1)


def train(plan: Plan, workers: int) -> NDArray[np.float64]:
    """Train a network.

    Args:
        plan: What is trained.
        workers: Processes; the weights are the same for any number of them.

    Returns:
        Its weights.
    """
    weights = 0.1 * np.random.default_rng([plan.seed, 0]).standard_normal(Policy.size(plan.hidden))
    mean, square = np.zeros_like(weights), np.zeros_like(weights)
    pairs = plan.population // 2
    bounds = np.linspace(0, pairs, workers + 1).astype(int).tolist()
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) if workers > 1 else None
    with pool or nullcontext():
        for generation in range(1, plan.generations + 1):
            parts = [(plan, weights, generation, *ends) for ends in pairwise(bounds) if ends[0] < ends[1]]
            earned = np.concatenate(list(pool.map(play, parts) if pool else map(play, parts)), axis=1)
            ranks = earned.ravel().argsort().argsort().reshape(earned.shape) / (earned.size - 1)
            slope = (ranks[0] - ranks[1]) @ plan.directions(generation) / (pairs * SIGMA)
            mean = MOMENTUM * mean + (1 - MOMENTUM) * slope
            square = SCALING * square + (1 - SCALING) * slope**2
            scale = np.sqrt(square / (1 - SCALING**generation)) + 1e-8
            left = 1 - (generation - 1) / plan.generations
            weights = weights + RATE * left * mean / (1 - MOMENTUM**generation) / scale
            if generation % 25 == 0 or generation == plan.generations:
                spent = f"after {generation * plan.robot_minutes:.0f} robot minutes"
                print(f"generation {generation}: {earned.mean():.2f} earned on average, {spent}", flush=True)
    return weights


def judge(policy: Policy, opponent: str, bouts: int) -> tuple[int, float | None]:
    """Play held-out bouts.

    Args:
        policy: Who plays.
        opponent: Against whom.
        bouts: How many.

    Returns:
        Bouts won, and the median time to win in s; None where none was won.
    """
    env, memories = rings(bouts, (opponent,), 0.0), np.zeros((bouts, policy.hidden))
    weights = np.repeat(policy.weights[None], bouts, 0)
    observations, _ = env.reset(options={"bout": np.arange(HELD_OUT, HELD_OUT + bouts), "opponent": [opponent] * bouts})
    going_on, times = np.ones(bouts, np.bool_), np.full(bouts, np.inf)
    while going_on.any():
        actions, memories = act(weights, observations, memories)
        observations, _, terminated, truncated, infos = env.step(actions.astype(np.float32))
        won: Any = going_on & (infos["outcome"] == "win") if "outcome" in infos else np.zeros(bouts, np.bool_)
        times[won] = infos["elapsed"][won] if won.any() else np.inf
        going_on &= ~(terminated | truncated)
    wins = times[np.isfinite(times)]
    return len(wins), float(np.median(wins)) if len(wins) else None


def main() -> None:
    """Train, judge, and write the policy."""
    parser = argparse.ArgumentParser(description="Train a policy by evolution strategies.")
    parser.add_argument("opponents", nargs="*", default=["flat-light"])
    parser.add_argument("--generations", type=int, default=300)
    parser.add_argument("--population", type=int, default=64)
    parser.add_argument("--steps", type=int, default=750)
    parser.add_argument("--hidden", type=int, default=10)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bouts", type=int, default=500)
    parser.add_argument("--out", type=Path, default=Path("policy.json"))
    options = parser.parse_args()
    opponents = tuple(options.opponents)
    plan = Plan(opponents, options.generations, options.population, options.steps, options.hidden, options.seed)
    weights = train(plan, options.workers).round(6)
    spent = plan.generations * plan.robot_minutes
    note = f"examples/train_policy.py: {plan.generations} generations, {spent:.0f} robot minutes, seed {plan.seed}"
    policy = Policy(weights, plan.hidden, opponents[0] if len(opponents) == 1 else "", note)
    for opponent in opponents:
        wins, time = judge(policy, opponent, options.bouts)
        told = "-" if time is None else f"{time:.2f} s"
        print(f"against {opponent}: won {wins} of {options.bouts} held-out bouts, median time to win {told}")
    save_policy(policy, options.out, overwrite=True)
    print(f"policy: {options.out}")


if __name__ == "__main__":
    main()
