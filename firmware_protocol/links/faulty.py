"""Any link, made worse on purpose: frames lost, damaged, doubled, late, and the plug pulled (and put back). All from a seed."""

from __future__ import annotations

import heapq
import random
import threading
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.link import Link
from firmware_protocol.wire.fields import CAN

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.clock import Clock
    from firmware_protocol.faults.spec import FaultSpec

HEADER: Final = 10
"""Bytes of a frame before its payload (MAVLink 2), which corruption leaves alone."""
TRAILER: Final = 2
"""Bytes of a frame after its payload: the checksum, left alone too."""
REORDER: Final = 0.04
"""Without jitter, greatest lateness of a frame that leaves its place in the line, in s."""
QUEUE: Final = 1.0
"""What would wait longer than this for a line with a limited rate is lost, in s."""
_SLACK: Final = 1e-9
"""The rounding of sums of control periods, or a wait would be a whole period too long now and then, in s."""
_POLL: Final = 0.002
"""In real time, longest sleep while a frame to be sent may become due, in s."""


@dataclass(slots=True)
class FaultCounts:
    """What was done to the frames that went one way."""

    frames: int = 0
    dropped: int = 0
    corrupted: int = 0
    duplicated: int = 0
    delayed: int = 0
    crowded: int = 0
    """Lost because the line could not carry them in time."""


class _Way:
    """One direction: frames in, the same frames out, later, fewer, or changed.

    Args:
        spec: What happens.
        seed: Any text; the same one does the same to the same frames.
        opened: When the link was opened, in s.
        split: Cuts bytes into frames; None leaves every piece whole and damages it anywhere.
        checked: The hardware checks frames and drops the damaged ones.
    """

    def __init__(
        self,
        spec: FaultSpec,
        seed: str,
        opened: float,
        split: Callable[[bytes], list[bytes]] | None,
        *,
        checked: bool = False,
    ) -> None:
        self._checked = checked
        self.spec = spec
        self.counts = FaultCounts()
        self._random = random.Random(seed)  # noqa: S311 - repeatable, not secret
        self._split = split
        self._queue: list[tuple[float, int, bytes]] = []
        self._number = 0
        self._last_due = -inf
        self._free = -inf
        # What befalls frames up to each change, and after the last one.
        changes = spec.line_changes()
        self._changes = [opened + time for time in changes]
        self._lines = [spec.line_at(time) for time in (0.0, *changes)]

    def clear(self) -> None:
        """Lose what is under way."""
        self._queue.clear()
        self._last_due = self._free = -inf

    @property
    def next_due(self) -> float:
        """When the next frame is due; infinite when none waits."""
        return self._queue[0][0] if self._queue else inf

    def admit(self, data: bytes, now: float) -> None:
        """Take bytes in."""
        for frame in self._split(data) if self._split else [data]:
            self._admit_frame(frame, now)

    def _admit_frame(self, frame: bytes, now: float) -> None:
        spec = self._lines[bisect_right(self._changes, now)] if self._changes else self._lines[0]
        draw, counts = self._random, self.counts
        counts.frames += 1
        if spec.drop and draw.random() < spec.drop:
            counts.dropped += 1
            return
        for share, damage in ((spec.corrupt, self._flip), (spec.corrupt_bytes, self._overwrite)):
            if share and draw.random() < share:
                counts.corrupted += 1
                if self._checked:
                    return
                frame = damage(frame)
        copies = 1
        if spec.duplicate and draw.random() < spec.duplicate:
            counts.duplicated += 1
            copies = 2
        for _ in range(copies):
            carried = self._carry(frame, now, spec)
            if carried is None:
                counts.crowded += 1
                continue
            due = carried + spec.delay + (draw.uniform(0.0, spec.jitter) if spec.jitter else 0.0)
            if spec.reorder and (spec.reorder == 1 or draw.random() < spec.reorder):
                due += 0.0 if spec.jitter else draw.uniform(0.0, REORDER)
            else:
                due = self._last_due = max(due, self._last_due)
            counts.delayed += due > now
            heapq.heappush(self._queue, (due, self._number, frame))
            self._number += 1

    def _carry(self, frame: bytes, now: float, spec: FaultSpec) -> float | None:
        """When a line of limited rate has carried a frame; None where too many wait already."""
        if spec.rate == inf and spec.frame_rate == inf:
            return now
        begins = max(now, self._free)
        if begins - now > QUEUE:
            return None
        self._free = begins + max(len(frame) / spec.rate, 1 / spec.frame_rate)
        return self._free

    def _flip(self, frame: bytes) -> bytes:
        """Flip one to three different bits of the payload; of anything shorter than a frame, anywhere."""
        first, last = 0, len(frame)
        if self._split and last > HEADER + TRAILER:
            first, last = HEADER, last - TRAILER
        places = range(first * 8, last * 8)
        damaged = bytearray(frame)
        for place in self._random.sample(places, min(self._random.randint(1, 3), len(places))):
            damaged[place >> 3] ^= 1 << (place & 7)
        return bytes(damaged)

    def _overwrite(self, frame: bytes) -> bytes:
        """Put other bytes in the place of one to three, anywhere."""
        damaged = bytearray(frame)
        for place in self._random.sample(range(len(frame)), min(self._random.randint(1, 3), len(frame))):
            damaged[place] ^= self._random.randint(1, 255)
        return bytes(damaged)

    def take(self, now: float) -> bytes:
        """Give out everything that is due."""
        queue = self._queue
        if not queue or queue[0][0] > now:
            return b""
        frames = []
        while queue and queue[0][0] <= now:
            frames.append(heapq.heappop(queue)[2])
        return b"".join(frames)


