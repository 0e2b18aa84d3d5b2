"""The terms that robot, Pal and host share: actions, stimuli, maneuvers, what a maneuver reported, and a swarm's classes.

This module depends on nothing but the standard library, so that the adviser can use it without knowing any wire.
The C firmware's action table is generated from `ACTIONS` (see `firmware_protocol.generate`).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from itertools import groupby
from math import isfinite, remainder, tau
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_ACTIONS: Final = 8
"""Longest maneuver the wire and the firmware can carry, in actions."""

MAX_SECTORS: Final = 16
"""Most sectors that a micro-robot's surroundings are divided into."""

MAX_RANGES: Final = 32
"""Most directions in which a micro-robot measures ranges."""

LONGEST_MOVE: Final = 60.0
"""Longest way of one move of a micro-robot, in m."""

MICRO_ROBOT_RADIUS: Final = 0.02
"""Radius of a micro-robot's body, a disc, in m."""

LEAST_PERIOD: Final = 0.02
"""No action lasts less, in s."""
MOST_PERIOD: Final = 5.0
"""No action lasts longer, in s."""

ANY_STIMULUS: Final = 255
"""In a memory slot, "whatever the previous stimulus was"."""
ANY: Final = "any"
"""The same in a file or a log."""


class Family(IntEnum):
    """The five kinds of motion; a basic action is refined by a fine action of its own family (Liu & Wu 2001, Table 10.1)."""

    STOP = 0
    FORWARD = 1
    BACKWARD = 2
    LEFT = 3
    RIGHT = 4


class Speed(IntEnum):
    """Which speed parameter an action's wheels use."""

    NONE = 0
    FAST = 1
    MODERATE = 2
    SLOW = 3
    TURN = 4


class Action(IntEnum):
    """The 5 basic and 13 fine-tuning actions of Liu & Wu 2001, Table 10.1 (S is both). The value is the wire code."""

    S = 0
    F = 1
    B = 2
    L = 3
    R = 4
    FF = 5
    MF = 6
    SF = 7
    FB = 8
    MB = 9
    SB = 10
    LSRF = 11
    LBRS = 12
    LBRF = 13
    LFRS = 14
    LSRB = 15
    LFRB = 16

    @property
    def spec(self) -> ActionSpec:
        """Family, speed and wheel directions of this action."""
        return ACTIONS[self]

    @property
    def family(self) -> Family:
        """The family this action belongs to."""
        return ACTIONS[self].family


@dataclass(frozen=True)
class ActionSpec:
    """How an action turns the wheels.

    Attributes:
        family: Kind of motion.
        speed: Which speed parameter applies.
        left: Direction of the left wheel: -1 backward, 0 stalled, 1 forward.
        right: Direction of the right wheel, likewise.
        meaning: The action in words.
    """

    family: Family
    speed: Speed
    left: int
    right: int
    meaning: str


ACTIONS: Final[dict[Action, ActionSpec]] = {
    Action.S: ActionSpec(Family.STOP, Speed.NONE, 0, 0, "stop"),
    Action.F: ActionSpec(Family.FORWARD, Speed.MODERATE, 1, 1, "forward"),
    Action.B: ActionSpec(Family.BACKWARD, Speed.MODERATE, -1, -1, "backward"),
    Action.L: ActionSpec(Family.LEFT, Speed.TURN, -1, 1, "left turn"),
    Action.R: ActionSpec(Family.RIGHT, Speed.TURN, 1, -1, "right turn"),
    Action.FF: ActionSpec(Family.FORWARD, Speed.FAST, 1, 1, "fast forward"),
    Action.MF: ActionSpec(Family.FORWARD, Speed.MODERATE, 1, 1, "moderate forward"),
    Action.SF: ActionSpec(Family.FORWARD, Speed.SLOW, 1, 1, "slow forward"),
    Action.FB: ActionSpec(Family.BACKWARD, Speed.FAST, -1, -1, "fast backward"),
    Action.MB: ActionSpec(Family.BACKWARD, Speed.MODERATE, -1, -1, "moderate backward"),
    Action.SB: ActionSpec(Family.BACKWARD, Speed.SLOW, -1, -1, "slow backward"),
    Action.LSRF: ActionSpec(Family.LEFT, Speed.TURN, 0, 1, "left wheel stalled, right wheel forward"),
    Action.LBRS: ActionSpec(Family.LEFT, Speed.TURN, -1, 0, "left wheel backward, right wheel stalled"),
    Action.LBRF: ActionSpec(Family.LEFT, Speed.TURN, -1, 1, "left wheel backward, right wheel forward"),
    Action.LFRS: ActionSpec(Family.RIGHT, Speed.TURN, 1, 0, "left wheel forward, right wheel stalled"),
    Action.LSRB: ActionSpec(Family.RIGHT, Speed.TURN, 0, -1, "left wheel stalled, right wheel backward"),
    Action.LFRB: ActionSpec(Family.RIGHT, Speed.TURN, 1, -1, "left wheel forward, right wheel backward"),
}

