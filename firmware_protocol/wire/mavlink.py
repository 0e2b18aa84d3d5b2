"""MAVLink 2 without I/O: bytes in, typed events out; messages in, frames out.

Nothing that comes from the wire raises. What is not accepted becomes a `Rejected` event that holds the bytes, so that the
`raw` of all events, one after the other, is exactly what came in.

Resynchronisation. A header is refused as soon as its ten bytes are there if the id is unknown, the length is one that
this message cannot have, or a flag is unknown. Of a refused frame only the start marker is given up; what follows is
scanned again for the next marker. Hence damage confined to one frame - bytes changed, lost or added - costs that frame
and no other: every good frame around it is delivered, in order. A damaged header that still looks possible can hold
back what follows until as many bytes have come as it claims (never more than `HOLD_BACK`) or until 20 ms of silence.
A 16-bit checksum lets one in 65,536 randomly damaged frames through; range checks stand behind it.

MAVLink 1 frames (marker 0xFE) are noise here. `MavlinkCodec` takes signed frames as what they would be without the
signature, which is neither checked nor required; `signed` counts them. `SignedMavlinkCodec` signs what it sends and believes
what is signed: see `signing`. Of a frame with a wrong signature only the start marker is given up, as of a damaged one.

Source: the MAVLink guide, "Packet Serialization" (https://mavlink.io/en/guide/serialization.html).
"""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING, Final

from fastcrc.crc16 import mcrf4xx

from firmware_protocol.errors import EncodeError
from firmware_protocol.events import Received, Rejected, RejectReason
from firmware_protocol.messages import MESSAGES
from firmware_protocol.wire.mavlink_layout import (
    CHECKSUM_LENGTH,
    FLAG_SIGNED,
    HEADER_LENGTH,
    MARKER,
    SIGNATURE_LENGTH,
    crc_extra,
)
from firmware_protocol.wire.payload import PAYLOADS, BadValueError

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message
    from firmware_protocol.wire.signing import Signing

SILENCE: Final = 0.020
"""A partial frame is given up after this much silence, in s."""

HOLD_BACK: Final = HEADER_LENGTH + max(p.length for p in PAYLOADS.values()) + CHECKSUM_LENGTH + SIGNATURE_LENGTH
"""Most bytes that a damaged header can make the codec wait for."""

_NOISE_LIMIT: Final = 256
"""Noise is reported in pieces of about this many bytes at most, so that nothing grows without end."""

_START: Final = bytes((MARKER,))
_SIGNED: Final = bytes((FLAG_SIGNED,))
_AT_FLAGS: Final = 2
_HEADER: Final = Struct("<BBBBBBBHB")
_CHECKSUM: Final = Struct("<H")
_EXTRA: Final = {number: bytes((crc_extra(message),)) for number, message in MESSAGES.items()}
_AROUND: Final = HEADER_LENGTH + CHECKSUM_LENGTH
"""Bytes of a frame without a signature that are not payload."""
_DOWN: Final = {number: (payload, payload.length, _EXTRA[number]) for number, payload in PAYLOADS.items()}
_UP: Final = {
    message: (number & 0xFFFF, number >> 16, PAYLOADS[number], _EXTRA[number]) for number, message in MESSAGES.items()
}


