"""What is told to everybody who looks on: the parts of a run that are over, and the one that goes on as it stands."""

from __future__ import annotations

from collections import deque
from threading import Condition
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

MOST_KEPT: Final = 8_000_000
"""Letters of the parts that are over and are kept for who comes later; the oldest are given up."""
ALIVE: Final = 1.0
"""Where nothing happens for so long, in s, that is said: so it is found out that somebody has gone."""

PART, BEGIN, ASKED, OVER = "part", "begin", "asked", "over"
"""Kinds of events: a part; forget what was told; what a person is asked now; nothing more comes."""

Told = tuple[str, str]
"""A kind of event, and its text in one line; an empty kind: nothing has happened."""


class Broadcast:
    """Holds what is told, for any number of listeners; each takes it at its own speed, and no one waits for them.

    Args:
        alive: Where nothing happens for so long, in s, that is said.
    """

    def __init__(self, alive: float = ALIVE) -> None:
        self._alive = alive
        self._changed = Condition()
        self._over: deque[tuple[int, str]] = deque()
        self._next = 0
        self._given_up = 0
        self._size = 0
        self._going: str | None = None
        self._version = 0
        self._asked: str | None = None
        self._end: str | None = None
        self._listening = 0
        self._came = False

    def commit(self, text: str, *, instead: bool = False) -> None:
        """Tell of a part that is over.

        Args:
            text: The part, in one line.
            instead: Who comes later needs not the one before it.
        """
        with self._changed:
            if instead and self._over:
                self._size -= len(self._over.pop()[1])
            self._over.append((self._next, text))
            self._next += 1
            self._size += len(text)
            while self._size > MOST_KEPT and len(self._over) > 1:
                number, oldest = self._over.popleft()
                self._size -= len(oldest)
                self._given_up = number + 1
            self._going = None
            self._version += 1
            self._changed.notify_all()

    def show(self, text: str) -> None:
        """Tell how the part that goes on stands.

        Args:
            text: The part, in one line.
        """
        with self._changed:
            self._going = text
            self._version += 1
            self._changed.notify_all()

    def ask(self, text: str) -> None:
        """Tell what a person is asked now.

        Args:
            text: The question and what may be answered, as JSON.
        """
        with self._changed:
            self._asked = text
            self._version += 1
            self._changed.notify_all()

    def end(self, text: str) -> None:
        """Nothing more comes.

        Args:
            text: Why, in words, as JSON.
        """
        with self._changed:
            self._end = text
            self._changed.notify_all()

    def wait_for_first(self, wait: float) -> None:
        """Wait until somebody listens, or has.

        Args:
            wait: At most so long, in s.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._came, wait)

    def wait_for_last(self, wait: float) -> None:
        """Wait until everybody who listens has been told the end.

        Args:
            wait: At most so long, in s.
        """
        with self._changed:
            self._changed.wait_for(lambda: not self._listening, wait)

    def listen(self) -> Iterator[Told]:
        """What is told from now on, and before that what there is; ends with the end."""
        with self._changed:
            self._listening += 1
            self._came = True
            self._changed.notify_all()
        try:
            yield BEGIN, "{}"
            yield from self._events()
        finally:
            with self._changed:
                self._listening -= 1
                self._changed.notify_all()

    def _events(self) -> Iterator[Told]:
        following, version = 0, -1
        answerable: str | None = None
        while True:
            with self._changed:
                changed = self._wait_for_more(version)
                skipped = following < self._given_up
                parts = [text for number, text in self._over if number >= following]
                following = self._next
                going = self._going if self._version != version else None
                version, end, asked = self._version, self._end, self._asked
            if not changed:
                yield "", ""
                continue
            if skipped and len(parts) > 1:
                yield BEGIN, "{}"
            for text in parts:
                yield PART, text
            if going is not None:
                yield PART, going
            if asked is not None and asked is not answerable:
                answerable = asked
                yield ASKED, asked
            if end is not None:
                yield OVER, end
                return

    def _wait_for_more(self, version: int) -> bool:
        return self._changed.wait_for(lambda: self._version != version or self._end is not None, self._alive)
