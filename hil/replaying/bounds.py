"""What the entries of a bridge can say. A log is not trusted: one that says anything else is not replayed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.mcaplog.records import BridgeOpening, BridgeStep, SessionDrawn

if TYPE_CHECKING:
    from collections.abc import Iterable

LATEST: Final = 1e9
"""No clock that begins with its program comes so far, in s: that is 31 years."""
MOST_SESSION: Final = 0xFFFF
MOST_SIGNING_TIME: Final = 2**48 - 1
"""A signature has room for no more, in 10 us."""
MOST_DROPPED: Final = 2**40
"""In bytes."""


def what_can_not_be(record: object) -> str:
    """What is wrong with an entry of a bridge, in words; empty where nothing is.

    Args:
        record: What it says.
    """
    match record:
        case BridgeOpening():
            return _opening(record)
        case SessionDrawn() if not 0 < record.number <= MOST_SESSION:
            return f"{record.number} is no number of a session"
        case BridgeStep():
            return _step(record)
        case _:
            return ""


def _opening(record: BridgeOpening) -> str:
    if record.wire not in {MAVLINK, CAN}:
        return f"{record.wire[:20]!r} is nothing that a link carries"
    if not 0 <= record.signing_time <= MOST_SIGNING_TIME:
        return f"{record.signing_time} is no calendar time of a signature"
    return _times([record.clock])


def _step(record: BridgeStep) -> str:
    if len(record.chunk_times) != len(record.chunk_sizes):
        return "it has more or fewer stamps than chunks"
    if len(record.inputs) != len(record.input_robots):
        return "it has more or fewer inputs than robots that these are for"
    if any(size <= 0 for size in record.chunk_sizes):
        return "it took in chunks without bytes"
    if not 0 <= record.dropped < MOST_DROPPED:
        return f"{record.dropped} bytes can't have been dropped"
    return _times([record.clock, *record.chunk_times])


def _times(times: Iterable[float]) -> str:
    for time in times:
        if not 0 <= time < LATEST:
            return f"{time:g} s is no time of its clock"
    return ""
