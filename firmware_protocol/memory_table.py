"""The robot's maneuver memory as a table: its slots, and the checksum over all of them."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Self

from fastcrc.crc16 import mcrf4xx

from firmware_protocol.maneuver_fields import from_fields, to_fields
from firmware_protocol.vocabulary import MAX_ACTIONS, Maneuver, situation_name

if TYPE_CHECKING:
    from collections.abc import Iterable

    from firmware_protocol.messages import JuniorMemoryEntry

_STORED: Final = f"<BBB{MAX_ACTIONS}BHB"
"""Previous, current, options, actions, period in ms, count: little-endian, as in the robot's memory."""


@dataclass(frozen=True)
class MemorySlot:
    """What the robot does in one situation.

    Attributes:
        previous: Stimulus when the maneuver before began, or `ANY_STIMULUS`.
        current: Present stimulus.
        maneuver: What to do then.
    """

    previous: int
    current: int
    maneuver: Maneuver

    @classmethod
    def of(cls, entry: JuniorMemoryEntry) -> Self:
        """A slot as the robot told it.

        Args:
            entry: Its message.

        Raises:
            ValueError: The message holds no valid maneuver.
        """
        return cls(entry.previous, entry.current, from_fields(entry))

    @property
    def key(self) -> tuple[int, int]:
        """Previous and current stimulus: no two slots of a memory share them; the robot's own order."""
        return self.previous, self.current

    @property
    def situation(self) -> str:
        """Previous and current stimulus in words."""
        return situation_name(self.previous, self.current)


def memory_checksum(slots: Iterable[MemorySlot]) -> int:
    """What JUNIOR_MEMORY_ENTRY.checksum must be.

    Args:
        slots: All slots in use, by previous, then current stimulus.

    Returns:
        CRC-16/MCRF4XX over previous, current, options, actions, period and count of each.
    """
    stored = b""
    for slot in slots:
        fields = to_fields(slot.maneuver)
        period = round(fields["period"] * 1e3)
        stored += struct.pack(_STORED, *slot.key, fields["options"], *fields["actions"], period, fields["count"])
    return mcrf4xx(stored)
