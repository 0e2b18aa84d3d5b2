"""What a robot's floor sensors and the clock tell of a bout."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import BoutOutcome, SensorFlag

if TYPE_CHECKING:
    from hil.sumo.junior import Junior

LIMIT: Final = 15.0
"""A bout that lasts longer is drawn, in s, as emulated referees have it."""
OUT_AFTER: Final = 0.3
"""Who has left the ring sees none on both sides for so long, in s: four times as long as one that turns back at the border."""
_OUT: Final = SensorFlag.OFF_RING_LEFT | SensorFlag.OFF_RING_RIGHT


class FloorJudge:
    """Says that a bout is lost when both floor sensors have seen no ring for a while, and drawn when its time is over.

    That it is won nobody can say by these.

    Args:
        junior: The robot.
    """

    def __init__(self, junior: Junior) -> None:
        self._junior = junior
        self._begun = 0.0
        self._out_since: float | None = None

    @property
    def sees_no_ring(self) -> bool:
        """Neither floor sensor sees the ring, by the latest reading."""
        reading = self._junior.latest
        return reading is not None and reading.flags & _OUT == _OUT

    def begin(self) -> None:
        """A bout begins."""
        self._begun = self._junior.now()
        self._out_since = None

    def look(self) -> BoutOutcome:
        """How the bout stands; to be asked for whenever something has come."""
        now = self._junior.now()
        if not self.sees_no_ring:
            self._out_since = None
        elif self._out_since is None:
            self._out_since = now
        elif now - self._out_since >= OUT_AFTER:
            return BoutOutcome.LOSS
        return BoutOutcome.DRAW if now - self._begun >= LIMIT else BoutOutcome.UNDECIDED
