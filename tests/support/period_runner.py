"""A device for links and servers that remembers for how many control periods it was asked to live."""

from __future__ import annotations

PERIOD = 0.005


class Runner:
    """A device that says something at certain control periods, and comes back at others without.

    Args:
        says: What it says, by the number of the period.
        pauses: Periods after which it is to be looked at.
    """

    period = PERIOD

    def __init__(self, says: dict[int, bytes], pauses: tuple[int, ...] = ()) -> None:
        self._says, self._pauses = says, pauses
        self._ticks = 0
        self.asked: list[tuple[bytes, int]] = []

    def now(self) -> float:
        return self._ticks * PERIOD

    def step(self, inbound: bytes) -> bytes:
        raise AssertionError((inbound, "it can live for many periods at a time"))

    def run(self, inbound: bytes, periods: int) -> list[tuple[float, bytes]]:
        self.asked.append((inbound, periods))
        for _ in range(periods):
            self._ticks += 1
            if self._ticks in self._says:
                return [(self.now(), self._says[self._ticks])]
            if self._ticks in self._pauses:
                break
        return []
