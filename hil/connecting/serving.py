"""Whoever serves links, one step at a time, and waits by doing so."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.events import Event

WAIT: Final = 0.05
"""Longest wait of one step, in s."""


class Serving(ABC):
    """Serves links: one robot's, or those of several.

    Attributes:
        between: Called after every step, when nothing is under way.
        telling: A step is being told of.
    """

    between: Callable[[], None] | None = None
    telling: bool = False

    @abstractmethod
    def now(self) -> float:
        """Time of the last step, in s."""

    @abstractmethod
    def step(self, wait: float = WAIT) -> list[Event]:
        """Serve the links once.

        Args:
            wait: Longest wait for something to come, in s.

        Returns:
            What happened.

        Raises:
            LinkError: The last link is gone.
        """

    def deadline(self, duration: float) -> float:
        """When a time that begins now is over, in s; a step of no length sees what time it is.

        Args:
            duration: How long, in s.

        Raises:
            LinkError: The last link is gone.
        """
        self.step(0.0)
        return self.now() + duration

    def wait(self, duration: float) -> None:
        """Let time pass, and serve the links meanwhile.

        Args:
            duration: How long, in s.
        """
        deadline = self.deadline(duration)
        while (left := deadline - self.now()) > 1e-9:
            self.step(min(WAIT, left))
