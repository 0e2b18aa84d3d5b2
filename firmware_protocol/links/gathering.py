"""A link in lock-step whose bytes come together, as by an adapter with a latency timer: fewer chunks, each worth looking at."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.link import Link

if TYPE_CHECKING:
    from firmware_protocol.clock import Clock

_SLACK: Final = 1e-9
"""Slack for sums of control periods, in s."""
_ROUNDING: Final = 1e-6
"""Slack for quotients of sums of control periods."""


class GatheringLink(Link):
    """Gives what has come at multiples of a span of time, and only then.

    Args:
        inner: The link, in lock-step; closed with this one.
        clock: Its clock.
        span: In s.
    """

    def __init__(self, inner: Link, clock: Clock, span: float) -> None:
        self.url = inner.url
        self.wire = inner.wire
        self.lockstep = inner.lockstep
        self._inner = inner
        self._now = clock.now
        self._span = span
        self._parts: list[bytes] = []
        self._due = 0.0

    def news(self) -> list[str]:
        """See `Link.news`."""
        return self._inner.news()

    def write(self, data: bytes) -> None:
        """See `Link.write`."""
        self._inner.write(data)

    def read(self, timeout: float) -> bytes:
        """Wait for bytes, and then for the end of the span in which they came; a read that ends before that gives nothing.

        Args:
            timeout: Longest wait in s.
        """
        until, first = self._now() + timeout, True
        while True:
            now = self._now()
            if self._parts and now >= self._due - _ROUNDING:
                data = b"".join(self._parts)
                self._parts.clear()
                return data
            left = (min(until, self._due) if self._parts else until) - now
            if left <= _SLACK and not first:
                return b""
            first = False
            try:  # time passes in every read that is given any, however little; one that is given none takes what has come
                data = self._inner.read(max(left, _SLACK) if timeout > 0 else 0.0)
            except LinkClosedError:
                if not self._parts:
                    raise
                self._due = now  # the next read says so
                continue
            if data:
                if not self._parts:
                    self._due = self._end_of(self._now())
                self._parts.append(data)

    def _end_of(self, time: float) -> float:
        """The end of the span that a time is in, in s."""
        return ceil(time / self._span - _ROUNDING) * self._span

    def close(self) -> None:
        """See `Link.close`."""
        self._inner.close()
