"""Tells two logs apart, record by record."""

from __future__ import annotations

from itertools import zip_longest
from typing import TYPE_CHECKING, Final

from mcap.opcode import Opcode

from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.walking import LogFile, RawRecord
from hil.mcaplog.writer import RUN

if TYPE_CHECKING:
    from pathlib import Path

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
    one, two = LogFile(first, limits), LogFile(second, limits)
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
