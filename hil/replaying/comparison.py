"""Takes what the recorder of a replay is told, and compares it with what was recorded, entry by entry, as bytes."""

from __future__ import annotations

from collections import deque
from dataclasses import fields
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final, NoReturn

from firmware_protocol.messages import HOST_COMPONENT, HOST_SYSTEM
from hil.mcaplog.attachments import ENDED_WITH
from hil.mcaplog.making.slimming import matches
from hil.mcaplog.reading.decoding import decoder_of
from hil.mcaplog.records import EVENTS, EventRecord, WireBytes
from hil.mcaplog.writing.encode import read_sender
from hil.replaying.difference import Difference, FieldDifference, ReplayDiverged, first_field, in_words, parting, same
from hil.replaying.tape import OPEN, RX, SESSION, STEP, TX, UNSENT, ReplayEndedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from firmware_protocol.errors import HilError
    from hil.mcaplog.reading.reader import RawEntry
    from hil.mcaplog.schemas import Schema
    from hil.mcaplog.writing.row_encoding import EntryRows
    from hil.replaying.tape import Step, Tape

BEFORE: Final = 3
"""So many decisions before a difference are shown."""
SINCE: Final = 12
"""And so many of the messages since the last of them, the latest."""
LEARNERS: Final = ("/pal/", "/surround/", "/swarm/round")
"""How the topics begin that tell what a learner does, and whom a swarm's host asks."""
NONE: Final = FieldDifference()
"""An entry is missing, or one too many: it is no field that differs."""
HOST: Final = (HOST_SYSTEM, HOST_COMPONENT)
_BRIDGE: Final = frozenset((OPEN, SESSION, STEP, RX))


def decides(topic: str) -> bool:
    """An entry of this topic tells what was decided.

    Args:
        topic: The topic.
    """
    return topic in {TX, UNSENT, EVENTS} or topic.startswith(LEARNERS)


