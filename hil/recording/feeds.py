"""How items reach the recorder's process: at once in lock-step, where time stands still meanwhile; else beside the control.

In real time nothing that the disk or the other process does holds up a step: the control only puts items into a queue, and a
thread hands them over. What does not fit into the queue is lost, counted and told of.
"""

from __future__ import annotations

from collections import deque
from threading import Event, Thread
from typing import TYPE_CHECKING, Final, Protocol

from hil.recording.handover import pack

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hil.recording.handover import Item

LOCKSTEP_BATCH: Final = 0.15
"""Log time between batches in lock-step, in s: what is lost when the control process is killed."""
REAL_TIME_BATCH: Final = 0.05
"""Likewise in real time, by the wall clock."""
QUEUE: Final = 60_000
"""Items that wait in real time at most: over two minutes of one robot's."""
PACKED: Final = 512
"""Items that are packed together at most."""
QUEUE_BYTES: Final = 8 << 20
"""Received bytes that wait at most."""


class Feed(Protocol):
    """Takes items from the control process.

    Attributes:
        add: Takes an item.
        losing: There is no room, and what comes is lost.
    """

    add: Callable[[Item], None]
    losing: bool

    def keep(self, item: Item) -> None:
        """Take an item that is rare, and is never lost."""
        ...

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]]) -> None:
        """A step begins, whose item comes next: its time in s, and what it has received."""
        ...

    def hurry(self) -> None:
        """Hand over everything, at once."""
        ...

    def end(self, last: Item) -> None:
        """Hand over everything; nothing comes after it.

        Args:
            last: What comes last.
        """
        ...


class LockstepFeed:
    """Hands over a batch at a time, and waits until it is taken.

    Each step's items are packed as soon as the next one begins, while they are still in the processor's cache: kept until the
    batch is due they cost twice the time.

    Args:
        send: Hands over a batch: its number, and its items, packed. An interrupted one is sent again with its number, and more.
    """

    def __init__(self, send: Callable[[int, Sequence[bytes]], None]) -> None:
        self._send = send
        self._number = 0
        self._due = 0.0
        self._packed: list[bytes] = []
        self._items: list[Item] = []
        self.losing = False
        self.add: Callable[[Item], None] = self._items.append

    def keep(self, item: Item) -> None:
        """Take an item; nothing is ever lost."""
        self.add(item)

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]]) -> None:  # noqa: ARG002 - part of the interface
        """Pack what there is, and hand it over when that is due."""
        # An interrupt comes only at calls and jumps: between packing and forgetting there is none.
        fresh: list[Item] = []
        add = fresh.append
        self._packed += (pack(self._items),)
        self._items, self.add = fresh, add
        if time >= self._due:
            self._hand_over()
            self._due = time + LOCKSTEP_BATCH

    def hurry(self) -> None:
        """Hand over everything."""
        fresh: list[Item] = []
        add = fresh.append
        self._packed += (pack(self._items),)
        self._items, self.add = fresh, add
        self._hand_over()

    def end(self, last: Item) -> None:
        """Hand over everything."""
        self.add(last)
        self.hurry()

    def _hand_over(self) -> None:
        self._send(self._number, self._packed)
        self._packed, self._number = [], self._number + 1


class RealTimeFeed:
    """Hands over what there is every so often, by a thread.

    Args:
        send: As in `LockstepFeed`; it may block.
        lost: Is told how many items have been lost, when there is room again, or at the end.

    Attributes:
        losing: There is no room, and what comes is lost.
    """

    def __init__(self, send: Callable[[int, Sequence[bytes]], None], lost: Callable[[int], None]) -> None:
        self._send = send
        self._tell = lost
        self._number = 0
        self._queue: deque[Item] = deque()
        self._bytes = 0
        self._lost = 0
        self.losing = False
        self._wake = Event()
        self._ending = False
        self.add: Callable[[Item], None] = self._queue.append
        self._thread = Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def keep(self, item: Item) -> None:
        """Take an item that is rare, and is never lost."""
        self._queue.append(item)

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]]) -> None:  # noqa: ARG002 - part of the interface
        """See whether there is room."""
        for _, data in chunks:
            self._bytes += len(data)
        waiting = len(self._queue)
        if self.losing:
            if waiting < QUEUE // 2 and self._bytes < QUEUE_BYTES // 2:
                self._found_room()
        elif waiting > QUEUE or self._bytes > QUEUE_BYTES:
            self.losing, self.add = True, self._lose

    def hurry(self) -> None:
        """Have the thread hand over everything now."""
        self._wake.set()

    def end(self, last: Item) -> None:
        """Hand over everything, and end the thread."""
        self._found_room()
        self._queue.append(last)
        self._ending = True
        self._wake.set()
        self._thread.join()

    def _lose(self, item: Item) -> None:  # noqa: ARG002 - it is lost
        self._lost += 1

    def _found_room(self) -> None:
        lost, self._lost = self._lost, 0
        self.losing, self.add = False, self._queue.append
        if lost:
            self._tell(lost)

    def _run(self) -> None:
        queue = self._queue
        ending = False
        while not ending:
            self._wake.wait(REAL_TIME_BATCH)
            self._wake.clear()
            ending = self._ending
            self._bytes = 0  # of what is added meanwhile some is not counted: the limit is none of bytes exactly
            while queue:
                self._send(self._number, (pack([queue.popleft() for _ in range(min(len(queue), PACKED))]),))
                self._number += 1
