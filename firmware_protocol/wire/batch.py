"""Many messages at once: what a chunk brings as arrays, one for each kind of message, whatever the wire.

What is plain and good is found by looking at the whole chunk at once. Everything else is judged by the codec of objects, in
its place, so that there is one truth for what is refused and why. What comes out is what that codec would have said, in the
same order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from firmware_protocol.events import Received, Rejected
from firmware_protocol.wire.rows import Rows, rows_of_messages, take_rows

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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
        place: Which of all events of the chunk each is, from 0.
    """

    message: type[Message]
    rows: Rows
    system: NDArray[np.uint8]
    component: NDArray[np.uint8]
    sequence: NDArray[np.uint8]
    place: NDArray[np.intp]


@dataclass(frozen=True)
class Arrivals:
    """What a chunk has brought.

    Attributes:
        batches: What was wanted as arrays, by class; a kind of which nothing has come is not there.
        events: The rest: other messages, and what was refused.
        places: Which of all events of the chunk each of these is, from 0.
        time: Stamp of the chunk, in s.
    """

    batches: Mapping[type[Message], Batch]
    events: Sequence[Received | Rejected]
    places: Sequence[int]
    time: float


@dataclass(frozen=True)
class BatchPart:
    """A part of a batch: `Batch` without its class."""

    rows: Rows
    system: NDArray[np.uint8]
    component: NDArray[np.uint8]
    sequence: NDArray[np.uint8]
    place: NDArray[np.intp]


def arrivals(
    pieces: dict[type[Message], list[BatchPart]],
    events: Sequence[Received | Rejected],
    places: Sequence[int],
    kinds: frozenset[type[Message]],
    time: float,
) -> Arrivals:
    """Put together what a chunk has brought; what a codec of objects has found of the wanted kinds becomes rows, too.

    Args:
        pieces: What was found as arrays.
        events: What the codec of objects has found.
        places: Of these events.
        kinds: What is wanted as arrays.
        time: Stamp of the chunk, in s.
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
        pieces.setdefault(kind, []).append(_piece(kind, found))
    batches = {kind: _batch(kind, parts) for kind, parts in pieces.items()}
    return Arrivals(batches, rest, rest_places, time)


def _piece(kind: type[Message], found: list[tuple[Received, int]]) -> BatchPart:
    """Objects as a part of a batch."""
    events = [event for event, _ in found]
    return BatchPart(
        rows_of_messages(kind, [event.message for event in events]),
        np.array([event.system for event in events], np.uint8),
        np.array([event.component for event in events], np.uint8),
        np.array([event.sequence for event in events], np.uint8),
        np.array([place for _, place in found], np.intp),
    )


def _batch(kind: type[Message], parts: list[BatchPart]) -> Batch:
    if len(parts) == 1:
        (one,) = parts
        return Batch(kind, one.rows, one.system, one.component, one.sequence, one.place)
    place = np.concatenate([part.place for part in parts])
    order = np.argsort(place)
    return Batch(
        kind,
        take_rows(np.concatenate([part.rows for part in parts]), order),
        np.concatenate([part.system for part in parts])[order],
        np.concatenate([part.component for part in parts])[order],
        np.concatenate([part.sequence for part in parts])[order],
        place[order],
    )