class MavlinkCodec:
    """One end of one MAVLink 2 connection.

    Args:
        system: Own system id, 1 to 255.
        component: Own component id.

    Attributes:
        good: Good messages received.
        signed: Of these, those with a signature.
        rejected: Rejections by reason.
    """

    def __init__(self, *, system: int, component: int) -> None:
        self.system = system
        self.component = component
        self.good = 0
        self.signed = 0
        self.rejected: dict[RejectReason, int] = dict.fromkeys(RejectReason, 0)
        self.reset()

    def reset(self) -> None:
        """Begin anew on a link that was opened again: nothing half received, frames counted from 0. Counters go on."""
        self.sequence = 0
        self._buffer = b""
        self._stamp = float("-inf")
        self._junk = b""
        self._junk_reason = RejectReason.NOISE
        self._junk_detail = ""
        self._junk_left = 0

    @property
    def pending(self) -> bytes:
        """What has come and is not judged yet."""
        return self._junk + self._buffer

    def encode(self, message: Message) -> bytes:
        """One frame; the frame sequence number goes up by one.

        Args:
            message: What to say.

        Returns:
            A whole MAVLink 2 frame, zeros at the payload's end trimmed.

        Raises:
            EncodeError: The wire can't carry it; names message, field, value and range. Nothing has changed then.
        """
        entry = _UP.get(type(message))
        if entry is None:
            raise EncodeError(f"{type(message).__name__} is not a message of this protocol")
        low, high, payload, extra = entry
        full = payload.pack(message)
        body = full.rstrip(b"\0") or full[:1]
        sequence = self.sequence
        frame = _HEADER.pack(MARKER, len(body), 0, 0, sequence, self.system, self.component, low, high) + body
        self.sequence = (sequence + 1) & 0xFF
        return frame + _CHECKSUM.pack(mcrf4xx(frame[1:] + extra))

    def receive(self, data: bytes, now: float) -> list[Received | Rejected]:
        """Take a chunk from the wire.

        Args:
            data: Bytes as they came; may be empty.
            now: Stamp of the chunk in s, not before that of the last one.

        Returns:
            What it completed, in the order of the bytes.
        """
        events = self.flush(now) if now - self._stamp > SILENCE and (self._buffer or self._junk) else []
        if data:
            self._stamp = now
            self._take_in(self._buffer + data if self._buffer else bytes(data), events)
        return events

    def _take_in(self, data: bytes, events: list[Received | Rejected]) -> None:
        """Find frames in what has come, and what was held back before it."""
        plain = self._take_plain(data, events)
        if plain < len(data):
            self._scan(data, plain, events, final=False)
        else:
            self._buffer = b""

    def flush(self, now: float, *, ended: bool = False) -> list[Received | Rejected]:
        """Give up a partial frame if nothing has come for 20 ms. `receive` does it by itself; call this when nothing comes.

        Args:
            now: Time in s.
            ended: Nothing will come any more: give it up at once.

        Returns:
            Usually nothing; else the rejection, and frames found in what had been held back.
        """
        events: list[Received | Rejected] = []
        if (self._buffer or self._junk) and (ended or now - self._stamp > SILENCE):
            self._scan(self._buffer, 0, events, final=True)
            self._report(events)
        return events

    def _scan(self, data: bytes, at: int, events: list[Received | Rejected], *, final: bool) -> None:
        """Find frames from `at` on; leaves in the buffer what may yet become one, unless `final`."""
        end = len(data)
        while at < end:
            taken = self._step(data, at, events, final=final)
            if not taken:
                break
            at += taken
        self._buffer = data[at:]

    def _take_plain(self, data: bytes, events: list[Received | Rejected]) -> int:
        """Take the frames that are there whole, good and unsigned, up to the first that is not: `_take` judges what that is.

        Returns:
            Bytes used up.
        """
        at, end, stamp = 0, len(data), self._stamp
        if self._junk:
            return at
        while end - at > _AROUND:
            marker, length, flags, _, sequence, system, component, low, high = _HEADER.unpack_from(data, at)
            entry = _DOWN.get(high << 16 | low)
            if entry is None or marker != MARKER or flags:
                break
            payload, longest, extra = entry
            tail = at + HEADER_LENGTH + length
            after = tail + CHECKSUM_LENGTH
            if not 0 < length <= longest or after > end:
                break
            if mcrf4xx(data[at + 1 : tail] + extra) != data[tail] | data[tail + 1] << 8:
                break
            try:
                message = payload.unpack(data[at + HEADER_LENGTH : tail])
            except BadValueError:
                break
            events.append(Received(message, system, component, sequence, stamp, data[at:after]))
            self.good += 1
            at = after
        return at

    def _step(self, data: bytes, at: int, events: list[Received | Rejected], *, final: bool) -> int:
        """Judge what begins at `at`, or skip to the next marker.

        Returns:
            Bytes used up; 0 to wait for more.
        """
        if data[at] == MARKER:
            return self._take(data, at, events, final=final)
        marker = data.find(_START, at)
        end = len(data) if marker < 0 else marker
        self._skip(data[at:end], events)
        return end - at

    def _take(self, data: bytes, at: int, events: list[Received | Rejected], *, final: bool) -> int:
        """Judge what begins with the marker at `at`.

        Returns:
            Bytes used up: the frame, or the marker alone; 0 to wait for more.
        """
        left = len(data) - at
        if left < HEADER_LENGTH:
            return self._refuse(RejectReason.INCOMPLETE, left, "", events) if final else 0
        length: int
        _, length, flags, _, sequence, system, component, low, high = _HEADER.unpack_from(data, at)
        size = HEADER_LENGTH + CHECKSUM_LENGTH + length + (SIGNATURE_LENGTH if flags & FLAG_SIGNED else 0)
        entry = _DOWN.get(high << 16 | low)
        if entry is None:
            return self._refuse_header(RejectReason.UNKNOWN_MESSAGE, size, f"message id {high << 16 | low}", events)
        payload, longest, extra = entry
        if not 0 < length <= longest or flags & ~FLAG_SIGNED:
            detail = f"{payload.message.NAME} with length {length}, flags {flags:#04x}"
            return self._refuse_header(RejectReason.BAD_HEADER, size, detail, events)
        if left < size:
            return self._refuse(RejectReason.INCOMPLETE, size, payload.message.NAME, events) if final else 0
        tail = at + HEADER_LENGTH + length
        if mcrf4xx(data[at + 1 : tail] + extra) != data[tail] | data[tail + 1] << 8:
            return self._refuse(RejectReason.BAD_CHECKSUM, size, payload.message.NAME, events)
        if self._junk:
            self._report(events)
        raw = data[at : at + size]
        try:
            message = payload.unpack(data[at + HEADER_LENGTH : tail])
        except BadValueError as cause:
            self.rejected[RejectReason.BAD_VALUE] += 1
            events.append(Rejected(RejectReason.BAD_VALUE, raw, self._stamp, str(cause), system))
        else:
            self.good += 1
            if flags:
                self.signed += 1
            events.append(Received(message, system, component, sequence, self._stamp, raw))
        return size

    def _refuse(self, reason: RejectReason, size: int, detail: str, events: list[Received | Rejected]) -> int:
        """Begin a rejection that claims `size` bytes, of which the marker is given up at once.

        Returns:
            1, the bytes used up.
        """
        self._report(events)
        self._junk = _START
        self._junk_reason = reason
        self._junk_detail = detail
        self._junk_left = size - 1
        return 1

    def _refuse_header(self, reason: RejectReason, size: int, detail: str, events: list[Received | Rejected]) -> int:
        """Give up a marker whose header is impossible; within a refused frame it was a byte of that frame and no news.

        Returns:
            1, the bytes used up.
        """
        if self._junk_left <= 0:
            return self._refuse(reason, size, detail, events)
        self._skip(_START, events)
        return 1

    def _skip(self, data: bytes, events: list[Received | Rejected]) -> None:
        """Give up bytes: as part of the rejection under way as far as it claims them, else as noise."""
        if self._junk_left > 0:
            claimed = data[: self._junk_left]
            self._junk += claimed
            self._junk_left -= len(claimed)
            data = data[len(claimed) :]
            if self._junk_left == 0:
                self._report(events)
        if data:
            self._junk += data
            if len(self._junk) >= _NOISE_LIMIT:
                self._report(events)

    def _report(self, events: list[Received | Rejected]) -> None:
        """Hand out the rejection under way."""
        if self._junk:
            self.rejected[self._junk_reason] += 1
            events.append(Rejected(self._junk_reason, self._junk, self._stamp, self._junk_detail))
        self._junk = b""
        self._junk_reason = RejectReason.NOISE
        self._junk_detail = ""
        self._junk_left = 0


