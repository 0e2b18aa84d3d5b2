"""Where a log that is played stands: times alone, no clock and no log."""

from __future__ import annotations

import math
from enum import Enum
from typing import Final, NamedTuple

SETTLING: Final = 0.02
"""From a request until something is sent by it, in s. The answer to it, and entries, go to a viewer by queues of their own: an
entry that overtook the answer would be taken for one of before."""
SLOWEST: Final = 0.01
FASTEST: Final = 1000.0


class PlayStatus(Enum):
    """What playing does."""

    PLAYING = "playing"
    PAUSED = "paused"
    ENDED = "ended"


class PlaybackStanding(NamedTuple):
    """What a viewer is told of it.

    Attributes:
        course: What it does.
        time: Log time that it has come to, in ns.
        speed: Log time that passes in a second, in s.
        jumped: It did not come there by playing.
    """

    course: PlayStatus
    time: int
    speed: float
    jumped: bool = False


class PlaybackClock:
    """Log time by the clock's. Every moment is reckoned from the last request, so that nothing adds up.

    Args:
        begin: Log time of the first entry, in ns.
        end: Log time of the last entry, in ns.

    Attributes:
        course: What it does.
        speed: Log time that passes in a second, in s.
    """

    def __init__(self, begin: int, end: int) -> None:
        self.course = PlayStatus.PAUSED
        self.speed = 1.0
        self._begin = begin
        self._end = end
        self._since = 0.0
        self._from = begin

    def control(self, now: float, *, play: bool, speed: float, seek: int | None) -> PlaybackStanding:
        """Do what a viewer asks for.

        Args:
            now: The clock's reading, in s.
            play: Play; else pause.
            speed: How fast. One that is no positive number leaves it as it is.
            seek: Log time to go on from, in ns; None: from where it is. What is played to its end begins anew.
        """
        place = self.position(now)
        if play and seek is None and place >= self._end:
            seek = self._begin
        if seek is not None:
            place = min(max(seek, self._begin), self._end)
        if math.isfinite(speed) and speed > 0:
            self.speed = min(max(speed, SLOWEST), FASTEST)
        self._from, self._since = place, now + SETTLING
        self.course = PlayStatus.PLAYING if play else PlayStatus.PAUSED
        return PlaybackStanding(self.course, place, self.speed, jumped=seek is not None)

    def position(self, now: float) -> int:
        """Log time that it has come to, in ns.

        Args:
            now: The clock's reading, in s.
        """
        if self.course is not PlayStatus.PLAYING:
            return self._from
        return min(self._from + round(max(0.0, now - self._since) * self.speed * 1e9), self._end)

    def due_at(self, time: int) -> float:
        """When the clock reads what it has to for an entry, in s; never, where it does not play.

        Args:
            time: The entry's log time, in ns.
        """
        if self.course is not PlayStatus.PLAYING:
            return math.inf
        return self._since + (time - self._from) / 1e9 / self.speed

    def settled_at(self) -> float:
        """From when on something may be sent by the last request, by the clock, in s."""
        return self._since

    def finish(self) -> PlaybackStanding:
        """Everything has been played."""
        self.course, self._from = PlayStatus.ENDED, self._end
        return PlaybackStanding(self.course, self._end, self.speed)

    def standing(self, now: float) -> PlaybackStanding:
        """What a viewer that has just come is told.

        Args:
            now: The clock's reading, in s.
        """
        return PlaybackStanding(self.course, self.position(now), self.speed)