class Comparison:
    """A log's sink that compares: see `hil.mcaplog.writing.sink.LogSink`.

    Args:
        tape: What was recorded.
        wire: What the link carries.
        strict: Every entry is compared; else what was decided.

    Attributes:
        compared: Entries found to be the same.
        difference: The first difference; None so far.
        steps: Steps begun.
    """

    def __init__(self, tape: Tape, wire: str, *, strict: bool) -> None:
        self.compared = 0
        self.difference: Difference | None = None
        self._tape = tape
        self._wire = wire
        self._strict = strict
        self._topics: list[str] = []
        self._numbers: dict[str, int] = {}
        self._decoders: list[Callable[[bytes], Any]] = []
        self._compared: list[bool] = []
        self._before: deque[tuple[float, int, bytes]] = deque(maxlen=BEFORE)
        self._since: deque[tuple[float, int, bytes]] = deque(maxlen=SINCE)
        self._attached: dict[str, bytes] = {}
        self.steps = 0
        self._step = 0
        self._time = 0.0

    # --- what a sink takes -------------------------------------------------------------------------------------------

    def channel(self, topic: str, schema: Schema) -> int:
        """The channel of a topic."""
        return self.raw_channel(topic, schema.name, schema.data)

    def raw_channel(
        self, topic: str, schema_name: str, schema: bytes, *, schema_encoding: str = "protobuf", encoding: str = "protobuf"
    ) -> int:
        """As `channel`, from a ready schema."""
        if topic not in self._numbers:
            self._numbers[topic] = len(self._topics)
            self._topics.append(topic)
            self._decoders.append(decoder_of(schema_name, schema, schema_encoding, encoding))
            self._compared.append(decides(topic) or (self._strict and self._was_kept(topic)))
        return self._numbers[topic]

    def write(self, channel: int, time: float, data: bytes) -> None:
        """Compare an entry with the next that was recorded.

        Raises:
            ReplayDiverged: It is another one; from then on every call raises.
            ReplayEndedError: The log was cut off here.
        """
        if self.difference is not None:
            raise ReplayDiverged(self.difference)
        topic = self._topics[channel]
        if topic == STEP:
            self._begin_step(time, data)
        elif self._compared[channel]:
            self._compare(channel, time, data)
        if decides(topic):
            self._before.append((time, channel, data))
            self._since.clear()
        elif topic not in _BRIDGE and (sender := read_sender(data)) is not None and sender[0] != HOST:
            self._since.append((time, channel, data))

    def write_rows(self, parts: Sequence[EntryRows]) -> None:
        """Compare entries, one by one; see `write`.

        Raises:
            ReplayDiverged: As `write`.
            ReplayEndedError: As `write`.
        """
        found = [
            (place, part.channel, time, entry.tobytes())
            for part in parts
            for place, time, entry in zip(part.places.tolist(), part.times.tolist(), part.data, strict=True)
        ]
        for _, channel, time, data in sorted(found, key=itemgetter(0)):
            self.write(channel, time, data)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """What the robot's parameters are is in what it said; all else is not decided."""

    def attachment(self, name: str, data: bytes, *, media_type: str, time: float) -> None:  # noqa: ARG002
        """What the run ends with is compared when it has ended."""
        if name.startswith(ENDED_WITH):
            self._attached[name] = data

    def flush(self) -> None:
        """Nothing is held."""

    def close(self) -> None:
        """Nothing is held."""

    def discard(self) -> None:
        """Nothing is held."""

    # --- comparing ---------------------------------------------------------------------------------------------------

    def end(self) -> None:
        """The run has ended: nothing may be left of the log.

        Raises:
            ReplayDiverged: Something is left, or the run ends with another file.
        """
        if self.difference is not None:
            raise ReplayDiverged(self.difference)
        left = self._next()
        if left is not None:
            self._differ(left.topic, NONE, self._said(left), "nothing: the run ends here, and the recorded one went on")
        if self._tape.cut_off:
            return
        recorded = {name: data for name, data in self._tape.files.items() if name.startswith(ENDED_WITH)}
        for name in sorted({*recorded, *self._attached}):
            one, other = recorded.get(name), self._attached.get(name)
            if one != other:
                self._differ(f"attachment {name}", NONE, _file(one, other), _file(other, one))

    def run_on(self, text: str) -> None:
        """The program goes on where the log, which is whole, has ended.

        Args:
            text: What is missing, in words.
        """
        self.difference = self._made(STEP, NONE, f"nothing: {text}", "the run goes on")

    def unlike(self, step: Step, recorded: bytes | None, now: bytes | None) -> HilError:
        """The error of a program that writes something else than was recorded; see `hil.replaying.network`.

        Args:
            step: In which step.
            recorded: What was recorded; None where nothing was.
            now: What is written; None where nothing is.
        """
        self._step, self._time = step.number, step.record.clock
        texts = [None if data is None else in_words(TX, WireBytes("tx", "", data), self._wire) for data in (recorded, now)]
        field = NONE
        if recorded is not None and now is not None:
            field = first_field(WireBytes("tx", "", recorded), WireBytes("tx", "", now), self._wire)
        nothing = "nothing more in this step"
        self.difference = self._made(TX, field, texts[0] or nothing, texts[1] or nothing)
        return ReplayDiverged(self.difference)

    def _was_kept(self, topic: str) -> bool:
        kept = self._tape.kept
        return kept is None or matches(topic, kept)

    def _next(self) -> RawEntry | None:
        """The next entry to be compared, or the beginning of the next step; others are passed over."""
        while (entry := self._tape.next_entry()) is not None:
            if self._strict or entry.topic == STEP or decides(entry.topic):
                return entry
        return None

    def _begin_step(self, time: float, data: bytes) -> None:
        """A step begins: what was decided in the one before must have been decided now."""
        entry = self._next()
        if entry is None:
            self._end_of_log("the next step of the bridge")
        if entry.topic != STEP:
            self._differ(entry.topic, NONE, self._said(entry), "nothing more in this step")
        self._step, self._time = self.steps, time
        self.steps += 1
        if self._strict and (entry.log_time, entry.data) != (round(time * 1e9), data):
            self._differ_in(entry, self._numbers[STEP], time, data)
        self.compared += 1

    def _compare(self, channel: int, time: float, data: bytes) -> None:
        topic = self._topics[channel]
        entry = self._next()
        if entry is None:
            self._end_of_log(self._told(channel, data))
        if entry.topic == STEP:
            self._tape.put_back(entry)
            self._differ(topic, NONE, "nothing more in this step", self._told(channel, data))
        if entry.topic != topic:
            self._differ(topic, NONE, self._said(entry), self._told(channel, data))
        same_time = not self._strict or entry.log_time == round(time * 1e9)
        if not same_time or (entry.data != data and (self._strict or not self._means(entry, channel, data))):
            self._differ_in(entry, channel, time, data)
        self.compared += 1

    def _means(self, entry: RawEntry, channel: int, data: bytes) -> bool:
        """An entry tells the same decision, though its bytes differ."""
        return _means_the_same(self._tape.decoded(entry), self._decoders[channel](data))

    def _differ_in(self, entry: RawEntry, channel: int, time: float, data: bytes) -> NoReturn:
        """Two entries of one topic differ."""
        recorded, now = self._tape.decoded(entry), self._decoders[channel](data)
        field = first_field(recorded, now, self._wire)
        if entry.data == data:
            field = FieldDifference("log time", (f"{entry.log_time / 1e9:.9f} s", f"{time:.9f} s"))
        self._differ(entry.topic, field, self._said(entry), self._told(channel, data))

    def _end_of_log(self, now: str) -> NoReturn:
        """There is no further entry."""
        if self._tape.cut_off:
            raise ReplayEndedError(f"{self._tape.path} was cut off here")
        self._differ("", NONE, "nothing: the log ends here", now)

    def _differ(self, topic: str, field: FieldDifference, recorded: str, now: str) -> NoReturn:
        self.difference = self._made(topic, field, recorded, now)
        raise ReplayDiverged(self.difference)

    def _made(self, topic: str, field: FieldDifference, recorded: str, now: str) -> Difference:
        return Difference(
            step=self._step,
            time=self._time,
            topic=topic,
            field=field.name,
            recorded=recorded,
            now=now,
            before=self._shown(self._before),
            received=self._shown(self._since),
            values=field.values,
            meaning=field.meaning,
            others=field.others,
        )

    def _shown(self, entries: Iterable[tuple[float, int, bytes]]) -> tuple[str, ...]:
        return tuple(f"{time:.6f} s {self._told(channel, data, raw=False)}" for time, channel, data in entries)

    def _said(self, entry: RawEntry) -> str:
        return in_words(entry.topic, self._tape.decoded(entry), self._wire)

    def _told(self, channel: int, data: bytes, *, raw: bool = True) -> str:
        return in_words(self._topics[channel], self._decoders[channel](data), self._wire, raw=raw)


