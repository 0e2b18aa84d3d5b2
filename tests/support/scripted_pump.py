"""A pump that hands over what a test writes down, and a link to nowhere."""

from __future__ import annotations

import queue
import threading
from typing import TYPE_CHECKING, NamedTuple

from firmware_protocol.link import Link

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.errors import LinkError
    from hil.bridge.pump import Chunk, Turn


class Nowhere(Link):
    """Takes what is written, and brings nothing.

    Attributes:
        written: What was written.
        failure: Raised by writing, where there is one.
        said: What is told of the link next.
    """

    def __init__(self, url: str = "nowhere:") -> None:
        self.url = url
        self.written: list[bytes] = []
        self.failure: LinkError | None = None
        self.said: list[str] = []

    def news(self) -> list[str]:
        said, self.said = self.said, []
        return said

    def write(self, data: bytes) -> None:
        if self.failure is not None:
            raise self.failure
        self.written.append(data)

    def read(self, timeout: float) -> bytes:
        raise NotImplementedError(f"the pump brings what comes, not the link: {timeout}")

    def close(self) -> None:
        """There is nothing to give back."""


class Taken(NamedTuple):
    """What is handed over at once."""

    chunks: tuple[Chunk, ...] = ()
    turn: Turn | None = None
    error: LinkError | None = None
    dropped: int = 0
    happens: Callable[[], None] | None = None


class ScriptedPump:
    """Hands over what it is told to, one entry a step; then nothing.

    Attributes:
        script: What comes next.
        waits: How long each step was ready to wait, in s.
        woken: Times it was woken.
        let: Times it was let go.
        dropped: Errors for which it was to take the link for lost.
    """

    def __init__(self, *script: Taken) -> None:
        self.error: LinkError | None = None
        self.turn: Turn | None = None
        self.overrun = 0
        self.pending = False
        self.script = list(script)
        self.waits: list[float] = []
        self.woken = 0
        self.let = 0
        self.dropped: list[LinkError] = []

    def take(self, wait: float, until: float) -> list[Chunk]:
        del until
        self.waits.append(wait)
        if not self.script:
            return []
        taken = self.script.pop(0)
        self.turn, self.error = taken.turn, taken.error
        self.overrun += taken.dropped
        if taken.happens is not None:
            taken.happens()
        return list(taken.chunks)

    def wake(self) -> None:
        self.woken += 1

    def let_go(self) -> None:
        self.let += 1

    def drop(self, error: LinkError, *, refused: bool = False) -> None:
        assert not refused
        self.dropped.append(error)

    def close(self) -> None:
        """There is nothing to end."""


class Mute(Nowhere):
    """A link in real time on which nothing comes: reading blocks until it is closed, or the time is over."""

    def __init__(self, url: str = "mute:") -> None:
        super().__init__(url)
        self._over = threading.Event()

    def read(self, timeout: float) -> bytes:
        self._over.wait(timeout)
        return b""

    def close(self) -> None:
        self._over.set()


class Bell(queue.SimpleQueue[None]):
    """A bell that says when somebody waits for it.

    Attributes:
        awaited: Somebody waits.
        unheard: Times nobody rang it in time.
    """

    def __init__(self) -> None:
        self.awaited = threading.Event()
        self.unheard = 0

    def get(self, block: bool = True, timeout: float | None = None) -> None:  # noqa: FBT001, FBT002 - as of the queue
        self.awaited.set()
        try:
            super().get(block, timeout)
        except queue.Empty:
            self.unheard += 1
            raise
