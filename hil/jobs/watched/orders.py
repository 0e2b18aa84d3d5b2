"""What keys have asked of one robot: done one after the other while the links are served, and given up for a stop."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from firmware_protocol.errors import PeerError, RefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from firmware_protocol.errors import HilError
    from hil.connecting.handle import RobotHandle

    Order = Callable[[], Iterator[None]]


def taken(robot: RobotHandle) -> Iterator[None]:
    """Take a robot that was only watched, bit by bit; one that is ours is left as it is.

    Args:
        robot: The robot.

    Raises:
        PeerError: It does not answer, or does not want to be taken.
    """
    if not robot.peer.taken:
        yield from robot.taking()


class OrderQueue:
    """OrderQueue to one robot.

    An order is done bit by bit (`RobotHandle.taking`), so that whoever gave it can go on serving the links, and a stop never
    waits behind an answer that does not come.
    """

    def __init__(self) -> None:
        self._waiting: deque[Order] = deque()
        self._current: Iterator[None] | None = None

    @property
    def open(self) -> bool:
        """One is under way, or waits."""
        return self._current is not None or bool(self._waiting)

    def give(self, order: Order) -> None:
        """Have something done when all before it is.

        Args:
            order: Begins it.
        """
        self._waiting.append(order)

    def instead(self, order: Order) -> None:
        """Have something done at once, and nothing of what was asked for before.

        Args:
            order: Begins it.
        """
        self._waiting.clear()
        self._current = None
        self._waiting.append(order)

    def step(self) -> list[HilError]:
        """Go on; called after every step of the links, and when an order was given.

        Returns:
            Why orders were not done.
        """
        refused: list[HilError] = []
        while self.open:
            if self._current is None:
                self._current = self._waiting.popleft()()
            try:
                next(self._current)
            except StopIteration:
                self._current = None
            except (PeerError, RefusedError) as error:
                self._current = None
                refused.append(error)
            else:
                break
        return refused
