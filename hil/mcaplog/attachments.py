"""Files that a log carries beside its entries: what a run began with, and what it ended with."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from io import BytesIO
from typing import Final

from mcap.data_stream import ReadDataStream
from mcap.records import Attachment

BEGUN_WITH: Final = "begin/"
ENDED_WITH: Final = "end/"
"""What the names of files begin with that a run began, or ended, with."""


@dataclass(frozen=True, slots=True)
class LogAttachment:
    """A file in a log.

    Attributes:
        name: Its name; a label, never a path to be opened.
        media_type: Its media type, as `application/json`.
        time: Log time in s.
        data: Its content.
    """

    name: str
    media_type: str
    time: float
    data: bytes


def read_attachment(content: bytes) -> LogAttachment:
    """Read an attachment record.

    Args:
        content: Content of the record.

    Raises:
        McapError: It ends too early.
        ValueError: It is not whole, its checksum is wrong, or its name is no text.
    """
    found = Attachment.read(ReadDataStream(BytesIO(content)))
    size = 32 + len(found.name.encode()) + len(found.media_type.encode()) + len(found.data)
    crc = int.from_bytes(content[size : size + 4], "little")
    if len(content) < size + 4 or (crc and zlib.crc32(content[:size]) != crc):
        raise ValueError("bad checksum, or not whole")
    return LogAttachment(found.name, found.media_type, found.log_time / 1e9, found.data)