def frame_size(data: bytes, at: int) -> int | None:
    """Length of the frame that begins here, in bytes, as its header says; None where too little of that has come.

    Args:
        data: Bytes of frames.
        at: Where the frame begins.
    """
    if len(data) < at + 3:
        return None
    return HEADER_LENGTH + data[at + 1] + CHECKSUM_LENGTH + (SIGNATURE_LENGTH if data[at + 2] & FLAG_SIGNED else 0)


class SignedMavlinkCodec(MavlinkCodec):
    """One end of a MAVLink 2 connection on which every frame is signed, and no other is believed.

    Args:
        system: Own system id, 1 to 255.
        component: Own component id.
        signing: Makes and checks the signatures.
    """

    def __init__(self, *, system: int, component: int, signing: Signing) -> None:
        super().__init__(system=system, component=component)
        self._signing = signing

    def encode(self, message: Message) -> bytes:
        """One signed frame; see `MavlinkCodec.encode`."""
        plain = super().encode(message)
        body = plain[1:_AT_FLAGS] + _SIGNED + plain[_AT_FLAGS + 1 : -CHECKSUM_LENGTH]
        frame = _START + body + _CHECKSUM.pack(mcrf4xx(body + _EXTRA[message.ID]))
        return frame + self._signing.sign(frame)

    def _take_plain(self, data: bytes, events: list[Received | Rejected]) -> int:  # noqa: ARG002 - none is believed at once
        """Take nothing: no frame is good without its signature."""
        return 0

    def _take(self, data: bytes, at: int, events: list[Received | Rejected], *, final: bool) -> int:
        """Judge what begins with the marker at `at`; of a good frame also who sent it, and when."""
        taken = super()._take(data, at, events, final=final)
        event = events[-1] if taken > 1 else None
        if isinstance(event, Received) and (reason := self._signing.check(event.raw)) is not None:
            self.good -= 1
            self.signed -= event.raw[_AT_FLAGS] & FLAG_SIGNED
            detail = f"{event.message.NAME} of system {event.system}, component {event.component}"
            if reason is RejectReason.BAD_SIGNATURE:  # bytes may be missing: it may end in the middle of the next frame
                events.pop()
                return self._refuse(reason, taken, detail, events)
            self.rejected[reason] += 1
            events[-1] = Rejected(reason, event.raw, event.time, detail)
        return taken


def split_frames(data: bytes) -> list[bytes]:
    """Cut a chunk of whole frames into frames.

    Args:
        data: Whole frames one after the other, as a codec encoded them.

    Returns:
        The frames; what does not begin like a frame, or is cut short, is the last piece.
    """
    pieces: list[bytes] = []
    at = 0
    while len(data) - at >= HEADER_LENGTH and data[at] == MARKER:
        size = frame_size(data, at)
        if size is None or at + size > len(data):
            break
        pieces.append(data[at : at + size])
        at += size
    if at < len(data):
        pieces.append(data[at:])
    return pieces
