"""A classical CAN frame of our own, checked, and its serial form: what CAN links carry and logs hold.

The serial form of a frame is the 16 bytes of Linux's `struct can_frame`, little-endian: identifier (32 bits, of which bit
31 says that it is a 29-bit one), length, three bytes of zero, eight bytes of data, zero beyond the length.

Source: the Linux kernel's documentation, "SocketCAN" (https://docs.kernel.org/networking/can.html).
"""

from __future__ import annotations

from dataclasses import dataclass
from struct import Struct
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable

RECORD_LENGTH: Final = 16
"""Bytes of a frame's serial form."""
EXTENDED_FLAG: Final = 1 << 31
MAX_DATA: Final = 8
"""Most data bytes of a classical frame."""
RECORD: Final = Struct("<IB3s8s")
_PADDING: Final = bytes(3)
_TAILS: Final = tuple(bytes(MAX_DATA - length) for length in range(MAX_DATA + 1))


@dataclass(frozen=True, slots=True)
class CanFrame:
    """A data frame of classical CAN (2.0A or 2.0B).

    Attributes:
        identifier: 11 bits, or 29 where `extended`.
        data: 0 to 8 bytes.
        extended: The identifier has 29 bits.

    Raises:
        ValueError: No such frame can exist.
    """

    identifier: int
    data: bytes = b""
    extended: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.identifier < (1 << 29 if self.extended else 1 << 11):
            bits = 29 if self.extended else 11
            raise ValueError(f"a CAN identifier has {bits} bits: {self.identifier:#x} is none")
        if len(self.data) > MAX_DATA:
            raise ValueError(f"a classical CAN frame holds at most {MAX_DATA} bytes, not {len(self.data)}")

    @property
    def length(self) -> int:
        """Number of data bytes."""
        return len(self.data)

    def pack(self) -> bytes:
        """The serial form, 16 bytes."""
        identifier = self.identifier | EXTENDED_FLAG if self.extended else self.identifier
        return RECORD.pack(identifier, len(self.data), _PADDING, self.data)

    @classmethod
    def unpack(cls, record: bytes) -> CanFrame:
        """A frame from its serial form.

        Args:
            record: 16 bytes.

        Raises:
            ValueError: They are no serial form of a frame that can exist.
        """
        if len(record) != RECORD_LENGTH:
            raise ValueError(f"a CAN frame is recorded in {RECORD_LENGTH} bytes, not {len(record)}")
        identifier, length, padding, data = RECORD.unpack(record)
        if length > MAX_DATA or padding != _PADDING or data[length:] != _TAILS[length]:
            raise ValueError("length and padding are those of no classical CAN frame")
        extended = bool(identifier & EXTENDED_FLAG)
        return cls(identifier & ~EXTENDED_FLAG, data[:length], extended)

    def __str__(self) -> str:
        """As candump's log writes it: `186#0102AABB`."""
        return f"{self.identifier:0{8 if self.extended else 3}X}#{self.data.hex().upper()}"


def pack_frames(frames: Iterable[CanFrame]) -> bytes:
    """Serial form of several frames.

    Args:
        frames: The frames.

    Returns:
        16 bytes for each, one after the other.
    """
    return b"".join([frame.pack() for frame in frames])


def split_records(data: bytes) -> list[bytes]:
    """Cut serial forms into frames.

    Args:
        data: Serial forms, one after the other.

    Returns:
        Pieces of 16 bytes; the last one is shorter where something has been cut off.
    """
    return [data[at : at + RECORD_LENGTH] for at in range(0, len(data), RECORD_LENGTH)]
