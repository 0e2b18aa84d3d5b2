"""How a class of robots senses, moves and learns."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from enum import StrEnum
from math import isfinite
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.fields import Fields, SettingsError, shown
from pal_advisor.surround.case import MOST_ROBOTS, Case, WildMotion
from pal_advisor.surround.experience import INCREMENTS
from pal_advisor.surround.stimuli import MOST_SECTORS, stimuli_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

MOST_GAIN: Final = 1e6
"""No gain is greater."""
MOST_ROUNDS: Final = 1_000_000
"""No number of rounds is greater."""


class Motion(StrEnum):
    """Motion mechanisms (Liu & Wu 2001, 6.1.7)."""

    EXPERIENCE = "experience"
    """A behaviour is selected by what was learnt, and learnt from."""
    CONDITIONAL = "conditional"
    """For some stimuli a behaviour is given; for the rest it is selected. Learning goes on."""
    RANDOM = "random"
    """Any behaviour that the robot can perform; nothing is learnt."""
    STATIONARY = "stationary"


class Sensing(StrEnum):
    """How the stimulus is taken from what the ring reads (6.1.4)."""

    HYBRID = "hybrid"
    """Who is within R0 makes the stimulus; when nobody is, it is STIMULUS1, and whom the grown radius shows gives the frame."""
    ADJUSTABLE = "adjustable"
    """Whom the grown radius shows makes both (Fig. 6.6)."""
    FIXED = "fixed"
    """Who is within R0 makes both."""


@dataclass(frozen=True)
class GroupSettings:
    """How a class of robots senses, moves and learns.

    Attributes:
        kind: The class.
        robots: How many there are.
        sectors: N, of sensors and of behaviours, 1 to 16.
        motion: Motion mechanism.
        sensing: What makes the stimulus.
        smoothing: function2 is part of shape (Eq. 6.14).
        by_maximum: The largest weight is selected (Eq. 6.19), and not by probability (Eq. 6.18).
        increment: Number of the increment (`INCREMENTS`).
        gain: Its c.
        learning: Weights are updated.
        feasible: Which behaviours the robots can perform, B1 first, as N digits 1 or 0; empty for all of them.
        conditional: With `Motion.CONDITIONAL`, the behaviour 1..N given for a stimulus, by its number.
        mutate_after: A robot that has met one stimulus for so many rounds, while its weights did not change, performs a random
            behaviour once (rule RC1, Eq. 7.8); 0 for never.

    Raises:
        SettingsError: A value makes no sense.
    """

    kind: RobotClass
    robots: int
    sectors: int = 8
    motion: Motion = Motion.EXPERIENCE
    sensing: Sensing = Sensing.HYBRID
    smoothing: bool = True
    by_maximum: bool = False
    increment: int = 1
    gain: float = 0.5
    learning: bool = True
    feasible: str = ""
    conditional: Mapping[int, int] = field(default_factory=dict)
    mutate_after: int = 0

    def __post_init__(self) -> None:
        self._require("robots", 0 <= self.robots <= MOST_ROBOTS, f"0 to {MOST_ROBOTS}")
        self._require("sectors", 1 <= self.sectors <= MOST_SECTORS, f"1 to {MOST_SECTORS}")
        self._require("increment", self.increment in INCREMENTS, f"one of {', '.join(map(str, INCREMENTS))}")
        self._require("gain", isfinite(self.gain) and 0.0 <= self.gain <= MOST_GAIN, f"a number, 0 to {MOST_GAIN:g}")
        self._require("mutate_after", 0 <= self.mutate_after <= MOST_ROUNDS, f"0 to {MOST_ROUNDS}")
        digits = set(self.feasible) <= {"0", "1"} and len(self.feasible) in {0, self.sectors}
        self._require("feasible", digits, f"{self.sectors} digits 0 or 1, B1 first")
        unused = not self.conditional or self.motion == Motion.CONDITIONAL
        self._require("conditional", unused, f"none unless the motion is {Motion.CONDITIONAL.value}")
        stimuli = len(stimuli_of(self.sectors))
        for stimulus, behaviour in self.conditional.items():
            self._require("conditional", 1 <= stimulus <= stimuli, f"stimuli from 1 to {stimuli}")
            self._require("conditional", 1 <= behaviour <= self.sectors, f"behaviours from 1 to {self.sectors}")
            self._require("conditional", bool(self.mask[behaviour - 1]), f"none that is not feasible, as B{behaviour}")

    def _require(self, name: str, condition: bool, wanted: str) -> None:  # noqa: FBT001
        if not condition:
            value = getattr(self, name)
            raise SettingsError(name, f"{shown(dict(value) if name == 'conditional' else value)} won't do; wanted: {wanted}")

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Which behaviours are feasible, shape (N,)."""
        return np.array([digit == "1" for digit in self.feasible or "1" * self.sectors])

    @property
    def sign(self) -> int:
        """1 for a class that wants others inside its radius, -1 for one that wants them out of it."""
        return 1 if self.kind == RobotClass.RANGER else -1

    @property
    def learns(self) -> bool:
        """Weights are updated, by mechanism and setting."""
        return self.learning and self.motion in {Motion.EXPERIENCE, Motion.CONDITIONAL}

    def to_dict(self) -> dict[str, Any]:
        """Settings as plain values."""
        return {
            **asdict(self),
            "kind": self.kind.name.lower(),
            "motion": self.motion.value,
            "sensing": self.sensing.value,
            "conditional": [[stimulus, behaviour] for stimulus, behaviour in self.conditional.items()],
        }

    @classmethod
    def from_fields(cls, fields: Fields) -> GroupSettings:
        """The inverse of `to_dict`.

        Args:
            fields: What it gave.

        Raises:
            FieldError: A field is missing, unknown or wrong; of the kind that the fields raise.
        """
        values: dict[str, Any] = {
            "kind": RobotClass[_one_of(fields, "kind", [kind.name.lower() for kind in RobotClass]).upper()],
            "robots": fields.integer("robots", 0, MOST_ROBOTS),
            "sectors": fields.integer("sectors", 1, MOST_SECTORS),
            "motion": Motion(_one_of(fields, "motion", list(Motion))),
            "sensing": Sensing(_one_of(fields, "sensing", list(Sensing))),
            "smoothing": fields.flag("smoothing"),
            "by_maximum": fields.flag("by_maximum"),
            "increment": fields.integer("increment"),
            "gain": fields.number("gain", 0.0, MOST_GAIN),
            "learning": fields.flag("learning"),
            "feasible": fields.text("feasible"),
            "conditional": dict(_pair(fields, path, pair) for path, pair in fields.items("conditional")),
            "mutate_after": fields.integer("mutate_after", 0, MOST_ROUNDS),
        }
        fields.done()
        try:
            return cls(**values)
        except SettingsError as error:
            raise fields.wrong(error.path, str(error).partition(": ")[2]) from error


