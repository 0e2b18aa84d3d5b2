"""How much a log may unpack to: a small file that holds much is damaged or made up, and must cost little."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

MIB: Final = 1 << 20
LARGEST_CHUNK: Final = 16 * MIB
"""What a chunk may unpack to, in bytes: ours hold 256 KiB, those of other programs 1 to 4 MiB."""
LARGEST_METADATA: Final = MIB
LARGEST_ATTACHMENTS: Final = 64 * MIB
"""All attachments together, in bytes: they are kept in memory. Ours have less than 1 MiB."""
LARGEST_CHANNEL: Final = 4096
MOST_CHANNELS: Final = 500
LARGEST_SCHEMAS: Final = 2 * MIB
"""All schemas together, in bytes: ours have 70 kB."""


@dataclass(frozen=True)
class ReadLimits:
    """What a log may cost.

    Attributes:
        chunk: What a chunk, or a record outside chunks, may unpack to, in bytes.
        lifted: The user says that this log is in order: there is no limit on the whole.
    """

    chunk: int = LARGEST_CHUNK
    lifted: bool = False

    @property
    def entry(self) -> int:
        """What an entry may have, in bytes: decoded it takes several times as much. Ours have less than 1 MiB."""
        return self.chunk if self.lifted else self.chunk // 4

    def unpacked(self, size: int) -> float:
        """Bytes that all chunks may unpack to: 16 MiB, and 50 times the file. Our logs unpack to 3 times the file.

        Args:
            size: Of the file, in bytes.
        """
        return float("inf") if self.lifted else LARGEST_CHUNK + 50.0 * size

    def records(self, size: int) -> float:
        """Records that all chunks may hold: 50,000, and one for every 2 bytes. Ours have one for every 20 bytes, or more bytes.

        Args:
            size: Of the file, in bytes.
        """
        return float("inf") if self.lifted else 50_000 + size / 2


def lifted(mib: int | None) -> ReadLimits:
    """The limits for a log that the user vouches for.

    Args:
        mib: What its chunks may unpack to, in MiB; None: nothing was said, and the usual limits hold.
    """
    return ReadLimits() if mib is None else ReadLimits(mib * MIB, lifted=True)


def remedy(needed: int = 0) -> str:
    """What to do about a limit.

    Args:
        needed: What a chunk would unpack to, in bytes.
    """
    return f"if the log is in order: --max-chunk {max(16, -(-needed // MIB))}"
