"""What is in a log, in figures: by its index where it has one, by its entries where it has none."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from mcap.records import Channel
from mcap.records import Schema as SchemaRecord

from hil.mcaplog.limits import LARGEST_METADATA, MIB, ReadLimits
from hil.mcaplog.reading.reader import MESSAGE_HEAD, LogReader
from hil.mcaplog.reading.unpacking import DAMAGE, RECORD_HEAD, stream
from hil.mcaplog.reading.walking import read_metadata
from hil.mcaplog.records import EVENTS, SERIES, EventRecord
from hil.mcaplog.schemas import RENAMED_TOPICS
from hil.mcaplog.writing.writer import SIZES

if TYPE_CHECKING:
    from pathlib import Path

    from mcap.records import Statistics

    from hil.mcaplog.reading.index import LogIndex

MESSAGE_SIZE: Final = RECORD_HEAD.size + MESSAGE_HEAD.size
"""Of an entry's record without its data, in bytes."""
_LOOKED_AT: Final = 8 * MIB
"""Of a log so large that its events are not all looked at: bytes at its beginning, and at its end."""
_MOST_METADATA: Final = 1000


@dataclass
class TopicOverview:
    """A topic.

    Attributes:
        topic: Its name.
        schema: Name of its schema; empty where it has none.
        entries: How many there are.
        size: Bytes of their records before compression; None where that is not known.
    """

    topic: str
    schema: str = ""
    entries: int = 0
    size: int | None = None


@dataclass
class LogOverview:
    """What is in a log.

    Attributes:
        path: The log.
        size: Its size in bytes.
        whole: Nothing is wrong with it, as far as was looked.
        health: What state it is in, in words.
        indexed: It has an index, and the figures are the index's.
        start: Log time of the first entry, in s.
        end: Of the last.
        topics: Its topics, by name.
        series: Log times in s and titles of the series of bouts in it.
        all_series: The log was small enough for all of its events to be looked at.
        metadata: Its metadata, by name.
        attachments: Media type and size in bytes of its attachments, by name.
    """

    path: Path
    size: int
    whole: bool = True
    health: str = ""
    indexed: bool = False
    start: float = 0.0
    end: float = 0.0
    topics: list[TopicOverview] = field(default_factory=list)
    series: list[tuple[float, str]] = field(default_factory=list)
    all_series: bool = True
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, tuple[str, int]] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """Log time from the first entry to the last, in s."""
        return self.end - self.start

    @property
    def entries(self) -> int:
        """Entries of all topics."""
        return sum(topic.entries for topic in self.topics)


def overview(path: Path, limits: ReadLimits = ReadLimits(), *, sizes: bool = False) -> LogOverview:  # noqa: B008 - frozen
    """Look what is in a log.

    Args:
        path: The log.
        limits: What it may unpack to.
        sizes: Find out how large each topic is, even if all has to be read for it.

    Returns:
        What is in it, up to damage.

    Raises:
        LogError: It cannot be opened, is not a log, or nothing of it could be read.
    """
    reader = LogReader(path, limits)
    found = _by_index(reader)
    if found is None or (sizes and any(topic.size is None for topic in found.topics)):
        return _by_entries(reader)
    _read_series(reader, found)
    return found


def _by_index(reader: LogReader) -> LogOverview | None:
    index = reader.index
    if index is None or index.statistics is None or index.statistics.channel_count != len(index.channels):
        return None
    found = LogOverview(reader.path, reader.size, health=f"whole, {reader.size:,} bytes", indexed=True)
    try:
        found.topics = _topics(index, index.statistics)
        _read_metadata(reader, index, found)
    except DAMAGE:
        return None
    found.start, found.end = index.statistics.message_start_time / 1e9, index.statistics.message_end_time / 1e9
    found.attachments = {one.name: (one.media_type, one.data_size) for one in index.attachments}
    _read_sizes(found)
    return found


def _topics(index: LogIndex, statistics: Statistics) -> list[TopicOverview]:
    schemas = {schema.id: schema.name for schema in (SchemaRecord.read(stream(content)) for content in index.schemas)}
    topics: dict[str, TopicOverview] = {}
    for content in index.channels:
        channel = Channel.read(stream(content))
        name = RENAMED_TOPICS.get(channel.topic, channel.topic)
        topic = topics.setdefault(name, TopicOverview(name, schemas.get(channel.schema_id, "")))
        topic.entries += statistics.channel_message_counts.get(channel.id, 0)
    return [topics[name] for name in sorted(topics)]


def _read_metadata(reader: LogReader, index: LogIndex, found: LogOverview) -> None:
    with reader.path.open("rb") as file:
        for place in index.metadata[:_MOST_METADATA]:
            if place.length > LARGEST_METADATA:
                continue
            file.seek(place.offset + RECORD_HEAD.size)
            name, values = read_metadata(file.read(place.length - RECORD_HEAD.size))
            found.metadata[name] = values


def _read_sizes(found: LogOverview) -> None:
    """Take the sizes that the log itself gives, where they are numbers."""
    told = found.metadata.get(SIZES, {})
    for topic in found.topics:
        text = told.get(topic.topic, "")
        if text.isascii() and text.isdigit() and len(text) < 20:
            topic.size = int(text)


def _read_series(reader: LogReader, found: LogOverview) -> None:
    """Read the titles of series from the events: all of them, or of a large log those at its two ends."""
    found.all_series = reader.size <= 2 * _LOOKED_AT
    for entry in reader.entries([EVENTS]):
        if not found.all_series and reader.bytes_read > _LOOKED_AT:
            break
        _take_event(found, entry.time, entry.value)
    if not found.all_series:
        late = _time_near_the_end(reader)
        for entry in reader.entries([EVENTS], start=late):
            _take_event(found, entry.time, entry.value)


def _time_near_the_end(reader: LogReader) -> float:
    """Log time from which on the end of a large log is looked at, in s."""
    index = reader.index
    if index is None or not index.begins:
        return 0.0
    return index.ends[max(0, bisect_left(index.begins, index.begin - _LOOKED_AT) - 1)] / 1e9


def _take_event(found: LogOverview, time: float, value: object) -> None:
    if isinstance(value, EventRecord) and value.kind == SERIES and (time, value.text) not in found.series[-1:]:
        found.series.append((time, value.text))


def _by_entries(reader: LogReader) -> LogOverview:
    found = LogOverview(reader.path, reader.size)
    topics: dict[str, TopicOverview] = {}
    span: tuple[int, int] | None = None
    for entry in reader.raw_entries():
        topic = topics.get(entry.topic)
        if topic is None:
            schema = reader.channels.schema(entry.channel)
            topic = topics[entry.topic] = TopicOverview(entry.topic, schema.name if schema else "", size=0)
        topic.entries += 1
        topic.size = (topic.size or 0) + MESSAGE_SIZE + len(entry.data)
        span = (min(entry.log_time, span[0]), max(entry.log_time, span[1])) if span else (entry.log_time, entry.log_time)
        if entry.topic == EVENTS:
            _take_event(found, entry.log_time / 1e9, reader.decoded(entry))
    reader.require_something()
    found.whole, found.health = reader.whole, reader.health()
    found.metadata = dict(reader.metadata)
    found.attachments = {name: (one.media_type, len(one.data)) for name, one in reader.attachments.items()}
    found.topics = [topics[name] for name in sorted(topics)]
    first, last = span or (0, 0)
    found.start, found.end = first / 1e9, last / 1e9
    return found