BASIC_ACTIONS: Final = (Action.F, Action.B, Action.L, Action.R, Action.S)
"""Phase 1 alphabet."""

FINE_ACTIONS: Final = (
    Action.FF, Action.MF, Action.SF, Action.FB, Action.MB, Action.SB,
    Action.LSRF, Action.LBRS, Action.LBRF, Action.LFRS, Action.LSRB, Action.LFRB, Action.S,
)  # fmt: skip
"""Phase 2 alphabet."""


class Stimulus(IntFlag):
    """What the robot senses of its opponent: which eyes see it, which arms touch it. The value is the wire code.

    The book's four categories (none, left, right, both eyes) are the values 0..3; with arms there are 16.
    """

    NONE = 0
    EYE_LEFT = 1
    EYE_RIGHT = 2
    ARM_LEFT = 4
    ARM_RIGHT = 8

    @property
    def label(self) -> str:
        """Name used in advice files, tables and figures: `none`, `left`, `right`, `both`, with `+touch-left` and so on."""
        eyes = ("none", "left", "right", "both")[self & 3]
        arms = ("", "+touch-left", "+touch-right", "+touch-both")[self >> 2 & 3]
        return eyes + arms

    @classmethod
    def from_label(cls, label: str) -> Stimulus:
        """The inverse of `label`.

        Raises:
            ValueError: No stimulus has this name.
        """
        for code in range(16):
            if cls(code).label == label:
                return cls(code)
        raise ValueError(f"unknown stimulus {label!r}: expected none, left, right or both, with +touch-left, -right or -both")


def stimulus_label(code: int) -> str:
    """Name of a stimulus in files and logs: `left`; `ANY` where it does not count.

    Args:
        code: Its code, or `ANY_STIMULUS`.
    """
    return ANY if code == ANY_STIMULUS else Stimulus(code).label


def situation_name(previous: int, current: int) -> str:
    """A situation in a table or a legend: `left`, or `both, left arm touches, before: right`.

    Args:
        previous: Code of the previous stimulus; `ANY_STIMULUS` where it does not count.
        current: Code of the current one.
    """
    name = _stimulus_name(current)
    return name if previous == ANY_STIMULUS else f"{name}, before: {_stimulus_name(previous)}"


def _stimulus_name(code: int) -> str:
    eyes = Stimulus(code & 3).label
    arms = ("", ", left arm touches", ", right arm touches", ", both arms touch")[code >> 2 & 3]
    return eyes + arms


class Outcome(IntEnum):
    """How a maneuver ended."""

    COMPLETED = 0
    STIMULUS_CHANGED = 1
    FLOOR_REFLEX = 2
    STOPPED = 3
    REPLACED = 4
    REFUSED = 5


@dataclass(frozen=True)
class Maneuver:
    """A sequence of actions that the robot performs and times itself.

    Attributes:
        actions: 1 to 8 actions.
        period: Time each action lasts, in s.
        floor_reflex: Let the robot back off and turn when it crosses the border; this ends the maneuver.
        end_on_change: End when the stimulus is no longer the one the maneuver began with.
        eyes: The eyes count as part of the stimulus.
        arms: The arms count as part of the stimulus.
        hold: When it is over, the last action goes on until the next command comes, for the robot's MAN_HOLD at most.
            For maneuvers that follow one another: the robot does not halt while the next is on its way.

    Raises:
        ValueError: No action, more than eight, or a period outside 0.02 to 5 s.
    """

    actions: tuple[Action, ...]
    period: float = 0.25
    floor_reflex: bool = True
    end_on_change: bool = False
    eyes: bool = True
    arms: bool = False
    hold: bool = False

    def __post_init__(self) -> None:
        if not 1 <= len(self.actions) <= MAX_ACTIONS:
            raise ValueError(f"a maneuver has 1 to {MAX_ACTIONS} actions, not {len(self.actions)}")
        if not LEAST_PERIOD <= self.period <= MOST_PERIOD:
            raise ValueError(f"an action lasts {LEAST_PERIOD:g} to {MOST_PERIOD:g} s, not {self.period:g} s")

    def __str__(self) -> str:
        return codes(self.actions)


