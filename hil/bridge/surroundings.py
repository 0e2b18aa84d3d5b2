"""What a step meets besides bytes: an operator's wishes, and what has become of the link."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from hil.bridge.pump import LIMIT, Back, Lost
from hil.bridge.taps import NOTHING, Circumstances

if TYPE_CHECKING:
    from firmware_protocol.link import Link
    from hil.bridge.operator import Operator
    from hil.bridge.pump import Pump, Turn

_NEWS_PERIOD: Final = 1.0
"""Shortest time between two pieces of news of bytes that were dropped, in s."""


class Surroundings:
    """Looks around once in every step, when its chunks have been taken.

    Args:
        operator: Whose keys and signals are taken in.
        pump: Brings what the link brings.

    Attributes:
        turn: The link was lost or is back, as the last look has it; None where it was neither.
        dropped: Bytes that came and were given up, in all.
        told: How many of them have been told of.
    """

    def __init__(self, operator: Operator, pump: Pump) -> None:
        self.turn: Turn | None = None
        self.dropped = self.told = 0
        self._tell_at = float("-inf")
        self._operator = operator
        self._pump = pump

    @property
    def changed(self) -> bool:
        """Something of the link waits to be seen to, though no time has passed."""
        return self._pump.pending or self._pump.turn is not None

    def look(self, link: Link) -> Circumstances:
        """What this step meets.

        Args:
            link: The link in use.
        """
        pump = self._pump
        self.turn = turn = pump.turn
        if turn is not None:
            pump.turn = None
        inputs, news, overrun, ended = self._operator.take(), link.news(), pump.overrun, pump.error
        if not (inputs or news or turn or ended) and overrun == self.dropped:
            return NOTHING
        dropped, self.dropped = overrun - self.dropped, overrun
        return Circumstances(
            inputs,
            turn.error if isinstance(turn, Lost) else None,
            ended,
            turn.link.url if isinstance(turn, Back) else "",
            tuple(news),
            dropped,
        )

    def dropped_news(self, now: float) -> str:
        """What is to be told of bytes that were dropped: once in a while, of all since the last time; empty for nothing.

        Args:
            now: Time of the step, in s.
        """
        since = self.dropped - self.told
        if not since or now < self._tell_at:
            return ""
        self.told, self._tell_at = self.dropped, now + _NEWS_PERIOD
        most = f"more than {LIMIT // 1024:,} KiB were waiting to be taken in"
        return f"{since:,} bytes that had come were dropped, the oldest first: {most}"
