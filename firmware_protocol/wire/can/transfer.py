"""Messages cut into CAN frames and put together again: one transfer at a time; which is which is the codec's business."""

from __future__ import annotations

from dataclasses import dataclass, field
from struct import Struct
from typing import TYPE_CHECKING, Final

from fastcrc.crc16 import mcrf4xx

from firmware_protocol.events import RejectReason
from firmware_protocol.messages import BYTE_LINKS_ONLY, MESSAGES
from firmware_protocol.wire.can import layout
from firmware_protocol.wire.can.frame import CanFrame
from firmware_protocol.wire.fields import Direction
from firmware_protocol.wire.mavlink_layout import crc_extra
from firmware_protocol.wire.payload import PAYLOADS

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

_HEAD: Final = Struct("<HB")
_CRC: Final = Struct("<H")


class Long:
    """One kind of message as a transfer.

    Attributes:
        message: The message class.
        direction: Which way it goes.
        payload: Its MAVLink payload.
        start: Where the target fields are in that.
        cut: How many bytes they take; CAN does not carry them.
        length: Bytes of its payload on CAN.
    """

    __slots__ = ("_extra", "cut", "direction", "length", "message", "payload", "start")

    def __init__(self, message: type[Message]) -> None:
        self.message = message
        self.direction = message.DIRECTION
        self.payload = PAYLOADS[message.ID]
        self.start, self.cut = layout.target_cut(message)
        self.length = self.payload.length - self.cut
        self._extra = bytes((crc_extra(message),))

    def cut_up(self, full: bytes, identifier: int, number: int) -> list[CanFrame]:
        """The frames of a transfer.

        Args:
            full: MAVLink's untrimmed payload.
            identifier: Of the frames.
            number: Of the transfer, 0 to 7.
        """
        data = _HEAD.pack(self.message.ID, self.length) + full[: self.start] + full[self.start + self.cut :]
        data += _CRC.pack(mcrf4xx(data + self._extra))
        head = number << layout.PART_BITS
        size = layout.PART_DATA
        return [
            CanFrame(identifier, bytes((head | part,)) + data[part * size : part * size + size])
            for part in range(-(-len(data) // size))
        ]

    def restore(self, data: bytes, targets: bytes) -> bytes | None:
        """The payload of a transfer that is complete.

        Args:
            data: Head, payload and CRC.
            targets: What the target fields are to hold.

        Returns:
            MAVLink's untrimmed payload; None where the CRC is wrong.
        """
        body = data[: -layout.TRANSFER_TAIL]
        if mcrf4xx(body + self._extra) != data[-2] | data[-1] << 8:
            return None
        full = body[layout.TRANSFER_HEAD :].ljust(self.length, b"\0")
        return full[: self.start] + targets[: self.cut] + full[self.start :] if self.cut else full


LONG: Final = {number: Long(message) for number, message in MESSAGES.items() if message not in BYTE_LINKS_ONLY}
"""Every message as a transfer, by message number."""


@dataclass(slots=True)
class Partial:
    """A transfer of which parts have come.

    Attributes:
        transfer: Its number.
        size: Bytes of all parts without their byte 0.
        heard: When the last part came, in s.
        known: What it carries; None for an unknown message.
        refused: Why it will be refused, whatever follows; it is collected all the same, so as to be refused in one piece.
        data: What has come, without the parts' byte 0.
        raw: The frames that have come, in serial form.
    """

    transfer: int
    size: int
    heard: float
    known: Long | None
    refused: tuple[RejectReason, str] | None
    data: bytes = b""
    raw: list[bytes] = field(default_factory=list)

    @classmethod
    def begin(cls, identifier: int, data: bytes, now: float) -> Partial | None:
        """Look at a first part.

        Args:
            identifier: Of the frame.
            data: Of the frame; byte 0 says that this is part 0.
            now: Time in s.

        Returns:
            A transfer of which no part has been taken yet; None where the frame can't be a first part.
        """
        if len(data) <= layout.TRANSFER_HEAD:
            return None
        number, length = _HEAD.unpack_from(data, 1)
        size = layout.TRANSFER_HEAD + length + layout.TRANSFER_TAIL
        if length > layout.MAX_TRANSFER or len(data) != 1 + min(layout.PART_DATA, size):
            return None
        known = LONG.get(number)
        refused: tuple[RejectReason, str] | None = None
        upward = identifier >> layout.FUNCTION_SHIFT & 1
        if known is None:
            refused = (RejectReason.UNKNOWN_MESSAGE, f"message id {number}")
        elif length > known.length:
            refused = (RejectReason.BAD_HEADER, f"{known.message.NAME} with length {length}")
        elif known.direction is (Direction.DOWN if upward else Direction.UP):
            refused = (RejectReason.BAD_HEADER, f"{known.message.NAME} under an identifier of the other direction")
        return cls(data[0] >> layout.PART_BITS, size, now, known, refused)

    @property
    def complete(self) -> bool:
        """All parts have come."""
        return len(self.data) == self.size

    def fits(self, data: bytes) -> bool:
        """Whether a frame holds the next part."""
        done = len(self.data)
        head = self.transfer << layout.PART_BITS | done // layout.PART_DATA
        return data[0] == head and len(data) == 1 + min(layout.PART_DATA, self.size - done)

    def take(self, data: bytes, raw: bytes, now: float) -> None:
        """Add the next part."""
        self.heard = now
        self.data += data[1:]
        self.raw.append(raw)
