"""Pictures in a log, made of what robots say while it is written."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from firmware_protocol.events import Received
    from firmware_protocol.wire.batch import Batch
    from firmware_protocol.wire.fields import Message


class Drawing(Protocol):
    """Draws what the messages of a role tell."""

    @property
    def kinds(self) -> frozenset[type[Message]]:
        """Messages that it draws of those that are heard; others need not be shown to it."""
        ...

    def received(self, event: Received) -> None:
        """A message was heard, and written.

        Args:
            event: The message.
        """
        ...

    def heard_rows(self, batch: Batch) -> None:
        """Messages of one kind were heard, and written, many at once.

        Args:
            batch: The messages.
        """
        ...

    def sent(self, message: Message) -> None:
        """A message of ours is said.

        Args:
            message: The message.
        """
        ...


class NoDrawing:
    """Draws nothing."""

    kinds: frozenset[type[Message]] = frozenset()

    def received(self, event: Received) -> None:
        """See `Drawing.received`."""

    def heard_rows(self, batch: Batch) -> None:
        """See `Drawing.heard_rows`."""

    def sent(self, message: Message) -> None:
        """See `Drawing.sent`."""


class Drawings:
    """Several drawings, each of what another role says.

    Args:
        *parts: The drawings.
    """

    def __init__(self, *parts: Drawing) -> None:
        self._parts = parts

    @property
    def kinds(self) -> frozenset[type[Message]]:
        """See `Drawing.kinds`."""
        return frozenset[type["Message"]]().union(*(part.kinds for part in self._parts))

    def received(self, event: Received) -> None:
        """See `Drawing.received`."""
        for part in self._parts:
            part.received(event)

    def heard_rows(self, batch: Batch) -> None:
        """See `Drawing.heard_rows`."""
        for part in self._parts:
            part.heard_rows(batch)

    def sent(self, message: Message) -> None:
        """See `Drawing.sent`."""
        for part in self._parts:
            part.sent(message)
