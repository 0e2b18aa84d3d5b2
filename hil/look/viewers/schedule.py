"""Which entries of a log go to viewers, and when; known to no server and no clock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from hil.look.viewers.playback import PlaybackClock, PlaybackStanding, PlayStatus

if TYPE_CHECKING:
    from hil.look.viewers.recorded import RecordedEntries

AT_A_TIME: Final = 256
"""Entries that are sent before a request is looked at again."""


class Turn(NamedTuple):
    """What is to be done now.

    Attributes:
        places: Entries that are due, in order.
        due: When the first of those that follow is due, by the clock, in s; infinite where nothing is.
        ended: What to tell, where the last entry was among them.
        jumped: They are the last of every channel before the place that was jumped to.
    """

    places: list[int]
    due: float
    ended: PlaybackStanding | None = None
    jumped: bool = False


class Schedule:
    """The entries of a log on their way to viewers.

    Args:
        entries: The entries.

    Attributes:
        playback: Where it stands.
    """

    def __init__(self, entries: RecordedEntries) -> None:
        self.playback = PlaybackClock(entries.begin, entries.end)
        self._entries = entries
        self._next = 0
        self._owed: list[int] = []

    def control(self, now: float, *, play: bool, speed: float, seek: int | None) -> PlaybackStanding:
        """See `PlaybackClock.control`. After a jump the last entry of every channel up to there is due first."""
        standing = self.playback.control(now, play=play, speed=speed, seek=seek)
        if standing.jumped:
            self._next = self._entries.first_after(standing.time)
            self._owed = self._entries.last_before(self._next)
        return standing

    def turn(self, now: float) -> Turn:
        """What is to be done.

        Args:
            now: The clock's reading, in s.
        """
        playback, entries = self.playback, self._entries
        if self._owed:
            if now < playback.settled_at():
                return Turn([], playback.settled_at())
            owed, self._owed = self._owed, []
            return Turn(owed, now, jumped=True)
        if playback.course is not PlayStatus.PLAYING or now < playback.settled_at():
            return Turn([], self._due())
        until = min(entries.first_after(playback.position(now)), self._next + AT_A_TIME)
        places = list(range(self._next, until))
        self._next = max(self._next, until)
        if self._next == len(entries):
            return Turn(places, self._due(), playback.finish())
        return Turn(places, self._due())

    def _due(self) -> float:
        """When the next entry is."""
        if self._next == len(self._entries):
            return self.playback.settled_at() if self.playback.course is PlayStatus.PLAYING else float("inf")
        return self.playback.due_at(int(self._entries.times[self._next]))

    def last_of(self, number: int, now: float) -> list[int]:
        """The entry of a channel that was sent last, or would have been; none, where it has none so early.

        Args:
            number: The channel.
            now: The clock's reading, in s.
        """
        reached = self._entries.first_after(self.playback.position(now)) if not self._next else self._next
        return self._entries.last_before(reached, number)
