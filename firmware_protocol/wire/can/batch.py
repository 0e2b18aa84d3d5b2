"""CAN, many messages at once: what robots say to arrays, and arrays to frames.

Of a chunk all transfers from robots are put together in a few passes over arrays. Those of a node are taken as they are if
all that it has said in this chunk is plain and good: whole transfers of wanted kinds, numbered one after the other, and
nothing left over from before. Everything else of that node, and all that is said to robots, is judged by `CanCodec`, frame by
frame.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.events import Received
from firmware_protocol.messages import (
    BYTE_LINKS_ONLY,
    MESSAGES,
    REFEREE_COMPONENT,
    ROBOT_COMPONENT,
    CommandLong,
    JuniorSensors,
    JuniorWheels,
    RobotAlive,
    RobotSession,
    RobotStatus,
    SwarmMove,
    SwarmSense,
)
from firmware_protocol.wire.batch import Arrivals, Batch, arrivals
from firmware_protocol.wire.can import layout
from firmware_protocol.wire.can.dbc import CanCodec
from firmware_protocol.wire.can.frame import MAX_DATA, RECORD_LENGTH
from firmware_protocol.wire.can.move import NO_FACE
from firmware_protocol.wire.can.transfer import LONG, Long
from firmware_protocol.wire.crc import checksums
from firmware_protocol.wire.fields import Direction
from firmware_protocol.wire.mavlink_layout import crc_extra
from firmware_protocol.wire.rows import ROWS, Rows, check_rows, column, good_rows, messages_of, row_bytes, take_rows

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from firmware_protocol.events import Rejected
    from firmware_protocol.wire.fields import Message

FEW: Final = 80
"""Fewer frames than this in a chunk are done sooner one by one."""

_UP: Final = (layout.REFEREE_UP_FUNCTION, layout.TRANSFER_UP_FUNCTION)
_DIGESTS: Final = (layout.SWITCHES_FUNCTION, layout.EYES_FUNCTION, layout.TRAVEL_FUNCTION)
_OF_REFEREE: Final = 128
"""What is added to a node's number for what stands beside it, which is a sender of its own."""
_SENDERS: Final = 256
_BEYOND: Final = np.array([(1 << 64) - (1 << 8 * length) if length < MAX_DATA else 0 for length in range(_SENDERS)], np.uint64)
"""By length of a frame: the data bytes that must be zero."""
_EXTENDED: Final = 0x7FF
_SEEDS: Final = {number: crc_extra(MESSAGES[number]) for number in LONG}
_FRAMING: Final = layout.TRANSFER_HEAD + layout.TRANSFER_TAIL


