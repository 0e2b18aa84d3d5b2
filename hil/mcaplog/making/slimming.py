"""Makes a log small: without its index, and, slim, without what running it again does not need."""

from __future__ import annotations

import json
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from hil.mcaplog.errors import LogError
from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.making.recovery import CopiedLog, copy_log
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.records import EVENTS
from hil.mcaplog.writing.writer import UNINDEXED

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

KEPT: Final = ("/bridge/*", "/wire/*", "/pal/*", EVENTS)
"""The topics that a slim log has, as patterns."""
SMALLEST: Final = 19
"""zstd's level where size alone matters: slim, 24 minutes of coaching (21 MB) are 6.1 MB, in 17 s."""
QUICK: Final = 9
"""zstd's level where time matters, too: they are 6.9 MB, in 2 s."""
SLIM: Final = "slim"
"""Name of the metadata record that says which topics were kept."""


def kept_of(metadata: Mapping[str, Mapping[str, str]]) -> tuple[str, ...] | None:
    """Topics that a slim log has, as patterns; None of a log that is not slim.

    Args:
        metadata: Its metadata records, by name.
    """
    slim = metadata.get(SLIM, {})
    if "kept" not in slim:
        return None
    try:
        kept = json.loads(slim["kept"])
    except (ValueError, RecursionError):
        return ()
    return tuple(topic for topic in kept if isinstance(topic, str)) if isinstance(kept, list) else ()


@lru_cache(maxsize=1024)
def matches(topic: str, patterns: tuple[str, ...]) -> bool:
    """A topic is one of these; it is asked of each entry of a log.

    Args:
        topic: The topic.
        patterns: As in the metadata of a slim log.
    """
    return any(fnmatchcase(topic, pattern) for pattern in patterns)


def slim(
    path: Path,
    out: Path,
    limits: ReadLimits = ReadLimits(),  # noqa: B008 - frozen
    *,
    level: int = SMALLEST,
    overwrite: bool = False,
) -> CopiedLog:
    """Write what running a log again needs into a new one.

    Args:
        path: The log.
        out: The new one.
        limits: What the log may unpack to.
        level: How well it is compressed: zstd's level.
        overwrite: One that exists is replaced.

    Returns:
        What became of it.

    Raises:
        UnreadableLogError: No entry could be had; no file is left.
        LogError: The log cannot be opened, or is slim already; the new one cannot be written.
        OutputExistsError: There is a file already, and it may not be replaced.
    """
    reader = LogReader(path, limits)
    for _ in reader.entries(topics=()):
        pass
    if SLIM in reader.metadata:
        raise LogError(f"{path} is slim already: copy it as it is")
    says = SLIM, {"kept": json.dumps(KEPT)}
    return copy_log(reader, out, topics=lambda topic: matches(topic, KEPT), small_level=level, says=says, overwrite=overwrite)


def pack(path: Path, out: Path, *, level: int = SMALLEST, overwrite: bool = False) -> CopiedLog:
    """Write a log into a new one without its index, which is half of a coaching's log; `recover` adds one. See `slim`."""
    return copy_log(LogReader(path), out, small_level=level, says=(UNINDEXED, {"why": "small"}), overwrite=overwrite)
