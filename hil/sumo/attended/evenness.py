"""Whether the wheels of a robot are even, found out by its wheel encoders: it drives ahead and back a little.

What is learnt on the left holds on the right only where equal commands turn both wheels alike. Ahead and back are looked at
apart: motors of which one is mounted the other way round may be even on the average, and in neither direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from itertools import count
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.errors import PeerGoneError, PeerLostError
from firmware_protocol.messages import SensorFlag
from firmware_protocol.vocabulary import Action, Maneuver, Outcome
from hil.bridge.operator import READY
from hil.statistics import Z95, error_of
from hil.sumo.attended.hands import put_aside, start_after_countdown, wait_for_answer
from hil.sumo.bouts import MOST_LOSSES, check_encounter
from hil.sumo.ring import perform

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.maneuver_fields import ManeuverReport
    from hil.questions import Questions
    from hil.sumo.junior import Junior
    from hil.sumo.ring import Ring

EVEN_WITHIN: Final = 0.05
"""Wheels are even whose ways differ by no more than this share of their mean."""
FEWEST: Final = 8
"""Drives in each direction before anything is concluded."""
MOST: Final = 40
"""Drives in each direction after which what is not clear stays so."""
_FAILED: Final = 8
"""So many drives may tell nothing, since something was touched, or the border was reached."""
_PERIOD: Final = 0.15
"""How long it drives, in s: some 4 cm."""
_LEAST_TRIM: Final = 0.5
"""A wheel that is weaker than this is broken: the other one can't be held back so far."""
_STILL: Final = 0.2
"""How long it takes to come to rest, in s."""
_ALONE: Final = (
    "The wheels are measured first: put the robot alone into the middle of the ring, and say when it may drive ahead and back."
)
_AHEAD: Final = Maneuver((Action.F,), period=_PERIOD)
_BACK: Final = Maneuver((Action.B,), period=_PERIOD)


class WheelVerdict(StrEnum):
    """What was found out of the wheels."""

    EVEN = "even"
    UNEVEN = "uneven"
    UNCLEAR = "unclear"
    """So many drives were not enough to tell."""
    NO_ENCODERS = "no encoders"
    """The robot can't tell how far its wheels turn."""
    NO_ROOM = "no room"
    """Most drives ended at the border, or at something that was touched, or did not turn the wheels at all."""


@dataclass(frozen=True)
class WheelDifference:
    """By how much further the left wheel turns than the right one when both are commanded alike, in one direction.

    Attributes:
        value: Difference of their ways, as a share of the mean of both; negative: the left wheel is slower.
        error: Standard error of that.
        drives: How many it is the mean of.
    """

    value: float
    error: float
    drives: int

    @classmethod
    def of(cls, ways: Sequence[tuple[float, float]]) -> WheelDifference:
        """By what the encoders said.

        Args:
            ways: Of the left and right wheel, in m, forward or backward, for each drive, two or more.
        """
        left, right = np.abs(np.array(ways)).T
        shares = 2.0 * (left - right) / (left + right)
        return cls(float(shares.mean()), error_of(shares), len(shares))

    @property
    def bounds(self) -> tuple[float, float]:
        """Of the 95 % interval."""
        return self.value - Z95 * self.error, self.value + Z95 * self.error

    @property
    def even(self) -> bool:
        """The whole interval is within `EVEN_WITHIN`."""
        low, high = self.bounds
        return low >= -EVEN_WITHIN and high <= EVEN_WITHIN

    @property
    def uneven(self) -> bool:
        """The whole interval is beyond it."""
        low, high = self.bounds
        return low > EVEN_WITHIN or high < -EVEN_WITHIN

    def __str__(self) -> str:
        value, low, high = (f"{100.0 * share:+.1f}" for share in (self.value, *self.bounds))
        return f"{value} % ({low} to {high})"


