"""MAVLink 2, many messages at once: chunks to arrays and arrays to frames.

Of a chunk every marker with a possible header behind it is looked at, the checksums of all these frames and the ranges of all
their fields, in a few passes over arrays. A run of good frames is then taken as it is; what is not plain and good - damage, a
signature, a message that is not wanted as an array, what goes on in the next chunk - is judged by `MavlinkCodec` in its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import MESSAGES
from firmware_protocol.wire.batch import Arrivals, Batch, arrivals
from firmware_protocol.wire.crc import checksums
from firmware_protocol.wire.mavlink import SILENCE, MavlinkCodec
from firmware_protocol.wire.mavlink_layout import CHECKSUM_LENGTH, HEADER_LENGTH, MARKER, crc_extra
from firmware_protocol.wire.payload import PAYLOADS
from firmware_protocol.wire.rows import ROWS, Rows, check_rows, good_rows, row_bytes, take_rows

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from firmware_protocol.events import Received, Rejected
    from firmware_protocol.wire.fields import Message

FEW: Final = 50
"""Fewer frames than this in a chunk are done sooner one by one."""

_AROUND: Final = HEADER_LENGTH + CHECKSUM_LENGTH
_COVERED: Final = HEADER_LENGTH - 1
"""Bytes of the header that the checksum covers: all but the marker."""
_SHORTEST: Final = _AROUND + 1
_PADDING: Final = bytes(HEADER_LENGTH + max(payload.length for payload in PAYLOADS.values()) + CHECKSUM_LENGTH)
"""Behind a chunk, so that a whole row can be read at any marker in it."""

_SEEDS: Final = {message: crc_extra(message) for message in MESSAGES.values()}
_KEPT: Final = {
    payload.length: np.tri(payload.length + 1, payload.length + _COVERED, _COVERED - 1, np.uint8)
    for payload in PAYLOADS.values()
}
"""By length of a row: by length of a frame's payload, 1 for the bytes that are in the frame."""


@dataclass(frozen=True)
class _Plain:
    """The frames of a chunk that are plain and good, wherever they stand, in order of their first byte.

    Attributes:
        start: Where each begins.
        after: Where the next would begin.
        last: The last one of the run that each is in: they follow one another without a gap.
        kind: Which of the wanted kinds each is.
        of_kind: Which of them are of each kind.
        row: Which row of its kind each is.
        header: Its header, shape (frames, 10).
        rows: The rows of each kind.
    """

    start: NDArray[np.intp]
    after: NDArray[np.intp]
    last: NDArray[np.intp]
    kind: NDArray[np.intp]
    of_kind: list[NDArray[np.intp]]
    row: NDArray[np.intp]
    header: NDArray[np.uint8]
    rows: list[Rows]


