"""CRC-16/MCRF4XX of many frames at once.

The checksum is linear: that of a frame is the checksum of as many zeros, and for each byte a contribution that depends on the
byte and on how many follow it. So the frames of a batch, one in a row, are looked up in a table and added up (XOR). At 30 to
60 bytes that takes half as long as a call for each frame.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from fastcrc.crc16 import mcrf4xx

if TYPE_CHECKING:
    from numpy.typing import NDArray

LONGEST: Final = 270
"""Most bytes of a row, the seed included."""


def _tables() -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """What a byte contributes, in row `LONGEST` - 1 less the bytes that follow it; and checksums of zeros, by their number."""
    contributions = np.zeros((2 * LONGEST, 256), np.uint16)
    zeros = np.array([mcrf4xx(bytes(length)) for length in range(LONGEST + 1)], np.uint16)
    step = np.array([mcrf4xx(bytes((byte,))) for byte in range(256)], np.uint16) ^ zeros[1]
    contributions[LONGEST - 1] = step
    for row in range(LONGEST - 2, -1, -1):  # one more zero behind it
        after = contributions[row + 1]
        contributions[row] = after >> 8 ^ step[after & 0xFF]
    return contributions.reshape(-1), zeros


_CONTRIBUTIONS, _ZEROS = _tables()
_PLACES: Final = np.arange(LONGEST - 1, 2 * LONGEST - 1) * 256
"""Where what a byte contributes is looked up, by its number in the row, less 256 for each byte of the row's length."""


def checksums(rows: NDArray[np.uint8], lengths: NDArray[np.intp], seed: int) -> NDArray[np.uint16]:
    """Checksums of the beginnings of rows.

    Args:
        rows: Bytes, shape (frames, columns), at most `LONGEST` - 1 columns; zero beyond the length of each row.
        lengths: Bytes that count of each row.
        seed: The byte that follows them and is not sent.

    Returns:
        One checksum for each row.
    """
    places = rows + _PLACES[: rows.shape[1]]
    places -= (lengths * 256)[:, None]
    found: NDArray[np.uint16] = np.bitwise_xor.reduce(_CONTRIBUTIONS.take(places), axis=1, initial=0)
    found ^= _ZEROS[lengths + 1]
    found ^= _CONTRIBUTIONS[256 * (LONGEST - 1) + seed]
    return found