@dataclass(frozen=True)
class Evenness:
    """What was found out of the wheels.

    Attributes:
        verdict: Whether they are even.
        ahead: The difference between left and right, driving ahead; None where it was not measured.
        back: Likewise, driving back.
    """

    verdict: WheelVerdict
    ahead: WheelDifference | None = None
    back: WheelDifference | None = None

    @classmethod
    def of(cls, ahead: WheelDifference, back: WheelDifference) -> Evenness:
        """By both directions.

        Args:
            ahead: The difference, driving ahead.
            back: Driving back.
        """
        if ahead.uneven or back.uneven:
            return cls(WheelVerdict.UNEVEN, ahead, back)
        return cls(WheelVerdict.EVEN if ahead.even and back.even else WheelVerdict.UNCLEAR, ahead, back)

    @property
    def even(self) -> bool:
        """They are even, for all that is known."""
        return self.verdict is WheelVerdict.EVEN

    @property
    def trim(self) -> tuple[str, float] | None:
        """The trim parameter, and the factor by which to change it, that would make uneven wheels even; None: nobody knows.

        That is where the same wheel is plainly the slower one in both directions.
        """
        if self.verdict is not WheelVerdict.UNEVEN or self.ahead is None or self.back is None:
            return None
        if self.ahead.bounds[1] < 0.0 and self.back.bounds[1] < 0.0:
            name = "TRIM_RIGHT"
        elif self.ahead.bounds[0] > 0.0 and self.back.bounds[0] > 0.0:
            name = "TRIM_LEFT"
        else:
            return None
        half = abs(self.ahead.value + self.back.value) / 4.0
        factor = (1.0 - half) / (1.0 + half)
        return (name, factor) if factor > _LEAST_TRIM else None

    def figures(self) -> dict[str, object]:
        """As plain values."""
        ways = {name: one for name, one in (("ahead", self.ahead), ("back", self.back)) if one is not None}
        return {
            "verdict": self.verdict.value,
            **{
                name: {"difference": round(one.value, 4), "error": round(one.error, 4), "drives": one.drives}
                for name, one in ways.items()
            },
        }

    def __str__(self) -> str:
        words = _WORDS[self.verdict]
        if self.ahead is None or self.back is None:
            return f"{words}."
        return (
            f"{words} ({100.0 * EVEN_WITHIN:g} % are allowed): the left one's way, less the right one's, is {self.ahead} ahead "
            f"and {self.back} back, by {self.ahead.drives + self.back.drives} drives."
        )


_WORDS: Final = {
    WheelVerdict.EVEN: "The wheels are even",
    WheelVerdict.UNEVEN: "The wheels are not even",
    WheelVerdict.UNCLEAR: "It is not clear whether the wheels are even",
    WheelVerdict.NO_ENCODERS: "The robot has no wheel encoders, so that nobody knows whether its wheels are even",
    WheelVerdict.NO_ROOM: "It is not known whether the wheels are even: the robot had no room, or its wheels did not turn",
}


def try_wheels(junior: Junior, ring: Ring, questions: Questions | None = None) -> Evenness:
    """Find out whether the wheels are even, before a coaching; see `measure_wheels`. A robot that is lost is waited for.

    Args:
        junior: The robot; one that is disarmed stands still for a countdown before it moves.
        ring: Its ring, which knows how to wait for it.
        questions: Asks a person to make room, and the robot is disarmed before and after; None: nobody is asked.

    Raises:
        RefusedError: It does not drive: its emergency stop was pressed.
        PeerError: It is gone for good.
        LinkError: The link is.
    """
    for losses in count(1):
        try:
            if not junior.read_sensors().flags & SensorFlag.TRAVEL_FROM_ENCODERS:
                break
            if questions is not None:
                put_aside(junior)
                questions.ask(_ALONE, (READY,))
                wait_for_answer(junior, questions)
            if not junior.armed:
                start_after_countdown(junior)
            found = measure_wheels(junior)
            if questions is not None:
                put_aside(junior)
        except PeerGoneError:
            raise
        except PeerLostError:
            if losses > MOST_LOSSES:
                raise
            ring.recover()
        else:
            return found
    return Evenness(WheelVerdict.NO_ENCODERS)


def measure_wheels(junior: Junior) -> Evenness:
    """Find out whether the wheels are even; the robot drives some 4 cm ahead and back for 6 to 30 s.

    It ends as soon as the interval of each direction is on one side of `EVEN_WITHIN`, or of one is beyond it.

    Args:
        junior: The robot; it is armed, has wheel encoders, and has room before and behind it.

    Raises:
        RefusedError: It does not drive: it is not armed, or is stopped.
        PeerError: It is gone, or does not answer.
        LinkError: The link is gone.
    """
    reading = junior.read_sensors()
    ways: dict[Maneuver, list[tuple[float, float]]] = {_BACK: [], _AHEAD: []}
    failed = 0
    while True:
        for maneuver, those in ways.items():
            before, told = reading.travel, _drive(junior, maneuver)
            reading = junior.read_sensors()
            left, right = (now - then for now, then in zip(reading.travel, before, strict=True))
            if told and (left or right):
                those.append((left, right))
            else:
                failed += 1
        if failed > _FAILED:
            return Evenness(WheelVerdict.NO_ROOM)
        if min(map(len, ways.values())) >= FEWEST:
            found = Evenness.of(WheelDifference.of(ways[_AHEAD]), WheelDifference.of(ways[_BACK]))
            if found.verdict is not WheelVerdict.UNCLEAR or min(map(len, ways.values())) >= MOST:
                return found


def _drive(junior: Junior, maneuver: Maneuver) -> bool:
    """Drive, and come to rest.

    Returns:
        It drove to the end, and touched nothing.
    """
    encounter = perform(junior, maneuver)
    check_encounter(encounter)
    junior.wait(_STILL)
    report = encounter.report
    return report.outcome is Outcome.COMPLETED and not _touched(report)


def _touched(report: ManeuverReport) -> bool:
    return any(press for tally in report.tallies for press in tally.longest_press)
