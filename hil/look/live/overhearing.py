"""What is written into a log is overheard: the same entries, before any of them can be read from the file."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple

from hil.mcaplog.reading.decoding import entry_decoder
from hil.mcaplog.reading.reader import LogEntry

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from hil.mcaplog.reading.decoding import Decode
    from hil.mcaplog.schemas import Schema
    from hil.mcaplog.writing.row_encoding import EntryRows
    from hil.mcaplog.writing.sink import LogSink

MOST_WAITING: Final = 200_000
"""Entries that wait to be looked at; the oldest are given up."""


class Overheard(NamedTuple):
    """An entry as it was written.

    Attributes:
        topic: Its topic.
        time: Log time in s.
        data: It, encoded.
        decode: What decodes it.
    """

    topic: str
    time: float
    data: bytes
    decode: Decode

    def entry(self) -> LogEntry:
        """It, decoded."""
        return LogEntry(self.topic, self.time, *self.decode(self.data))


class OverhearingSink:
    """Hands a log's entries on, and keeps those of some topics for somebody to take; a `LogSink`.

    It costs whoever writes a look-up an entry: nothing is decoded here.

    Args:
        sink: Where entries go.
        topics: Topics that are overheard.

    Attributes:
        records: The metadata records so far, by name.
    """

    def __init__(self, sink: LogSink, topics: Collection[str]) -> None:
        self.records: dict[str, Mapping[str, str]] = {}
        self._sink = sink
        self._topics = topics
        self._channels: dict[int, tuple[str, Decode]] = {}
        self._waiting: deque[tuple[int, float, bytes] | EntryRows] = deque(maxlen=MOST_WAITING)
        self.raw_channel = sink.raw_channel
        self.attachment = sink.attachment
        self.flush = sink.flush
        self.close = sink.close
        self.discard = sink.discard

    def take(self) -> list[Overheard]:
        """What was written since this was last called, in order; called by one thread."""
        found: list[Overheard] = []
        waiting, channels = self._waiting, self._channels
        for _ in range(len(waiting)):
            one = waiting.popleft()
            if isinstance(one, tuple):
                channel, time, data = one
                topic, decode = channels[channel]
                found.append(Overheard(topic, time, data, decode))
            else:
                topic, decode = channels[one.channel]
                rows = zip(one.times.tolist(), one.data, strict=True)
                found += [Overheard(topic, time, row.tobytes(), decode) for time, row in rows]
        return found

    def channel(self, topic: str, schema: Schema) -> int:
        """See `LogSink.channel`."""
        number = self._sink.channel(topic, schema)
        if topic in self._topics:
            self._channels[number] = topic, entry_decoder(schema)
        return number

    def write(self, channel: int, time: float, data: bytes) -> None:
        """See `LogSink.write`."""
        self._sink.write(channel, time, data)
        if channel in self._channels:
            self._waiting.append((channel, time, data))

    def write_rows(self, parts: Sequence[EntryRows]) -> None:
        """See `LogSink.write_rows`; of each kind all are overheard together."""
        self._sink.write_rows(parts)
        self._waiting.extend(part for part in parts if part.channel in self._channels and len(part.times))

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """See `LogSink.metadata`."""
        self._sink.metadata(name, values)
        self.records[name] = dict(values)