def _one_of(fields: Fields, name: str, known: list[Any]) -> str:
    value = fields.text(name)
    if value not in known:
        raise fields.wrong(name, f"expected one of {', '.join(known)}, not {shown(value)}")
    return value


def _pair(fields: Fields, path: str, pair: object) -> tuple[int, int]:
    if not isinstance(pair, list) or len(pair) != 2 or any(type(number) is not int for number in pair):
        raise fields.wrong("conditional", f"expected [stimulus, behaviour], as numbers, at {path}, not {shown(pair)}")
    return pair[0], pair[1]


def case_settings(
    case: Case,
    *,
    sectors: int = 8,
    sensing: Sensing = Sensing.HYBRID,
    gain: float = 0.5,
    learning: bool = True,
    feasible: str = "",
    conditional: Mapping[RobotClass, Mapping[int, int]] | None = None,
    mutate_after: int = 0,
) -> tuple[GroupSettings, GroupSettings]:
    """How the RANGERs and the WILDs of a case sense, move and learn.

    Args:
        case: The case; B is how the WILDs move.
        sectors: See `GroupSettings`, as the following, for both classes.
        sensing: For both classes.
        gain: For both classes.
        learning: For both classes.
        feasible: For both classes.
        conditional: Behaviours given for stimuli, by class; what the class learns otherwise stays as the case says. A class
            that stands still or moves at random has none.
        mutate_after: For the RANGERs.

    Returns:
        Settings of the RANGERs, and of the WILDs.

    Raises:
        SettingsError: A value makes no sense.
    """
    given = conditional or {}
    wild_motion = {
        WildMotion.LEARNING: Motion.EXPERIENCE,
        WildMotion.STATIONARY: Motion.STATIONARY,
        WildMotion.RANDOM: Motion.RANDOM,
    }[case.wild_motion]

    def settings(kind: RobotClass, robots: int, motion: Motion, mutate_after: int) -> GroupSettings:
        table = given.get(kind, {})
        return GroupSettings(
            kind=kind,
            robots=robots,
            sectors=sectors,
            motion=Motion.CONDITIONAL if table and motion == Motion.EXPERIENCE else motion,
            sensing=sensing,
            smoothing=case.smoothing,
            by_maximum=case.by_maximum,
            increment=case.increment,
            gain=gain,
            learning=learning,
            feasible=feasible,
            conditional=table,
            mutate_after=mutate_after,
        )

    return (
        settings(RobotClass.RANGER, case.rangers, Motion.EXPERIENCE, mutate_after),
        settings(RobotClass.WILD, case.wilds, wild_motion, 0),
    )
