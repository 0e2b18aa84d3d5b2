"""The memory image of an emulated robot: what its EEPROM holds, kept in a file between runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import HilError
from hil.doors import Door

if TYPE_CHECKING:
    from pathlib import Path


class MemoryFileError(HilError):
    """A memory image can't be read, or is none of these robots."""


DOOR: Final = Door("memory image", MemoryFileError, largest=1 << 20)


def load_memory(path: Path, count: int = 1) -> bytes | None:
    """Read the memory image of one robot or of several.

    What it holds is the robot's to judge: it checks every record it keeps.

    Args:
        path: The file.
        count: Robots whose memory it holds, one after the other.

    Returns:
        The image; None where there is no such file, as at the first run.

    Raises:
        MemoryFileError: It can't be read, or has another size.
    """
    from simdevice.boards import NVM_SIZE  # noqa: PLC0415 - the firmware is loaded with it

    try:
        if not path.exists():
            return None
    except (OSError, ValueError):  # the door says what is wrong
        pass
    image = DOOR.read(path)
    if len(image) != count * NVM_SIZE:
        robots = "a robot" if count == 1 else f"{count} robots"
        raise MemoryFileError(f"{path} is no memory image of {robots}: expected {count * NVM_SIZE} bytes, not {len(image)}")
    return image
