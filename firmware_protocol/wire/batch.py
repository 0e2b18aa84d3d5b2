"""Many messages at once: what a chunk brings as arrays, one for each kind of message, whatever the wire.

What is plain and good is found by looking at the whole chunk at once. Everything else is judged by the codec of objects, in
its place, so that there is one truth for what is refused and why. What comes out is what that codec would have said, in the
same order.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np

from firmware_protocol.events import Received, Rejected
from firmware_protocol.wire.payload import PAYLOADS
from firmware_protocol.wire.rows import Rows, messages_of, rows_of_payloads, take_rows

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from firmware_protocol.wire.fields import Message


@dataclass(frozen=True)
class Batch:
    """Good messages of one kind that have come in one chunk, in the order in which they came.

    Attributes:
        message: Their class.
        rows: The messages, in wire units: `firmware_protocol.wire.rows` makes columns of them.
        system: System id of each sender.
        component: Component id of each sender.
        sequence: Frame sequence number of each, 0..255.
        time: Stamp of the chunk that completed each, in s: an earlier one's where it had been held back.
        place: Which of all events of the chunk each is, from 0.
    """

    message: type[Message]
    rows: Rows
    system: NDArray[np.uint8]
    component: NDArray[np.uint8]
    sequence: NDArray[np.uint8]
    time: NDArray[np.float64]
    place: NDArray[np.intp]

    def ordered(self) -> Batch:
        """The same, by place."""
        return self.part(np.argsort(self.place))

    def part(self, these: NDArray[np.intp]) -> Batch:
        """Some of them.

        Args:
            these: Their numbers in the batch.
        """
        return Batch(
            self.message,
            take_rows(np.ascontiguousarray(self.rows), these),
            self.system[these],
            self.component[these],
            self.sequence[these],
            self.time[these],
            self.place[these],
        )

    def objects(self) -> list[tuple[int, Received]]:
        """Each as an object, without the frame as it came, and its place."""
        columns = (self.system, self.component, self.sequence, self.time, self.place)
        plain = zip(*(column.tolist() for column in columns), strict=True)
        return [
            (place, Received(message, system, component, sequence, time, b""))
            for message, (system, component, sequence, time, place) in zip(
                messages_of(self.message, self.rows), plain, strict=True
            )
        ]


@dataclass(frozen=True)
class Arrivals:
    """What a chunk has brought.

    Attributes:
        batches: What was wanted as arrays, by class; a kind of which nothing has come is not there.
        events: The rest: other messages, and what was refused.
        places: Which of all events of the chunk each of these is, from 0.
    """

    batches: Mapping[type[Message], Batch]
    events: Sequence[Received | Rejected]
    places: Sequence[int]

    def objects(self) -> list[Received | Rejected]:
        """All of it as objects, in the order in which it came."""
        found: list[tuple[int, Received | Rejected]] = list(zip(self.places, self.events, strict=True))
        for batch in self.batches.values():
            found += batch.objects()
        found.sort(key=itemgetter(0))
        return [event for _, event in found]


def packed(event: Received) -> bytes:
    """The payload of a message that was found as an object."""
    return PAYLOADS[event.message.ID].pack(event.message)


def arrivals(
    batches: dict[type[Message], Batch],
    events: Sequence[Received | Rejected],
    places: Sequence[int],
    kinds: frozenset[type[Message]],
    payload: Callable[[Received], bytes] = packed,
) -> Arrivals:
    """Put together what a chunk has brought; what a codec of objects has found of the wanted kinds becomes rows, too.

    Args:
        batches: What was found as arrays.
        events: What the codec of objects has found.
        places: Of these events.
        kinds: What is wanted as arrays.
        payload: Gives the payload of an object's message; zeros at the end may be left out.
    """
    rest: list[Received | Rejected] = []
    rest_places: list[int] = []
    single: dict[type[Message], list[tuple[Received, int]]] = {}
    for event, place in zip(events, places, strict=True):
        if isinstance(event, Received) and type(event.message) in kinds:
            single.setdefault(type(event.message), []).append((event, place))
        else:
            rest.append(event)
            rest_places.append(place)
    for kind, found in single.items():
        more = batch_of(kind, found, payload)
        batches[kind] = _merged(batches[kind], more) if kind in batches else more
    return Arrivals(batches, rest, rest_places)


def batch_of(
    kind: type[Message], found: Sequence[tuple[Received, int]], payload: Callable[[Received], bytes] = packed
) -> Batch:
    """Objects of one kind as a batch.

    Args:
        kind: Class of the messages.
        found: The objects, and the place of each.
        payload: Gives the payload of an object's message; zeros at the end may be left out.
    """
    heads = [(event.system, event.component, event.sequence) for event, _ in found]
    system, component, sequence = np.array(heads, np.uint8).T
    return Batch(
        kind,
        rows_of_payloads(kind, [payload(event) for event, _ in found]),
        system,
        component,
        sequence,
        np.array([event.time for event, _ in found]),
        np.array([place for _, place in found], np.intp),
    )


def _merged(one: Batch, other: Batch) -> Batch:
    """Two batches of a kind as one."""
    return Batch(
        one.message,
        np.concatenate([one.rows, other.rows]),
        np.concatenate([one.system, other.system]),
        np.concatenate([one.component, other.component]),
        np.concatenate([one.sequence, other.sequence]),
        np.concatenate([one.time, other.time]),
        np.concatenate([one.place, other.place]),
    ).ordered()
