"""Reads a link: by a thread in real time, inline in lock-step. A link that is gone is opened again here, if it may be."""

from __future__ import annotations

import queue
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.errors import LinkClosedError, LinkError

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link
    from hil.reopening import Reopening

Chunk = tuple[float, bytes]
"""Bytes that arrived together, and when, in s."""

_SLICE: Final = 0.05
"""Longest read of the pump's thread, in s: so long may closing take."""
_LIMIT: Final = 10_000
"""Chunks held for somebody to take."""


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
    """

    error: LinkError | None
    turn: Turn | None

    def take(self, wait: float, until: float) -> list[Chunk]:
        """Wait for bytes.

        Args:
            wait: Longest wait in s; 0 takes what is there.
            until: Clock reading beyond which not to wait, in s.

        Returns:
            Everything that has arrived, in order, up to a turn; empty when nothing came in time, or the link ended.
        """
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
        self._link = link
        self._now = clock.now
        self._reopening = reopening
        self._down = False

    def take(self, wait: float, until: float) -> list[Chunk]:
        """Read once; see `Pump.take`. While there is no link, time passes all the same."""
        if self.turn is not None:
            return []
        if wait > 0:
            wait = min(wait, until - self._now())
        if self._down and self._reopening is not None:
            self._try_again(self._reopening, wait)
            return []
        try:
            data = self._link.read(wait)
        except LinkError as error:
            self.drop(error)
            return []
        return [(self._now(), data)] if data else []

    def drop(self, error: LinkError, *, refused: bool = False) -> None:
        """Take the link for lost; see `Pump.drop`."""
        if self._reopening is None:
            self.error = error
        elif not self._down:
            self._reopening.begin(error, self._now(), refused=refused)
            self._down = True
            self.turn = Lost(error)

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
        self._link = link
        self._arrived = arrived
        self._now = clock.now
        self._reopening = reopening
        self._wait = wait
        self._queue: queue.SimpleQueue[Chunk | Turn | LinkError] = queue.SimpleQueue()
        self._stop = threading.Event()
        self._free = threading.Event()
        self._dropped: tuple[LinkError, bool] | None = None
        self._thread = threading.Thread(target=self._run, name=f"pump {link.url}", daemon=True)
        self._thread.start()

    def take(self, wait: float, until: float) -> list[Chunk]:
        """Take what the thread has read; see `Pump.take`."""
        chunks: list[Chunk] = []
        if self.error is not None or self.turn is not None:
            return chunks
        waiting = self._queue
        if waiting.empty():
            if wait > 0:
                wait = min(wait, until - self._now())
            if wait <= 0:
                return chunks
            try:
                item = waiting.get(timeout=wait)
            except queue.Empty:
                return chunks
        else:
            item = waiting.get_nowait()
        while isinstance(item, tuple):
            chunks.append(item)
            if waiting.empty():  # we are the only one who takes
                return chunks
            item = waiting.get_nowait()
        if isinstance(item, LinkError):
            self.error = item
        else:
            self.turn = item
        return chunks

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
        self._queue.put(item)
        if self._arrived is not None:
            self._arrived()

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
            if self._queue.qsize() >= _LIMIT:  # nobody takes: let the link's own buffers fill, not ours
                self._stop.wait(_SLICE)
            elif data := read(_SLICE):
                put((now(), data))
            if self._dropped is not None:
                raise self._dropped[0]

    def _open_again(self, reopening: Reopening, error: LinkError) -> None:
        """Tell of the loss, and try until the link is open, the patience over (raises LinkError), or the pump closed."""
        refused = self._dropped is not None and self._dropped[1]
        reopening.begin(error, self._now(), refused=refused)
        self._free.clear()
        self._put(Lost(error))
        while not self._free.wait(_SLICE) and not self._stop.is_set():
            pass
        self._link.close()
        self._dropped = None
        while not self._wait(self._stop, reopening.wait(self._now())):
            link = reopening.attempt(self._now())
            if link is not None:
                self._link = link
                self._put(Back(link))
                return
