"""How good a connection is: counters, and the comparison of two clocks."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import Timesync

if TYPE_CHECKING:
    from firmware_protocol.events import Received

_WINDOW: Final = 15
"""Comparisons that the clock offset is the median of."""
_WINDOW_FRAMES: Final = 32
"""A frame that comes twice does so within so many."""

_CLOCK_SLACK: Final = 1.0
"""Frames may overtake each other by less than this, in s: a robot's clock that goes back further has restarted."""


@dataclass(slots=True)
class Counters:
    """What has come from one robot, and how well.

    Attributes:
        good: Good frames.
        lost: Frames missing by their sequence numbers.
        duplicates: Frames that came twice; the second is ignored.
        late: Frames that came after a later one.
        rejected: Pieces of wire input that were no good message.
        retries: Messages sent again because no answer had come.
        answers: Questions answered at the first try: those that latency is measured on.
        latency: Time from the last such question to its answer, in s.
        latency_min: Least of these, in s.
        latency_sum: Sum of these, in s.
    """

    good: int = 0
    lost: int = 0
    duplicates: int = 0
    late: int = 0
    rejected: int = 0
    retries: int = 0
    answers: int = 0
    latency: float = 0.0
    latency_min: float = float("inf")
    latency_sum: float = 0.0

    @property
    def latency_mean(self) -> float:
        """Mean time from question to answer, in s; NaN before the first."""
        return self.latency_sum / self.answers if self.answers else float("nan")

    @property
    def loss(self) -> float:
        """Share of the robot's frames that did not arrive, 0 to 1."""
        sent = self.good + self.lost
        return self.lost / sent if sent else 0.0

    def answered(self, latency: float) -> None:
        """Note the answer to a question that was asked once.

        Args:
            latency: Time it took, in s.
        """
        self.answers += 1
        self.latency = latency
        self.latency_min = min(self.latency_min, latency)
        self.latency_sum += latency

    def jump(self, step: int) -> None:
        """Note a sequence number other than the next one.

        Args:
            step: Distance to the number before, 2..255 (modulo 256).
        """
        if step < 128:
            self.lost += step - 1
        else:  # a frame that had been counted as lost
            self.late += 1
            self.lost = max(0, self.lost - 1)


class _FrameStream:
    """The frames of one component.

    Args:
        first: The first of them.

    Attributes:
        sequence: Highest sequence number so far.
        recent: The last frames, to know one that comes twice.
    """

    __slots__ = ("recent", "sequence")

    def __init__(self, first: Received) -> None:
        self.sequence = first.sequence
        self.recent = deque([first.raw], maxlen=_WINDOW_FRAMES)


class FrameStreams:
    """Keeps the books of one system's frame sequences, by component.

    Args:
        counters: Where frames are counted.

    Attributes:
        components: Component ids heard.
    """

    def __init__(self, counters: Counters) -> None:
        self.components: set[int] = set()
        self._counters = counters
        self._streams: dict[int, _FrameStream] = {}

    def clear(self) -> None:
        """The link is another one: sequences begin anew."""
        self._streams.clear()

    def count(self, received: Received) -> bool:
        """Take a frame down.

        Args:
            received: What was in it.

        Returns:
            False for a frame that came twice.
        """
        stream = self._streams.get(received.component)
        if stream is None:
            self.components.add(received.component)
            self._streams[received.component] = _FrameStream(received)
            self._counters.good += 1
            return True
        step = (received.sequence - stream.sequence) & 255
        if step != 1:
            if not 0 < step < 128 and received.raw in stream.recent:  # a number already used, and the same frame
                self._counters.duplicates += 1
                return False
            if step:
                self._counters.jump(step)
        if step < 128:
            stream.sequence = received.sequence
        stream.recent.append(received.raw)
        self._counters.good += 1
        return True


class RobotClock:
    """A robot's own clock: one that goes back has restarted, and the robot with it."""

    def __init__(self) -> None:
        self._latest = float("-inf")

    def begin(self, time: float) -> None:
        """The robot has restarted.

        Args:
            time: What its clock says since, in s.
        """
        self._latest = time

    def went_back(self, time: float) -> bool:
        """Whether the robot has restarted since its clock was seen last.

        Args:
            time: What it says now, in s.
        """
        if time > self._latest:
            self._latest = time
            return False
        restarted = time < self._latest - _CLOCK_SLACK
        if restarted:
            self._latest = time
        return restarted


class ClockComparison:
    """Estimates how far the robot's clock is from ours, by TIMESYNC.

    The answer to a question is taken to have been written half way between asking and hearing; the estimate is the median
    of the last fifteen, of those the quicker half.
    """

    def __init__(self) -> None:
        self._samples: deque[tuple[float, float]] = deque(maxlen=_WINDOW)
        self._asked: int | None = None
        self.offset: float | None = None

    def question(self, now: float, system: int, component: int) -> Timesync:
        """Ask for the robot's time.

        Args:
            now: Time in s.
            system: Robot asked.
            component: Its component.

        Returns:
            The message to send.
        """
        self._asked = round(now * 1e9)
        return Timesync(tc1=0, ts1=self._asked, target_system=system, target_component=component)

    def answer(self, message: Timesync, now: float) -> None:
        """Take an answer; one that was not asked for, or that comes twice, is ignored.

        Args:
            message: The robot's TIMESYNC.
            now: When it came, in s.
        """
        if message.tc1 == 0 or message.ts1 != self._asked:
            return
        self._asked = None
        asked = message.ts1 * 1e-9
        self._samples.append((now - asked, (asked + now) / 2 - message.tc1 * 1e-9))
        quickest = sorted(self._samples)[: (len(self._samples) + 1) // 2]
        self.offset = median(offset for _, offset in quickest)

    def reset(self) -> None:
        """Forget everything: the robot has restarted and its clock with it."""
        self._samples.clear()
        self._asked = None
        self.offset = None
