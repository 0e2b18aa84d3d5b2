"""Reads a link: by a thread in real time, inline in lock-step. A link that is gone is opened again here, if it may be."""

from __future__ import annotations

import queue
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.errors import LinkClosedError, LinkError

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link
    from hil.bridge.reopening import Reopening

Chunk = tuple[float, bytes]
"""Bytes that arrived together, and when, in s."""

SLICE: Final = 16 * 1024
"""Most bytes that are taken at once: decoding them takes some ms. Whole CAN records."""
LIMIT: Final = 1024 * 1024
"""Most bytes held for somebody to take: 90 s of a line at 115,200 baud, or two seconds of 250 robots on one link. What comes
in behind so many is heard when they have been decoded: 0.06 s for noise, 0.3 s for heartbeats (benchmarks/flood.py)."""
CHUNKS: Final = 10_000
"""Most chunks held, since each costs memory of its own however few its bytes are."""

_READ: Final = 0.05
"""Longest read of the pump's thread, in s: so long may closing take."""


@dataclass(frozen=True)
class Lost:
    """The link is gone, and is going to be opened again.

    Attributes:
        error: Why it is gone.
    """

    error: LinkError


@dataclass(frozen=True)
class Back:
    """A link is there again.

    Attributes:
        link: It; the one before is closed.
    """

    link: Link


Turn = Lost | Back


class Pump(Protocol):
    """Hands over what a link brings.

    Attributes:
        error: What ended the link for good, once everything that came before has been taken; None while it lives.
        turn: The link was lost or is back: so at the end of the chunks taken last. Who has seen to it sets it to None.
        overrun: Bytes that came and were never taken, since too many were waiting: the oldest are given up first.
    """

    error: LinkError | None
    turn: Turn | None
    overrun: int

    @property
    def pending(self) -> bool:
        """Something has arrived that `take` has not handed over yet."""
        ...

    def take(self, wait: float, until: float) -> list[Chunk]:
        """Wait for bytes.

        Args:
            wait: Longest wait in s; 0 takes what is there.
            until: Clock reading beyond which not to wait, in s.

        Returns:
            What has arrived, in order, up to a turn, and up to `SLICE` bytes: of a chunk that is too long for that, the
            rest comes next, with the same stamp. Empty when nothing came in time, or the link ended.
        """
        ...

    def wake(self) -> None:
        """Have a `take` that waits return at once, or the next one; called in any thread, and by signal handlers."""
        ...

    def let_go(self) -> None:
        """Nobody writes to the link that is lost any more: it may be closed, and opened again."""
        ...

    def drop(self, error: LinkError, *, refused: bool = False) -> None:
        """Take the link for lost: writing has found it gone, or what answers there is not the robot.

        Args:
            error: Why.
            refused: What answers is not the robot: the patience runs on.
        """
        ...

    def close(self) -> None:
        """Stop reading, and close the link. Repeating it does nothing."""
        ...


def _cut(chunk: Chunk, size: int) -> tuple[Chunk, Chunk | None]:
    """A chunk's first bytes, at most so many, and what is left of it, of the same moment."""
    stamp, data = chunk
    if len(data) <= size:
        return chunk, None
    return (stamp, data[:size]), (stamp, data[size:])


def open_pump(link: Link, clock: Clock, reopening: Reopening | None = None, arrived: Callable[[], None] | None = None) -> Pump:
    """What reads a link: in the caller's thread where it runs in lock-step, else in one of its own.

    Args:
        link: What to read.
        clock: Stamps the chunks.
        reopening: How to open it again; None does not.
        arrived: Called, by the thread, whenever there is something to take.
    """
    if link.lockstep:
        return InlinePump(link, clock, reopening)
    return ThreadedPump(link, clock, reopening, arrived)


