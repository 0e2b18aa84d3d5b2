"""What sees everything that passes a bridge."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.events import Event, Received, Rejected
    from firmware_protocol.wire import Message


class Tap(Protocol):
    """Sees everything that passes the bridge, and changes nothing: the recorder is one.

    Of wire bytes that carry a signing key all behind the frame's header is zero.
    """

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]]) -> None:
        """The bridge has begun a step: its one reading of the clock, and the chunks it has received."""
        ...

    def wire_rx(self, time: float, data: bytes) -> None:
        """Bytes came; time is their stamp. Where a key may be in them, this waits until it is known."""
        ...

    def wire_tx(self, time: float, data: bytes) -> None:
        """Bytes were handed to the link."""
        ...

    def received(self, event: Received | Rejected) -> None:
        """A message was decoded, or input rejected."""
        ...

    def sent(self, time: float, message: Message) -> None:
        """A message of ours was sent."""
        ...

    def event(self, event: Event) -> None:
        """A robot was found, lost, or is back."""
        ...
