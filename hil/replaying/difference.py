"""The first difference between a log and what today's program decides on the same input, and how it is told."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.codec import open_codec
from firmware_protocol.errors import HilError
from firmware_protocol.events import Received
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM
from hil.mcaplog.records import EventRecord, UnsentBytes, WireBytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

LONGEST: Final = 300
"""Letters that are said of one value."""


@dataclass(frozen=True)
class Difference:
    """Where a replay went another way.

    Attributes:
        step: Number of the step in which it did, of all steps in the log, from 0.
        time: Log time of that step, in s.
        topic: Of the entry that differs.
        field: The first field that differs, as `data: JuniorManeuver.period`; empty where an entry is missing or one too many.
        recorded: What was recorded, in words.
        now: What is decided now.
        before: The decisions before, the last one last.
        received: What the robot has said since the last of these.
    """

    step: int
    time: float
    topic: str
    field: str
    recorded: str
    now: str
    before: tuple[str, ...] = ()
    received: tuple[str, ...] = ()

    def __str__(self) -> str:
        where = f"step {self.step} at {self.time:.6f} s, {self.topic}{f', field {self.field}' if self.field else ''}"
        lines = [f"first difference: {where}", f"  recorded: {self.recorded}", f"  now:      {self.now}"]
        lines += ["  decisions before:", *(f"    {text}" for text in self.before or ["none"])]
        lines += ["  received since the last of them:", *(f"    {text}" for text in self.received or ["nothing"])]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """As plain values."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


class ReplayDiverged(HilError):  # noqa: N818 - it is what has happened, and no fault of anybody's
    """A program decides otherwise than was recorded.

    Attributes:
        difference: Where, and how.
    """

    def __init__(self, difference: Difference) -> None:
        super().__init__(str(difference))
        self.difference = difference


def first_field(recorded: Any, now: Any, wire: str) -> str:  # noqa: ANN401 - whatever a log holds
    """The first field in which two entries of one kind differ, by name; empty where that can't be told.

    Args:
        recorded: What an entry says.
        now: What the other says.
        wire: What the link carries.
    """
    if type(recorded) is not type(now) or not is_dataclass(recorded):
        return ""
    if isinstance(recorded, WireBytes | UnsentBytes):
        return _first_in_frames(messages_in(recorded.data, wire), messages_in(now.data, wire))
    for each in fields(recorded):
        one, other = getattr(recorded, each.name), getattr(now, each.name)
        if not same(one, other):
            if isinstance(recorded, EventRecord) and each.name == "fields":
                return f"fields: {_first_key(one, other)}"
            return each.name
    return ""


def same(one: object, other: object) -> bool:
    """Equal, and a NaN equals itself.

    Args:
        one: A value of a field.
        other: Another.
    """
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other or (one != one and other != other)  # noqa: PLR0124 - only a NaN differs from itself


def messages_in(data: bytes, wire: str) -> list[object]:
    """The messages that wire bytes hold.

    Args:
        data: The bytes.
        wire: What the link carries.
    """
    found = open_codec(wire, system=HOST_SYSTEM, component=HOST_COMPONENT).receive(data, 0.0)
    return [item.message for item in found if isinstance(item, Received)]


def in_words(topic: str, value: Any, wire: str) -> str:  # noqa: ANN401 - whatever a log holds
    """An entry for people, in a line.

    Args:
        topic: Its topic.
        value: What it says; None where nobody can tell.
        wire: What the link carries.
    """
    match value:
        case WireBytes() | UnsentBytes():
            messages = ", ".join(map(str, messages_in(value.data, wire)))
            took = "" if isinstance(value, WireBytes) else f" (not taken: {value.error})"
            text = f"{messages or 'no message'}{took} [{value.data.hex()}]"
        case EventRecord():
            text = f"{value.kind}: {value.text} {value.fields if value.fields != '{}' else ''}"
        case _:
            text = str(value)
    text = " ".join(text.split())
    return f"{topic} {text if len(text) <= LONGEST else text[: LONGEST - 1] + '…'}"


def _first_in_frames(recorded: Sequence[object], now: Sequence[object]) -> str:
    for one, other in zip(recorded, now, strict=False):
        if type(one) is not type(other):
            return f"data: {type(one).__name__} or {type(other).__name__}"
        for name in _names(one):
            if not same(getattr(one, name), getattr(other, name)):
                return f"data: {type(one).__name__}.{name}"
    return "data" if len(recorded) == len(now) else f"data: {len(recorded)} messages or {len(now)}"


def _names(message: object) -> Iterable[str]:
    return [each.name for each in fields(message)] if is_dataclass(message) else []


def _first_key(recorded: str, now: str) -> str:
    """The first key in which two JSON objects differ."""
    try:
        one, other = json.loads(recorded), json.loads(now)
    except ValueError:
        return ""
    if not isinstance(one, dict) or not isinstance(other, dict):
        return ""
    for key in sorted({*one, *other}):
        if one.get(key) != other.get(key):
            return f"{key}"
    return ""
