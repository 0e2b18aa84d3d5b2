"""How far tasks are that processes of our own are at: some numbers of each, in memory that they share, for whoever looks on.

Nothing waits for anybody, and a process that dies leaves its numbers as they were: they decide nothing.
"""

from __future__ import annotations

import multiprocessing
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

PLACES: Final = 256
"""Tasks that can be told of; others are not."""
NUMBERS: Final = 2
"""Numbers that are told of each."""


class ProgressBoard:
    """Takes down what is told of tasks, by any of the processes that have it."""

    def __init__(self) -> None:
        self._numbers: Any = multiprocessing.get_context("spawn").RawArray("d", PLACES * NUMBERS)

    def tell(self, place: int, *numbers: float) -> None:
        """Tell of a task.

        Args:
            place: Its place.
            *numbers: What is told: how far it is, 0..1, and something else.
        """
        if 0 <= place < PLACES:
            for index, number in enumerate(numbers[:NUMBERS]):
                self._numbers[place * NUMBERS + index] = number

    def read(self, place: int) -> Sequence[float]:
        """What was told last of a task; zeros where nothing was.

        Args:
            place: Its place.
        """
        if not 0 <= place < PLACES:
            return (0.0,) * NUMBERS
        return tuple(self._numbers[place * NUMBERS : (place + 1) * NUMBERS])
