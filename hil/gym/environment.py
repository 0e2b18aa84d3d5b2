"""One emulated robot in the ring, as an environment of Gymnasium."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
from gymnasium.error import ResetNeeded

from firmware_protocol.messages import BoutOutcome
from hil.gym.task import REWARDS, Task, action_space, observation_space, timed_out
from hil.policies import scaled

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from firmware_protocol.faults.spec import FaultSpec
    from simdevice.junior.profile import JuniorProfile


class JuniorEnv(gymnasium.Env["NDArray[np.float32]", "NDArray[np.float32]"]):
    """A bout of Junior's, in steps of 20 ms of robot time: JUNIOR_SENSORS in, JUNIOR_WHEELS out.

    The observation has the numbers of `hil.policies.NAMES`. The action is left and right wheel, share of full speed, -1..1. A
    win is worth 1, a loss -1, a draw 0. Who leaves the ring terminates the episode; the time limit of 15 s truncates it. What
    follows from a reset depends on its seed and the actions alone.

    `reset` takes the options `bout`, a bout's own seed, and `opponent`. Its `info` names both; that of the last step has
    `outcome`, as `win`, and `elapsed`, the time that the bout took, in s.

    Args:
        opponent: Whom it meets; of several, one is drawn for each bout.
        delay: Time that a frame takes, each way, in s: 0 to 0.1.
        duration: How long the wheels go on after an action unless the next one comes, in s.
        shaping: Reward for each metre that the opponent comes nearer to the border; 0 is none.
        profile: The robot's numbers; None are the defaults.
        faults: What befalls the robot in each bout, as data or as text.

    Raises:
        ValueError: No such opponent, or a number is out of range.
        FaultSpecError: Faults can't be read.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - declared so by the base class

    def __init__(
        self,
        opponent: str | Sequence[str] = "flat-light",
        *,
        delay: float = 0.0,
        duration: float = 0.1,
        shaping: float = 0.0,
        profile: JuniorProfile | None = None,
        faults: FaultSpec | str | None = None,
    ) -> None:
        self._task = Task.of(opponent, profile, faults, delay=delay, duration=duration, shaping=shaping)
        self._rings = rings = self._task.rings(1)
        self.observation_space, self.action_space = observation_space(), action_space()
        self._actions, self._readings = rings.actions, rings.readings[0]
        self._living, self._outcomes, self._clearances = rings.living, rings.outcomes, rings.clearances
        self._clearance = 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin a bout.

        Args:
            seed: Seed of this and all later bouts; None goes on with those of the last one.
            options: See the class.

        Returns:
            Observation and info.

        Raises:
            ValueError: An option is unknown or out of range.
        """
        super().reset(seed=seed)
        bout, opponent = self._task.draw(self.np_random, options)
        self._rings.begin([0], [bout], [opponent])
        self._clearance = float(self._clearances[0])
        return scaled(self._readings), {"bout": bout, "opponent": opponent}

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Drive for 20 ms.

        Args:
            action: Left and right wheel, share of full speed, shape (2,).

        Returns:
            Observation, reward, terminated, truncated, info.

        Raises:
            ResetNeeded: No bout is begun, or it is over.
            ValueError: The action is not two finite numbers.
        """
        if not self._living[0]:
            raise ResetNeeded("no bout is going on: call reset() first, and after each that is over")
        self._actions[0] = action
        self._rings.step()
        reward = 0.0
        if self._task.shaping:
            clearance = float(self._clearances[0])
            reward = self._task.shaping * (self._clearance - clearance)
            self._clearance = clearance
        if self._living[0]:
            return scaled(self._readings), reward, False, False, {}
        outcome = BoutOutcome(self._outcomes[0])
        truncated = bool(timed_out(self._outcomes, self._clearances)[0])
        info = {"outcome": outcome.name.lower(), "elapsed": float(self._rings.periods[0] * self._rings.period)}
        return scaled(self._readings), reward + float(REWARDS[outcome]), not truncated, truncated, info
