"""A link in lock-step whose bytes come together, as by an adapter with a latency timer: fewer chunks, each worth looking at."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import LinkClosedError
from firmware_protocol.link import Link

if TYPE_CHECKING:
    from firmware_protocol.clock import Clock

_ROUNDING: Final = 1e-6
"""Slack for quotients of sums of control periods."""


class GatheringLink(Link):
    """Gives what has come at multiples of a span of time, or when the time of a read is over.

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

    def news(self) -> list[str]:
        """See `Link.news`."""
        return self._inner.news()

    def write(self, data: bytes) -> None:
        """See `Link.write`."""
        self._inner.write(data)

    def read(self, timeout: float) -> bytes:
        """Wait for bytes, and then for the end of the span in which they came.

        Args:
            timeout: Longest wait in s.
        """
        until = self._now() + timeout
        data = self._inner.read(timeout)
        if not data:
            return data
        parts = [data]
        now = self._now()
        until = min(until, ceil(now / self._span - _ROUNDING) * self._span)
        while (left := until - self._now()) > _ROUNDING:
            try:
                parts.append(self._inner.read(left))
            except LinkClosedError:  # the next read says so
                break
        return b"".join(parts)

    def close(self) -> None:
        """See `Link.close`."""
        self._inner.close()
