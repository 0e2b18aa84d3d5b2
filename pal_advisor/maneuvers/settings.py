"""What Pal can be told about how to coach."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

from firmware_protocol.vocabulary import LEAST_PERIOD, MAX_ACTIONS, MOST_PERIOD
from pal_advisor.fields import SettingsError, is_number, shown

if TYPE_CHECKING:
    from collections.abc import Mapping

Phases = Literal["multi", "basic", "fine"]
"""Both phases; the basic actions alone; the fine actions alone, from the beginning."""

MOST_MEMBERS: Final = 10_000
"""No population is larger."""
MOST_BUDGET: Final = 10_000_000
"""No budget is greater."""
MOST_AGAIN: Final = 1000
"""No maneuver is handed out again more often in a bout."""
MOST_BROOD: Final = 100
"""No more children are bred for a place."""
MOST_WORTH: Final = 1e6
"""No weight and no time is greater, so that every fitness is a number."""
BEFORE: Final[Mapping[str, Any]] = {"mirror": False, "surrogate": False, "again": 0, "brood": 1, "exam_whole_bout": False}
"""How it was coached before there were these settings: what is saved without them went on so."""
_SINCE: Final = {*BEFORE, "curiosity"}
_KINDS: Final = {int: "a whole number", float: "a number", bool: "true or false", str: "a text"}


class Objective(StrEnum):
    """What a good maneuver is."""

    CONTACT = "contact"
    """Eq. 10.1 of Liu & Wu 2001 as it stands: see, hold, come into contact."""
    EFFECTIVE = "effective"
    """The same, but a hold counts only when the robot gained ground while it lasted."""
    OUTCOME = "outcome"
    """Effective, and the opponent brought nearer to the border, and the bout won or lost."""


@dataclass(frozen=True)
class PalSettings:
    """How Pal coaches. The defaults serve all five dummy opponents.

    `benchmarks/learning.py` measures what a change is worth. Without the model .048 fewer of the bouts are won (95 %: .010 to
    .086), without mirror images .022 (.004 to .040); docs/adr/0035-learning.md has the rest.

    Attributes:
        objective: What a good maneuver is.
        budget: Maneuvers performed in all.
        robot_time: Time that the robot performs in all, in s, instead of so many maneuvers; 0: the budget counts. Where a
            maneuver may end early, by `end_on_change`, a budget of maneuvers is none of time.
        phases: Which phases of learning.
        phase_share: Share of the learning (the budget less the exam) that phase 1 gets.
        exam_share: Share of the budget spent at the end on testing the best again.
        exam_best: How many of each category are tested again.
        actions: Actions a maneuver has.
        period: Time an action lasts, in s.
        floor_reflex: The robot saves itself at the border; this ends the maneuver.
        end_on_change: A maneuver ends when the stimulus changes.
        hold: Until the next maneuver comes, the last action of the one before goes on: the robot does not halt in between.
        arms_in_stimulus: The arms count as part of the stimulus: 16 categories instead of 4.
        pairs: Phase 2 has categories of (previous, current) stimulus instead of the current one alone.
        population: Maneuvers in a category's population.
        elite: How many of the best survive a GP step unchanged.
        tournament: How many compete to become a parent.
        crossover: Probability that a child has two parents.
        mutation: Probability that an action of a child is replaced.
        in_family: In phase 2, share of the mutations that stay in the action's family.
        rounds: How often a generation is rated: everyone, then the better half up to two ratings, the best quarter up to
            four, and so on.
        greedy: While learning, share of the maneuvers that are the best known and not the next to be rated: what is rated
            is rated in good company, and the best are rated again.
        mirror: Experience on the left is experience on the right: a situation and its mirror image have one population, and
            a situation that is its own image keeps one of two maneuvers that mirror each other. For a robot whose wheels are
            even.
        surrogate: What a maneuver is worth is foretold from its parts, and mixed with its own performances; else a maneuver
            leans on those that begin like it (see `model` and `evidence`).
        again: How often a maneuver is handed out again when its situation comes up again in the same bout, so that it is
            rated in its own company.
        brood: Children bred for each place in a generation, of whom the most promising by the surrogate becomes a member;
            1 without it.
        curiosity: Standard errors of what is foretold that a child is the more promising by.
        exam_whole_bout: In the exam a situation keeps one maneuver for the whole bout.
        credit: What happens one second after a maneuver counts this share as much for it as its own doing; 0 credits it
            with nothing but its own doing.
        caution: A maneuver counts as good as its expected fitness less this many standard errors.
        action_weights: w_i of Eq. 10.1, one per action; empty for 1 each.
        contact_weight: Weight of coming into contact (1 in Eq. 10.1) against seeing and holding.
        hold_time: An arm pressed this long without a break holds, in s.
        hold_travel: Ground the robot must gain during an effective hold, in m.
        score_weight: In the objective `outcome`, weight of the sum of Eq. 10.1 beside the following three.
        progress_weight: Worth of a metre that the opponent came nearer to the border.
        win: Worth of a bout won.
        loss: Cost of a bout lost.

    Raises:
        SettingsError: A value makes no sense.
    """

    objective: Objective = Objective.OUTCOME
    budget: int = 1600
    robot_time: float = 0.0
    phases: Phases = "multi"
    phase_share: float = 0.5
    exam_share: float = 0.2
    exam_best: int = 5
    actions: int = 4
    period: float = 0.15
    floor_reflex: bool = True
    end_on_change: bool = False
    hold: bool = True
    arms_in_stimulus: bool = False
    pairs: bool = False
    population: int = 20
    elite: int = 2
    tournament: int = 3
    crossover: float = 0.9
    mutation: float = 0.1
    in_family: float = 0.5
    rounds: int = 2
    greedy: float = 0.5
    mirror: bool = True
    surrogate: bool = True
    again: int = 1
    brood: int = 4
    curiosity: float = 0.5
    exam_whole_bout: bool = True
    credit: float = 0.2
    caution: float = 0.5
    action_weights: tuple[float, ...] = ()
    contact_weight: float = 1.0
    hold_time: float = 0.1
    hold_travel: float = 0.005
    score_weight: float = 0.25
    progress_weight: float = 120.0
    win: float = 12.0
    loss: float = 20.0

    def __post_init__(self) -> None:
        self._require("objective", self.objective in set(Objective), f"one of {', '.join(Objective)}")
        self._require("phases", self.phases in get_args(Phases), f"one of {', '.join(get_args(Phases))}")
        self._require("actions", 1 <= self.actions <= MAX_ACTIONS, f"1 to {MAX_ACTIONS}")
        self._require("period", LEAST_PERIOD <= self.period <= MOST_PERIOD, f"{LEAST_PERIOD:g} to {MOST_PERIOD:g} s")
        self._require("population", 2 <= self.population <= MOST_MEMBERS, f"2 to {MOST_MEMBERS}")
        self._require("elite", 0 <= self.elite < self.population, "less than the population, and not negative")
        for name, most in (("budget", MOST_BUDGET), ("exam_best", MOST_MEMBERS), ("tournament", MOST_MEMBERS), ("rounds", 30)):
            self._require(name, 1 <= getattr(self, name) <= most, f"1 to {most}")
        for name in ("crossover", "mutation", "in_family", "exam_share", "phase_share", "greedy"):
            self._require(name, 0.0 <= getattr(self, name) <= 1.0, "0 to 1")
        self._require("again", 0 <= self.again <= MOST_AGAIN, f"0 to {MOST_AGAIN}")
        self._require("brood", 1 <= self.brood <= MOST_BROOD, f"1 to {MOST_BROOD}")
        self._require("credit", 0.0 <= self.credit < 1.0, "0 to less than 1")
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float):
                self._require(field.name, 0.0 <= value <= MOST_WORTH, f"a number, 0 to {MOST_WORTH:g}")
        self._require(
            "action_weights",
            len(self.action_weights) in {0, self.actions} and all(0.0 <= w <= MOST_WORTH for w in self.action_weights),
            f"none, or {self.actions} numbers, 0 to {MOST_WORTH:g}",
        )

    def _require(self, name: str, condition: bool, wanted: str) -> None:  # noqa: FBT001
        if not condition:
            raise SettingsError(name, f"{shown(getattr(self, name))} won't do; wanted: {wanted}")

    def to_dict(self) -> dict[str, Any]:
        """Settings as plain values."""
        return {**asdict(self), "objective": self.objective.value, "action_weights": list(self.action_weights)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> PalSettings:
        """The inverse of `to_dict`; what is left out keeps its default.

        Raises:
            SettingsError: Unknown setting, or a value of the wrong type or out of range.
        """
        defaults = cls()
        values: dict[str, Any] = {}
        known = {field.name for field in fields(cls)}
        for name, value in data.items():
            if name not in known:
                raise SettingsError(str(name)[:60], "no setting has this name")
            values[name] = _plain(name, value, getattr(defaults, name))
        return cls(**values)

    def to_saved(self) -> dict[str, Any]:
        """The same without what there was not before, where it is as it was then: what was begun then is saved as it was."""
        data = self.to_dict()
        if not self.robot_time:
            del data["robot_time"]
        if self.robot_time or any(data[name] != value for name, value in BEFORE.items()):
            return data
        return {name: value for name, value in data.items() if name not in _SINCE}

    @classmethod
    def of_saved(cls, data: Mapping[str, Any]) -> PalSettings:
        """Settings that were saved, perhaps before there were some of those that there are now (`BEFORE`).

        Args:
            data: What `to_saved` gave, or `to_dict`.

        Raises:
            SettingsError: As `from_dict`.
        """
        return cls.from_dict({**BEFORE, **data})


def _plain(name: str, value: object, default: object) -> object:
    """The value as the type of the default."""
    if isinstance(default, tuple):
        if not isinstance(value, list | tuple) or not all(is_number(item) for item in value):
            raise SettingsError(name, f"expected a list of numbers, not {shown(value)}")
        return tuple(float(item) for item in value)
    if isinstance(default, Objective):
        if not isinstance(value, str) or value not in set(Objective):
            raise SettingsError(name, f"expected one of {', '.join(Objective)}, not {shown(value)}")
        return Objective(str(value))
    if isinstance(default, float) and is_number(value):
        return float(value)  # type: ignore[arg-type]
    if type(value) is not type(default):
        raise SettingsError(name, f"expected {_KINDS[type(default)]}, not {shown(value)}")
    return value
