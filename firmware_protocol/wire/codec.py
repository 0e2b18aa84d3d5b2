"""What a codec does, whichever wire it speaks, and which one a wire has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import split_records
from firmware_protocol.wire.fields import CAN, MAVLINK
from firmware_protocol.wire.mavlink import MavlinkCodec, SignedMavlinkCodec, split_frames

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.events import Received, Rejected, RejectReason
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.signing import Signing


class Codec(Protocol):
    """Bytes to events, messages to bytes; does no I/O.

    Attributes:
        system: Own system id.
        component: Own component id.
        good: Good messages received.
        signed: Of these, those with a signature.
        rejected: Rejections by reason.
    """

    system: int
    component: int
    good: int
    signed: int
    rejected: dict[RejectReason, int]

    def encode(self, message: Message) -> bytes:
        """What goes over the link for a message; EncodeError where the wire can't carry it."""
        ...

    def receive(self, data: bytes, now: float) -> list[Received | Rejected]:
        """Take a chunk from the link; `now` is its stamp in s. Never raises on what has come."""
        ...

    def reset(self) -> None:
        """Begin anew on a link that was opened again: nothing half received, frames counted from 0. Counters go on."""
        ...

    def flush(self, now: float, *, ended: bool = False) -> list[Received | Rejected]:
        """Give up what has been incomplete for too long, or, where nothing will come any more, everything; `now` in s."""
        ...


def open_codec(wire: str, *, system: int, component: int, signing: Signing | None = None) -> Codec:
    """The codec of a wire.

    Args:
        wire: `mavlink` or `can`, as a link says.
        system: Own system id.
        component: Own component id.
        signing: Makes and checks signatures; None: nothing is signed, and nothing is asked for.

    Raises:
        ValueError: There is no such wire, or nothing can be signed on it.
    """
    if wire not in SPLITTERS:
        raise ValueError(f"there is no wire {wire!r}: there are {', '.join(SPLITTERS)}")
    if signing is not None:
        if wire != MAVLINK:
            raise ValueError(f"nothing is signed on the wire {wire!r}")
        return SignedMavlinkCodec(system=system, component=component, signing=signing)
    return (CanCodec if wire == CAN else MavlinkCodec)(system=system, component=component)


SPLITTERS: Final[dict[str, Callable[[bytes], list[bytes]]]] = {MAVLINK: split_frames, CAN: split_records}
"""How a chunk of whole frames is cut into frames, by wire."""