class InlinePump:
    """Reads in the caller's thread, for links that run in lock-step.

    Args:
        link: What to read.
        clock: Stamps the chunks.
        reopening: How to open it again; None does not.
    """

    def __init__(self, link: Link, clock: Clock, reopening: Reopening | None = None) -> None:
        self.error: LinkError | None = None
        self.turn: Turn | None = None
        self.overrun = 0
        self._link = link
        self._now = clock.now
        self._reopening = reopening
        self._down = False
        self._rest: Chunk | None = None

    @property
    def pending(self) -> bool:
        """A part of what was read last has not been taken yet."""
        return self._rest is not None

    def take(self, wait: float, until: float) -> list[Chunk]:
        """Read once; see `Pump.take`. While there is no link, time passes all the same."""
        if self.turn is not None:
            return []
        if self._rest is not None:
            return self._first(self._rest)
        if wait > 0 and (left := until - self._now()) < wait:
            wait = left
        if self._down and self._reopening is not None:
            self._try_again(self._reopening, wait)
            return []
        try:
            data = self._link.read(wait)
        except LinkError as error:
            self.drop(error)
            return []
        if not data:
            return []
        chunk = (self._now(), data)
        return [chunk] if len(data) <= SLICE else self._first(chunk)

    def _first(self, chunk: Chunk) -> list[Chunk]:
        """As much of a chunk as may be taken at once; the rest is kept."""
        head, self._rest = _cut(chunk, SLICE)
        return [head]

    def drop(self, error: LinkError, *, refused: bool = False) -> None:
        """Take the link for lost; see `Pump.drop`."""
        if self._reopening is None:
            self.error = error
        elif not self._down:
            self._reopening.begin(error, self._now(), refused=refused)
            self._down = True
            self._rest = None  # not worth more than what the link still held
            self.turn = Lost(error)

    def wake(self) -> None:
        """Nobody waits: time passes as fast as the machine can."""

    def let_go(self) -> None:
        """Close what is lost."""
        self._link.close()

    def close(self) -> None:
        """Close the link; nothing runs, so nothing stops."""
        self._link.close()

    def _try_again(self, reopening: Reopening, wait: float) -> None:
        """Wait for the next try, and make it."""
        if (rest := min(wait, reopening.wait(self._now()))) > 0:
            reopening.opener.let_pass(rest)
        now = self._now()
        if reopening.wait(now):
            return
        try:
            link = reopening.attempt(now)
        except LinkError as error:
            self.error = error
            return
        if link is not None:
            self._link, self._down = link, False
            self.turn = Back(link)


