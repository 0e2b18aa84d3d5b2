"""What the host says arrives late: a delay of the line that a world has itself, whatever carries its bytes."""

from __future__ import annotations

from collections import deque


class Late:
    """Holds what is on its way; all of it keeps its order."""

    def __init__(self) -> None:
        self._way: deque[tuple[int, bytes]] = deque()

    def arriving(self, inbound: bytes, now: int, delay: int) -> bytes:
        """Take what has been said, and give what arrives.

        Args:
            inbound: Bytes that the host has said by now.
            now: The time, in control periods.
            delay: How late they are to be, in control periods; behind others they wait for them.

        Returns:
            Bytes that arrive now, of before and of now.
        """
        if inbound:
            due = now + delay
            self._way.append((max(due, self._way[-1][0]) if self._way else due, inbound))
        arrived = b""
        while self._way and self._way[0][0] <= now:
            arrived += self._way.popleft()[1]
        return arrived

    def next(self, now: int, periods: int) -> int:
        """How many control periods may pass before something else arrives.

        Args:
            now: The time, in control periods.
            periods: At most so many.
        """
        return min(periods, self._way[0][0] - now) if self._way else periods