def _means_the_same(recorded: Any, now: Any) -> bool:  # noqa: ANN401 - whatever a log holds
    """Two entries tell the same decision, though their bytes differ: a better wording, or a field that one does not know."""
    if isinstance(recorded, EventRecord) and isinstance(now, EventRecord):
        return (recorded.kind, recorded.fields) == (now.kind, now.fields)
    if type(recorded) is type(now) and (added := getattr(now, "ADDED", None)):
        told = [one.name for one in fields(now) if one.name not in added or getattr(recorded, one.name) != one.default]
        return all(same(getattr(recorded, name), getattr(now, name)) for name in told)
    descriptor = getattr(recorded, "DESCRIPTOR", None)
    if descriptor is None or type(recorded) is type(now):
        return False
    known = [field.name for field in descriptor.fields if hasattr(now, field.name)]
    return bool(known) and all(same(_plain(getattr(recorded, name)), _plain(getattr(now, name))) for name in known)


def _plain(value: Any) -> Any:  # noqa: ANN401 - whatever a field holds
    """A list as a tuple, None as the NaN that stands for it in a log."""
    if value is None:
        return float("nan")
    return value if isinstance(value, str | bytes) or not hasattr(value, "__iter__") else tuple(map(_plain, value))


def _file(data: bytes | None, other: bytes | None) -> str:
    """A file for people, from where it differs from another."""
    if data is None:
        return "there is none"
    at = parting(data, other or b"")
    return f"{len(data)} bytes, from byte {at} on: {data[at : at + 60].decode(errors='replace')!r}"
