"""The contract every byte link keeps, and the door through which links are opened."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self


class Link(ABC):
    """Carries bytes to and from a robot; knows nothing of messages.

    A link may be read by one thread and written by another. Third-party errors never pass: they become
    `LinkOpenError`, `LinkClosedError` or `LinkTimeoutError`.

    Attributes:
        url: Address it was opened with.
        lockstep: True when time passes only inside `read` (an in-process link): such a link must be read
            by the thread that uses it, never by a pump thread.
    """

    url: str
    lockstep: bool = False

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Hand over bytes for sending, all or nothing. One call carries whole frames.

        Raises:
            LinkClosedError: The link is gone.
            LinkTimeoutError: The other end does not take the bytes.
        """

    @abstractmethod
    def read(self, timeout: float) -> bytes:
        """Wait for bytes.

        Args:
            timeout: Longest wait in s; 0 returns at once with what is there.

        Returns:
            What has arrived, as soon as anything has; empty after the time-out.

        Raises:
            LinkClosedError: The link is gone (bytes that arrived before are returned first).
        """

    @abstractmethod
    def close(self) -> None:
        """Give the link back. Repeating it does nothing; later calls of `read` and `write` raise LinkClosedError."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()
