"""Writes a log file: MCAP, zstd chunks of 256 KiB, cut by log time and size alone.

Nothing here reads a clock: the same calls give the same bytes, but for the metadata record `run`, which is padded to a fixed
length and stands in a fixed place, so that not even an offset moves when its text changes.

The rare records are serialized by the `mcap` package. Messages and their index are packed here, since its writer takes
6 to 9 us a message, more than a lock-step simulation has to spare.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import zstandard
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, DataEnd, Header, Metadata, MetadataIndex
from mcap.records import Schema as SchemaRecord

from hil.files.outputs import Output
from hil.mcaplog.errors import LogError
from hil.mcaplog.log_file import LogFile
from hil.mcaplog.writing.packing import (
    MESSAGE_RECORD_HEAD,
    index_attachment,
    pack_chunk,
    pack_messages,
    pack_summary,
    serialize,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from mcap.records import AttachmentIndex, ChunkIndex

    from hil.mcaplog.schemas import Schema
    from hil.mcaplog.writing.row_encoding import EntryRows

MAGIC: Final = b"\x89MCAP0\r\n"
LIBRARY: Final = "junior-hil"
RUN: Final = "run"
"""Name of the one metadata record that may differ between two logs of the same run."""
CONFIG: Final = "config"
"""Name of the metadata record that says what was asked for."""
SIZES: Final = "sizes"
"""Name of the metadata record that closes a log: by topic, the bytes of its messages before compression."""
CUT: Final = "cut"
"""Name of the metadata record of a log that ends before the run did, though the file is whole: `why`, in words, and in one that
was made from a damaged log, how many `entries` come before the first that is missing."""
UNINDEXED: Final = "unindexed"
"""Name of the metadata record of a log that was made small by leaving out its index, and nothing else."""
RUN_BLOCK: Final = 4096
"""The `run` record is padded to a multiple of this, in bytes."""
CHUNK_SIZE: Final = 256 * 1024
"""A chunk is full with so many bytes, before compression."""
LONG_CHUNK_SIZE: Final = 1024 * 1024
"""Likewise a long one."""
LEVEL: Final = 6
"""How hard zstd tries: 5 % less than with its usual 3, for 0.15 ms a robot second; beyond it little is gained for much more."""
_PADDING: Final = "padding"
_PACK_HEAD: Final = MESSAGE_RECORD_HEAD.pack
_LEAD_SIZE: Final = 9
"""Bytes of a record's opcode and length, which its length does not count."""
_BODY_SIZE: Final = MESSAGE_RECORD_HEAD.size - _LEAD_SIZE
"""Bytes of a message record before the entry, of those that its length counts."""
_MESSAGE: Final = int(Opcode.MESSAGE)


class _Entries:
    """What a channel holds.

    Attributes:
        places: The stamp and the place of its messages in the next chunk, by turns.
        count: Messages so far, which number them.
        size: Bytes of all their records, as these tell their lengths.
    """

    __slots__ = ("count", "places", "size")

    def __init__(self) -> None:
        self.places: list[int] = []
        self.count = 0
        self.size = 0


