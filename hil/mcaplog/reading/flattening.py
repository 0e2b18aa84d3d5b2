"""Takes the values of entries apart into fields, and writes them as tables."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import fields, is_dataclass
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, Final

from google.protobuf.message import Message

from hil.files.outputs import Output
from hil.mcaplog.errors import LogError
from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.reading.walking import shown

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from hil.mcaplog.reading.reader import LogEntry

Scalar = str | int | float | bool | None
MOST_ELEMENTS: Final = 16
"""A list longer than this is one cell of a table, as JSON."""
MOST_COLUMNS: Final = 1000
_DEEPEST: Final = 32


def flatten(value: object, *, most: int | None = None) -> dict[str, Scalar]:
    """Take a value apart.

    Args:
        value: A dataclass, a protobuf message, or bytes.
        most: Lists longer than this are one JSON text; None: none is.

    Returns:
        Values by field: `eye[0]`, `pose.position.x`; bytes as hexadecimal digits, under `data` where there is no field.
    """
    found: dict[str, Scalar] = {}
    _put(found, "", value, most, 0)
    return found


def _put(found: dict[str, Scalar], name: str, value: Any, most: int | None, depth: int) -> None:  # noqa: ANN401 - a log's
    if depth > _DEEPEST:
        found[name] = "..."
    elif isinstance(value, bytes):
        found[name or "data"] = value.hex()
    elif value is None or isinstance(value, str | int | float):
        found[name or "data"] = value
    elif (parts := _parts(value)) is not None:
        for part, inner in parts:
            _put(found, f"{name}.{part}" if name else part, inner, most, depth + 1)
    else:
        items = list(value)
        if most is not None and len(items) > most:
            found[name] = json.dumps([flatten(item) if _parts(item) is not None else _plain(item) for item in items])
        else:
            for number, item in enumerate(items):
                _put(found, f"{name}[{number}]", item, most, depth + 1)


def _parts(value: Any) -> Iterator[tuple[str, Any]] | None:  # noqa: ANN401 - likewise
    """Fields of a value that has any; those that a protobuf message may leave out and does are left out."""
    if isinstance(value, Message):
        there = value.DESCRIPTOR.fields
        return ((one.name, getattr(value, one.name)) for one in there if not one.has_presence or value.HasField(one.name))
    if is_dataclass(value):
        return ((one.name, getattr(value, one.name)) for one in fields(value))
    return None


def _plain(item: object) -> object:
    return item.hex() if isinstance(item, bytes) else item


def write_tables(
    path: Path,
    folder: Path,
    topics: Collection[str] | None = None,
    limits: ReadLimits = ReadLimits(),  # noqa: B008 - frozen
    *,
    overwrite: bool = False,
) -> dict[Path, int]:
    """Write a table of each topic of a log: a line an entry, a column a field.

    Args:
        path: The log.
        folder: Where to; made where it does not exist.
        topics: Only these; None is all.
        limits: What the log may unpack to.
        overwrite: Tables that exist are replaced.

    Returns:
        The files, and how many entries each has.

    Raises:
        UnreadableLogError: Nothing could be read.
        LogError: The log cannot be opened, has no such topic, or a table cannot be written.
        OutputExistsError: There is one already, and it may not be replaced.
    """
    reader = LogReader(path, limits)
    columns, senders = _columns(reader, topics)
    if topics is None:
        reader.require_something()
    missing = sorted(set(topics or ()) - set(columns))
    if missing:
        raise LogError(f"{path} has no entries of {', '.join(map(shown, missing[:5]))}: hil log info tells what it has")
    written: dict[Path, int] = {}
    for topic, names in columns.items():
        out = folder / f"{_file_name(topic, set(written), folder)}.csv"
        head = ["log_time", *(["system", "component", "frame"] if topic in senders else []), *names]
        try:
            written[out] = _write(LogReader(path, limits), topic, out, head, overwrite=overwrite)
        except OSError as error:
            raise LogError(f"cannot write the table {out}: {error.strerror}") from error
    return written


def _columns(reader: LogReader, topics: Collection[str] | None) -> tuple[dict[str, list[str]], set[str]]:
    """The columns of each topic, in the order in which they first come, and which topics have senders."""
    columns: dict[str, dict[str, None]] = {}
    senders = set()
    for entry in reader.entries(topics):
        known = columns.setdefault(entry.topic, {})
        if len(known) < MOST_COLUMNS:
            known.update(dict.fromkeys(flatten(entry.value, most=MOST_ELEMENTS)))
        if entry.sender is not None:
            senders.add(entry.topic)
    return {topic: list(known)[:MOST_COLUMNS] for topic, known in sorted(columns.items())}, senders


def _file_name(topic: str, taken: set[Path], folder: Path) -> str:
    """A topic as the name of a file, which nobody else has."""
    name = base = re.sub(r"[^\w.-]+", "_", topic.strip("/")).strip("._")[:100] or "topic"
    number = 1
    while folder / f"{name}.csv" in taken:
        number += 1
        name = f"{base}-{number}"
    return name


def _write(reader: LogReader, topic: str, out: Path, head: list[str], *, overwrite: bool) -> int:
    output, count = Output(out, overwrite=overwrite), 0
    text = TextIOWrapper(output.file, encoding="utf-8", newline="", write_through=True)
    try:
        table = csv.DictWriter(text, head, extrasaction="ignore", restval="")
        table.writeheader()
        for entry in reader.entries([topic]):
            table.writerow(_row(entry))
            count += 1
        text.detach()
        output.finish()
    except BaseException:
        output.discard()
        raise
    return count


def _row(entry: LogEntry) -> dict[str, Scalar]:
    row = flatten(entry.value, most=MOST_ELEMENTS)
    row = {name: _safe(value) for name, value in row.items()}
    if entry.sender is not None:
        row["system"], row["component"], row["frame"] = *entry.sender, entry.frame
    return {**row, "log_time": f"{entry.time:.9f}"}


def _safe(value: Scalar) -> Scalar:
    """A text that no spreadsheet takes for a formula."""
    return f"'{value}" if isinstance(value, str) and value[:1] in {"=", "+", "-", "@"} else value
