"""Makes a log small: what running it again needs, and no more."""

from __future__ import annotations

import json
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

from hil.mcaplog.errors import LogError
from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.making.recovery import SMALLEST, CopiedLog, copy_log
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.records import EVENTS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from hil.mcaplog.making.copying import LogCopy

KEPT: Final = ("/bridge/*", "/wire/*", "/pal/*", EVENTS)
"""The topics that a slim log has, as patterns."""
EVERY: Final = ("*",)
"""Likewise of one that has all there is to see, and is small for want of an index of its entries."""
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


def matches(topic: str, patterns: Iterable[str]) -> bool:
    """A topic is one of these.

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
    topics: tuple[str, ...] = KEPT,
    level: int = SMALLEST,
    overwrite: bool = False,
) -> CopiedLog:
    """Write what running a log again needs into a new one.

    Args:
        path: The log.
        out: The new one.
        limits: What the log may unpack to.
        topics: What it has, as patterns.
        level: How well it is compressed: zstd's level.
        overwrite: One that exists is replaced.

    Returns:
        What became of it.

    Raises:
        UnreadableLogError: No entry could be had; no file is left.
        LogError: The log cannot be opened, or is slim already; the new one cannot be written.
        OutputExistsError: There is a file already, and it may not be replaced.
    """

    def say(copy: LogCopy) -> None:
        copy.values(SLIM, {"kept": json.dumps(topics)})

    reader = LogReader(path, limits)
    for _ in reader.entries(topics=()):
        pass
    if SLIM in reader.metadata and kept_of(reader.metadata) != EVERY:
        raise LogError(f"{path} is slim already: copy it as it is")
    return copy_log(
        reader, out, topics=lambda topic: matches(topic, topics), small=level, more=say, instead_of=(SLIM,), overwrite=overwrite
    )