def codes(actions: Iterable[Action]) -> str:
    """A maneuver by the names of its actions: `MF FF FF S`.

    Args:
        actions: Its actions.
    """
    return " ".join(action.name for action in actions)


def spelled_out(actions: Iterable[Action]) -> str:
    """A maneuver in words: `moderate forward; fast forward, twice; left wheel stalled, right wheel backward`.

    Args:
        actions: Its actions.
    """
    often = {1: "", 2: ", twice"}
    runs = ((action.spec.meaning, sum(1 for _ in run)) for action, run in groupby(actions))
    return "; ".join(f"{meaning}{often.get(count, f', {count} times')}" for meaning, count in runs)


@dataclass(frozen=True)
class ActionTally:
    """What the robot counted while it performed one action.

    Attributes:
        samples: Control periods the action lasted.
        eyes: Of these, those in which the left, right eye saw the opponent.
        edges: Press edges of the left, right arm.
        longest_press: Longest unbroken press of the left, right arm, in s.
        pressed_travel: Travel over the ground while an arm was pressed, in m (positive forward);
            None where the robot has no ground odometer.
    """

    samples: int
    eyes: tuple[int, int]
    edges: tuple[int, int]
    longest_press: tuple[float, float]
    pressed_travel: float | None


class RobotClass(IntEnum):
    """What a micro-robot is among the others (Liu & Wu 2001, 7.2): those that surround, and those that are surrounded."""

    RANGER = 0
    WILD = 1

    @property
    def other(self) -> RobotClass:
        """The class that this one looks out for."""
        return RobotClass(1 - self)


class SwarmOutcome(IntEnum):
    """How a micro-robot's move ended. The value is the wire code."""

    NONE = 0
    """It ends no move: the observation was asked for."""
    ARRIVED = 1
    BLOCKED = 2
    """Contact ahead, or wheels that stand although they are driven."""
    STOPPED = 3
    REFUSED = 4
    """After it had been accepted: beyond the fence, or the position fix is lost."""
    TIMED_OUT = 5
    REPLACED = 6


class MoveOption(IntFlag):
    """Bits of the options of a micro-robot's move. The value is the wire code."""

    BODY = 1
    STOP_ON_CONTACT = 2
    PUSH = 4
    BACKWARD = 8
    SENSE = 16
    RANGES = 32


class ObservationFlag(IntFlag):
    """Bits of what a micro-robot observed. The value is the wire code."""

    CONTACT_AHEAD = 1
    CONTACT = 2
    TOUCHES_BOX = 4
    DEAD_RECKONING = 8
    RING_NOT_READ = 16


@dataclass(frozen=True)
class Move:
    """One move of a micro-robot: it turns, drives straight, turns again, and observes.

    Attributes:
        distance: Way to drive, in m; 0 turns only.
        heading: Which way, in rad, kept within half a turn: in the arena's frame, or with `MoveOption.BODY` from the nose.
            None: `sector` says it.
        sector: Number of the sector of the body along whose bisector it drives, from 1; 0: `heading` says it.
        sectors: How many sectors there are, where `sector` is given.
        face: Heading to turn to when there, in the arena's frame, in rad; None stays as it came.
        speed: In m/s; 0 is the robot's MOVE_SPEED.
        effort: Limit of the wheels' force, in percent; 0 is all of it.
        options: What ends it, and what is sensed then.

    Raises:
        ValueError: It is said twice or not at all which way, or a value is out of range.
    """

    distance: float = 0.0
    heading: float | None = None
    sector: int = 0
    sectors: int = 0
    face: float | None = None
    speed: float = 0.0
    effort: int = 0
    options: MoveOption = MoveOption.STOP_ON_CONTACT | MoveOption.SENSE

    def __post_init__(self) -> None:
        if not 0.0 <= self.distance <= LONGEST_MOVE:
            raise ValueError(f"a move is 0 to {LONGEST_MOVE:g} m long, not {self.distance:g} m")
        if not 0 <= self.sectors <= MAX_SECTORS or not 0 <= self.sector <= self.sectors:
            raise ValueError(f"there is no sector {self.sector} of {self.sectors}: there are at most {MAX_SECTORS}, from 1")
        if (self.heading is None) != bool(self.sector):
            raise ValueError("a move has a heading or a sector: one of the two")
        if not 0 <= self.effort <= 100:
            raise ValueError(f"the effort of a move is 0 to 100 percent, not {self.effort}")
        for name in ("heading", "face"):
            angle = getattr(self, name)
            if angle is not None and not isfinite(angle):
                raise ValueError(f"the {name} of a move is an angle in rad, not {angle}")
            if angle is not None:
                object.__setattr__(self, name, remainder(angle, tau))
