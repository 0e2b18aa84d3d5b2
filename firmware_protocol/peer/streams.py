"""Which messages a host needs a robot to send by itself, and whether they come. No I/O, no clock.

Any client may change what a robot streams, and the last one to ask has its way. A reading that has stopped coming must not
look fresh: see `Streams.stale`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.peer.timetable import NEVER

if TYPE_CHECKING:
    from collections.abc import Mapping

    from firmware_protocol.wire.fields import Message

STALE_INTERVALS: Final = 3
"""A reading older than so many intervals is stale, ..."""
STALE_LEAST: Final = 0.25
"""... but not before it is this old, in s."""
ASK_AGAIN: Final = 5.0
"""Least time between two requests for a stream that has stopped, in s."""
MOST_REQUESTS: Final = 3
"""Requests for a stream that does not come back; then it is left at that."""


@dataclass(slots=True)
class _Stream:
    """One message.

    Attributes:
        interval: Between two, in s.
        heard: When the last one came; before the first, when it was first wanted, in s.
        stopped: It does not come, and that has been told.
        requests: How often it was asked for since it stopped.
        asked: When it was asked for last, in s.
    """

    interval: float
    heard: float
    stopped: bool = False
    requests: int = 0
    asked: float = float("-inf")

    @property
    def limit(self) -> float:
        """Greatest age of a reading that is not stale, in s."""
        return max(STALE_INTERVALS * self.interval, STALE_LEAST)


class Streams:
    """The streams that a host needs from one robot.

    Args:
        needs: Which, and their intervals in s.

    Attributes:
        next_due: When to look next whether they come, in s.
    """

    def __init__(self, needs: Mapping[type[Message], float]) -> None:
        self._defaults = needs
        self._intervals = dict(needs)
        self._streams: dict[type[Message], _Stream] = {}
        self.next_due = NEVER

    @property
    def intervals(self) -> Mapping[type[Message], float]:
        """What is needed, and how often: in s."""
        return self._intervals

    def begin(self, now: float) -> None:
        """The robot can be used: from now on they are waited for.

        Args:
            now: Time in s.
        """
        self._streams = {message: _Stream(interval, now) for message, interval in self._intervals.items()}
        self._plan(now)

    def end(self) -> None:
        """The robot is gone: nothing is waited for."""
        self._streams.clear()
        self.next_due = NEVER

    def want(self, message: type[Message], interval: float, now: float) -> None:
        """Have it at another rate.

        Args:
            message: Its class.
            interval: Between two, in s; 0 is the usual one, and negative: it is not needed any more.
            now: Time in s.
        """
        if interval == 0:
            interval = self._defaults.get(message, -1.0)
        self._intervals.pop(message, None)
        self._streams.pop(message, None)
        if interval > 0:
            self._intervals[message] = interval
            self._streams[message] = _Stream(interval, now)
        self._plan(now)

    def heard(self, message: type[Message], now: float) -> bool:
        """One has come.

        Args:
            message: Its class.
            now: Its stamp in s.

        Returns:
            True where it had stopped, and is back.
        """
        stream = self._streams.get(message)
        if stream is None:
            return False
        stream.heard = now
        back = stream.stopped
        if back:
            stream.stopped = False
            stream.requests = 0
        return back

    def missed(self, duration: float) -> None:
        """Nobody has listened for a while: whatever came then, none of them has stopped by that.

        Args:
            duration: How long, in s.
        """
        for stream in self._streams.values():
            stream.heard += duration

    def stale(self, message: type[Message], age: float) -> bool:
        """Whether a reading is too old to act on.

        Args:
            message: Its class.
            age: Of the reading, in s.
        """
        return age > max(STALE_INTERVALS * self._intervals.get(message, 0.0), STALE_LEAST)

    def check(self, now: float, alive: float) -> tuple[list[type[Message]], list[type[Message]]]:
        """Look which do not come although the robot is heard.

        Args:
            now: Time in s.
            alive: When anything of the robot came last, in s.

        Returns:
            Those that have stopped since the last look; those that may be asked for again.
        """
        stopped: list[type[Message]] = []
        missing: list[type[Message]] = []
        for message, stream in self._streams.items():
            if alive - stream.heard < stream.limit:
                continue
            if not stream.stopped:
                stream.stopped = True
                stopped.append(message)
            if stream.requests < MOST_REQUESTS and now >= stream.asked + ASK_AGAIN:
                missing.append(message)
        self._plan(now)
        return stopped, missing

    def asked(self, message: type[Message], now: float) -> int:
        """It is being asked for again.

        Args:
            message: Its class.
            now: Time in s.

        Returns:
            How often by now.
        """
        stream = self._streams[message]
        stream.requests += 1
        stream.asked = now
        return stream.requests

    def _plan(self, now: float) -> None:
        """Set the time of the next look: when one may have stopped, and no sooner than that takes to tell."""
        soonest = min((stream.heard + stream.limit for stream in self._streams.values()), default=NEVER)
        self.next_due = max(soonest, now + STALE_LEAST) if self._streams else NEVER
