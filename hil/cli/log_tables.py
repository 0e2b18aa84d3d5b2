"""`hil log csv` and `hil log diff`: what a log holds as tables, and what differs between two."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from hil.cli import common
from hil.cli.log_arguments import SHOWN, LogArgument, MaxChunkOption, OverwriteOption, find
from hil.files.outputs import OutputError
from hil.mcaplog.compare import LogComparison, TopicComparison, compare_logs
from hil.mcaplog.limits import lifted
from hil.mcaplog.reading.flattening import write_tables
from hil.mcaplog.reading.walking import shown
from hil.replaying.difference import parting

if TYPE_CHECKING:
    from rich.console import Console

TopicOption = Annotated[
    list[str] | None, typer.Option("--topic", metavar="TOPIC", help="Only this topic; may be given several times.")
]
MOST_METADATA = 20
SENT = "/wire/tx"


def csv(
    log: LogArgument = None,
    *,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FOLDER", help="Where the tables go; made if need be.")],
    topic: TopicOption = None,
    overwrite: OverwriteOption = False,
    max_chunk: MaxChunkOption = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
) -> None:
    """Write a table of each topic: a line for each entry, a column for each field.

    Example: hil log csv runs/20261128-130501-coach-flat-light --topic /junior/sensors -o tables
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    found = find(log, console, quiet=quiet)
    if out.exists() and not out.is_dir():
        raise OutputError(f"cannot write tables to {out}: it is no folder")
    written = write_tables(found, out, topic, lifted(max_chunk), overwrite=overwrite)
    if as_json:
        common.print_json([{"table": str(path), "entries": count} for path, count in written.items()])
        return
    for path, count in written.items():
        typer.echo(str(path)) if quiet else console.print(f"{path}: {count:,} entries")


def diff(
    first: Annotated[Path, typer.Argument(metavar="A", help="A run's folder or a log (.mcap).")],
    second: Annotated[Path, typer.Argument(metavar="B", help="Another.")],
    *,
    topic: TopicOption = None,
    max_chunk: MaxChunkOption = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
) -> int:
    """Tell what differs between two logs, by topic and field; exit status 1 where anything does.

    Example: hil log diff before.mcap after.mcap
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    one, two = find(first, console, quiet=True), find(second, console, quiet=True)
    found = compare_logs(one, two, topic, limits=lifted(max_chunk))
    require_compared(found)
    if as_json:
        common.print_json({"first": str(one), "second": str(two), "same": found.same, **asdict(found)})
    elif not quiet:
        print_comparison(found, console)
    return common.EXIT_DONE if found.same else common.EXIT_FELL_SHORT


def require_compared(found: LogComparison) -> None:
    """See that two logs of which nothing differs have anything in common.

    Args:
        found: How they compare.

    Raises:
        UsageError: They have no such entry.
    """
    if found.same and not found.compared:
        raise common.UsageError("the two logs have no such entries: there is nothing to compare")


def print_comparison(found: LogComparison, console: Console) -> None:
    """Print how two logs compare.

    Args:
        found: How they do.
        console: Where to.
    """
    for name, health in zip("AB", found.health, strict=True):
        if not health.startswith("whole"):
            console.print(f"{name} is {health}")
    differing = sorted((topic for topic in found.topics if topic.difference), key=_begins)
    common_topics = sum(1 for topic in found.topics if topic.first and topic.second)
    if found.same:
        console.print(f"No difference in {found.compared:,} entries of {common_topics} topics")
    else:
        sent = next((topic for topic in found.topics if topic.topic == SENT), None)
        if sent is not None:
            console.print(f"What is sent to the robot ({SENT}) {'DIFFERS' if sent.difference else 'is the same'}")
    if found.behind_cut:
        console.print(f"{found.behind_cut:,} entries more of one log come behind where the other was cut off: not compared")
    if found.left_out:
        console.print(f"Slim logs never have {len(found.left_out)} of the topics: not compared")
    if differing:
        console.print(_table(differing))
        for topic in differing:
            _explain(topic, console)
    for name, key, a, b in found.metadata[:MOST_METADATA]:
        console.print(f"metadata {shown(name)}, {shown(key) or 'the whole of it'}: {' in A, '.join(_values(a, b))} in B")
    if len(found.metadata) > MOST_METADATA:
        console.print(f"and {len(found.metadata) - MOST_METADATA} more differences in metadata")
    for name in found.attachments:
        console.print(f"attachment {shown(name)} differs, or only one log has it")


def _table(differing: list[TopicComparison]) -> Table:
    table = Table()
    table.add_column("topic", no_wrap=True, overflow="fold")
    for head in ("in A", "in B", "differ"):
        table.add_column(head, justify="right")
    table.add_column("in the fields", overflow="fold")
    for topic in differing:
        most = sorted(topic.fields.items(), key=lambda counted: -counted[1])
        named = ", ".join(f"{shown(name)} ({count:,})" for name, count in most[:6]) + (", ..." if len(most) > 6 else "")
        table.add_row(
            _name(topic),
            f"{topic.first:,}",
            f"{topic.second:,}",
            f"{topic.differing:,}",
            named,
        )
    return table


def _begins(topic: TopicComparison) -> tuple[float, str]:
    return (topic.difference.time if topic.difference else 0.0), topic.topic


def _explain(topic: TopicComparison, console: Console) -> None:
    at = topic.difference
    if at is not None:
        where = f"{_name(topic)}, entry {at.number:,} at {at.time:.6f} s, {shown(at.field, SHOWN)}"
        if topic.first and topic.second:
            first, second = _values(at.first, at.second)
            console.print(f"{where}: {first} in A, {second} in B")
        else:
            console.print(f"{_name(topic)} is in {'A' if topic.first else 'B'} only")


def _name(topic: TopicComparison) -> str:
    return shown(topic.topic, SHOWN) or "(not described)"


def _values(first: object, second: object) -> tuple[str, str]:
    """Two values, from a little before where they differ."""
    texts = [None if value is None else repr(value) for value in (first, second)]
    one, two = (text or "" for text in texts)
    alike = parting(one, two) if max(len(one), len(two)) > SHOWN else 0
    begin = max(0, alike - SHOWN // 5)
    return _excerpt(texts[0], begin), _excerpt(texts[1], begin)


def _excerpt(text: str | None, begin: int) -> str:
    if text is None:
        return "nothing"
    end = begin + SHOWN
    return f"{'...' if begin else ''}{text[begin:end]}{'...' if end < len(text) else ''}"
