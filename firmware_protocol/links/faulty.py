"""Any link, made worse on purpose: frames lost, damaged, doubled, late, and the plug pulled (and put back). All from a seed."""

from __future__ import annotations

import heapq
import random
import re
import threading
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import LinkClosedError, LinkOpenError, LinkTimeoutError
from firmware_protocol.link import Link
from firmware_protocol.wire import CAN

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.clock import Clock

HEADER: Final = 10
"""Bytes of a frame before its payload (MAVLink 2), which corruption leaves alone."""
TRAILER: Final = 2
"""Bytes of a frame after its payload: the checksum, left alone too."""
_PLUS: Final = re.compile(r"(?<![eE])\+")
"""Between the two times of `unplug`; 1e+3 is one number."""
_POLL: Final = 0.002
"""In real time, longest sleep while a frame to be sent may become due, in s."""


@dataclass(frozen=True)
class FaultSpec:
    """What happens to the frames that go one way.

    Attributes:
        drop: Share of frames lost, 0 to 1.
        corrupt: Share of frames in which one to three bits of the payload are flipped; on CAN, whose controllers check
            frames and drop the damaged ones, they are lost.
        duplicate: Share of frames that arrive twice.
        delay: Time every frame is late, in s.
        jitter: Further lateness, drawn for each frame uniformly from 0 to this, in s.
        reorder: Jitter may change the order, as in a network; otherwise a late frame holds up those after it, as in a wire.
        unplug: Time after opening at which the link dies, in s; None is never.
        replug: Time after that at which it is plugged in again, in s, and can be opened anew; None is never.

    Raises:
        ValueError: A share outside 0 to 1, a negative time, or plugging in what is never unplugged.
    """

    drop: float = 0.0
    corrupt: float = 0.0
    duplicate: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    reorder: bool = False
    unplug: float | None = None
    replug: float | None = None

    def __post_init__(self) -> None:
        for name in ("drop", "corrupt", "duplicate"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"fault {name!r} is a share of frames, 0 to 1, not {getattr(self, name):g}")
        for name in ("delay", "jitter", "unplug", "replug"):
            if not 0 <= (getattr(self, name) or 0) < float("inf"):
                raise ValueError(f"fault {name!r} is a time in s, not {getattr(self, name):g}")
        if self.replug is not None and self.unplug is None:
            raise ValueError("fault 'replug' needs the time of 'unplug' too: write unplug:T+D")

    @classmethod
    def parse(cls, text: str) -> FaultSpec:
        """Read a specification from an address or a command line.

        Args:
            text: As `drop:0.05,corrupt:0.01,jitter:0.02,reorder`; `=` may stand for `:`. `unplug:5+2` is unplugged after
                5 s and plugged in again 2 s later.

        Returns:
            The specification; what is not named does not happen.

        Raises:
            ValueError: An unknown name, or a value that does not fit.
        """
        spec = cls()
        known = [field.name for field in fields(cls) if field.name != "replug"]
        for item in filter(None, (part.strip() for part in text.split(","))):
            name, _, value = item.replace("=", ":").partition(":")
            if name not in known:
                raise ValueError(f"unknown fault {name!r}: known are {', '.join(known)}")
            if name == "reorder":
                if value not in {"", "1", "true", "0", "false"}:
                    raise ValueError(f"fault 'reorder' is on or off, not {value!r}")
                spec = replace(spec, reorder=value in {"", "1", "true"})
                continue
            first, *again = _PLUS.split(value, 1) if name == "unplug" else [value]
            try:
                number, replug = float(first), float(again[0]) if again else None
            except ValueError:
                raise ValueError(f"fault {name!r} needs a number, not {value!r}") from None
            match name:
                case "drop":
                    spec = replace(spec, drop=number)
                case "corrupt":
                    spec = replace(spec, corrupt=number)
                case "duplicate":
                    spec = replace(spec, duplicate=number)
                case "delay":
                    spec = replace(spec, delay=number)
                case "jitter":
                    spec = replace(spec, jitter=number)
                case _:
                    spec = replace(spec, unplug=number, replug=replug)
        return spec

    def __str__(self) -> str:
        """The specification as `parse` reads it."""
        items: list[str] = []
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "replug" and value is not None:
                items[-1] += f"+{value:g}"
            elif value != field.default:
                items.append("reorder" if field.name == "reorder" else f"{field.name}:{value:g}")
        return ",".join(items)