class FaultyLink(Link):
    """A link with faults, each way.

    Over a lock-step link, lateness passes in the device's time; over any other, in the clock's. There a thread must be
    reading for late frames to leave, which a pump does.

    Args:
        inner: The link proper; it is closed with this one.
        down: What happens on the way to the robot.
        up: What happens on the way back; None is the same as `down`.
        seed: The same seed does the same to the same frames.
        clock: Tells the time: the device's own for a lock-step link.
        split: Cuts bytes into frames (`firmware_protocol.wire.mavlink.split_frames`), so that faults befall frames, and damage
            their payload; None treats every piece of bytes as one frame and damages it anywhere.
    """

    def __init__(
        self,
        inner: Link,
        down: FaultSpec,
        up: FaultSpec | None = None,
        *,
        seed: int,
        clock: Clock,
        split: Callable[[bytes], list[bytes]] | None = None,
    ) -> None:
        self.url = inner.url
        self.lockstep = inner.lockstep
        self.wire = inner.wire
        self._inner = inner
        self._clock = clock
        opened = clock.now()
        self._down = _Way(down, f"{seed} down", opened, split, checked=self.wire == CAN)
        self._up = _Way(up or down, f"{seed} up", opened, split, checked=self.wire == CAN)
        specs = (down,) if up is None else (down, up)
        self._cuts = [(opened + spell.at, opened + spell.ends) for spec in specs for spell in spec.unplugs]
        self._dies = min((at for at, _ in self._cuts), default=inf)
        told = [(opened + time, text) for spec in specs for time, text in spec.timeline()]
        self._to_tell = deque(sorted(told, key=lambda one: one[0]))
        self._lock = threading.Lock()
        self._closed = False
        self._gone: LinkClosedError | None = None
        self._slice = _POLL if down.late() and not inner.lockstep else inf

    @property
    def down(self) -> FaultCounts:
        """What was done on the way to the robot."""
        return self._down.counts

    @property
    def up(self) -> FaultCounts:
        """What was done on the way from the robot."""
        return self._up.counts

    def news(self) -> list[str]:
        """What has happened to the link proper, and which faults began and ended, those of an emulated robot too."""
        news = self._inner.news()
        while self._to_tell and self._clock.now() >= self._to_tell[0][0]:
            news.append(self._to_tell.popleft()[1])
        return news

    def write(self, data: bytes) -> None:
        """Hand over whole frames; those that are not lost or late leave at once."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        now = self._clock.now()
        self._unplug(now)
        if self._gone:
            raise self._gone
        with self._lock:
            self._down.admit(data, now)
            self._forward(now)

    def read(self, timeout: float) -> bytes:
        """Wait for bytes that are not lost, at most `timeout` s."""
        if self._closed:
            raise LinkClosedError(self.url, "the link is closed")
        deadline = self._clock.now() + timeout
        looked = False
        while True:
            now = self._clock.now()
            self._unplug(now)
            if self._gone:  # what had arrived is handed over first
                if rest := self._up.take(inf):
                    return rest
                raise self._gone
            try:
                with self._lock:
                    self._forward(now)
                    due = self._down.next_due
            except LinkTimeoutError:  # a late frame that the other end does not take is lost: nobody waits for it here
                continue
            except LinkClosedError as error:
                self._gone = error
                continue
            if data := self._up.take(now):
                return data
            if looked and now >= deadline - _SLACK:
                return b""
            self._look(min(deadline, due, self._up.next_due, self._dies) - now)
            looked = True

    def close(self) -> None:
        """Close the link proper; frames still on their way are lost."""
        self._closed = True
        self._inner.close()

    def open_again(self, opener: Callable[[], Link]) -> None:
        """Go on with a link proper that is opened anew: the same faults, from where their chance stood. Closed before.

        Args:
            opener: Opens it; not called while the plug is out.

        Raises:
            LinkOpenError: The plug is out, or the link proper can't be opened.
        """
        now = self._clock.now()
        if any(at <= now < ends for at, ends in self._cuts):
            raise LinkOpenError(self.url, "unplugged")
        inner = opener()
        self._dies = min((at for at, _ in self._cuts if at > now), default=inf)  # what is over is over
        self._inner, self.url = inner, inner.url
        self._down.clear()
        self._up.clear()
        self._gone, self._closed = None, False

    def _look(self, wait: float) -> None:
        """Take in what comes within `wait` s."""
        try:
            data = self._inner.read(max(0.0, min(wait, self._slice)))
        except LinkClosedError as error:
            self._gone = error
            return
        if data:
            self._up.admit(data, self._clock.now())

    def _forward(self, now: float) -> None:
        """Send on what is due; the caller holds the lock."""
        if data := self._down.take(now):
            self._inner.write(data)

    def _unplug(self, now: float) -> None:
        """Die when the time has come."""
        if now >= self._dies and not self._gone:
            self._gone = LinkClosedError(self.url, "unplugged")
