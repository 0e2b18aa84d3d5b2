"""How good a link has been lately: what came and what did not, in the last seconds."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple

from hil.cockpit.snapshot import Fact, Tone

if TYPE_CHECKING:
    from firmware_protocol.peer.quality import Counters

LATELY: Final = 5.0
"""How far back `lately` reaches, in s."""
_EVERY: Final = 0.5
_GOOD, _FAIR = 0.99, 0.9
"""Share of frames that come over a line that is good, and over one that is fair."""


class _Counted(NamedTuple):
    now: float
    good: int
    lost: int


class Quality:
    """Watches the counters of one robot."""

    def __init__(self) -> None:
        self._counted: deque[_Counted] = deque()

    def look(self, now: float, counters: Counters) -> None:
        """Remember what has come by now.

        Args:
            now: Time in s.
            counters: Of the robot.
        """
        if not self._counted or now - self._counted[-1].now >= _EVERY:
            self._counted.append(_Counted(now, counters.good, counters.lost))
            while len(self._counted) > 1 and now - self._counted[1].now >= LATELY:
                self._counted.popleft()

    def facts(self, now: float, counters: Counters) -> tuple[Fact, ...]:
        """What there is to say of the link.

        Args:
            now: Time in s.
            counters: Of the robot.
        """
        first = self._counted[0] if self._counted else _Counted(now, counters.good, counters.lost)
        good, lost, time = counters.good - first.good, counters.lost - first.lost, now - first.now
        share = good / (good + lost) if good + lost else 0.0
        tone = Tone.GOOD if share >= _GOOD else Tone.CALM if share >= _FAIR else Tone.WARNING
        rate = good / time if time > 0 else 0.0
        answers = f"{counters.latency * 1000:.1f} ms" if counters.answers else "-"
        return (
            Fact("link", f"{share:.0%}, {rate:.0f}/s", share, tone),
            Fact("lost", f"{counters.lost}, rejected {counters.rejected}"),
            Fact("answers in", f"{answers}, repeated {counters.retries}"),
        )
