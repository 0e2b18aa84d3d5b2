"""Reads a link: by a thread in real time, inline in lock-step."""

from __future__ import annotations

import queue
import threading
from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.errors import LinkClosedError, LinkError

if TYPE_CHECKING:
    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link

Chunk = tuple[float, bytes]
"""Bytes that arrived together, and when, in s."""

_SLICE: Final = 0.05
"""Longest read of the pump's thread, in s: so long may closing take."""
_LIMIT: Final = 10_000
"""Chunks held for somebody to take."""


class Pump(Protocol):
    """Hands over what a link brings.

    Attributes:
        error: What ended the link, once everything that came before has been taken; None while it lives.
    """

    error: LinkError | None

    def take(self, wait: float, until: float) -> list[Chunk]:
        """Wait for bytes.

        Args:
            wait: Longest wait in s; 0 takes what is there.
            until: Clock reading beyond which not to wait, in s.

        Returns:
            Everything that has arrived, in order; empty when nothing came in time, or the link ended.
        """
        ...

    def close(self) -> None:
        """Stop reading; the link itself is left open. Repeating it does nothing."""
        ...


class InlinePump:
    """Reads in the caller's thread, for links that run in lock-step.

    Args:
        link: What to read.
        clock: Stamps the chunks.
    """

    def __init__(self, link: Link, clock: Clock) -> None:
        self.error: LinkError | None = None
        self._read = link.read
        self._now = clock.now

    def take(self, wait: float, until: float) -> list[Chunk]:
        """Read once; see `Pump.take`."""
        if wait > 0:
            wait = min(wait, until - self._now())
        try:
            data = self._read(wait)
        except LinkError as error:
            self.error = error
            return []
        return [(self._now(), data)] if data else []

    def close(self) -> None:
        """Nothing runs, so nothing stops."""


class ThreadedPump:
    """Reads in a thread of its own, stamps what comes at once, and queues it.

    Args:
        link: What to read.
        clock: Stamps the chunks.
    """

    def __init__(self, link: Link, clock: Clock) -> None:
        self.error: LinkError | None = None
        self._link = link
        self._now = clock.now
        self._queue: queue.SimpleQueue[Chunk | LinkError] = queue.SimpleQueue()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"pump {link.url}", daemon=True)
        self._thread.start()

    def take(self, wait: float, until: float) -> list[Chunk]:
        """Take what the thread has read; see `Pump.take`."""
        chunks: list[Chunk] = []
        if self.error is not None:
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
        while not isinstance(item, LinkError):
            chunks.append(item)
            if waiting.empty():  # we are the only one who takes
                return chunks
            item = waiting.get_nowait()
        self.error = item
        return chunks

    def close(self) -> None:
        """End the thread and wait for it."""
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        put, read, now, stopped = self._queue.put, self._link.read, self._now, self._stop.is_set
        try:
            while not stopped():
                if self._queue.qsize() >= _LIMIT:  # nobody takes: let the link's own buffers fill, not ours
                    self._stop.wait(_SLICE)
                elif data := read(_SLICE):
                    put((now(), data))
        except LinkError as error:
            put(error)
        except Exception as error:  # noqa: BLE001 - a thread that died in silence would look like a silent robot
            put(LinkClosedError(self._link.url, f"reading failed: {error!r}"))
