"""The same actions over the wire give the same observations as in the environment, to the last bit."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import pytest
from wire_driver import WireDriver

from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.messages import OpponentCode
from hil.gym import JuniorEnv
from hil.policies import NAMES, Perception
from simdevice.sumo.junior_world import junior_world
from simdevice.sumo.opponents import OPPONENTS
from simdevice.sumo.settings import WorldSettings
from simdevice.sumo.world import World

if TYPE_CHECKING:
    from numpy.typing import NDArray

STEPS = 800
SEES = NAMES.index("flags.eye_left")
TOUCHES = NAMES.index("flags.arm_left")


@dataclass
class Played:
    """A bout in the environment: what was done, what was seen, how it ended."""

    actions: list[tuple[float, float]] = field(default_factory=list)
    seen: list[NDArray[np.float32]] = field(default_factory=list)
    outcome: str = "undecided"


def reflex(observation: NDArray[np.float32], rng: np.random.Generator) -> tuple[float, float]:
    """Chases, not very well; in permille, as the wire has it."""
    left, right = observation[SEES], observation[SEES + 1]
    wheels = (0.9, 0.9) if left and right else (0.1, 0.6) if left else (0.6, 0.1) if right else (-0.4, 0.4)
    drawn = np.round(np.clip(np.array(wheels) + rng.normal(0.0, 0.1, 2), -1, 1), 3)
    return float(drawn[0]), float(drawn[1])


def play(opponent: str, seed: int, delay: float = 0.0, faults: str | None = None) -> Played:
    env, played, rng = JuniorEnv(opponent, delay=delay, faults=faults), Played(), np.random.default_rng(seed)
    env.reset(seed=99)
    env.step(np.array([1.0, -1.0], np.float32))  # what was before leaves no trace
    observation, _ = env.reset(options={"bout": seed})
    played.seen.append(observation)
    for _ in range(STEPS):
        played.actions.append(reflex(observation, rng))
        observation, _, terminated, truncated, info = env.step(np.array(played.actions[-1], np.float32))
        played.seen.append(observation)
        if terminated or truncated:
            played.outcome = info["outcome"]
            break
    return played


def compare(played: Played, driver: WireDriver, seed: int) -> None:
    readings = driver.play(seed, OpponentCode.KEEP, played.actions)
    perception = Perception()
    over_wire = [perception.observe(reading) for reading in readings]
    whole = len(played.seen) - (played.outcome != "undecided")  # the step in which it ended may have had no reading any more
    assert whole > 20
    np.testing.assert_array_equal(over_wire[:whole], played.seen[:whole])
    assert driver.outcome.name.lower() == played.outcome


@pytest.mark.parametrize("delay", [0.0, 0.01, 0.04])
@pytest.mark.parametrize("opponent", list(OPPONENTS))
@pytest.mark.parametrize("seed", [1, 2])
def test_the_same_actions_give_the_same_observations(opponent: str, seed: int, delay: float) -> None:
    compare(play(opponent, seed, delay), WireDriver(junior_world(WorldSettings(opponent=opponent)), delay), seed)


def test_the_readable_world_gives_the_same() -> None:
    compare(play("corner-light", 4), WireDriver(World(WorldSettings(opponent="corner-light"))), 4)


def test_the_bouts_that_are_compared_have_wins_and_draws_and_touches() -> None:
    played = [play(opponent, seed) for opponent in OPPONENTS for seed in (1, 2)]
    assert {one.outcome for one in played} == {"win", "draw"}
    assert sum(float(np.array(one.seen)[:, TOUCHES].sum()) for one in played) > 50


@pytest.mark.parametrize("faults", ["wheel:left:0.4@{0}+1,stuck:eye_right@{1}", "battery:5@{0}+0.7"])
def test_what_befalls_the_robot_is_the_same(faults: str) -> None:
    played = play("flat-heavy", 2, faults=faults.format(0.1, 0.3))
    settings = WorldSettings(opponent="flat-heavy")
    measured = WireDriver(junior_world(settings))
    measured.play(2, OpponentCode.KEEP, [])
    spec = FaultSpec.parse(faults.format(0.1 + measured.placed, 0.3 + measured.placed))  # there its own time counts
    compare(played, WireDriver(junior_world(WorldSettings(opponent="flat-heavy", faults=spec))), 2)
