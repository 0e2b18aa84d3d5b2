"""A tap that looks at nothing: what the tests' own taps extend."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.errors import LinkError
    from firmware_protocol.events import Event, Received, Rejected
    from firmware_protocol.wire.batch import Arrivals
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows
    from hil.bridge.taps import Circumstances, Opening


class QuietTap:
    """Looks at nothing; of several networks, one tap sees all."""

    def of_network(self, name: str) -> Self:
        del name
        return self

    def opened(self, opening: Opening) -> None:
        """Not looked at."""

    def session_drawn(self, number: int) -> None:
        """Not looked at."""

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        """Not looked at."""

    def wire_rx(self, time: float, data: bytes) -> None:
        """Not looked at."""

    def wire_tx(self, time: float, data: bytes) -> None:
        """Not looked at."""

    def unsent(self, time: float, data: bytes, error: LinkError) -> None:
        """Not looked at."""

    def received(self, event: Received | Rejected) -> None:
        """Not looked at."""

    def arrived(self, came: Arrivals) -> None:
        """Not looked at."""

    def sent_rows(self, time: float, message: type[Message], rows: Rows) -> None:
        """Not looked at."""

    def sent(self, time: float, message: Message) -> None:
        """Not looked at."""

    def event(self, event: Event) -> None:
        """Not looked at."""
