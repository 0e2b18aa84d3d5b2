"""What sees everything that passes a bridge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.errors import LinkError
    from firmware_protocol.events import Event, Received, Rejected
    from firmware_protocol.wire.batch import Arrivals
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.rows import Rows
    from hil.bridge.operator import OperatorInput


@dataclass(frozen=True)
class Opening:
    """How a bridge begins.

    Attributes:
        network: Name of the network: the address of its link as it was asked for.
        link: Address of the link, as it calls itself.
        wire: What it carries: `mavlink` or `can`.
        lockstep: Time passes only while the host waits.
        clock: The first reading of the clock, in s.
        signing_time: The calendar at that moment as signatures carry it, in 10 us since 2015-01-01 GMT; 0 where nothing is
            signed.
    """

    network: str
    link: str
    wire: str
    lockstep: bool
    clock: float
    signing_time: int = 0


@dataclass(frozen=True)
class Circumstances:
    """What a step has met besides bytes, and acts on.

    Attributes:
        inputs: What the operator asked for since the step before.
        lost: The link is gone, and going to be opened again: why; None where it is not.
        ended: The link is gone for good: why; None where it is not.
        back: The link is there again, under this address; empty where it is not.
        news: What has happened to the link, in its own words.
        dropped: Bytes that came and were given up since the step before, since too many waited.
    """

    inputs: tuple[OperatorInput, ...] = ()
    lost: LinkError | None = None
    ended: LinkError | None = None
    back: str = ""
    news: tuple[str, ...] = ()
    dropped: int = 0


NOTHING: Final = Circumstances()
"""What most steps meet."""


class Tap(Protocol):
    """Sees everything that passes the bridge, and changes nothing: the recorder is one.

    Of wire bytes that carry a signing key all behind the frame's header is zero.
    """

    def of_network(self, name: str) -> Tap:
        """What sees this network alone, where there are several."""
        ...

    def opened(self, opening: Opening) -> None:
        """The bridge begins."""
        ...

    def session_drawn(self, number: int) -> None:
        """A number was drawn: the first is the host's own, the others are of sessions."""
        ...

    def step(self, time: float, chunks: Sequence[tuple[float, bytes]], met: Circumstances) -> None:
        """The bridge has begun a step: its one reading of the clock, the chunks it has received, and what else it met."""
        ...

    def wire_rx(self, time: float, data: bytes) -> None:
        """Bytes came; time is their stamp. Where a key may be in them, this waits until it is known."""
        ...

    def wire_tx(self, time: float, data: bytes) -> None:
        """Bytes were handed to the link."""
        ...

    def unsent(self, time: float, data: bytes, error: LinkError) -> None:
        """The link did not take these bytes: for the moment (LinkTimeoutError), or since it is gone."""
        ...

    def received(self, event: Received | Rejected) -> None:
        """A message was decoded, or input rejected."""
        ...

    def arrived(self, came: Arrivals) -> None:
        """Messages were decoded and input rejected, many at once: as `received` for each, in the order of their places."""
        ...

    def sent(self, time: float, message: Message) -> None:
        """A message of ours was sent."""
        ...

    def sent_rows(self, time: float, message: type[Message], rows: Rows) -> None:
        """Many messages of ours, all of a kind, were sent: as `sent` for each."""
        ...

    def event(self, event: Event) -> None:
        """A robot was found, lost, or is back."""
        ...
