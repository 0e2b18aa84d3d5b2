"""Numbers for a page: quantised, as differences, deflated; a few bytes a row where JSON takes dozens.

Every column is a list of whole numbers, each the difference to the one before, its bytes told apart by their weight (all low
ones first), so that what changes slowly is mostly zeros. All columns of a document are deflated together.
"""

from __future__ import annotations

import zlib
from base64 import b64encode
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

LARGEST: Final = 1 << 29
"""No quantised value is farther from 0: differences fit 32 bits."""
LEVEL: Final = 6
"""Of deflating: 9 takes eight times as long for less than a hundredth of the bytes."""


class Columns:
    """Takes columns, and gives the one block of bytes that holds them."""

    def __init__(self) -> None:
        self._blocks: list[bytes] = []
        self._size = 0

    def add(self, values: NDArray[np.float64], step: float) -> dict[str, Any]:
        """Take a column.

        Args:
            values: The numbers, shape (n,); NaN is none, and infinite or huge ones count as none.
            step: What they are rounded to multiples of.

        Returns:
            Where it is and how it is read: `at` and `n`; `b`, bytes a number has; `s`, the step; `z`, what stands for none.
        """
        good = np.isfinite(values) & (np.abs(np.nan_to_num(values)) < LARGEST * step)
        whole = np.zeros(len(values), np.int64)
        whole[good] = np.round(values[good] / step).astype(np.int64)
        none = int(whole[good].min()) - 1 if good.any() else 0
        whole[~good] = none
        apart = np.diff(whole, prepend=0)
        reach = int(np.abs(apart).max()) if len(apart) else 0
        width = 1 if reach < 1 << 7 else 2 if reach < 1 << 15 else 4
        planes = apart.astype(f"<i{width}").view(np.uint8).reshape(-1, width).T
        block = planes.tobytes()
        found: dict[str, Any] = {"at": self._size, "n": len(values), "b": width, "s": step}
        if not good.all():
            found["z"] = none
        self._blocks.append(block)
        self._size += len(block)
        return found

    def text(self) -> str:
        """All of it, deflated (RFC 1950), in base64."""
        return b64encode(zlib.compress(b"".join(self._blocks), LEVEL)).decode("ascii")
