"""Reads the entries of logs, whole or damaged: everything up to the damage, and how much that was, never a traceback.

Where one topic or a late part is asked for, the index at the end of a log says what need not be looked at. It says no more
than that: what is read is read as in a log that has none, in the order of the file.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from struct import Struct, iter_unpack
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, BinaryIO, Final, NamedTuple

from mcap.opcode import Opcode

from hil.mcaplog.limits import remedy
from hil.mcaplog.reading.decoding import Channels, Decode, UnreadableError, sender_only
from hil.mcaplog.reading.unpacking import DAMAGE, RECORD_HEAD
from hil.mcaplog.reading.walking import RawRecord, TooMuchError, WalkedLog, shown
from hil.mcaplog.writing.packing import INDEX_HEAD

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

    from hil.mcaplog.reading.index import IndexedChunk, LogIndex

MESSAGE_HEAD: Final = Struct("<HIQQ")
"""Channel, sequence, log time and publish time of an entry, times in ns."""
_ENTRY_HEAD: Final = Struct("<BQHIQ")
_LARGEST_EMPTY_INDEXES: Final = 1 << 16
_MOST_WORDS: Final = 500
"""Topics and reasons by which entries that can't be given are counted apart."""


@dataclass(frozen=True, slots=True)
class LogEntry:
    """One entry of a log.

    Attributes:
        topic: Its topic.
        time: Log time in s.
        value: A message of `firmware_protocol.messages`, a record of `records`, or, for anything else,
            the protobuf message as the log's own descriptor parses it; the bytes where it is not
            protobuf, or has no schema. None where it was not asked for.
        sender: MAVLink system and component of the sender of a robot message.
        frame: Sequence number of the frame that a received robot message came in, 0..255.
    """

    topic: str
    time: float
    value: Any
    sender: tuple[int, int] | None = None
    frame: int | None = None


class RawEntry(NamedTuple):
    """One entry of a log as it stands there.

    Attributes:
        topic: Its topic; empty where the log does not describe its channel.
        channel: Its channel.
        sequence: Its sequence number.
        log_time: Log time in ns.
        publish_time: Publish time in ns.
        data: What its decoder takes.
    """

    topic: str
    channel: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


class LogReader(WalkedLog):
    """A log file whose entries can be read, as often as wanted.

    Attributes:
        channels: The channels met in the last pass, and those that the index knows, where it was used.
    """

    channels: Channels
    _decoders: dict[int, Decode]

    def entries(
        self,
        topics: Collection[str] | None = None,
        *,
        start: float | None = None,
        leave_out: Collection[str] = (),
        unread: Collection[str] = (),
        only: Mapping[str, Callable[[bytes], bool]] = MappingProxyType({}),
    ) -> Iterator[LogEntry]:
        """Everything readable, in the order of the file.

        Args:
            topics: Only these topics; None is all. An empty collection reads the metadata only, fast.
            start: Only entries of this log time and later, in s.
            leave_out: Not these topics.
            unread: Of these topics of robot messages only who sent them: their value is None. It is much faster.
            only: Of these topics only entries of which this holds, told by their bytes; the others are not decoded.

        Yields:
            The entries.
        """
        for entry in self.raw_entries(topics, start=start, leave_out=leave_out):
            if entry.topic in only and not only[entry.topic](entry.data):
                continue
            if entry.topic in unread and entry.channel not in self._decoders:
                self._decoders[entry.channel] = sender_only
            decoded = self._decode(entry)
            if decoded is not None:
                yield LogEntry(entry.topic, entry.log_time / 1e9, *decoded)

    def decoded(self, entry: RawEntry) -> Any:  # noqa: ANN401 - whatever its schema says
        """The value of an entry of the last pass, as in `LogEntry`; None where it can't be given, which is counted."""
        decoded = self._decode(entry)
        return None if decoded is None else decoded[0]

    def _decode(self, entry: RawEntry) -> tuple[Any, ...] | None:
        decode = self._decoders.get(entry.channel)
        try:
            if decode is None:
                decode = self._decoders[entry.channel] = self.channels.decoder(entry.channel)
            return decode(entry.data)
        except UnreadableError as error:
            self.count_unread(entry, str(error))
        except DAMAGE as error:
            self.count_unread(entry, f"could not be decoded: {error}")
        return None

    def raw_entries(
        self,
        topics: Collection[str] | None = None,
        *,
        start: float | None = None,
        leave_out: Collection[str] = (),
        others: Callable[[RawRecord], None] | None = None,
    ) -> Iterator[RawEntry]:
        """As `entries`, nothing decoded.

        Args:
            topics: Only these topics; None is all.
            start: Only entries of this log time and later, in s.
            leave_out: Not these topics.
            others: Is given the metadata and the attachments, as they are met.

        Yields:
            The entries.
        """
        self.channels, self._decoders = Channels(self.note), {}
        selection = _Selection(self, topics, leave_out, None if start is None else round(start * 1e9))
        expand = topics is None or bool(topics)
        passages = selection.passages() if expand else ()
        with self.path.open("rb") as file:
            for record in self.walk(expand=expand, passages=passages):
                self.rescuing = False
                if others is not None and record.opcode in {Opcode.METADATA, Opcode.ATTACHMENT}:
                    others(record)
                if record.opcode != Opcode.CHUNK:
                    yield from selection.take(record.opcode, record.content, 0, len(record.content))
                elif expand:
                    try:
                        yield from self._chunk(record, selection, file)
                    except TooMuchError as error:
                        self.stop(error)
                        return

    def count_unread(self, entry: RawEntry, why: str) -> None:
        """Count an entry that can't be given.

        Args:
            entry: The entry.
            why: In words.
        """
        key = entry.topic, shown(why, 120)
        if key not in self.not_read and len(self.not_read) >= _MOST_WORDS:
            key = "other topics", "for one reason or another"
        self.not_read[key] = self.not_read.get(key, 0) + 1

    def _chunk(self, record: RawRecord, selection: _Selection, file: BinaryIO) -> Iterator[RawEntry]:
        data = self.open_chunk(record)
        places = selection.places(record, data, file)
        for opcode, begin, end in self.split_chunk(data, record.offset) if places is None else places:
            yield from selection.take(opcode, data, begin, end)


