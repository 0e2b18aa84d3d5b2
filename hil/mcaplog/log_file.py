"""The file of a log: what lasts, and behind it a tail that what lasts is written over.

A chunk compresses well when it is long, and what is in none yet is lost with the program. So it is written as it is, behind the
last chunk, where MCAP allows messages too, and when its chunk is full that takes its place. The file that is whole in the end
shows nothing of it.
"""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING, Final

from hil.files.outputs import is_special

if TYPE_CHECKING:
    from hil.files.outputs import Output

_FILLER: Final = Struct("<BQ")
_PRIVATE: Final = 0x80
"""Kind of a record that no reader of MCAP knows: it is passed over."""


class LogFile:
    """A log's file.

    Args:
        output: The file, empty.

    Attributes:
        offset: Bytes that last.

    All methods raise OSError where the disk does not take it.
    """

    def __init__(self, output: Output) -> None:
        self.offset = 0
        self._output = output
        self._tail = 0
        self._takes_tail = not is_special(output.path)

    def put(self, data: bytes) -> None:
        """Append to what lasts, over a tail.

        Args:
            data: Whole records.
        """
        file = self._output.file
        left = self._tail - len(data)
        if self._tail:
            file.seek(self.offset)
        if 0 < left < _FILLER.size:
            file.truncate()
        file.write(data + _FILLER.pack(_PRIVATE, left - _FILLER.size) if left >= _FILLER.size else data)
        self.offset += len(data)
        self._tail = 0
        if left >= _FILLER.size:  # until it is cut off, the rest of the tail is the body of a record that means nothing
            file.seek(self.offset)
            file.truncate()

    def extend_tail(self, records: bytearray) -> None:
        """Have the tail hold all these, and hand it to the operating system; nothing is done where it is no regular file.

        Args:
            records: Those that it holds, and more behind them.
        """
        if self._takes_tail and self._tail < len(records):
            self._output.file.write(records[self._tail :])
            self._tail = len(records)
        self._output.file.flush()

    def flush(self) -> None:
        """Hand everything to the operating system."""
        self._output.file.flush()
