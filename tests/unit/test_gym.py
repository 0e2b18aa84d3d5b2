"""The environments of Gymnasium: what it asks of them, and what a bout's rules make of an episode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from hil.gym import ENVIRONMENT, JuniorEnv, JuniorVectorEnv
from hil.policies import HIGH, LOW, NAMES
from simdevice.kernel.pilot import PilotedRings
from simdevice.sumo.opponents import OPPONENTS
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from numpy.typing import NDArray

AHEAD, SPIN, STOP = (np.array(wheels, np.float32) for wheels in ((1.0, 1.0), (-0.5, 0.5), (0.0, 0.0)))
SEES = NAMES.index("flags.eye_left")


def reflex(observation: NDArray[np.float32]) -> NDArray[np.float32]:
    """Ahead where both eyes see, else round and round."""
    return AHEAD if observation[SEES] and observation[SEES + 1] else SPIN * np.float32(0.6)


def episode(env: JuniorEnv, **options: Any) -> tuple[list[float], bool, bool, dict[str, Any]]:  # noqa: ANN401 - of reset
    observation, _ = env.reset(options=options)
    rewards = []
    while True:
        observation, reward, terminated, truncated, info = env.step(reflex(observation))
        rewards.append(reward)
        if terminated or truncated:
            return rewards, terminated, truncated, info


@pytest.mark.parametrize("opponent", list(OPPONENTS))
def test_gymnasium_s_checker_has_nothing_to_say(opponent: str) -> None:
    check_env(gymnasium.make(f"hil.gym:{ENVIRONMENT}", opponent=opponent).unwrapped)


def test_the_vector_environment_is_made_by_the_same_name() -> None:
    envs = gymnasium.make_vec(f"hil.gym:{ENVIRONMENT}", num_envs=3, vectorization_mode="vector_entry_point", shaping=1.0)
    assert isinstance(envs.unwrapped, JuniorVectorEnv)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    observations, infos = envs.reset(seed=1)
    assert observations in envs.observation_space
    assert infos["_bout"].all()
    assert envs.step(envs.action_space.sample())[0] in envs.observation_space


def test_the_kernel_and_the_observation_have_the_same_numbers() -> None:
    rings = PilotedRings(1, WorldSettings(referee=False))
    assert len(NAMES) == len(LOW) == len(HIGH) == rings.readings.shape[1] == 18


@pytest.mark.parametrize("opponent", list(OPPONENTS))
def test_every_ring_of_a_vector_plays_what_one_alone_plays(opponent: str) -> None:
    rng = np.random.default_rng(3)
    envs = JuniorVectorEnv(5, opponent, shaping=2.0)
    singles = [JuniorEnv(opponent, shaping=2.0) for _ in range(5)]
    observations, infos = envs.reset(seed=11)
    for ring, env in enumerate(singles):
        observation, info = env.reset(seed=11 + ring)
        np.testing.assert_array_equal(observation, observations[ring])
        assert info["bout"] == infos["bout"][ring]
    over, ended = np.zeros(5, bool), 0
    for _ in range(800):
        actions = np.array([reflex(one) for one in observations]) + rng.normal(0, 0.2, (5, 2)).astype(np.float32)
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        for ring, env in enumerate(singles):
            if over[ring]:
                observation, info = env.reset()
                assert (rewards[ring], terminated[ring], truncated[ring]) == (0.0, False, False)
                assert infos["bout"][ring] == info["bout"]
            else:
                observation, reward, *end, info = env.step(actions[ring])
                assert (reward, *end) == (rewards[ring], terminated[ring], truncated[ring])
                if any(end):
                    ended += 1
                    assert infos["outcome"][ring] == info["outcome"]
                    assert infos["elapsed"][ring] == info["elapsed"]
            np.testing.assert_array_equal(observation, observations[ring])
        over = terminated | truncated
    assert ended > 4


def test_a_seed_decides_and_nothing_before_it() -> None:
    fresh, used = JuniorEnv(list(OPPONENTS)), JuniorEnv(list(OPPONENTS))
    used.reset(seed=3)
    for _ in range(20):
        used.step(SPIN)
    seen = []
    for env in (fresh, used):
        observation, info = env.reset(seed=5)
        seen.append([info["bout"], info["opponent"], observation, *[env.step(SPIN * np.float32(0.4))[0] for _ in range(100)]])
    assert seen[0][:2] == seen[1][:2]
    np.testing.assert_array_equal(seen[0][2:], seen[1][2:])


def test_of_several_opponents_each_is_met() -> None:
    env = JuniorEnv(("flat-heavy", "point-light"))
    assert {env.reset(seed=seed)[1]["opponent"] for seed in range(12)} == {"flat-heavy", "point-light"}
    assert env.reset(options={"opponent": "curved-light"})[1]["opponent"] == "curved-light"


def test_a_win_is_worth_1_and_terminates() -> None:
    env = JuniorEnv()
    played = [episode(env, bout=seed) for seed in range(12)]
    won = [one for one in played if one[3]["outcome"] == "win"]
    assert won
    for rewards, terminated, truncated, info in won:
        assert rewards == [0.0] * (len(rewards) - 1) + [1.0]
        assert (terminated, truncated) == (True, False)
        assert info["elapsed"] == pytest.approx(0.04 + 0.02 * len(rewards), abs=0.02)


def test_driving_out_is_a_loss_and_terminates() -> None:
    env = JuniorEnv()
    env.reset(options={"bout": 3})
    for _ in range(200):
        _, reward, terminated, truncated, info = env.step(-AHEAD)
        if terminated or truncated:
            break
    assert (reward, terminated, truncated, info["outcome"]) == (-1.0, True, False, "loss")


def test_the_time_limit_truncates_and_is_worth_nothing() -> None:
    env = JuniorEnv()
    env.reset(seed=1)
    steps, truncated = 0, False
    while not truncated:
        observation, reward, terminated, truncated, info = env.step(STOP)
        steps += 1
        assert observation in env.observation_space
    assert (steps, reward, terminated, info) == (748, 0.0, False, {"outcome": "draw", "elapsed": 15.0})
    with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
        env.step(STOP)


def test_shaping_adds_what_the_opponent_came_nearer_to_the_border() -> None:
    plain, shaped = JuniorEnv(), JuniorEnv(shaping=10.0)
    for seed in range(6):
        first, second = episode(plain, bout=seed), episode(shaped, bout=seed)
        assert first[1:] == second[1:]
        start = plain._task.rings(1)
        start.begin([0], [seed])
        if first[3]["outcome"] == "win":  # the whole way from where it stood to the border
            assert sum(second[0]) - sum(first[0]) == pytest.approx(10.0 * start.clearances[0], abs=0.05)


def test_wheels_go_on_for_the_duration_and_no_longer() -> None:
    ways = []
    for duration in (0.02, 0.5):
        rings = PilotedRings(1, WorldSettings(referee=False), duration=duration)
        rings.begin([0], [1])
        rings.actions[0] = 0.6
        rings.step()
        for _ in range(5):
            rings._live_for(4)
        ways.append(rings.worlds[0].match.robot.motors.travel_left)
    assert ways[0] < 0.4 * ways[1]


def test_a_robot_that_booted_is_armed_again() -> None:
    env = JuniorEnv(faults="brownout:0.3+0.1")
    env.reset(seed=1)
    times, ways = [], []
    for _ in range(60):
        observation, *_ = env.step(SPIN)
        times.append(float(observation[-1]))
        ways.append(float(observation[NAMES.index("travel.right")]))
    assert times == sorted(times)
    assert ways[5] > 0.2
    assert ways[-1] > 0.2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"opponent": "flat-hevy"}, "called 'flat-hevy': choose from .* Did you mean flat-heavy"),
        ({"opponent": "junior"}, "a second Junior plays in `hil bout` alone"),
        ({"opponent": ()}, "at least one opponent"),
        ({"delay": 0.2}, "delay is 0.2 s: it must lie within 0 and 0.1"),
        ({"duration": 0.001}, "duration is 0.001 s: it must lie within 0.02 and 5"),
        ({"faults": "drop:0.1"}, "only those of the robot .* `delay`"),
    ],
)
def test_what_cannot_be_played_is_refused(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        JuniorEnv(**arguments)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"bouts": 3}, "no option of a bout is called 'bouts': choose from bout, opponent"),
        ({"bout": -1}, "the bout's seed is -1"),
        ({"opponent": "nobody"}, "called 'nobody'"),
    ],
)
def test_options_of_a_bout_that_make_no_sense_are_refused(options: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        JuniorEnv().reset(options=options)


def test_an_action_that_is_no_number_is_refused_and_one_beyond_the_limit_is_at_it() -> None:
    env, other = JuniorEnv(), JuniorEnv()
    env.reset(seed=1)
    other.reset(seed=1)
    with pytest.raises(ValueError, match="not a number"):
        env.step(np.array([0.0, np.nan], np.float32))
    for _ in range(3):
        np.testing.assert_array_equal(env.step(AHEAD * 7)[0], other.step(AHEAD)[0])


def test_as_many_seeds_as_rings() -> None:
    with pytest.raises(ValueError, match="there are 2 rings, and 3 seeds"):
        JuniorVectorEnv(2).reset(seed=[1, 2, 3])