class MavlinkBatchCodec(MavlinkCodec):
    """One end of one MAVLink 2 connection that takes and gives arrays; as `MavlinkCodec`, it takes and gives objects, too.

    Args:
        system: Own system id, 1 to 255.
        component: Own component id.
        kinds: What is wanted as arrays; everything else comes as objects.
    """

    def __init__(self, *, system: int, component: int, kinds: Iterable[type[Message]]) -> None:
        super().__init__(system=system, component=component)
        self._wanted = tuple(dict.fromkeys(kinds))
        self.kinds = frozenset(self._wanted)
        self._lengths = np.array([ROWS[kind].itemsize for kind in self._wanted], np.intp)
        self._which = np.full(1 << 16, -1, np.intp)
        for index, kind in enumerate(self._wanted):
            self._which[kind.ID] = index

    def receive_batches(self, data: bytes, now: float) -> Arrivals:
        """Take a chunk from the wire.

        Args:
            data: Bytes as they came; may be empty.
            now: Stamp of the chunk in s, not before that of the last one.

        Returns:
            What it completed.
        """
        events = self.flush(now) if now - self._stamp > SILENCE else []
        if not data:
            return arrivals({}, events, range(len(events)), self.kinds, _payload)
        self._stamp = now
        data = self._buffer + data if self._buffer else bytes(data)
        plain = self._find(data)
        if plain is None:
            self._take_in(data, events)
            return arrivals({}, events, range(len(events)), self.kinds, _payload)
        return self._walk(data, plain, events, now)

    def _find(self, data: bytes) -> _Plain | None:
        """Look for plain and good frames of the wanted kinds anywhere in a chunk; None where there are few."""
        room = len(data) - _SHORTEST + 1
        if room < FEW * _SHORTEST or not self._wanted:
            return None
        padded = np.frombuffer(data + _PADDING, np.uint8)
        start = np.flatnonzero(padded[:room] == MARKER)
        header = _read(padded, start, HEADER_LENGTH)
        kind = self._which[header[:, 7] | header[:, 8].astype(np.uint16) << 8]
        length = header[:, 1].astype(np.intp)
        sane = (kind >= 0) & (header[:, 9] == 0) & (header[:, 2] == 0) & (length > 0)
        sane &= (length <= self._lengths[kind]) & (start + length + _AROUND <= len(data))
        chosen = np.flatnonzero(sane)
        if len(chosen) < FEW:
            return None
        if len(chosen) < len(start):
            start, header, kind, length = start[chosen], header[chosen], kind[chosen], length[chosen]
        good = np.zeros(len(start), bool)
        row = np.zeros(len(start), np.intp)
        rows: list[Rows] = []
        of_kind = [np.flatnonzero(kind == index) for index in range(len(self._wanted))]
        for message, these in zip(self._wanted, of_kind, strict=True):
            found, good[these] = _judge(message, padded, start[these], length[these])
            row[these] = np.arange(len(these))
            rows.append(found)
        if not good.all():
            kept = np.flatnonzero(good)
            start, header, kind, length, row = start[kept], header[kept], kind[kept], length[kept], row[kept]
            of_kind = [np.flatnonzero(kind == index) for index in range(len(self._wanted))]
        after = start + length + _AROUND
        return _Plain(start, after, _ends_of_runs(start, after), kind, of_kind, row, header, rows)

    def _walk(self, data: bytes, plain: _Plain, events: list[Received | Rejected], now: float) -> Arrivals:
        """Go through a chunk from run to run, and through what is between them step by step."""
        at, end, place = 0, len(data), len(events)
        places = list(range(place))
        taken: list[tuple[int, int, int]] = []
        known, limit = 0, len(plain.start)
        while at < end:
            if known < limit and plain.start[known] < at:
                known = int(np.searchsorted(plain.start, at))
            if known < limit and plain.start[known] == at:
                if self._junk:
                    self._report(events)
                    places.append(place)
                    place += 1
                last = int(plain.last[known])
                taken.append((known, last + 1, place))
                place += last + 1 - known
                at = int(plain.after[last])
                continue
            before = len(events)
            used = self._step(data, at, events, final=False)
            if not used:
                break
            at += used
            told = len(events) - before
            places.extend(range(place, place + told))
            place += told
        self._buffer = data[at:]
        return arrivals(self._batches(plain, taken, now), events, places, self.kinds, _payload)

    def _batches(self, plain: _Plain, taken: list[tuple[int, int, int]], now: float) -> dict[type[Message], Batch]:
        """The frames of the runs that were taken, by kind.

        Args:
            plain: The frames there are.
            taken: Of each run the first, the one after the last, and the place of the first.
            now: Stamp of the chunk, in s.
        """
        count = sum(after - first for first, after, _ in taken)
        self.good += count
        place = np.full(len(plain.start), -1, np.intp)
        for first, after, at in taken:
            place[first:after] = np.arange(at, at + after - first)
        batches: dict[type[Message], Batch] = {}
        for message, rows, of_kind in zip(self._wanted, plain.rows, plain.of_kind, strict=True):
            these = of_kind if count == len(place) else of_kind[place[of_kind] >= 0]
            if these.size:
                said = rows if these.size == len(rows) else take_rows(rows, plain.row[these])
                head = plain.header[these]
                time = np.full(len(these), now)
                batches[message] = Batch(message, said, head[:, 5], head[:, 6], head[:, 4], time, place[these])
        return batches

    def encode_batch(self, message: type[Message], rows: Rows) -> bytes:
        """Frames of many messages of one kind; the frame sequence number goes up by one for each.

        Args:
            message: Their class.
            rows: The messages, in wire units.

        Returns:
            Whole MAVLink 2 frames, one after the other, as `encode` makes them of the objects.

        Raises:
            EncodeError: The wire can't carry one of them, or they are rows of something else. Nothing has changed then.
        """
        check_rows(message, rows)
        if not len(rows):
            return b""
        width, number = ROWS[message].itemsize, message.ID
        body = row_bytes(rows)
        filled = body[:, ::-1] != 0
        length = np.where(filled.any(axis=1), width - filled.argmax(axis=1), 1).astype(np.intp)
        frames = np.zeros((len(rows), width + _AROUND), np.uint8)
        header = frames[:, :HEADER_LENGTH]
        header[:] = (MARKER, 0, 0, 0, 0, self.system, self.component, number & 0xFF, number >> 8 & 0xFF, number >> 16)
        header[:, 1] = length
        header[:, 4] = np.arange(self.sequence, self.sequence + len(rows)) & 0xFF
        frames[:, HEADER_LENGTH:-CHECKSUM_LENGTH] = body
        crc = checksums(frames[:, 1:-CHECKSUM_LENGTH], length + _COVERED, _SEEDS[message])
        each, tail = np.arange(len(rows)), length + HEADER_LENGTH
        frames[each, tail] = crc & 0xFF
        frames[each, tail + 1] = crc >> 8
        self.sequence = (self.sequence + len(rows)) & 0xFF
        return frames[np.arange(frames.shape[1]) < (length + _AROUND)[:, None]].tobytes()