class _Selection:
    """Which entries of a log are wanted, and what its index says of where they are.

    Args:
        reader: The log.
        topics: Only these topics; None is all.
        leave_out: Not these.
        start: Log time of the first that is wanted, in ns; None is the first of all.
    """

    def __init__(
        self, reader: LogReader, topics: Collection[str] | None, leave_out: Collection[str], start: int | None
    ) -> None:
        self._reader = reader
        self._topics = topics
        self._leave_out = leave_out
        self._start = start
        self._asked: dict[int, str | None] = {}
        self._indexed: dict[int, bool] = {}
        self._asked_index = False
        self._known: dict[int, tuple[int, int, set[int]]] = {}
        """Where the message indexes of a chunk that may hold a wanted entry are, and how long, by where the chunk is."""

    def asks_for(self, topic: str) -> bool:
        """The topic is wanted."""
        return topic not in self._leave_out and (self._topics is None or topic in self._topics)

    def take(self, opcode: int, data: bytes, begin: int, end: int) -> Iterator[RawEntry]:
        """Take a record: learn from it, or give the entry if it is a wanted one."""
        if opcode == Opcode.MESSAGE:
            entry = self._entry(data, begin, end)
            if entry is not None:
                yield entry
        elif opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
            channels = self._reader.channels
            try:
                (channels.add_schema if opcode == Opcode.SCHEMA else channels.add_channel)(data[begin:end])
            except DAMAGE as error:
                self._reader.note(f"a record could not be decoded ({error})")

    def _entry(self, data: bytes, begin: int, end: int) -> RawEntry | None:
        reader = self._reader
        if end - begin < MESSAGE_HEAD.size:
            reader.note("an entry is too short to be one")
            return None
        reader.messages_read += 1
        channel, sequence, stamp, published = MESSAGE_HEAD.unpack_from(data, begin)
        if channel in self._asked:
            wanted = self._asked[channel]
        else:
            topic = self._topic(channel)
            wanted = topic if self.asks_for(topic) else None
            if channel in reader.channels:  # one that is not may be described later
                self._asked[channel] = wanted
        if wanted is None or (self._start is not None and stamp < self._start):
            return None
        entry = RawEntry(wanted, channel, sequence, stamp, published, data[begin + MESSAGE_HEAD.size : end])
        if end - begin > reader.limits.entry:
            reader.count_unread(entry, f"one has {end - begin:,} bytes; {remedy()}")
            return None
        return entry

    def _topic(self, channel: int) -> str:
        """Topic of a channel, as the index has it where what describes it was lost with a chunk."""
        reader = self._reader
        if channel not in reader.channels and not self._asked_index:
            self._asked_index = True
            if reader.index is not None:
                with suppress(*DAMAGE):
                    reader.channels.add_all(reader.index.schemas, reader.index.channels)
        return reader.channels.topic(channel)

    def passages(self) -> Iterable[tuple[int, int]]:
        """What of the file can be passed over, from and to, in bytes, neighbours put together; nothing without an index."""
        index, channels = self._reader.index, self._reader.channels
        if (self._topics is None and self._start is None) or index is None or not index.chunk_count:
            return ()
        try:
            channels.add_all(index.schemas, index.channels)
        except DAMAGE:
            return ()
        if not channels.complete or (index.statistics is not None and index.statistics.channel_count != len(index.channels)):
            return ()  # what describes entries may be in a chunk that would be passed over
        return _merged(self._passages(index))

    def _passages(self, index: LogIndex) -> Iterator[tuple[int, int]]:
        first = 0 if self._start is None else index.first(self._start)
        yield from zip(index.begins[:first], index.behinds[:first], strict=True)
        with self._reader.path.open("rb") as file:
            for chunk in index.chunks(file, first):
                behind = chunk.offset + chunk.length
                if not self._may_hold(chunk):
                    yield chunk.offset, behind + chunk.message_index_length
                elif chunk.message_index_length:
                    wanted = {channel for channel in chunk.channels if self._indexed.get(channel)}
                    self._known[chunk.offset] = behind, chunk.message_index_length, wanted
                    yield behind, behind + chunk.message_index_length
        yield index.begin, index.footer

    def _may_hold(self, chunk: IndexedChunk) -> bool:
        """There may be a wanted entry in a chunk."""
        if self._start is not None and chunk.end < self._start:
            return False
        if self._topics is None or not chunk.places:
            return True
        for channel in chunk.channels:
            if channel not in self._indexed:
                self._indexed[channel] = self.asks_for(self._reader.channels.topic(channel))
        return any(self._indexed[channel] for channel in chunk.channels)

    def places(self, record: RawRecord, data: bytes, file: BinaryIO) -> list[tuple[int, int, int]] | None:
        """Where the wanted entries of a chunk are by its message indexes, as `split_chunk` has it.

        Args:
            record: The chunk.
            data: What it unpacks to.
            file: The log, opened once more.

        Returns:
            None where there are no message indexes, or they contradict the chunk.
        """
        place = self._known.pop(record.offset, None)
        if place is None or self._topics is None or not data:
            return None
        try:
            file.seek(place[0])
            return _places(file.read(min(place[1], 4 * len(data) + _LARGEST_EMPTY_INDEXES)), place[2], data)
        except DAMAGE:
            self._reader.note(f"the message indexes of the chunk at byte {record.offset:,} are wrong, and were not used")
            return None


