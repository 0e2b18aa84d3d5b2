"""The first difference between a log and what today's program decides on the same input, and how it is told."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple, get_type_hints

from firmware_protocol.errors import HilError
from firmware_protocol.events import Received
from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM
from firmware_protocol.wire.codec import open_codec
from firmware_protocol.wire.fields import Wire
from firmware_protocol.wire.signing import may_carry_key
from hil.mcaplog.records import EventRecord, UnsentBytes, WireBytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

PAL: Final = "/pal/"
DIGEST: Final = "digest"
"""A field that follows from all the others: it is told of where nothing else differs."""
LONGEST: Final = 300
"""Letters that are said of one value."""
TOPICS: Final = {
    "/bridge/open": "how the link was opened",
    "/bridge/session": "a session number, drawn by chance",
    "/bridge/step": "a step of the program: when it took place, and what it took in",
    "/wire/tx": "what the program sends to the robot",
    "/wire/unsent": "what the program could not send to the robot",
    "/wire/rx": "what the robot sends",
    "/events": "what the program says has happened",
    "/pal/decision": "what the learner asks for next, and why",
    "/pal/trial": "how a maneuver was rated",
    "/pal/credit": "what the learner credits to which trials",
    "/pal/generation": "a step of the genetic programming",
    "/pal/checkpoint": "the learner's whole state",
    "/pal/advice": "what was learnt",
}
"""What an entry of a topic is."""


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
        values: What that field was when it was recorded, and is now; empty without a field.
        meaning: What that field is, and its unit; empty where that is not known.
        others: The other fields of the entry that differ, each in a line, but for a digest, which follows from them.
    """

    step: int
    time: float
    topic: str
    field: str
    recorded: str
    now: str
    before: tuple[str, ...] = ()
    received: tuple[str, ...] = ()
    values: tuple[str, str] = ("", "")
    meaning: str = ""
    others: tuple[str, ...] = ()

    @property
    def head(self) -> str:
        """Where it is, in half a line."""
        return self.head_of()

    def head_of(self, log: str = "") -> str:
        """Where it is, in half a line that names the log.

        Args:
            log: As it is to be called; empty leaves it out.
        """
        where = f"step {self.step} ({self.time:.6f} s){f' of {log}' if log else ''}"
        return f"{self.topic or 'the end'} differs at {where}{f', field {self.field}' if self.field else ''}"

    @property
    def body(self) -> str:
        """Everything but where it is, in lines."""
        lines = [f"  {self.topic} is {TOPICS[self.topic]}"] if self.topic in TOPICS else []
        if self.meaning:
            lines.append(f"  {self.field.rpartition(': ')[2]} is: {self.meaning}")
        if any(self.values):
            lines += [f"  recorded: {self.values[0]}", f"  now:      {self.values[1]}"]
            lines += ["  also:", *(f"    {text}" for text in self.others)] if self.others else []
            lines.append("  in")
            lines += [f"    recorded: {self.recorded}", f"    now:      {self.now}"]
        else:
            lines += [f"  recorded: {self.recorded}", f"  now:      {self.now}"]
        if self.before:
            lines += ["  decisions before, which were the same:", *(f"    {text}" for text in self.before)]
        if self.before and self.received:
            lines += ["  received since the last of them:", *(f"    {text}" for text in self.received)]
        return "\n".join(lines)

    def __str__(self) -> str:
        return f"first difference: {self.head}\n{self.body}"

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


class FieldDifference(NamedTuple):
    """The first field in which two entries of one kind differ.

    Attributes:
        name: Its name, as in `Difference.field`; empty where that can't be told.
        values: What it was when it was recorded, and is now, in words.
        meaning: What it is, and its unit.
        others: The other fields of the entry that differ, each in a line.
    """

    name: str = ""
    values: tuple[str, str] = ("", "")
    meaning: str = ""
    others: tuple[str, ...] = ()


def first_field(recorded: Any, now: Any, wire: str) -> FieldDifference:  # noqa: ANN401 - whatever a log holds
    """The first field in which two entries of one kind differ.

    Args:
        recorded: What an entry says.
        now: What the other says.
        wire: What the link carries.
    """
    if type(recorded) is not type(now) or not is_dataclass(recorded):
        return FieldDifference()
    if isinstance(recorded, WireBytes | UnsentBytes) and recorded.data != now.data:
        return _first_in_frames(messages_in(recorded.data, wire), messages_in(now.data, wire))
    if isinstance(recorded, EventRecord) and (recorded.kind, recorded.text) == (now.kind, now.text):
        return _first_key(recorded.fields, now.fields)
    return _first_of(recorded, now) or FieldDifference()


def same(one: object, other: object) -> bool:
    """Equal, and a NaN equals itself.

    Args:
        one: A value of a field.
        other: Another.
    """
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other or (one != one and other != other)  # noqa: PLR0124 - only a NaN differs from itself


def parting(one: Sequence[object], other: Sequence[object]) -> int:
    """Where two texts, or two files' bytes, part.

    Args:
        one: The one.
        other: The other.
    """
    unlike = (at for at, (this, that) in enumerate(zip(one, other, strict=False)) if this != that)
    return next(unlike, min(len(one), len(other)))


