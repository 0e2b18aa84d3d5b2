"""Who chooses Junior's next maneuver in a bout: learnt advice, or one of the yardsticks, which are written by hand."""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING, Final, Protocol, runtime_checkable

from firmware_protocol.vocabulary import FINE_ACTIONS, MAX_ACTIONS, Action, Maneuver, Stimulus

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from firmware_protocol.messages import JuniorSensors
    from pal_advisor.maneuvers import Advice

EYES = Stimulus.EYE_LEFT | Stimulus.EYE_RIGHT
ARMS = Stimulus.ARM_LEFT | Stimulus.ARM_RIGHT


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


class Chase2Controller:
    """Chasing that rams: it comes in arcs, and backs off from what it has pushed for a while, to push it again with a run-up.

    Every maneuver but the backing off ends on board as soon as eyes or arms sense something else.
    """

    PUSH: Final = 0.5
    """What both, or the same, arms have touched for so long is backed off from, in s."""
    BACK: Final = 0.1
    """Time of backing off, in s."""
    ROUND: Final = 2.0
    """Time of one look round, in s."""
    ON: Final = 0.25
    """What is lost from sight is close ahead, between the eyes, as like as not: it goes on for so long, in s, ..."""

    def __init__(self) -> None:
        self._pushing = self._looked_on = False

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:
        """Push, back off, or come nearer."""
        pushed = self._pushing and previous is not None and previous & ARMS == current & ARMS
        self._pushing = bool(current & ARMS) and not pushed
        if pushed:
            return Maneuver((Action.FB,), period=self.BACK, hold=True)
        if self._pushing:
            return _until_changed((Action.FF,) * MAX_ACTIONS, self.PUSH / MAX_ACTIONS)
        return self._come_nearer(current, previous)

    def _come_nearer(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:
        match current & EYES:
            case Stimulus.EYE_LEFT:
                return _until_changed((Action.LBRF, Action.FF, Action.FF) * 2, 0.05)
            case Stimulus.EYE_RIGHT:
                return _until_changed((Action.LFRB, Action.FF, Action.FF) * 2, 0.05)
            case Stimulus.NONE if previous is None or self._looked_on:
                self._looked_on = False
                return _until_changed((Action.LBRF,) * MAX_ACTIONS, self.ROUND / MAX_ACTIONS)
            case Stimulus.NONE:
                self._looked_on = True
                return _until_changed((Action.FF,), self.ON)
            case _:
                return _until_changed((Action.FF,) * MAX_ACTIONS, 0.25)


class _Hobby(Enum):
    """States of a hobby sumo robot."""

    SEARCH = auto()
    MOVE_ON = auto()
    TRACK = auto()
    ATTACK = auto()
    EVADE = auto()


class HobbyController:
    """What many a hobby sumo robot runs: a state machine that searches, moves on, tracks, attacks, and evades a stalemate.

        SEARCH   turns on the spot, to where the opponent was seen last; after a turn: MOVE_ON
        MOVE_ON  drives ahead for a while, to search elsewhere
        TRACK    one eye sees: turns to it
        ATTACK   both eyes see, or an arm touches: ahead, at full speed; after two seconds of touching: EVADE
        EVADE    backs off, and turns away to come from the side

    The border is the business of the robot's own floor reflex.
    """

    STALEMATE: Final = 2.0
    """A push that lasts longer leads nowhere, in s."""
    TURN: Final = 1.5
    """Time of a search on one place, in s."""

    def __init__(self) -> None:
        self._state = _Hobby.SEARCH
        self._to_right = False

    def choose(self, current: Stimulus, previous: Stimulus | None) -> Maneuver:
        """What the state machine does next."""
        if previous is None:
            self._state, self._to_right = _Hobby.SEARCH, False
        same = previous is not None and previous == current
        eyes = current & EYES
        if eyes in {Stimulus.EYE_LEFT, Stimulus.EYE_RIGHT}:
            self._to_right = eyes == Stimulus.EYE_RIGHT
        self._state = self._next(current, timed_out=same)
        turn = Action.LFRB if self._to_right else Action.LBRF
        match self._state:
            case _Hobby.SEARCH:
                return _until_changed((turn,) * MAX_ACTIONS, self.TURN / MAX_ACTIONS)
            case _Hobby.MOVE_ON:
                return _until_changed((Action.MF,) * 2, 0.2)
            case _Hobby.TRACK:
                return _until_changed((turn,) * MAX_ACTIONS, 0.25)
            case _Hobby.ATTACK:
                return _until_changed((Action.FF,) * MAX_ACTIONS, self.STALEMATE / MAX_ACTIONS)
            case _Hobby.EVADE:
                away = Action.LSRF if self._to_right else Action.LFRS
                return Maneuver((Action.FB, Action.FB, away, away), period=0.15, hold=True)

    def _next(self, current: Stimulus, *, timed_out: bool) -> _Hobby:
        """The state that follows.

        Args:
            current: What the robot senses.
            timed_out: The last maneuver was performed to its end, and nothing has changed.
        """
        if current & EYES == EYES or current & ARMS:
            stuck = timed_out and self._state is _Hobby.ATTACK and bool(current & ARMS)
            return _Hobby.EVADE if stuck else _Hobby.ATTACK
        if current & EYES:
            return _Hobby.TRACK
        return _Hobby.MOVE_ON if timed_out and self._state is _Hobby.SEARCH else _Hobby.SEARCH


BUILT_IN: Final[dict[str, Callable[[np.random.Generator], Controller]]] = {
    "chase": lambda _: ChaseController(),
    "chase2": lambda _: Chase2Controller(),
    "hobby": lambda _: HobbyController(),
    "random": RandomController,
}
"""Makes the controllers that are written by hand, by name, of a source of chance."""


def _until_changed(actions: tuple[Action, ...], period: float) -> Maneuver:
    """A maneuver that ends as soon as eyes or arms sense something else."""
    return Maneuver(actions, period=period, end_on_change=True, arms=True, hold=True)