def _merged(stretches: Iterator[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Stretches of a file, ascending, neighbours put together."""
    begin = end = 0
    for start, stop in stretches:
        if start != end:
            if begin < end:
                yield begin, end
            begin = start
        end = stop
    yield begin, end


def _places(indexes: bytes, wanted: Collection[int], data: bytes) -> list[tuple[int, int, int]] | None:
    """Where entries are in a chunk; None where the indexes do not tell.

    Args:
        indexes: The message index records that follow the chunk.
        wanted: The channels whose entries are wanted, and of which the summary says that they are in the chunk.
        data: What the chunk unpacks to.

    Raises:
        ValueError: They are not where the indexes say.
        struct.error: An index is none.
    """
    found: list[tuple[int, int, int]] = []
    missing = set(wanted)
    at = 0
    while at < len(indexes):
        opcode, length, channel, size = INDEX_HEAD.unpack_from(indexes, at)
        if opcode != Opcode.MESSAGE_INDEX or size + 6 != length:  # with more in it, one bit could take entries out of it
            raise ValueError("no message index")
        if channel in wanted:
            missing.discard(channel)
            begin = at + INDEX_HEAD.size
            found += [_place(data, place, channel, stamp) for stamp, place in iter_unpack("<QQ", indexes[begin : begin + size])]
        at += RECORD_HEAD.size + length
    if missing:  # some writers name indexes that they do not write: the chunk itself tells
        return None
    found.sort()
    return found


def _place(data: bytes, place: int, channel: int, stamp: int) -> tuple[int, int, int]:
    """An entry in a chunk, which is the one that the index means."""
    opcode, length, there, _, log_time = _ENTRY_HEAD.unpack_from(data, place)
    begin = place + RECORD_HEAD.size
    if opcode != Opcode.MESSAGE or there != channel or log_time != stamp or begin + length > len(data):
        raise ValueError("no such entry")
    return opcode, begin, begin + length
