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


def is_kept(topic: str) -> bool:
    """A slim log has the entries of a topic."""
    return matches(topic, KEPT)


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

    def say(copy: LogCopy) -> None:
        copy.values(SLIM, {"kept": json.dumps(KEPT)})

    reader = LogReader(path, limits)
    for _ in reader.entries(topics=()):
        pass
    if SLIM in reader.metadata:
        raise LogError(f"{path} is slim already: copy it as it is")
    return copy_log(reader, out, topics=is_kept, small=level, more=say, overwrite=overwrite)
