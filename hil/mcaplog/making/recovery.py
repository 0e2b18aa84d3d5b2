"""Makes a log of all that can be read of another, which may be damaged: whole and indexed, or small."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from mcap.opcode import Opcode
from mcap.records import Header

from hil.files.outputs import Output, OutputError
from hil.mcaplog.attachments import read_attachment
from hil.mcaplog.errors import LogError, UnreadableLogError
from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.making.copying import LogCopy
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.reading.unpacking import DAMAGE, stream
from hil.mcaplog.reading.walking import read_metadata
from hil.mcaplog.writing.writer import CUT, UNINDEXED

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from hil.mcaplog.reading.walking import RawRecord

_SMALL: Final[dict[str, Any]] = {"chunk_size": 256 << 10, "indexed": False}


@dataclass(frozen=True)
class CopiedLog:
    """What became of a log.

    Attributes:
        path: The new log.
        size: Its size in bytes.
        entries: Entries in it.
        metadata: Metadata records in it.
        attachments: Attachments in it.
        health: What state the old log was in, in words.
        whole: There was nothing wrong with the old log.
    """

    path: Path
    size: int
    entries: int
    metadata: int
    attachments: int
    health: str
    whole: bool


def recover(path: Path, out: Path, limits: ReadLimits = ReadLimits(), *, overwrite: bool = False) -> CopiedLog:  # noqa: B008 - frozen
    """Write all that can be read of a log into a new one, which is whole.

    The metadata record `cut` of the new one says what was wrong with it. Of a chunk that is cut off or does not unpack to
    its end, the entries before that are kept; one that unpacks to something of another checksum is left out.

    Args:
        path: The log.
        out: The new one.
        limits: What the log may unpack to.
        overwrite: One that exists is replaced.

    Returns:
        What became of it.

    Raises:
        UnreadableLogError: Nothing could be had; no file is left.
        LogError: The log cannot be opened, or the new one cannot be written.
        OutputExistsError: There is a file already, and it may not be replaced.
    """
    reader = LogReader(path, limits, rescue=True)
    return copy_log(reader, out, overwrite=overwrite)


def copy_log(
    reader: LogReader,
    out: Path,
    *,
    topics: Callable[[str], bool] = lambda _: True,
    small_level: int | None = None,
    says: tuple[str, Mapping[str, str]] | None = None,
    overwrite: bool = False,
) -> CopiedLog:
    """Write what a reader gives into a new log.

    Args:
        reader: The log.
        out: The new one.
        topics: Tells whether the entries of a topic are wanted; all are, where it is left out.
        small_level: Size matters more than finding entries by their index: zstd's level; None: it does not.
        says: Name and values of a metadata record that is added; None adds none.
        overwrite: One that exists is replaced.

    Raises:
        UnreadableLogError: Nothing could be had; no file is left.
        LogError: The new one cannot be written.
        OutputExistsError: There is a file already, and it may not be replaced.
    """
    if out.exists() and out.samefile(reader.path):
        raise LogError(f"{out} is the log itself: choose another file")
    try:
        output = Output(out, overwrite=overwrite)
    except OutputError:
        raise
    except OSError as error:
        raise LogError(f"cannot write the log {out}: {error.strerror}") from error
    try:
        copy = LogCopy(output.file, header=_header(reader), **({} if small_level is None else {**_SMALL, "level": small_level}))
        files = _fill(copy, reader, topics, entries=small_level is not None)
        if says is not None:
            copy.values(*says)
        if not reader.whole and CUT not in reader.metadata:
            copy.values(CUT, {"why": reader.health(), "entries": str(files.before)})
        copy.finish()
        output.finish()
    except OSError as error:
        output.discard()
        raise LogError(f"cannot write the log {out}: {error.strerror}") from error
    except BaseException:
        output.discard()
        raise
    size = out.stat().st_size
    return CopiedLog(out, size, copy.entries, files.metadata, files.attachments, reader.health(), reader.whole)


def _fill(copy: LogCopy, reader: LogReader, topics: Callable[[str], bool], *, entries: bool) -> _Extras:
    """Copy entries, metadata and attachments.

    Raises:
        UnreadableLogError: There are none, or no entries where these are what is wanted.
    """
    files = _Extras(copy)
    for entry in reader.raw_entries(others=files.take):
        if not entry.topic or topics(entry.topic):
            described = reader.channels.described(entry.channel)
            if described is None:
                reader.count_unread(entry, "the log does not describe it")
            else:
                if not reader.damage or reader.rescuing:
                    files.before += 1
                copy.entry(entry, *described)
    if not copy.entries and (entries or not (files.metadata or files.attachments)):
        what = "no entry" if files.metadata or files.attachments else "nothing"
        raise UnreadableLogError(f"{what} could be had of the log {reader.path}: it is {reader.health(most=1)}")
    return files


class _Extras:
    """Takes what a log holds besides entries, but for what it says of its own index.

    Attributes:
        metadata: Metadata records taken.
        attachments: Attachments taken.
        before: Entries that were copied and come before the first that is missing.
    """

    def __init__(self, copy: LogCopy) -> None:
        self._copy = copy
        self.metadata = self.attachments = self.before = 0

    def take(self, record: RawRecord) -> None:
        """Take a metadata record or an attachment, where it is in order; the reader tells where it is not."""
        with suppress(*DAMAGE):
            if record.opcode == Opcode.METADATA:
                name, _ = read_metadata(record.content)
                if name != UNINDEXED:
                    self._copy.metadata(record.content)
                    self.metadata += 1
            else:
                read_attachment(record.content)
                self._copy.attachment(record.content)
                self.attachments += 1


def _header(reader: LogReader) -> Header | None:
    """A log's header, which says who wrote it; None where that can't be read."""
    for record in reader.walk(expand=False):
        if record.opcode == Opcode.HEADER:
            with suppress(*DAMAGE):
                header: Header = Header.read(stream(record.content))
                return header
        break
    return None
