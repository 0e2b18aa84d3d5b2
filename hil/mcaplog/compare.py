"""Tells two logs apart: byte for byte, record by record; or by topic and field, entry by entry."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import zip_longest
from math import isnan
from typing import TYPE_CHECKING, Final

from mcap.opcode import Opcode

from hil.mcaplog.errors import UnreadableLogError
from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.making.slimming import SLIM, kept_of, matches
from hil.mcaplog.reading.flattening import flatten
from hil.mcaplog.reading.reader import LogReader, RawEntry
from hil.mcaplog.reading.walking import RawRecord, WalkedLog
from hil.mcaplog.writing.writer import CUT, RUN, SIZES, UNINDEXED

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

    from hil.mcaplog.reading.flattening import Scalar

_NAMES: Final = {int(opcode): opcode.name.lower().replace("_", " ") for opcode in Opcode}
_RUN_START: Final = len(RUN).to_bytes(4, "little") + RUN.encode()


def differences(first: Path, second: Path, *, limit: int = 20) -> list[str]:
    """Compare two logs byte for byte, but for the content of the one metadata record `run`.

    Schemas, channels, entries, their times and order, chunk boundaries, indexes and the summary all count.

    Args:
        first: A log.
        second: Another.
        limit: Stop after this many differences.

    Returns:
        The differences in words; empty when there are none.

    Raises:
        LogError: One of them cannot be opened or is not a log.
    """
    limits = ReadLimits(chunk=1 << 28, lifted=True)  # who compares logs has made them
    one, two = WalkedLog(first, limits), WalkedLog(second, limits)
    found: list[str] = []
    for number, (a, b) in enumerate(zip_longest(one.records(), two.records())):
        if len(found) >= limit:
            break
        text = _compare(a, b)
        if text:
            found.append(f"record {number}: {text}")
        if a is None or b is None:
            break
    if not found and one.size != two.size:
        found.append(f"{first} has {one.size:,} bytes, {second} {two.size:,}")
    return found


def _compare(a: RawRecord | None, b: RawRecord | None) -> str:
    if a is None or b is None:
        return f"only the {'second' if a is None else 'first'} log goes on"
    if a.opcode != b.opcode:
        return f"a {_name(a)} in the first log, a {_name(b)} in the second"
    if a.offset != b.offset:
        return f"the {_name(a)} is at byte {a.offset:,} of the first log and {b.offset:,} of the second"
    if a.opcode == Opcode.METADATA and a.content.startswith(_RUN_START) and b.content.startswith(_RUN_START):
        return "" if len(a.content) == len(b.content) else "the record `run` differs in length"
    if a.content != b.content:
        same = [x == y for x, y in zip(a.content, b.content, strict=False)]
        at = same.index(False) if False in same else len(same)
        return f"the {_name(a)}s differ from byte {at} on ({len(a.content)} and {len(b.content)} bytes)"
    return ""


def _name(record: RawRecord) -> str:
    return _NAMES.get(record.opcode, f"record of kind {record.opcode}")


MOST_DECODED: Final = 1000
"""Entries of a topic that differ and are looked at field by field; all are counted."""


@dataclass(frozen=True)
class FirstDifference:
    """Where two logs first differ in a topic.

    Attributes:
        number: Number of the entry in its topic, from 0.
        time: Its log time in s, in the first log; in the second where the first has no more.
        field: What differs: a field of the entry, `log time`, `publish time`, `schema`, or `entry` where one log has no more.
        first: What the first log has; None where it has nothing.
        second: What the second has.
    """

    number: int
    time: float
    field: str
    first: Scalar
    second: Scalar


@dataclass
class TopicComparison:
    """How a topic of two logs compares.

    Attributes:
        topic: The topic.
        first: Entries in the first log.
        second: Entries in the second.
        differing: Entries that differ, by number; those that one log has more are not among them.
        fields: How many entries differ in which field, of the first `MOST_DECODED` that differ.
        difference: The first difference; None where there is none.
        behind_cut: Entries that one log has more, where the other was cut off: they are no difference.
    """

    topic: str
    first: int = 0
    second: int = 0
    differing: int = 0
    fields: dict[str, int] = field(default_factory=dict)
    difference: FirstDifference | None = None
    behind_cut: int = 0


@dataclass
class LogComparison:
    """How two logs compare.

    Attributes:
        topics: By topic, in the order of their names.
        metadata: What differs, as (record, key, value in the first log, in the second); None where there is no such key.
        attachments: Names of attachments that differ, or that only one has.
        health: What state each log is in, in words.
        left_out: Topics that were not compared, since one log is slim, and slim logs never have them.
    """

    topics: list[TopicComparison]
    metadata: list[tuple[str, str, str | None, str | None]]
    attachments: list[str]
    health: tuple[str, str]
    left_out: list[str] = field(default_factory=list)

    @property
    def compared(self) -> int:
        """Entries that both have."""
        return sum(min(topic.first, topic.second) for topic in self.topics)

    @property
    def behind_cut(self) -> int:
        """Entries that one log has more, where the other was cut off."""
        return sum(topic.behind_cut for topic in self.topics)

    @property
    def same(self) -> bool:
        """Nothing differs."""
        return not (self.metadata or self.attachments or any(topic.difference for topic in self.topics))


def compare_logs(
    first: Path,
    second: Path,
    topics: Collection[str] | None = None,
    *,
    leave_out: Collection[str] = (),
    limits: ReadLimits = ReadLimits(),  # noqa: B008 - frozen
) -> LogComparison:
    """Compare two logs by topic: the entries of each in their order, with their times, and in which fields they differ.

    Chunks, indexes, sequence numbers, and how topics take turns do not count, nor do the metadata records `run` and `sizes`.
    A NaN equals itself. Where a log is slim, only the topics that slim logs have are compared. What a log lacks at its end
    because it was cut off is no difference.

    Args:
        first: A log.
        second: Another.
        topics: Only these topics, and neither metadata nor attachments; None is all.
        leave_out: Not these topics.
        limits: What the logs may unpack to.

    Raises:
        UnreadableLogError: One of them has no entries that could be read.
        LogError: One of them cannot be opened or is not a log.
    """
    one, two = LogReader(first, limits), LogReader(second, limits)
    found: set[str] = set()
    for reader in (one, two):
        found.update({entry.topic for entry in reader.raw_entries(topics, leave_out=leave_out)})
        if not reader.messages_read and not reader.whole:
            raise UnreadableLogError(
                f"no entry could be read of {reader.path}, so nothing is compared: it is {reader.health(1)}"
            )
        if topics is None and not leave_out:
            reader.require_something()
    cut = one.ends_early, two.ends_early
    metadata, attachments = ([], []) if topics is not None else (_metadata(one, two, cut), _attachments(one, two, cut))
    health = one.health(), two.health()
    kept = [kept_of(one.metadata), kept_of(two.metadata)]
    left_out = {topic for topic in found if any(each is not None and not matches(topic, each) for each in kept)}
    compared = [_compare_topic(one, two, topic, cut) for topic in sorted(found - left_out)]
    return LogComparison(compared, metadata, attachments, health, sorted(left_out))


def _metadata(one: LogReader, two: LogReader, cut: tuple[bool, bool]) -> list[tuple[str, str, str | None, str | None]]:
    found: list[tuple[str, str, str | None, str | None]] = []
    for name in sorted({*one.metadata, *two.metadata} - {RUN, SIZES, CUT, SLIM, UNINDEXED}):
        if _is_behind_cut((name in one.metadata, name in two.metadata), cut):
            continue
        a, b = one.metadata.get(name, {}), two.metadata.get(name, {})
        found += [(name, key, a.get(key), b.get(key)) for key in sorted({*a, *b}) if a.get(key) != b.get(key)]
        if name not in one.metadata or name not in two.metadata:
            found += [] if a or b else [(name, "", None, None)]
    return found


def _attachments(one: LogReader, two: LogReader, cut: tuple[bool, bool]) -> list[str]:
    names = sorted({*one.attachments, *two.attachments})
    return [
        name
        for name in names
        if one.attachments.get(name) != two.attachments.get(name)
        and not _is_behind_cut((name in one.attachments, name in two.attachments), cut)
    ]


def _is_behind_cut(there: tuple[bool, bool], cut: tuple[bool, bool]) -> bool:
    """Something is in one log only, and the other was cut off before it would have come."""
    return (cut[0] and not there[0]) or (cut[1] and not there[1])


def _compare_topic(one: LogReader, two: LogReader, topic: str, cut: tuple[bool, bool]) -> TopicComparison:
    found = TopicComparison(topic)
    for number, (a, b) in enumerate(zip_longest(one.raw_entries([topic]), two.raw_entries([topic]))):
        found.first += a is not None
        found.second += b is not None
        if a is None or b is None:
            if _is_behind_cut((a is not None, b is not None), cut):
                found.behind_cut += 1
            elif found.difference is None:
                there = a or b
                found.difference = FirstDifference(
                    number, there.log_time / 1e9 if there else 0.0, "entry", _brief(one, a), _brief(two, b)
                )
        elif a[3:] != b[3:] or (number == 0 and _schema(one, a) != _schema(two, b)):
            found.differing += 1
            if found.differing <= MOST_DECODED:
                _count_fields(found, number, _fields(one, a), _fields(two, b), a.log_time / 1e9)
    return found


def _count_fields(found: TopicComparison, number: int, a: dict[str, Scalar], b: dict[str, Scalar], time: float) -> None:
    names = [name for name in {**a, **b} if not _same(a.get(name), b.get(name))]
    for name in names or ["encoding"]:  # the same values, written in another way
        found.fields[name] = found.fields.get(name, 0) + 1
        if found.difference is None:
            found.difference = FirstDifference(number, time, name, a.get(name), b.get(name))


def _fields(reader: LogReader, entry: RawEntry) -> dict[str, Scalar]:
    value = reader.decoded(entry)
    times: dict[str, Scalar] = {"log time": entry.log_time / 1e9, "publish time": entry.publish_time / 1e9}
    return {**times, "schema": _schema(reader, entry), **flatten(entry.data if value is None else value)}


def _schema(reader: LogReader, entry: RawEntry) -> str:
    found = reader.channels.schema(entry.channel)
    return found.name if found else ""


def _brief(reader: LogReader, entry: RawEntry | None) -> str | None:
    if entry is None:
        return None
    value = reader.decoded(entry)
    return f"{entry.data.hex() if value is None else value!r:.200}"


def _same(a: Scalar, b: Scalar) -> bool:
    if isinstance(a, float) and isinstance(b, float) and isnan(a) and isnan(b):
        return True
    return type(a) is type(b) and a == b
