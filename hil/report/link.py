"""How good the link was, from what a log holds of it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.messages import CommandLong, RobotAck, RobotStatus, Timesync

if TYPE_CHECKING:
    from collections.abc import Iterable

    from firmware_protocol.wire.fields import Message

Frame = tuple[tuple[int, int], int, float]
"""Of a good frame the system and component that sent it, its sequence number, and its log time in s."""
HEARD: Final[frozenset[type[Message]]] = frozenset({RobotAck, RobotStatus, Timesync})
"""What a robot says of the link."""
MOST_GAPS: Final = 1_000_000
"""Lost frames whose times are kept."""


@dataclass
class LinkQuality:
    """Counts and times of one link.

    Attributes:
        received: Good frames received, by (system, component) of the sender.
        lost: Frames missing by their sequence numbers, damaged ones included.
        duplicates: Frames that came twice.
        rejected: Pieces of wire input that were no good message, by reason.
        sent: Messages sent, by topic.
        retries: Messages sent again because no answer had come.
        bytes_received: Bytes that came over the link.
        bytes_sent: Bytes that went out.
        round_trips: Time from a question asked once to its answer, in s.
        arrivals: Log times of good frames, in s.
        gaps: Log times at which frames were missed (once per frame; some may come late), in s.
        refusals: Log times of rejected input, in s.
        robot: The robot's own counters, as last told; None where it never told.
    """

    received: Counter[tuple[int, int]] = field(default_factory=Counter)
    lost: int = 0
    duplicates: int = 0
    rejected: Counter[str] = field(default_factory=Counter)
    sent: Counter[str] = field(default_factory=Counter)
    retries: int = 0
    bytes_received: int = 0
    bytes_sent: int = 0
    round_trips: list[float] = field(default_factory=list)
    arrivals: list[float] = field(default_factory=list)
    gaps: list[float] = field(default_factory=list)
    refusals: list[float] = field(default_factory=list)
    robot: RobotStatus | None = None

    @property
    def good(self) -> int:
        """Good frames received, all senders together."""
        return sum(self.received.values())

    @property
    def loss(self) -> float:
        """Share of the frames sent to us that did not arrive whole, 0 to 1."""
        return self.lost / (self.good + self.lost) if self.good else 0.0


class LinkWatcher:
    """Collects the quality of a link from a log's messages, in their order."""

    def __init__(self) -> None:
        self.quality = LinkQuality()
        self._last: dict[tuple[int, int], int] = {}
        self._asked: dict[tuple[int, int], tuple[float, bool]] = {}
        self._compared: dict[int, float] = {}

    def came(self, frames: Iterable[Frame]) -> None:
        """Good frames came.

        Args:
            frames: Them, in order.
        """
        received, arrivals, numbers = self.quality.received, self.quality.arrivals, self._last
        for sender, frame, time in frames:
            received[sender] += 1
            arrivals.append(time)
            last = numbers.get(sender)
            if last is not None and (last + 1) & 0xFF == frame:  # as nearly always
                numbers[sender] = frame
            else:
                self._count(sender, frame, last, time)

    def received(self, message: Message | None, time: float) -> None:
        """A good frame held a message, one of `HEARD` if anything is to be learnt of it.

        Args:
            message: The message; None where it was not read.
            time: Log time in s.
        """
        quality = self.quality
        if isinstance(message, RobotAck):
            self._answered(self._asked.pop((message.session, message.sequence), None), time)
        elif isinstance(message, Timesync) and message.ts1 in self._compared:
            quality.round_trips.append(time - self._compared.pop(message.ts1))
        elif isinstance(message, RobotStatus):
            quality.robot = message

    def _count(self, sender: tuple[int, int], frame: int, last: int | None, time: float) -> None:
        quality = self.quality
        step = 1 if last is None else (frame - last) & 0xFF
        if step == 0:
            quality.duplicates += 1
        elif step >= 128:  # it comes late and had been counted as lost
            quality.lost = max(0, quality.lost - 1)
        else:
            quality.lost += step - 1
            if len(quality.gaps) < MOST_GAPS:
                quality.gaps.extend([time] * (step - 1))
            self._last[sender] = frame

    def sent(self, message: Message | None, topic: str, time: float) -> None:
        """A message was sent.

        Args:
            message: The message; None where it was not read.
            topic: Its topic.
            time: Log time in s.
        """
        quality = self.quality
        quality.sent[topic] += 1
        if message is None:
            return
        if message.NUMBERED:
            numbered: Any = message
            key = (numbered.session, numbered.sequence)
            again = key in self._asked
            quality.retries += again
            self._asked[key] = (self._asked[key][0] if again else time, again)
        elif isinstance(message, CommandLong):
            quality.retries += message.confirmation > 0
        elif isinstance(message, Timesync) and message.tc1 == 0:
            self._compared[message.ts1] = time

    def rejected(self, reason: str, time: float) -> None:
        """Wire input was no good message.

        Args:
            reason: Why.
            time: Log time in s.
        """
        self.quality.rejected[reason] += 1
        self.quality.refusals.append(time)

    def _answered(self, asked: tuple[float, bool] | None, time: float) -> None:
        if asked is not None and not asked[1]:
            self.quality.round_trips.append(time - asked[0])