class LogWriter:
    """A log file being written.

    Chunks are closed, and the file flushed, when the log time has moved on by `flush_every` or the chunk is full (long ones:
    when it is full). After a failure (a full disk) the first call raises and later ones do nothing, so that a robot can
    still be stopped through a bridge that has this log as a tap.

    Args:
        path: File to write; directories above it are made.
        run: Text for the metadata record `run`: wall clock, command line, paths; whatever differs between two runs of
            the same seed.
        flush_every: Log time between flushes, in s.
        overwrite: A file that exists is replaced, when the log is whole.
        on_failure: Is told, in words, when the disk does not take any more, and which file holds what there is of the log
            (None: no file does); nothing is raised then.
        long_chunks: Chunks are as long as they may be, for a smaller file: what a flush finds in none is written as it is, and
            the chunk written over it.
        sync_every: Log time after which what was written is seen onto the disk, in s; 0 sees to that at the end only.
        output: The file, where it is open already; None opens it.

    Raises:
        OutputExistsError: There is a file already, and it may not be replaced.
        LogError: The file cannot be created.
    """

    def __init__(
        self,
        path: Path,
        *,
        run: Mapping[str, str],
        flush_every: float = 0.5,
        overwrite: bool = False,
        on_failure: Callable[[str, Path | None], None] | None = None,
        long_chunks: bool = False,
        sync_every: float = 0.0,
        output: Output | None = None,
    ) -> None:
        self.path = path
        self._interval = round(flush_every * 1e9)
        self._flush_at = 0
        self._long = long_chunks
        self._chunk_size = LONG_CHUNK_SIZE if long_chunks else CHUNK_SIZE
        self._sync_interval = round(sync_every * 1e9)
        self._sync_at = 0
        self._compressor = zstandard.ZstdCompressor(level=LEVEL)
        self._buffer = bytearray()
        """The content of the next chunk, as far as it has come."""
        self._schemas: dict[str, SchemaRecord] = {}
        self._channels: dict[str, Channel] = {}
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._entries: dict[int, _Entries] = {}
        """Of each channel, what it holds so far."""
        self._open = True
        try:
            self._output = output or Output(path, overwrite=overwrite)
        except OSError as error:
            raise LogError(f"cannot write the log {path}: {error.strerror}. Choose another place, or do without") from error
        self._file = LogFile(self._output)
        self._on_failure = on_failure
        self._put(MAGIC + serialize(Header(profile="", library=LIBRARY)))
        self._write_metadata(RUN, _padded(run))
        self._flush_file()

    def channel(self, topic: str, schema: Schema) -> int:
        """The channel of a topic, registered when it is first asked for.

        Args:
            topic: Topic name.
            schema: What its entries look like.

        Returns:
            Channel id for `write`.
        """
        return self.raw_channel(topic, schema.name, schema.data)

    def raw_channel(
        self, topic: str, schema_name: str, schema: bytes, *, schema_encoding: str = "protobuf", encoding: str = "protobuf"
    ) -> int:
        """As `channel`, from a ready schema.

        Args:
            topic: Topic name.
            schema_name: Full name of the schema.
            schema: The schema; for protobuf a serialized FileDescriptorSet.
            schema_encoding: How the schema is written.
            encoding: How the entries are.

        Returns:
            Channel id for `write`.
        """
        if topic in self._channels:
            return self._channels[topic].id
        record = self._schemas.get(schema_name)
        if record is None:
            record = SchemaRecord(id=len(self._schemas) + 1, data=schema, encoding=schema_encoding, name=schema_name)
            self._schemas[schema_name] = record
            self._buffer += serialize(record)
        found = Channel(id=len(self._channels) + 1, topic=topic, message_encoding=encoding, metadata={}, schema_id=record.id)
        self._channels[topic] = found
        self._entries[found.id] = _Entries()
        self._buffer += serialize(found)
        return found.id

    def write(self, channel: int, time: float, data: bytes) -> None:
        """Append an entry.

        Args:
            channel: From `channel`.
            time: Log time in s; decides when to flush.
            data: The encoded entry.

        Raises:
            LogError: The disk does not take it (once; from then on nothing is written).
        """
        stamp = round(time * 1e9)
        if stamp >= self._flush_at or len(self._buffer) >= self._chunk_size:
            self._hand_on(stamp)
        buffer, size = self._buffer, len(data) + _BODY_SIZE
        entries = self._entries[channel]
        entries.places += (stamp, len(buffer))
        entries.count = number = entries.count + 1
        entries.size += size
        buffer += _PACK_HEAD(_MESSAGE, size, channel, number, stamp, stamp)
        buffer += data

    def write_rows(self, parts: Sequence[EntryRows]) -> None:
        """Append many entries, in the order of their places; they come into one chunk.

        Args:
            parts: The entries, each of another channel.

        Raises:
            LogError: As in `write`.
        """
        parts = [part for part in parts if len(part.places)]
        if not parts:
            return
        stamp = round(min(float(part.times[0]) for part in parts) * 1e9)
        if stamp >= self._flush_at or len(self._buffer) >= self._chunk_size:
            self._hand_on(stamp)
        held = [self._entries[part.channel] for part in parts]
        records, places = pack_messages(parts, [entries.count for entries in held], len(self._buffer))
        for part, entries, added in zip(parts, held, places, strict=True):
            count, size = part.data.shape
            entries.places += added
            entries.count += count
            entries.size += count * (size + _BODY_SIZE)
        self._buffer += records

    def _hand_on(self, stamp: int) -> None:
        """A flush is due, or the chunk is full.

        Args:
            stamp: Log time in ns.
        """
        if self._long and self._open and len(self._buffer) < self._chunk_size:
            self._write_tail()
        else:
            self.flush()
        self._flush_at = stamp + self._interval
        if self._sync_interval and stamp >= self._sync_at:
            self._sync()
            self._sync_at = stamp + self._sync_interval

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record at once.

        Args:
            name: Name of the record.
            values: Text by key.

        Raises:
            LogError: As in `write`.
        """
        if self._open:
            self._write_metadata(name, _text(values))
            self._write_tail()

    def attachment(self, name: str, data: bytes, *, media_type: str, time: float) -> None:
        """Write an attachment, a whole file inside the log, at once.

        Args:
            name: Name of the attachment.
            data: Its content.
            media_type: What it is, as `application/json`.
            time: Log time in s; when it was made is not said, so that equal runs give equal logs.

        Raises:
            LogError: As in `write`.
        """
        if not self._open:
            return
        attached = Attachment(create_time=0, log_time=round(time * 1e9), name=name, media_type=media_type, data=data)
        record = serialize(attached)
        self._attachments.append(index_attachment(attached, self._file.offset, len(record)))
        self._put(record)
        self._write_tail()

    def flush(self) -> None:
        """Close the chunk and hand everything to the operating system.

        Raises:
            LogError: As in `write`.
        """
        if self._open:
            self._finish_chunk()
            self._flush_file()
        else:
            self._forget()

    def close(self) -> None:
        """Finish the file. Repeating it does nothing; after a failure it only gives the file back.

        Raises:
            LogError: The disk does not take the rest.
        """
        if not self._open:
            return
        self._finish_chunk()
        held = self._entries
        sizes = {topic: str(held[at.id].size + held[at.id].count * _LEAD_SIZE) for topic, at in self._channels.items()}
        self._write_metadata(SIZES, sizes)
        self._put(serialize(DataEnd(0)))
        self._put(
            pack_summary(
                self._file.offset,
                schemas=list(self._schemas.values()),
                channels=list(self._channels.values()),
                counts={channel: entries.count for channel, entries in held.items()},
                chunks=self._chunks,
                attachments=self._attachments,
                metadata=self._metadata,
            )
        )
        self._put(MAGIC)
        if self._open:
            try:
                self._output.finish()
            except OSError as error:
                self._fail(error)
        self._open = False

    def discard(self) -> None:
        """Give it up, and leave no file: nothing has happened that would be worth one. What is no regular file stays."""
        self._open = False
        self._forget()
        self._output.discard()

    def _finish_chunk(self) -> None:
        held = [(entries.places, channel) for channel, entries in self._entries.items() if entries.places]
        if not held:
            return
        raw = bytes(self._buffer)
        index = {channel: places for places, channel in sorted(held, key=lambda one: one[0][1])}  # by their first messages
        self._forget()
        records, found = pack_chunk(raw, index, self._file.offset, self._compressor)
        self._put(records)
        self._chunks.append(found)

    def _forget(self) -> None:
        self._buffer = bytearray()
        for entries in self._entries.values():
            entries.places = []

    def _write_metadata(self, name: str, values: dict[str, str]) -> None:
        record = serialize(Metadata(name=name, metadata=values))
        self._metadata.append(MetadataIndex(offset=self._file.offset, length=len(record), name=name))
        self._put(record)

    def _put(self, data: bytes) -> None:
        if not self._open:
            return
        try:
            self._file.put(data)
        except OSError as error:
            self._fail(error)

    def _write_tail(self) -> None:
        """Hand everything to the operating system; of long chunks also what is in none yet."""
        if not self._open:
            return
        try:
            if self._long:
                self._file.extend_tail(self._buffer)
            else:
                self._file.flush()
        except OSError as error:
            self._fail(error)

    def _flush_file(self) -> None:
        if not self._open:
            return
        try:
            self._file.flush()
        except OSError as error:
            self._fail(error)

    def _sync(self) -> None:
        if not self._open:
            return
        try:
            self._output.sync()
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        self._open = False
        self._forget()
        kept = self._output.leave()
        if kept is None:
            rest = "nothing of it is kept"
        elif kept == self.path:
            rest = "it ends here"
        else:
            rest = f"what there is of it is in {kept}, and {self.path} is as it was"
        text = f"the log {self.path} cannot be written any further: {error.strerror}; {rest}"
        if self._on_failure is None:
            raise LogError(text) from error
        self._on_failure(text, kept)


def _text(values: Mapping[str, str]) -> dict[str, str]:
    """Values as UTF-8 can carry them: a path may hold bytes that are no text."""
    return {key: value.encode(errors="backslashreplace").decode() for key, value in values.items()}


def _padded(run: Mapping[str, str]) -> dict[str, str]:
    """Fill the record up to a whole number of blocks, so that its length does not tell what it says."""
    values = {**_text(run), _PADDING: ""}
    short = -len(serialize(Metadata(name=RUN, metadata=values))) % RUN_BLOCK
    return {**values, _PADDING: " " * short}