def _payload(event: Received) -> bytes:
    """The payload of a frame, zeros at its end trimmed."""
    return event.raw[HEADER_LENGTH : HEADER_LENGTH + event.raw[1]]


def _read(padded: NDArray[np.uint8], start: NDArray[np.intp], width: int) -> NDArray[np.uint8]:
    """So many bytes from each of these places of a chunk, shape (places, width)."""
    everywhere = np.ndarray((len(padded) - width + 1,), np.dtype((np.void, width)), padded.data, strides=(1,))
    return everywhere[start].view(np.uint8).reshape(len(start), width)


def _judge(
    message: type[Message], padded: NDArray[np.uint8], start: NDArray[np.intp], length: NDArray[np.intp]
) -> tuple[Rows, NDArray[np.bool_]]:
    """Frames with sane headers of one kind: their rows, and which of them are good."""
    if not len(start):
        return np.zeros(0, ROWS[message]), np.zeros(0, bool)
    width = ROWS[message].itemsize
    block = _read(padded, start + 1, _COVERED + width)
    if (length != width).any():
        block *= _KEPT[width][length]
    crc = checksums(block, length + _COVERED, _SEEDS[message])
    tail = start + length + HEADER_LENGTH
    good = crc == (padded[tail] | padded[tail + 1].astype(np.uint16) << 8)
    rows: Rows = np.ascontiguousarray(block[:, _COVERED:]).view(ROWS[message]).reshape(-1)
    good &= good_rows(message, rows)
    return rows, good


def _ends_of_runs(start: NDArray[np.intp], after: NDArray[np.intp]) -> NDArray[np.intp]:
    """For each frame the last one of those that follow it, and one another, without a gap."""
    if (start[1:] == after[:-1]).all():
        return np.full(len(start), len(start) - 1)
    breaks = np.flatnonzero(np.append(start[1:] != after[:-1], True))
    return breaks[np.searchsorted(breaks, np.arange(len(start)))]