class ThreadedPump:
    """Reads in a thread of its own, stamps what comes at once, and queues it. A lost link is opened again by that thread.

    The thread reads on though nobody takes, and gives up the oldest chunks that are too many: what a robot says now, the
    answer to a stop above all, must not wait behind what came while nobody listened, here or in the link's own buffers.

    Args:
        link: What to read.
        clock: Stamps the chunks.
        reopening: How to open it again; None does not.
        arrived: Called, by the thread, whenever there is something to take.
        wait: Lets so many seconds pass between two tries, and returns True at once when the event is set.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        reopening: Reopening | None = None,
        arrived: Callable[[], None] | None = None,
        *,
        wait: Callable[[threading.Event, float], bool] = threading.Event.wait,
    ) -> None:
        self.error: LinkError | None = None
        self.turn: Turn | None = None
        self.overrun = 0
        self._link = link
        self._arrived = arrived
        self._now = clock.now
        self._reopening = reopening
        self._wait = wait
        self._lock = threading.Lock()
        self._items: deque[Chunk | Turn | LinkError] = deque()
        self._held = 0
        self._chunks = 0
        self._waiting = False
        self._woken = False
        self._bell: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._stop = threading.Event()
        self._free = threading.Event()
        self._dropped: tuple[LinkError, bool] | None = None
        self._thread = threading.Thread(target=self._run, name=f"pump {link.url}", daemon=True)
        self._thread.start()

    @property
    def pending(self) -> bool:
        """The thread has queued what has not been taken yet."""
        return bool(self._items)

    def take(self, wait: float, until: float) -> list[Chunk]:
        """Take what the thread has read; see `Pump.take`."""
        chunks: list[Chunk] = []
        if self.error is not None or self.turn is not None:
            return chunks
        if not self._items:
            if wait > 0:
                wait = min(wait, until - self._now())
            if wait <= 0:
                return chunks
            self._await(wait)
        room = SLICE
        with self._lock:
            items = self._items
            while items and room > 0:
                item = items.popleft()
                if not isinstance(item, tuple):
                    if isinstance(item, LinkError):
                        self.error = item
                    else:
                        self.turn = item
                    break
                head, rest = _cut(item, room)
                if rest is None:
                    self._chunks -= 1
                else:
                    items.appendleft(rest)
                chunks.append(head)
                room -= len(head[1])
            self._held -= SLICE - room
        return chunks

    def _await(self, wait: float) -> None:
        """Wait until there is something to take, at most so long."""
        with self._lock:
            if self._items:
                return
            while not self._bell.empty():  # rung when the wait before was over, or broken off
                self._bell.get_nowait()
            self._waiting = True
        with suppress(queue.Empty):
            if not self._woken:
                self._bell.get(timeout=wait)
        self._waiting = self._woken = False

    def wake(self) -> None:
        """Ring the bell; no lock is taken, which the thread that is interrupted by a signal may hold."""
        self._woken = True
        self._bell.put(None)

    def drop(self, error: LinkError, *, refused: bool = False) -> None:
        """Have the thread take the link for lost, within the length of a read; see `Pump.drop`."""
        self._dropped = (error, refused)

    def let_go(self) -> None:
        """Let the thread close the link and open it again."""
        self._free.set()

    def close(self) -> None:
        """End the thread, wait for it, and close the link."""
        self._stop.set()
        self._free.set()
        self._thread.join()
        self._link.close()

    def _put(self, item: Chunk | Turn | LinkError) -> None:
        with self._lock:
            self._items.append(item)
            if isinstance(item, tuple):
                self._held += len(item[1])
                self._chunks += 1
                while self._chunks > 1 and (self._held > LIMIT or self._chunks > CHUNKS):
                    self._drop_oldest()
            if self._waiting:
                self._waiting = False
                self._bell.put(None)
        if self._arrived is not None:
            self._arrived()

    def _drop_oldest(self) -> None:
        """Give up the oldest chunk; turns, of which few can wait at a time, stay where they are."""
        for at, item in enumerate(self._items):
            if isinstance(item, tuple):
                del self._items[at]
                self._chunks -= 1
                self._held -= len(item[1])
                self.overrun += len(item[1])
                return

    def _run(self) -> None:
        put = self._put
        try:
            while not self._stop.is_set():
                try:
                    self._read_on()
                except LinkError as error:
                    if self._reopening is None:
                        raise
                    self._open_again(self._reopening, error)
        except LinkError as error:
            put(error)
        except Exception as error:  # noqa: BLE001 - a thread that died in silence would look like a silent robot
            put(LinkClosedError(self._link.url, f"reading failed: {error!r}"))

    def _read_on(self) -> None:
        """Read until told to stop, or the link is lost."""
        put, read, now, stopped = self._put, self._link.read, self._now, self._stop.is_set
        while not stopped():
            if data := read(_READ):
                put((now(), data))
            if self._dropped is not None:
                raise self._dropped[0]

    def _open_again(self, reopening: Reopening, error: LinkError) -> None:
        """Tell of the loss, and try until the link is open, the patience over (raises LinkError), or the pump closed."""
        refused = self._dropped is not None and self._dropped[1]
        reopening.begin(error, self._now(), refused=refused)
        self._free.clear()
        self._put(Lost(error))
        while not self._free.wait(_READ) and not self._stop.is_set():
            pass
        self._link.close()
        self._dropped = None
        while not self._wait(self._stop, reopening.wait(self._now())):
            link = reopening.attempt(self._now())
            if link is not None:
                self._link = link
                self._put(Back(link))
                return