@dataclass(slots=True)
class FaultCounts:
    """What was done to the frames that went one way."""

    frames: int = 0
    dropped: int = 0
    corrupted: int = 0
    duplicated: int = 0
    delayed: int = 0


class _Way:
    """One direction: frames in, the same frames out, later, fewer, or changed.

    Args:
        spec: What happens.
        seed: Any text; the same one does the same to the same frames.
        split: Cuts bytes into frames; None leaves every piece whole and damages it anywhere.
        checked: The hardware checks frames and drops the damaged ones.
    """

    def __init__(
        self, spec: FaultSpec, seed: str, split: Callable[[bytes], list[bytes]] | None, *, checked: bool = False
    ) -> None:
        self._checked = checked
        self.spec = spec
        self.counts = FaultCounts()
        self._random = random.Random(seed)  # noqa: S311 - repeatable, not secret
        self._split = split
        self._queue: list[tuple[float, int, bytes]] = []
        self._number = 0
        self._last_due = float("-inf")

    def clear(self) -> None:
        """Lose what is under way."""
        self._queue.clear()
        self._last_due = float("-inf")

    @property
    def next_due(self) -> float:
        """When the next frame is due; infinite when none waits."""
        return self._queue[0][0] if self._queue else float("inf")

    def admit(self, data: bytes, now: float) -> None:
        """Take bytes in."""
        for frame in self._split(data) if self._split else [data]:
            self._admit_frame(frame, now)

    def _admit_frame(self, frame: bytes, now: float) -> None:
        spec, draw, counts = self.spec, self._random, self.counts
        counts.frames += 1
        if spec.drop and draw.random() < spec.drop:
            counts.dropped += 1
            return
        if spec.corrupt and draw.random() < spec.corrupt:
            counts.corrupted += 1
            if self._checked:
                return
            frame = self._damage(frame)
        copies = 1
        if spec.duplicate and draw.random() < spec.duplicate:
            counts.duplicated += 1
            copies = 2
        for _ in range(copies):
            due = now + spec.delay + (draw.uniform(0.0, spec.jitter) if spec.jitter else 0.0)
            if not spec.reorder:
                due = max(due, self._last_due)
            self._last_due = due
            counts.delayed += due > now
            heapq.heappush(self._queue, (due, self._number, frame))
            self._number += 1

    def _damage(self, frame: bytes) -> bytes:
        """Flip one to three different bits of the payload; of anything shorter than a frame, anywhere."""
        first, last = 0, len(frame)
        if self._split and last > HEADER + TRAILER:
            first, last = HEADER, last - TRAILER
        places = range(first * 8, last * 8)
        damaged = bytearray(frame)
        for place in self._random.sample(places, min(self._random.randint(1, 3), len(places))):
            damaged[place >> 3] ^= 1 << (place & 7)
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
        split: Cuts bytes into frames (`firmware_protocol.mavlink.split_frames`), so that faults befall frames, and damage
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
        self.news = inner.news  # type: ignore[method-assign]
        self._inner = inner
        self._clock = clock
        self._down = _Way(down, f"{seed} down", split, checked=self.wire == CAN)
        self._up = _Way(up or down, f"{seed} up", split, checked=self.wire == CAN)
        dies, away = min((_never(spec.unplug), _never(spec.replug)) for spec in (down, up or down))
        self._dies = clock.now() + dies
        self._returns = self._dies + away
        self._lock = threading.Lock()
        self._closed = False
        self._gone: LinkClosedError | None = None
        late = down.delay or down.jitter
        self._slice = _POLL if late and not inner.lockstep else float("inf")

    @property
    def down(self) -> FaultCounts:
        """What was done on the way to the robot."""
        return self._down.counts

    @property
    def up(self) -> FaultCounts:
        """What was done on the way from the robot."""
        return self._up.counts

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
                if rest := self._up.take(float("inf")):
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
            if looked and now >= deadline:
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
        if self._dies <= now < self._returns:
            raise LinkOpenError(self.url, "unplugged")
        inner = opener()
        if now >= self._dies:  # that was the one time
            self._dies = float("inf")
        self._inner, self.url, self.news = inner, inner.url, inner.news  # type: ignore[method-assign]
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


def _never(time: float | None) -> float:
    """None as infinity."""
    return float("inf") if time is None else time