def messages_in(data: bytes, wire: str) -> list[object]:
    """The messages that wire bytes hold.

    Args:
        data: The bytes.
        wire: What the link carries.
    """
    found = open_codec(wire, system=HOST_SYSTEM, component=HOST_COMPONENT).receive(data, 0.0)
    return [item.message for item in found if isinstance(item, Received)]


def in_words(topic: str, value: Any, wire: str, *, raw: bool = True) -> str:  # noqa: ANN401 - whatever a log holds
    """An entry for people, in a line.

    Args:
        topic: Its topic.
        value: What it says; None where nobody can tell.
        wire: What the link carries.
        raw: Bytes are shown too, beside the messages that they hold.
    """
    match value:
        case WireBytes() | UnsentBytes():
            secret = may_carry_key(value.data)  # a log has zeros there; a program has not
            messages = ", ".join(type(one).__name__ if secret else str(one) for one in messages_in(value.data, wire))
            took = "" if isinstance(value, WireBytes) else f" (not taken: {value.error})"
            also = f" [{value.data.hex()}]" if not secret and (raw or not messages) else ""
            text = f"{messages or 'no message'}{took}{also}"
        case EventRecord():
            text = f"{value.kind}: {value.text} {value.fields if value.fields != '{}' else ''}"
        case _ if is_dataclass(value) and topic.startswith(PAL):
            told = (f"{each.name}={getattr(value, each.name)!r}" for each in fields(value) if each.name != DIGEST)
            text = f"{type(value).__name__}({', '.join(told)})"
        case _:
            text = str(value)
    return f"{topic} {_short(text)}"


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= LONGEST else text[: LONGEST - 1] + "…"


def _shown(recorded: object, now: object) -> tuple[str, str]:
    """Two values, in words that differ: of two long texts, from where they part."""
    one, other = str(recorded), str(now)
    if len(one) <= LONGEST and len(other) <= LONGEST:
        return _short(one), _short(other)
    begin = max(0, parting(one, other) - LONGEST // 3)
    before = "…" if begin else ""
    return f"{before}{_short(one[begin:])}", f"{before}{_short(other[begin:])}"


def _definition(kind: type, name: str) -> Wire | str:
    """What a record or message says of a field of its own."""
    told = getattr(get_type_hints(kind, include_extras=True).get(name), "__metadata__", ("",))[0]
    return told if isinstance(told, Wire) else str(told)


def _meaning(kind: type, name: str) -> str:
    """What a field of a record or message is, and its unit, as its definition has it."""
    told = _definition(kind, name)
    if isinstance(told, Wire):
        return f"{told.text}, in {told.unit}" if told.unit else told.text
    return told


def _named(kind: type, name: str, value: object) -> object:
    """The value of a message's field, with the names of what it enumerates."""
    told = _definition(kind, name)
    if not isinstance(told, Wire):
        return value
    if told.secret:
        return "not shown: it is secret"
    if told.enum is None:
        return value
    if isinstance(value, tuple):
        return " ".join(str(_named(kind, name, each)) for each in value)
    return next((member.name for member in told.enum if member.value == value), value)


def _first_in_frames(recorded: Sequence[object], now: Sequence[object]) -> FieldDifference:
    for one, other in zip(recorded, now, strict=False):
        if type(one) is not type(other):
            names = type(one).__name__, type(other).__name__
            return FieldDifference(f"data: {names[0]} or {names[1]}", names)
        found = _first_of(one, other)
        if found is not None:
            return found._replace(name=f"data: {type(one).__name__}.{found.name}")
    if len(recorded) == len(now):
        return FieldDifference("data")
    return FieldDifference(f"data: {len(recorded)} messages or {len(now)}")


def _first_of(recorded: object, now: object) -> FieldDifference | None:
    """The first field in which two messages or records of one type differ; None where all are the same."""
    kind = type(recorded)
    values = [(name, getattr(recorded, name), getattr(now, name)) for name in _names(recorded)]
    differ = [
        (name, _shown(_named(kind, name, one), _named(kind, name, other)))
        for name, one, other in values
        if not same(one, other)
    ]
    if not differ:
        return None
    name, shown = differ[0]
    others = (_also(kind, other, *values) for other, values in differ[1:] if other != DIGEST)
    return FieldDifference(name, shown, _meaning(kind, name), tuple(others))


def _also(kind: type, name: str, recorded: str, now: str) -> str:
    """Another field that differs, in a line."""
    meaning = _meaning(kind, name)
    return f"{name}: {recorded}, now {now}{f' ({meaning})' if meaning else ''}"


def _names(message: object) -> Iterable[str]:
    return [each.name for each in fields(message)] if is_dataclass(message) else []


def _first_key(recorded: str, now: str) -> FieldDifference:
    """The first key in which two JSON objects differ."""
    try:
        one, other = json.loads(recorded), json.loads(now)
    except (ValueError, RecursionError):
        one = other = None
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted({*one, *other}):
            values = one.get(key, "not there"), other.get(key, "not there")
            if values[0] != values[1]:
                return FieldDifference(f"fields: {key}", _shown(*values))
    return FieldDifference("fields: ", _shown(recorded, now))
