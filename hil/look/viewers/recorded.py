"""A log's entries in the order of their time, at hand from any moment on."""

from __future__ import annotations

import tempfile
from array import array
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

import numpy as np

from hil.mcaplog.errors import UnreadableLogError
from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.reading.reader import LogReader

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

IN_MEMORY: Final = 64 << 20
"""Entries of so many bytes are kept in memory; those of a larger log go into a temporary file."""


class Described(NamedTuple):
    """A channel of a log.

    Attributes:
        topic: Its topic.
        encoding: How its entries are encoded.
        schema_name: What they look like; empty where the log does not say.
        schema_encoding: How that is written.
        schema: It.
    """

    topic: str
    encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes


class RecordedEntries:
    """The entries of a log, read once, by their time: a log's own order is that in which they were written.

    Args:
        path: The log, also one that was cut off.
        limits: What it may unpack to.

    Attributes:
        channels: The channels, by number.
        times: Log time of each entry in ns, ascending; shape (n,).
        numbers: Channel of each entry; shape (n,).
        health: What is wrong with the log, in words.

    Raises:
        UnreadableLogError: There are no entries that could be had.
        LogError: The log cannot be opened.
    """

    channels: dict[int, Described]

    def __init__(self, path: Path, limits: ReadLimits = ReadLimits()) -> None:  # noqa: B008 - frozen
        self.channels = {}
        self._file = tempfile.SpooledTemporaryFile(IN_MEMORY)  # noqa: SIM115 - closed by `close`
        times, numbers, begins = array("Q"), array("H"), array("Q", [0])
        reader = LogReader(path, limits)
        for entry in reader.raw_entries():
            if entry.channel not in self.channels:
                described = reader.channels.described(entry.channel)
                if described is None:
                    reader.count_unread(entry, "the log does not describe it")
                    continue
                self.channels[entry.channel] = _described(*described)
            times.append(entry.log_time)
            numbers.append(entry.channel)
            begins.append(begins[-1] + len(entry.data))
            self._file.write(entry.data)
        self.health = "" if reader.whole else reader.health()
        if not times:
            self.close()
            raise UnreadableLogError(f"no entry could be had of the log {path}: it is {reader.health(most=1)}")
        order = np.argsort(np.frombuffer(times, np.uint64), kind="stable")
        self.times: NDArray[np.uint64] = np.frombuffer(times, np.uint64)[order]
        self.numbers: NDArray[np.uint16] = np.frombuffer(numbers, np.uint16)[order]
        ends = np.frombuffer(begins, np.uint64).astype(np.int64)
        self._begins, self._sizes = ends[:-1][order], np.diff(ends)[order]
        self._places = {number: np.flatnonzero(self.numbers == number) for number in self.channels}

    def __len__(self) -> int:
        return len(self.times)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the entries up."""
        self._file.close()

    @property
    def begin(self) -> int:
        """Log time of the first entry, in ns."""
        return int(self.times[0])

    @property
    def end(self) -> int:
        """Log time of the last entry, in ns."""
        return int(self.times[-1])

    def data(self, place: int) -> bytes:
        """An entry's data.

        Args:
            place: Which, from 0.
        """
        self._file.seek(int(self._begins[place]))
        return self._file.read(int(self._sizes[place]))

    def first_after(self, time: int) -> int:
        """Place of the first entry that is later than a time.

        Args:
            time: Log time in ns.
        """
        return int(np.searchsorted(self.times, np.uint64(max(0, time)), side="right"))

    def last_before(self, place: int, number: int | None = None) -> list[int]:
        """Places of the last entry of every channel before a place, ascending; without channels that have none.

        Args:
            place: Entries from this one on do not count.
            number: Of this channel alone.
        """
        wanted = self._places if number is None else {number: self._places[number]}
        counts = ((places, int(np.searchsorted(places, place))) for places in wanted.values())
        return sorted(int(places[count - 1]) for places, count in counts if count)


def _described(channel: Any, schema: Any) -> Described:  # noqa: ANN401 - as MCAP's library has them
    if schema is None:
        return Described(channel.topic, channel.message_encoding, "", "", b"")
    return Described(channel.topic, channel.message_encoding, schema.name, schema.encoding, schema.data)
