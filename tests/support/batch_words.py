"""What a codec of arrays has found, told as a codec of objects tells it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.events import Received, Rejected
from firmware_protocol.wire.rows import messages_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from firmware_protocol.wire.batch import Arrivals


def told(arrived: Arrivals) -> list[str]:
    """All events of a chunk in order, in words; frames that were good without their bytes."""
    found = {place: in_words(event) for place, event in zip(arrived.places, arrived.events, strict=True)}
    for kind, batch in arrived.batches.items():
        assert batch.message is kind
        assert (batch.place[1:] > batch.place[:-1]).all()
        for index, message in enumerate(messages_of(kind, batch.rows)):
            said = (int(batch.system[index]), int(batch.component[index]), int(batch.sequence[index]))
            assert int(batch.place[index]) not in found
            found[int(batch.place[index])] = in_words(Received(message, *said, float(batch.time[index]), b""))
    assert sorted(found) == list(range(len(found)))
    return [found[place] for place in range(len(found))]


def in_words(event: Received | Rejected) -> str:
    """An event; NaN is equal to itself in words."""
    if isinstance(event, Received):
        return f"{event.message} {event.system} {event.component} {event.sequence} {event.time}"
    return repr(event)


def all_in_words(events: Sequence[Received | Rejected]) -> list[str]:
    """What a codec of objects has found."""
    return [in_words(event) for event in events]
