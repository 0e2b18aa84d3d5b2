"""Many emulated robots, each in a ring of its own, as a vector environment of Gymnasium: one call of the kernel a step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from firmware_protocol.messages import BoutOutcome
from hil.gym.task import REWARDS, Task, action_space, observation_space, timed_out
from hil.policies import scaled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from firmware_protocol.faults.spec import FaultSpec
    from simdevice.junior.profile import JuniorProfile

_NAMES = np.array([outcome.name.lower() for outcome in BoutOutcome])


class JuniorVectorEnv(VectorEnv["NDArray[np.float32]", "NDArray[np.float32]", "NDArray[Any]"]):
    """Bouts of Junior's, many at a time; each is what `JuniorEnv` plays with the same seed and actions.

    A bout that is over is followed by another in the next step, whose action does nothing and whose reward is 0. `reset` takes
    the options `bout` and `opponent`, each with one value a ring. The `info` of a reset has `bout` and `opponent`, that of a
    step in which bouts have ended `outcome` and `elapsed`, with `_outcome` and `_elapsed` saying where.

    Args:
        num_envs: How many rings.
        opponent: As of `JuniorEnv`, and the others likewise.

    Raises:
        ValueError: As by `JuniorEnv`.
        FaultSpecError: Likewise.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 - declared so by the base class

    def __init__(
        self,
        num_envs: int = 1,
        opponent: str | Sequence[str] = "flat-light",
        *,
        delay: float = 0.0,
        duration: float = 0.1,
        shaping: float = 0.0,
        profile: JuniorProfile | None = None,
        faults: FaultSpec | str | None = None,
    ) -> None:
        self._task = Task.of(opponent, profile, faults, delay=delay, duration=duration, shaping=shaping)
        self._rings = self._task.rings(num_envs)
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = observation_space(), action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators = [np_random()[0] for _ in range(num_envs)]
        self._clearances = np.zeros(num_envs)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin a bout in every ring.

        Args:
            seed: Ring n has the seed that many further on; or one for each. None goes on with those of the last one.
            options: See the class.

        Returns:
            Observations, shape (num_envs, numbers), and info.

        Raises:
            ValueError: An option is unknown or out of range, or there are not as many seeds as rings.
        """
        seeds = [seed + ring for ring in range(self.num_envs)] if isinstance(seed, int) else seed or [None] * self.num_envs
        if len(seeds) != self.num_envs:
            raise ValueError(f"there are {self.num_envs} rings, and {len(seeds)} seeds: give each its own")
        for ring, one in enumerate(seeds):
            if one is not None:
                self._generators[ring] = np_random(one)[0]
        infos = self._begin(range(self.num_envs), options)
        return scaled(self._rings.readings), infos

    def _begin(self, rings: Sequence[int], options: dict[str, Any] | None = None) -> dict[str, Any]:
        """Begin bouts in some rings; returns what there is to be said of them."""
        given = [{name: values[ring] for name, values in (options or {}).items()} for ring in rings]
        drawn = [self._task.draw(self._generators[ring], one) for ring, one in zip(rings, given, strict=True)]
        bouts, opponents = [bout for bout, _ in drawn], [opponent for _, opponent in drawn]
        self._rings.begin(rings, bouts, opponents)
        self._clearances[rings] = self._rings.clearances[rings]
        where = np.zeros(self.num_envs, np.bool_)
        seeds, names = np.zeros(self.num_envs, np.int64), np.full(self.num_envs, "", object)
        where[rings], seeds[rings], names[rings] = True, bouts, opponents
        return {"bout": seeds, "_bout": where, "opponent": names, "_opponent": where.copy()}

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Drive everybody for 20 ms; where a bout was over, begin another.

        Args:
            actions: Left and right wheels, share of full speed, shape (num_envs, 2).

        Returns:
            Observations, rewards, terminations, truncations, infos.

        Raises:
            ValueError: An action is not two finite numbers.
        """
        rings = self._rings
        playing = rings.living.copy()
        rings.actions[:] = actions
        rings.step()
        rewards = np.zeros(self.num_envs)
        if self._task.shaping:
            rewards += self._task.shaping * (self._clearances - rings.clearances)
            self._clearances[:] = rings.clearances
        over = playing & ~rings.living
        infos: dict[str, Any] = {}
        terminated, truncated = over, np.zeros(self.num_envs, np.bool_)
        if over.any():
            rewards[over] += REWARDS[rings.outcomes[over]]
            truncated = over & timed_out(rings.outcomes, rings.clearances)
            terminated = over & ~truncated
            infos = {"outcome": np.where(over, _NAMES[rings.outcomes], ""), "_outcome": over}
            infos |= {"elapsed": np.where(over, rings.periods * rings.period, 0.0), "_elapsed": over.copy()}
        if not playing.all():
            rewards[~playing] = 0.0
            infos |= self._begin(np.flatnonzero(~playing).tolist())
        return scaled(rings.readings), rewards, terminated, truncated, infos
