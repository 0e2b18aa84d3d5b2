"""Walks the records of a log from the start, whole or damaged: all that is whole, and what was wrong, never a traceback.

MCAP's indexed readers need the footer that a crashed writer never wrote; this needs nothing but the records themselves. Where
there is an index, it tells what can be passed over, and where to go on behind damage.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING, BinaryIO, Final, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Metadata

from hil.mcaplog.attachments import LogAttachment, read_attachment
from hil.mcaplog.errors import LogError, UnreadableLogError
from hil.mcaplog.limits import LARGEST_ATTACHMENTS, LARGEST_METADATA, ReadLimits, remedy
from hil.mcaplog.reading.index import LogIndex, read_index
from hil.mcaplog.reading.unpacking import DAMAGE, RECORD_HEAD, read_chunk, salvage, split, stream, unpack
from hil.mcaplog.writing.writer import CUT, MAGIC

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

MOST_NOTES: Final = 100
_LONGEST_NOTE: Final = 250
_NO_PASSAGE: Final = (1 << 64, 1 << 64)


class RawRecord(NamedTuple):
    """A record as it stands in the file.

    Attributes:
        opcode: Its MCAP opcode.
        content: Its content.
        offset: Where it begins in the file, in bytes; -1 inside a chunk.
    """

    opcode: int
    content: bytes
    offset: int


class TooMuchError(Exception):
    """The file holds more than a file of its size may; the text says of what."""


class WalkedLog:
    """A log file whose records can be walked from the start, as often as wanted.

    Attributes:
        path: The file.
        size: Its size in bytes.
        metadata: The metadata records met in the last pass, by name; of several with one name the last.
        attachments: The attachments met in the last pass, by name, likewise.
        truncated: The last pass did not come to a proper end of the file.
        damage: What the last pass found wrong, in words.
        bytes_read: Bytes up to the end of the last whole record of the last pass.
        messages_read: Entries met in the last pass, wanted or not; those in chunks that the index passed over are not met.
        not_read: Entries met in the last pass that were wanted and can't be given, by topic and why.
        rescuing: What is given now is of the first chunk that is damaged, and comes before what is missing of it.
        stopped: Why the last pass did not go on to the end though the file does; empty where it did.

    Args:
        path: The file.
        limits: What it may unpack to.
        rescue: Chunks that are cut off or do not unpack give what they hold before that.

    Raises:
        LogError: It cannot be opened or is not a log.
    """

    def __init__(self, path: Path, limits: ReadLimits = ReadLimits(), *, rescue: bool = False) -> None:  # noqa: B008 - frozen
        self.path = path
        self.limits = limits
        self._rescue = rescue
        self._index: LogIndex | None = None
        self._indexed = False
        try:
            self.size = path.stat().st_size
            with path.open("rb") as file:
                start = file.read(len(MAGIC))
        except OSError as error:
            raise LogError(f"cannot read the log {path}: {error.strerror}") from error
        except ValueError as error:  # a zero byte in its name
            raise LogError(f"cannot read the log {str(path)!r}: no file has this name") from error
        if not MAGIC.startswith(start):
            raise LogError(f"{path} is not a log: it does not begin as an MCAP file does")
        self._begin()
        self.truncated = False

    @property
    def index(self) -> LogIndex | None:
        """The index at the end of the file; None where there is none, or it can't be right."""
        if not self._indexed:
            self._indexed = True
            with self.path.open("rb") as file:
                self._index = read_index(file, self.size)
        return self._index

    @property
    def whole(self) -> bool:
        """The last pass read all there is, and found nothing wrong."""
        return not (self.truncated or self.damage or self.stopped or self.not_read)

    @property
    def ends_early(self) -> bool:
        """The log ends before the run did, by the last pass: it was cut off, or recovered from one that was."""
        return self.truncated or bool(self.stopped) or CUT in self.metadata

    def records(self, *, expand: bool = True) -> Iterator[RawRecord]:
        """Every record, those inside chunks too, each whole.

        Args:
            expand: Open the chunks; else they are skipped over.

        Yields:
            The records; those inside a chunk follow it.
        """
        for record in self.walk(expand=expand):
            yield record
            if record.opcode != Opcode.CHUNK or not expand:
                continue
            try:
                data = self.open_chunk(record)
                for opcode, start, end in self.split_chunk(data, record.offset):
                    yield RawRecord(opcode, data[start:end], -1)
            except TooMuchError as error:
                self.stop(error)
                return

    def walk(self, *, expand: bool = True, passages: Iterable[tuple[int, int]] = ()) -> Iterator[RawRecord]:
        """The records that stand in the file itself.

        Args:
            expand: Read the content of chunks.
            passages: What is passed over: where it begins, always with a record, and where it ends; ascending, in bytes.

        Yields:
            The records.
        """
        self._begin()
        with self.path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                self.note("the file ends within its first bytes")
                return
            self.bytes_read = len(MAGIC)
            for record in self._whole_records(file, expand=expand, passages=passages):
                yield record
                if record.opcode == Opcode.METADATA:
                    self._take_metadata(record)
                elif record.opcode == Opcode.ATTACHMENT:
                    self._take_attachment(record)
                elif record.opcode == Opcode.FOOTER:
                    self.truncated = file.read(len(MAGIC)) != MAGIC
                    self.bytes_read += 0 if self.truncated else len(MAGIC)
                    return

    def open_chunk(self, record: RawRecord) -> bytes:
        """What a chunk unpacks to; nothing, and a note, where it can't be.

        Raises:
            TooMuchError: With this one, the chunks of the file unpack to more than those of a file of its size may.
        """
        where = f"the chunk at byte {record.offset:,}"
        in_order = not self.damage
        try:
            chunk, size = read_chunk(record.content)
            if size > self.limits.chunk:
                text = f"{where} unpacks to {size:,} bytes and was left out"
                self.note(f"{text}: {remedy(size)}" if size < 1 << 40 else text)
                return b""
            self._count_bytes(size)
            return unpack(chunk, size)
        except DAMAGE as error:
            data = self._rescued(record.content)
            self.rescuing = in_order and bool(data)
            rest = f"only the first {len(data):,} bytes of what it holds could be had" if data else "was left out"
            self.note(f"{where} is damaged and {rest} ({error})")
            return data

    def split_chunk(self, data: bytes, offset: int) -> Iterator[tuple[int, int, int]]:
        """The records in what a chunk unpacks to: opcode, and where the content begins and ends.

        Args:
            data: What the chunk unpacks to.
            offset: Where the chunk begins in the file, in bytes.

        Raises:
            TooMuchError: The chunks of the file hold more records than those of a file of its size may.
        """
        most = self.limits.records(self.size)
        for found in split(data, lambda text: self.note(f"the chunk at byte {offset:,} {text}")):
            self._records += 1
            if self._records > most:
                raise TooMuchError("records")
            yield found

    def health(self, most: int = 3) -> str:
        """What the last pass found, in a sentence.

        Args:
            most: Of what is wrong, and of what could not be read, so many are named.
        """
        noted = "".join(f"; {text}" for text in (*self._unread(most), *self.damage[:most]))
        if not self.size:
            return "empty: 0 of 0 bytes could be read"
        if self.stopped:
            return f"read in part: {self.stopped}; {self.bytes_read:,} of {self.size:,} bytes were read{noted}"
        if not self.truncated and not self.damage:
            return f"{'read in part' if noted else 'whole'}, {self.size:,} bytes{noted}"
        share = f"{self.bytes_read:,} of {self.size:,} bytes could be read"
        words = "cut off: the run was not ended properly" if self.truncated else "damaged"
        return f"{words}; {share}{noted}"

    def require_something(self) -> None:
        """See that the last pass, one over all topics, has given anything.

        Raises:
            UnreadableLogError: There is something in the log, and nothing of it could be read.
        """
        given = self.messages_read - sum(self.not_read.values())
        if given <= 0 and (self.damage or self.stopped or self.not_read or (self.truncated and not self.metadata)):
            raise UnreadableLogError(f"nothing could be read of the log {self.path}: it is {self.health(most=1)}")

    def note(self, text: str) -> None:
        """Take note of damage, in words."""
        if len(self.damage) < MOST_NOTES:
            self.damage.append(shown(text, _LONGEST_NOTE))

    def stop(self, error: TooMuchError) -> None:
        """Take note that the pass ends here."""
        self.stopped = f"it holds more {error} than a file of its size may; {remedy()}"

    def _begin(self) -> None:
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, LogAttachment] = {}
        self.damage: list[str] = []
        self.not_read: dict[tuple[str, str], int] = {}
        self.truncated = True
        self.rescuing = False
        self.stopped = ""
        self.bytes_read = self.messages_read = self._unpacked = self._records = self._attached = 0

    def _unread(self, most: int) -> Sequence[str]:
        found = sorted(self.not_read.items(), key=lambda counted: -counted[1])[:most]
        return [
            f"{count:,} {'entry' if count == 1 else 'entries'} of {shown(topic) or 'no known topic'} could not be read ({why})"
            for (topic, why), count in found
        ]

    def _whole_records(self, file: BinaryIO, *, expand: bool, passages: Iterable[tuple[int, int]]) -> Iterator[RawRecord]:
        left = iter(passages)
        begin, end = next(left, _NO_PASSAGE)
        while True:
            offset = file.tell()
            while begin < offset:
                begin, end = next(left, _NO_PASSAGE)
            if begin == offset:
                file.seek(end)
                offset = self.bytes_read = end
            head = file.read(RECORD_HEAD.size)
            opcode, length = RECORD_HEAD.unpack(head) if len(head) == RECORD_HEAD.size else (0, 0)
            if opcode == 0 or offset + RECORD_HEAD.size + length > self.size:
                if opcode == Opcode.CHUNK and self._rescue:
                    yield from self._cut_chunk(file, offset)
                if not self._go_on_behind(file, offset):
                    return
                continue
            if length > self.limits.chunk:
                self.note(f"the record at byte {offset:,} has {length:,} bytes and was left out: {remedy(length)}")
                file.seek(length, 1)
                self.bytes_read = file.tell()
                continue
            if opcode == Opcode.CHUNK and not expand:
                file.seek(length, 1)
                content = b""
            else:
                content = file.read(length)
            self.bytes_read = file.tell()
            yield RawRecord(opcode, content, offset)

    def _cut_chunk(self, file: BinaryIO, offset: int) -> Iterator[RawRecord]:
        """The last chunk of a log that was cut off within it."""
        content = file.read(self.limits.chunk)
        if content:
            yield RawRecord(Opcode.CHUNK, content, offset)

    def _go_on_behind(self, file: BinaryIO, offset: int) -> bool:
        """Go to the next place that the index knows, behind what is no record."""
        if offset >= self.size or self.index is None:
            return False
        at = bisect_right(self.index.places, offset)
        if at == len(self.index.places):
            return False
        self.note(
            f"what is at byte {offset:,} is no record: it went on at byte {self.index.places[at]:,}, which the index names"
        )
        file.seek(self.index.places[at])
        return True

    def _count_bytes(self, size: int) -> None:
        self._unpacked += size
        if self._unpacked > self.limits.unpacked(self.size):
            raise TooMuchError("bytes")

    def _rescued(self, content: bytes) -> bytes:
        if not self._rescue:
            return b""
        data = salvage(content, self.limits.chunk)
        self._count_bytes(len(data))
        return data

    def _take_metadata(self, record: RawRecord) -> None:
        if len(record.content) > LARGEST_METADATA:
            self.note(f"the metadata at byte {record.offset:,} has {len(record.content):,} bytes and was left out")
            return
        try:
            name, values = read_metadata(record.content)
        except DAMAGE as error:
            self.note(f"the metadata at byte {record.offset:,} is damaged ({error})")
            return
        self.metadata[name] = values

    def _take_attachment(self, record: RawRecord) -> None:
        self._attached += len(record.content)
        if self._attached > LARGEST_ATTACHMENTS:
            self._attached -= len(record.content)
            self.note(
                f"the attachment at byte {record.offset:,} was left out: there are more than {LARGEST_ATTACHMENTS:,} bytes"
            )
            return
        try:
            attachment = read_attachment(record.content)
        except DAMAGE as error:
            self.note(f"the attachment at byte {record.offset:,} is damaged ({error})")
            return
        self.attachments[attachment.name] = attachment


def shown(text: str, most: int = 60) -> str:
    """A text out of a log, short and without what a terminal obeys."""
    return "".join(letter if letter.isprintable() else "?" for letter in text[:most])


def read_metadata(content: bytes) -> tuple[str, dict[str, str]]:
    """Read a metadata record.

    Args:
        content: Content of the record.

    Returns:
        Its name, and its values by key, but for what fills it up.

    Raises:
        McapError: It is damaged. Likewise one of `unpacking.DAMAGE`.
    """
    metadata = Metadata.read(stream(content))
    return metadata.name, {key: value for key, value in metadata.metadata.items() if key != "padding"}