def _parts(length: int) -> int:
    """Frames of a transfer whose payload has so many bytes."""
    return -(-(length + _FRAMING) // layout.PART_DATA)


class CanBatchCodec(CanCodec):
    """One node of a CAN bus that takes and gives arrays; as `CanCodec`, it takes and gives objects, too.

    Args:
        system: Own system id: 1 to 127 is the robot of that node, anything greater the host.
        component: Own component id.
        kinds: What is wanted as arrays; everything else comes as objects.
    """

    def __init__(self, *, system: int, component: int, kinds: Iterable[type[Message]]) -> None:
        super().__init__(system=system, component=component)
        self.kinds = frozenset(kinds)
        wanted = [kind for kind in dict.fromkeys(kinds) if kind.DIRECTION is not Direction.DOWN and kind.ID in LONG]
        self._wanted = tuple(wanted)
        self._lengths = np.array([LONG[kind.ID].length for kind in wanted], np.intp)
        self._which = np.full(1 << 16, -1, np.intp)
        for index, kind in enumerate(wanted):
            self._which[kind.ID] = index

    # --- in ----------------------------------------------------------------------------------------------------------

    def receive_batches(self, data: bytes, now: float) -> Arrivals:
        """Take a chunk from the wire.

        Args:
            data: Frames in serial form, 16 bytes each; may be empty.
            now: Stamp of the chunk in s, not before that of the last one.

        Returns:
            What it completed.
        """
        count = len(data) // RECORD_LENGTH
        if count < FEW or not self._wanted:
            events = self.receive(data, now)
            return arrivals({}, events, range(len(events)), self.kinds)
        events = self.flush(now)
        keys = [-1] * len(events)
        records = np.frombuffer(data, np.uint8, count * RECORD_LENGTH).reshape(count, RECORD_LENGTH)
        plain, others = self._find(records)
        for index in others.tolist():
            at = index * RECORD_LENGTH
            self._take_record(data[at : at + RECORD_LENGTH])
            keys += [index] * (len(events) - len(keys))
        if len(data) > count * RECORD_LENGTH:
            self._take_record(data[count * RECORD_LENGTH :])
            keys += [count] * (len(events) - len(keys))
        return self._gather(plain, events, keys)

    def _find(self, records: NDArray[np.uint8]) -> tuple[dict[type[Message], Batch], NDArray[np.intp]]:
        """Look for what is plain and good.

        Returns:
            What was found, each with the number of its last frame as its place; and the numbers of all other frames.
        """
        identifier = records[:, :4].copy().view("<u4").reshape(-1)
        length = records[:, 4]
        content = records[:, 8:].copy().view("<u8").reshape(-1)
        whole = (identifier <= _EXTENDED) & (length <= MAX_DATA) & ~records[:, 5:8].any(axis=1)
        whole &= content & _BEYOND[length] == 0
        function, node = identifier >> layout.FUNCTION_SHIFT, identifier & layout.NODE_MASK
        whole &= node > 0
        up = np.flatnonzero(whole & np.isin(function, _UP))
        sender = np.full(len(records), -1, np.intp)
        sender[up] = node[up] + _OF_REFEREE * (function[up] == layout.REFEREE_UP_FUNCTION)
        odd = np.zeros(_SENDERS, bool)
        odd[node[whole & np.isin(function, _DIGESTS)]] = True
        odd[list(self._digests)] = True
        odd[[self._sender(pending) for pending in self._partials if pending >> layout.FUNCTION_SHIFT in _UP]] = True
        order = up[np.argsort(identifier[up].astype(np.uint16), kind="stable")]
        found = self._transfers_of(records[order], order, identifier[order], sender[order], odd)
        rest = sender < 0
        rest |= odd[sender]
        return found, np.flatnonzero(rest)

    @staticmethod
    def _sender(identifier: int) -> int:
        """Number of who sends under an identifier: the node, or what stands beside it."""
        beside = identifier >> layout.FUNCTION_SHIFT == layout.REFEREE_UP_FUNCTION
        return (identifier & layout.NODE_MASK) + _OF_REFEREE * beside

    def _transfers_of(
        self,
        records: NDArray[np.uint8],
        places: NDArray[np.intp],
        identifier: NDArray[np.uint32],
        sender: NDArray[np.intp],
        odd: NDArray[np.bool_],
    ) -> dict[type[Message], Batch]:
        """Put transfers together.

        Args:
            records: Frames of transfers from robots, those with one identifier together, in order.
            places: Their numbers in the chunk.
            identifier: Their identifiers.
            sender: Who has sent each.
            odd: By sender: something of it is not plain and good. Those that are found to be so are marked.

        Returns:
            What is plain and good, by kind.
        """
        head = records[:, 8]
        part: NDArray[np.uint8] = head & np.uint8(layout.PART_MASK)
        number: NDArray[np.uint8] = head >> np.uint8(layout.PART_BITS)
        first = np.flatnonzero(part == 0)
        if not len(first):
            odd[sender] = True
            return {}
        of = np.searchsorted(first, np.arange(len(records)), side="right") - 1
        kind = self._which[records[first, 9] | records[first, 10].astype(np.uint16) << 8]
        size = self._lengths[kind] + _FRAMING
        parts = -(-size // layout.PART_DATA)
        fits = (kind >= 0) & (records[first, 11] == self._lengths[kind])
        fits &= (kind != self._which[RobotStatus.ID]) | (sender[first] < _OF_REFEREE)  # its time is the robot's
        nth = np.arange(len(records)) - first[of]
        good = (of >= 0) & (identifier == identifier[first[of]]) & (part == nth) & (number == number[first[of]])
        good &= fits[of] & (nth < parts[of])
        good &= records[:, 4] == 1 + np.minimum(layout.PART_DATA, size[of] - layout.PART_DATA * nth)
        odd[sender[~good]] = True
        fits &= np.bincount(of[good], minlength=len(first)) == parts
        odd[sender[first[~fits]]] = True
        begins, position, expected = self._numbering_of(identifier[first], number[first])
        odd[sender[first[number[first] != expected]]] = True
        rows: dict[int, tuple[NDArray[np.intp], Rows]] = {}
        for index, message in enumerate(self._wanted):
            chosen = np.flatnonzero((kind == index) & ~odd[sender[first]])
            if chosen.size:
                made, passed = self._rows(message, records, first[chosen], identifier)
                odd[sender[first[chosen[~passed]]]] = True
                rows[index] = chosen, made
        kept = ~odd[sender[first]]
        sequence = self._count(identifier[first], number[first], begins, position, kept)
        batches: dict[type[Message], Batch] = {}
        for index, (chosen, made) in rows.items():
            good_ones = kept[chosen]
            these = chosen[good_ones]
            if these.size:
                who = sender[first[these]]
                component = np.where(who < _OF_REFEREE, ROBOT_COMPONENT, REFEREE_COMPONENT).astype(np.uint8)
                last = places[first[these] + parts[these] - 1]
                said = made if good_ones.all() else take_rows(made, np.flatnonzero(good_ones))
                node = (who & layout.NODE_MASK).astype(np.uint8)
                message, time = self._wanted[index], np.full(len(these), self._now)
                batches[message] = Batch(message, said, node, component, sequence[these], time, last)
        return batches

    def _numbering_of(
        self, identifier: NDArray[np.uint32], number: NDArray[np.uint8]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """The numbers that transfers should have.

        Args:
            identifier: Of each transfer, those with one together.
            number: That each has.

        Returns:
            Where each identifier begins; how many transfers of its identifier are before each; the number that it should have.
        """
        begins = np.flatnonzero(np.append(True, identifier[1:] != identifier[:-1]))
        runs = np.diff(np.append(begins, len(identifier)))
        position = np.arange(len(identifier)) - np.repeat(begins, runs)
        pairs = zip(identifier[begins].tolist(), number[begins].tolist(), strict=True)
        next_ones = np.array([self._next.get(one, own) for one, own in pairs])
        return begins, position, (np.repeat(next_ones, runs) + position) % layout.TRANSFERS

    def _rows(
        self, message: type[Message], records: NDArray[np.uint8], first: NDArray[np.intp], identifier: NDArray[np.uint32]
    ) -> tuple[Rows, NDArray[np.bool_]]:
        """Whole transfers of one kind: their rows, and which of them are good."""
        known = LONG[message.ID]
        size = known.length + _FRAMING
        parts = records[first[:, None] + np.arange(_parts(known.length))]
        data = parts[:, :, 9:].reshape(len(first), -1)[:, :size]
        covered = size - layout.TRANSFER_TAIL
        crc = checksums(data[:, :covered], np.full(len(first), covered), _SEEDS[message.ID])
        good = crc == (data[:, covered] | data[:, covered + 1].astype(np.uint16) << 8)
        full = np.zeros((len(first), ROWS[message].itemsize), np.uint8)
        payload, cut = data[:, layout.TRANSFER_HEAD : covered], known.start + known.cut
        full[:, : known.start] = payload[:, : known.start]
        full[:, cut:] = payload[:, known.start :]
        targets = self._targets(int(identifier[first[0]]))
        full[:, known.start : cut] = tuple(targets[: known.cut])
        rows: Rows = full.view(ROWS[message]).reshape(-1)
        return rows, good & good_rows(message, rows)

    def _count(
        self,
        identifier: NDArray[np.uint32],
        number: NDArray[np.uint8],
        begins: NDArray[np.intp],
        position: NDArray[np.intp],
        kept: NDArray[np.bool_],
    ) -> NDArray[np.uint8]:
        """Count transfers that are taken, as `CanCodec` does; returns the sequence number of each."""
        sequence = position.copy()
        ends = np.append(begins[1:], len(identifier)).tolist()
        ones, taken = identifier[begins].tolist(), kept[begins].tolist()
        for begin, end, one, good in zip(begins.tolist(), ends, ones, taken, strict=True):
            if good:
                count = end - begin
                beside = one >> layout.FUNCTION_SHIFT == layout.REFEREE_UP_FUNCTION
                who = (one & layout.NODE_MASK, REFEREE_COMPONENT if beside else ROBOT_COMPONENT)
                before = self._counts.get(who, 0)
                sequence[begin:end] += before
                self._counts[who] = before + count
                self._next[one] = (int(number[begin]) + count) % layout.TRANSFERS
                self.good += count
        return (sequence & 0xFF).astype(np.uint8)

    def _take_clocks(self, status: Batch, events: list[Received | Rejected], keys: list[int]) -> None:
        """Know each robot's clock by what came last of it, be that among the arrays or an object."""
        told = {
            event.system: key
            for key, event in zip(keys, events, strict=True)
            if isinstance(event, Received) and isinstance(event.message, RobotStatus | JuniorSensors)
        }
        times = column(RobotStatus, status.rows, "time").tolist()
        for node, time, end in zip(status.system.tolist(), times, status.place.tolist(), strict=True):
            if end > told.get(node, -1):
                self._times[node] = round(time * 1000)

    def _gather(self, found: dict[type[Message], Batch], events: list[Received | Rejected], keys: list[int]) -> Arrivals:
        """Put what was found in the order in which its last frames came.

        Args:
            found: As arrays, each with the number of its last frame as its place.
            events: As objects.
            keys: The number of the frame after which each of these was known.
        """
        status = found.get(RobotStatus)
        if status is not None:
            self._take_clocks(status.ordered(), events, keys)
        ends = np.concatenate([np.array(keys, np.intp), *(batch.place for batch in found.values())])
        place = np.empty(len(ends), np.intp)
        place[np.argsort(ends, kind="stable")] = np.arange(len(ends))
        at = len(keys)
        batches: dict[type[Message], Batch] = {}
        for kind, batch in found.items():
            after = at + len(batch.place)
            batches[kind] = replace(batch, place=place[at:after]).ordered()
            at = after
        return arrivals(batches, events, place[: len(keys)].tolist(), self.kinds)

    # --- out ---------------------------------------------------------------------------------------------------------

    def encode_batch(self, message: type[Message], rows: Rows) -> bytes:
        """Frames of many messages of one kind; a transfer takes the next number.

        Args:
            message: Their class.
            rows: The messages, in wire units.

        Returns:
            The frames in serial form, as `encode` makes them of the objects.

        Raises:
            EncodeError: The wire can't carry one of them, or they are rows of something else.
        """
        check_rows(message, rows)
        known = LONG.get(message.ID)
        names = ROWS[message].names or ()
        addressed = "target_system" in names and "target_component" in names
        if self._is_node or known is None or known.direction is Direction.UP or not addressed or message in _SPECIAL:
            return b"".join([self.encode(each) for each in messages_of(message, rows)])
        node, component = rows["target_system"], rows["target_component"]
        beside = component == REFEREE_COMPONENT
        nowhere = (node > layout.LAST_NODE) | ~(beside | (component <= ROBOT_COMPONENT))
        if nowhere.any():  # it says why
            self.encode(messages_of(message, rows[nowhere][:1])[0])
        if message in {RobotSession, SwarmSense}:
            for to, each in zip(node[~beside].tolist(), messages_of(message, rows[~beside]), strict=True):
                self._remember(to, each)
        function = np.where(beside, layout.REFEREE_DOWN_FUNCTION, layout.TRANSFER_DOWN_FUNCTION)
        single = self._single(rows) & ~beside if message is SwarmMove else np.zeros(len(rows), bool)
        if single.all():
            return _moves(rows).tobytes()
        identifier = (function << layout.FUNCTION_SHIFT | node)[~single]
        frames = self._cut_all(known, rows[~single], identifier)
        if not single.any():
            return frames.tobytes()
        cut, moves = iter(frames), iter(_moves(rows[single]))
        return b"".join([next(moves if alone else cut).tobytes() for alone in single.tolist()])

    def _single(self, rows: Rows) -> NDArray[np.bool_]:
        """Which moves are single frames."""
        told = np.array([self._sectors.get(node, 0) for node in range(layout.LAST_NODE + 1)])[rows["target_system"]]
        sector, sectors = rows["sector"], rows["sectors"]
        single = (rows["face"] == NO_FACE) & (rows["speed"] == 0) & (rows["effort"] == 0)
        fits: NDArray[np.bool_] = single & np.where(sector > 0, (told > 0) & (sectors == told), sectors == 0)
        return fits

    def _cut_all(self, known: Long, rows: Rows, identifier: NDArray[np.intp]) -> NDArray[np.uint8]:
        """Transfers with the next numbers: shape (transfers, frames of each, 16)."""
        size, count = known.length + _FRAMING, _parts(known.length)
        data = np.zeros((len(rows), count * layout.PART_DATA), np.uint8)
        body, cut = row_bytes(rows), known.start + known.cut
        data[:, : layout.TRANSFER_HEAD] = (known.message.ID & 0xFF, known.message.ID >> 8, known.length)
        data[:, layout.TRANSFER_HEAD : layout.TRANSFER_HEAD + known.start] = body[:, : known.start]
        covered = size - layout.TRANSFER_TAIL
        data[:, layout.TRANSFER_HEAD + known.start : covered] = body[:, cut:]
        crc = checksums(data[:, :covered], np.full(len(rows), covered), _SEEDS[known.message.ID])
        data[:, covered], data[:, covered + 1] = crc & 0xFF, crc >> 8
        numbers = np.zeros(len(rows), np.uint8)
        for index, one in enumerate(identifier.tolist()):
            numbers[index] = number = self._transfers.get(one, 0)
            self._transfers[one] = (number + 1) % layout.TRANSFERS
        frames = np.zeros((len(rows), count, RECORD_LENGTH), np.uint8)
        frames[:, :, 0], frames[:, :, 1] = (identifier & 0xFF)[:, None], (identifier >> 8)[:, None]
        frames[:, :, 4] = MAX_DATA
        frames[:, -1, 4] = 1 + size - (count - 1) * layout.PART_DATA
        frames[:, :, 8] = (numbers << layout.PART_BITS)[:, None] | np.arange(count, dtype=np.uint8)
        frames[:, :, 9:] = data.reshape(len(rows), count, layout.PART_DATA)
        return frames


_SPECIAL: Final = frozenset({JuniorWheels, RobotAlive, CommandLong, *BYTE_LINKS_ONLY})
"""What has single frames of its own, beside moves."""
_MOVE_RECORD: Final = np.dtype(
    [
        ("identifier", "<u4"), ("length", "u1"), ("padding", "V3"), ("sequence", "<u2"), ("heading", "<i2"),
        ("distance", "<u2"), ("sector", "u1"), ("options", "u1"),
    ]
)  # fmt: skip


def _moves(rows: Rows) -> NDArray[np.void]:
    """Moves as single frames."""
    frames = np.zeros(len(rows), _MOVE_RECORD)
    frames["identifier"] = layout.MOVE_FUNCTION << layout.FUNCTION_SHIFT | rows["target_system"].astype(np.uint32)
    frames["length"] = MAX_DATA
    for name in ("sequence", "heading", "distance", "sector", "options"):
        frames[name] = rows[name]
    return frames
