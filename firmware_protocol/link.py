"""The contract every byte link keeps; `links/opening.py` opens one by its address."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Self

from firmware_protocol.wire.fields import MAVLINK

if TYPE_CHECKING:
    from types import TracebackType


class Link(ABC):
    """Carries bytes to and from a robot; knows nothing of messages.

    A link may be read by one thread and written by another. Third-party errors never pass: they become
    `LinkOpenError`, `LinkClosedError` or `LinkTimeoutError`.

    Attributes:
        url: Address it was opened with.
        lockstep: True when time passes only inside `read` (an in-process link): such a link must be read
            by the thread that uses it, never by a pump thread.
        wire: What the bytes are: `MAVLINK`, or `CAN`, where every read and write is of whole CAN frames.
    """

    url: str
    lockstep: bool = False
    wire: str = MAVLINK

    def news(self) -> list[str]:
        """What has happened to the link since the last call, in words: a bus in trouble, or well again."""
        return []

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Hand over bytes for sending. One call carries whole frames.

        Raises:
            LinkClosedError: The link is gone.
            LinkTimeoutError: The other end does not take the bytes; a part of them may be on its way.
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
        """Give the link back. Repeating it does nothing; later calls of `read` and `write` raise LinkClosedError.

        Another thread must not be inside `read` or `write` meanwhile.
        """

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()
