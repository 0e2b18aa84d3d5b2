"""How well a maneuver did: Eq. 10.1 of Liu & Wu 2001, and two objectives that build on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pal_advisor.maneuvers.names import CONTROL_PERIOD
from pal_advisor.maneuvers.settings import Objective, PalSettings

if TYPE_CHECKING:
    from firmware_protocol.vocabulary import ActionTally

EYES = 2
ARMS = 2


class ObjectiveError(ValueError):
    """The robot or its surroundings can't tell what the objective asks for."""


@dataclass(frozen=True)
class Performance:
    """What became of one maneuver.

    Attributes:
        tallies: One per action begun, in order, as the robot counted.
        planned: Actions the maneuver has.
        won: The bout was won during the maneuver.
        lost: The bout was lost during the maneuver.
        progress: How much nearer the opponent's centre came to the border, in m (negative: farther away); None where
            nobody can tell.
        over: The bout ended with this maneuver, however it ended (time limit too): what comes next is not its doing.
        duration: Time until its result came, in s, the floor reflex included; None: the
            time of the actions alone.

    Raises:
        ValueError: More tallies than actions planned, or both won and lost.
    """

    tallies: tuple[ActionTally, ...]
    planned: int
    won: bool = False
    lost: bool = False
    progress: float | None = None
    over: bool = False
    duration: float | None = None

    def __post_init__(self) -> None:
        if len(self.tallies) > self.planned:
            raise ValueError(f"{len(self.tallies)} actions performed, but only {self.planned} planned")
        if self.won and self.lost:
            raise ValueError("a bout is won or lost, not both")

    @property
    def performed(self) -> float:
        """Time that the robot performed, in s: until its result came; where nobody measured that, the actions' alone."""
        return CONTROL_PERIOD * sum(tally.samples for tally in self.tallies) if self.duration is None else self.duration

    def time(self, period: float) -> float:
        """Time from its beginning to where the next maneuver counts, in s.

        Actions left undone because the bout was won count in full, so their time counts too.

        Args:
            period: Time an action lasts, in s.
        """
        return self.planned * period if self.won else self.performed


def action_worth(tally: ActionTally, settings: PalSettings) -> float:
    """Worth of one action: the inner sums of Eq. 10.1, at most `full_worth`.

    Without a ground odometer no hold is known to be effective. The objective `outcome` does without: where the opponent went
    says what the push was worth.

    Args:
        tally: What the robot counted during the action.
        settings: Objective and constants.

    Raises:
        ObjectiveError: The objective is `effective` and the robot has no ground odometer.
    """
    seen = sum(count > 0 and 2 * count >= tally.samples for count in tally.eyes)
    touched = sum(edges > 0 for edges in tally.edges)
    held = sum(press >= settings.hold_time for press in tally.longest_press)
    if settings.objective is not Objective.CONTACT:
        if tally.pressed_travel is None and settings.objective is Objective.EFFECTIVE:
            raise ObjectiveError(
                "the objective 'effective' needs to know how far the robot moved while it pushed, and this robot has no "
                "ground odometer (wheel encoders do not see slip): use the objective 'contact'"
            )
        if tally.pressed_travel is None or tally.pressed_travel < settings.hold_travel:
            held = 0
    return seen + held + settings.contact_weight * touched


def full_worth(settings: PalSettings) -> float:
    """The most one action can be worth: 6 with unit weights."""
    return EYES + ARMS + settings.contact_weight * ARMS


def full_rate(settings: PalSettings) -> float:
    """Fitness a second of actions that count in full: what there is after a bout won."""
    weight = settings.score_weight if settings.objective is Objective.OUTCOME else 1.0
    return weight * full_worth(settings) / settings.period


def fitness(performance: Performance, settings: PalSettings) -> float:
    """Fitness of one performance of a maneuver.

    Actions left undone because the bout was won count in full.

    Args:
        performance: What became of the maneuver.
        settings: Objective, weights and constants.

    Raises:
        ObjectiveError: The objective needs something that nobody measured.
    """
    weights = settings.action_weights or (1.0,) * performance.planned
    worths = [action_worth(tally, settings) for tally in performance.tallies]
    if performance.won:
        worths += [full_worth(settings)] * (performance.planned - len(worths))
    score = sum(weight * worth for weight, worth in zip(weights, worths, strict=False))  # Eq. 10.1
    if settings.objective is Objective.OUTCOME:
        score *= settings.score_weight
        if performance.progress is not None:
            score += settings.progress_weight * performance.progress
        score += settings.win * performance.won - settings.loss * performance.lost
    return score
