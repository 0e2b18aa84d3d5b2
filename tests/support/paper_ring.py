"""A ring on paper: engagements as the test writes them, no robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.maneuver_fields import ManeuverReport
from firmware_protocol.messages import BoutOutcome, Reason
from firmware_protocol.vocabulary import ActionTally, Outcome, Stimulus
from hil.sumo.ring import Encounter

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firmware_protocol.vocabulary import Maneuver
    from hil.sumo.controllers import Driver

TALLY = ActionTally(samples=10, eyes=(10, 10), edges=(0, 0), longest_press=(0.0, 0.0), pressed_travel=0.0)


def encounter(
    outcome: BoutOutcome = BoutOutcome.UNDECIDED,
    *,
    ended: Outcome = Outcome.COMPLETED,
    reason: Reason = Reason.NONE,
    tallies: int = 1,
    elapsed: float | None = 1.0,
    after: Stimulus = Stimulus.NONE,
) -> Encounter:
    """What a maneuver of one action did."""
    report = ManeuverReport(ended, reason, tallies, (TALLY,) * tallies, Stimulus.NONE, after)
    progress = None if elapsed is None else 0.01
    return Encounter(report, after, outcome, elapsed, progress, 0.25)


class PaperRing:
    """Plays what it is given, in order, again and again at the last.

    Args:
        *script: What the maneuvers do; an exception is raised instead.
        refereed: There is a referee.

    Attributes:
        begun: Seeds of the bouts begun.
        performed: Maneuvers performed.
        recovered: Times that a lost robot was waited for.
        recovers: What waiting for it comes to, in order; nothing is well.
    """

    def __init__(self, *script: Encounter | BaseException, refereed: bool = True) -> None:
        self.refereed = refereed
        self.opponent = "flat-light"
        self.begun: list[int] = []
        self.performed: list[Maneuver] = []
        self.recovered = 0
        self.recovers: list[BaseException | None] = []
        self._script: Iterator[Encounter | BaseException] = iter(script)
        self._next = script[0]

    def steer(self, driver: Driver) -> tuple[BoutOutcome, float]:
        raise AssertionError((driver, "there are no wheels on paper"))

    def begin(self, seed: int) -> Stimulus:
        self.begun.append(seed)
        return Stimulus.EYE_LEFT

    def engage(self, maneuver: Maneuver) -> Encounter:
        self.performed.append(maneuver)
        self._next = next(self._script, self._next)
        if isinstance(self._next, BaseException):
            raise self._next
        return self._next

    def recover(self) -> None:
        self.recovered += 1
        if self.recovers and (error := self.recovers.pop(0)) is not None:
            raise error
