"""What the environments have in common: who is met, what the line does, and what is rewarded."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
from gymnasium import spaces

from firmware_protocol.faults.spec import FaultSpec
from firmware_protocol.messages import BoutOutcome
from hil.policies import HIGH, LOW
from simdevice.junior.profile import JuniorProfile
from simdevice.kernel.pilot import PilotedRings, check_dummies
from simdevice.sumo.settings import WorldSettings

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

REWARDS: Final = np.zeros(len(BoutOutcome))
"""Of an outcome, by its number."""
REWARDS[BoutOutcome.WIN], REWARDS[BoutOutcome.LOSS] = 1.0, -1.0
_NOTHING: Final[dict[str, Any]] = {"brownouts": (), "stuck": (), "wheels": (), "batteries": ()}
"""What a specification has of a robot, with nothing that befalls it."""
_SEEDS: Final = 2**32
"""Seeds of bouts lie below this."""


@dataclass(frozen=True)
class Task:
    """A bout as a task to be learnt.

    Attributes:
        opponents: Names of the dummies; each bout has one, drawn anew.
        delay: Time that a frame takes, each way, in s: 0 to 0.1.
        duration: How long the wheels go on after an action unless the next one comes, in s: 0.02 to 5.
        shaping: Reward for each metre that the opponent comes nearer to the border; 10 is what the objective *outcome* has
            beside a win. 0: only the outcome counts.
        profile: The robot's numbers.
        faults: What befalls the robot, counted from the beginning of each bout; None is nothing.

    Raises:
        ValueError: There is no such opponent or none at all, or the faults are those of a line.
    """

    opponents: tuple[str, ...] = ("flat-light",)
    delay: float = 0.0
    duration: float = 0.1
    shaping: float = 0.0
    profile: JuniorProfile = field(default_factory=JuniorProfile)
    faults: FaultSpec | None = None

    def __post_init__(self) -> None:
        if not self.opponents:
            raise ValueError("there is to be at least one opponent")
        check_dummies(self.opponents)
        if self.faults is not None and replace(self.faults, **_NOTHING) != FaultSpec():
            raise ValueError("of faults, only those of the robot can befall it here; of a line there is `delay`")

    @classmethod
    def of(
        cls,
        opponent: str | Sequence[str],
        profile: JuniorProfile | None,
        faults: FaultSpec | str | None,
        **others: float,
    ) -> Task:
        """A task as the environments take it.

        Args:
            opponent: One opponent, or several.
            profile: The robot's numbers; None are the defaults.
            faults: As the class has them, or their text.
            others: Numbers among the class's fields.

        Raises:
            ValueError: As the class.
            FaultSpecError: The text says nothing that can go wrong.
        """
        spec = FaultSpec.parse(faults) if isinstance(faults, str) else faults
        opponents = (opponent,) if isinstance(opponent, str) else tuple(opponent)
        return cls(opponents, profile=JuniorProfile() if profile is None else profile, faults=spec, **others)

    def rings(self, count: int) -> PilotedRings:
        """Rings to play in.

        Args:
            count: How many.

        Raises:
            ValueError: There are none, or a time is out of range.
        """
        settings = WorldSettings(opponent=self.opponents[0], referee=False, profile=self.profile, faults=self.faults)
        return PilotedRings(count, settings, delay=self.delay, duration=self.duration)

    def draw(self, random: np.random.Generator, options: Mapping[str, Any] | None = None) -> tuple[int, str]:
        """Seed and opponent of a bout.

        Args:
            random: Where what is not given comes from.
            options: What is given: `bout` is the seed, `opponent` the name.

        Raises:
            ValueError: Something else is given, or the seed is out of range.
        """
        given = dict(options or {})
        seed, at = int(random.integers(_SEEDS)), int(random.integers(len(self.opponents)))
        seed, opponent = given.pop("bout", seed), given.pop("opponent", self.opponents[at])
        if given:
            raise ValueError(f"no option of a bout is called {next(iter(given))!r}: choose from bout, opponent")
        if not 0 <= seed < _SEEDS:
            raise ValueError(f"the bout's seed is {seed}: it must lie within 0 and {_SEEDS - 1}")
        check_dummies([opponent])
        return int(seed), opponent


def observation_space() -> spaces.Space[NDArray[np.float32]]:
    """Of one robot: the numbers of `hil.policies.NAMES`."""
    return cast("spaces.Space[NDArray[np.float32]]", spaces.Box(LOW, HIGH, dtype=np.float32))


def action_space() -> spaces.Space[NDArray[np.float32]]:
    """Of one robot: left and right wheel, share of full speed."""
    return cast("spaces.Space[NDArray[np.float32]]", spaces.Box(-1.0, 1.0, (2,), np.float32))


def timed_out(outcomes: NDArray[np.uint8], clearances: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Bouts that the time limit has ended: draws with the opponent in the ring. Where both are out it is none.

    Args:
        outcomes: As of `PilotedRings`.
        clearances: Likewise, in m.
    """
    ended: NDArray[np.bool_] = (outcomes == BoutOutcome.DRAW) & (clearances >= 0.0)
    return ended
