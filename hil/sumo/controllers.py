"""Who chooses Junior's next maneuver in a bout: learnt advice, or one of the two yardsticks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, runtime_checkable

from firmware_protocol.vocabulary import FINE_ACTIONS, MAX_ACTIONS, Action, Maneuver, Stimulus

if TYPE_CHECKING:
    import numpy as np

    from firmware_protocol.messages import JuniorSensors
    from pal_advisor.maneuvers import Advice

EYES = Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT


class Controller(Protocol):
    """Chooses maneuvers."""

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:
        """The next maneuver.

        Args:
            current: What the robot senses.
            previous: What it sensed when its last maneuver began; None at the beginning of a bout.
        """
        ...


@runtime_checkable
class Driver(Protocol):
    """Sets the wheels itself, at every reading of the sensors: a policy, say."""

    def begin(self) -> None:
        """A bout begins."""
        ...

    def drive(self, sensors: JuniorSensors) -> tuple[float, float]:
        """What to do now.

        Args:
            sensors: The reading that has come; none comes twice.

        Returns:
            Left and right wheel, share of full speed, -1..1.
        """
        ...


class AdviceController:
    """Plays by an advice file.

    Args:
        advice: What was learnt.
    """

    def __init__(self, advice: Advice) -> None:
        self._advice = advice

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:
        """The maneuver that the advice has for this situation."""
        return self._advice.choose(int(current), None if previous is None else int(previous))


class RandomController:
    """Performs random maneuvers: what a robot does that has learnt nothing.

    Args:
        rng: Source of chance.
        actions: Actions a maneuver has.
        period: Time an action lasts, in s.
    """

    def __init__(self, rng: np.random.Generator, actions: int = 4, period: float = 0.25) -> None:
        self._rng = rng
        self._actions = actions
        self._period = period

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:  # noqa: ARG002
        """A maneuver drawn from the fine actions, whatever the situation."""
        drawn = self._rng.integers(len(FINE_ACTIONS), size=self._actions)
        return Maneuver(tuple(FINE_ACTIONS[index] for index in drawn), period=self._period, hold=True)


class ChaseController:
    """The simplest reflex: ahead when both eyes see, turn to the eye that sees, spin when none does.

    The maneuver ends on board as soon as the stimulus changes, so that the robot reacts at its own pace.
    """

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:  # noqa: ARG002
        """Ahead, or a turn, for up to two seconds."""
        match current & EYES:
            case Stimulus.EYE_LEFT:
                action = Action.LBRF
            case Stimulus.EYE_RIGHT:
                action = Action.LFRB
            case Stimulus.NONE:
                action = Action.LBRF
            case _:
                action = Action.FF
        return Maneuver((action,) * MAX_ACTIONS, period=0.25, end_on_change=True, hold=True)
