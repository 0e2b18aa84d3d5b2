"""What kinds of files a log holds as attachments."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import Final

_TYPES: Final = {".json": "application/json", ".toml": "application/toml"}


def media_type_of(name: str) -> str:
    """The media type of a file, by its name.

    Args:
        name: The name, as `advice.toml`.
    """
    return _TYPES.get(PurePosixPath(name).suffix, "application/octet-stream")
