"""`hil log`: what is in a log, is it in order, make it whole, make it small."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from hil.cli import common
from hil.cli.log_arguments import SHOWN, LogArgument, MaxChunkOption, OutLogOption, OverwriteOption, find
from hil.files.outputs import check_output
from hil.mcaplog.checking import check_log
from hil.mcaplog.errors import UnreadableLogError
from hil.mcaplog.limits import lifted
from hil.mcaplog.making.recovery import CopiedLog, recover
from hil.mcaplog.making.slimming import SLIM, kept_of, slim
from hil.mcaplog.reading.overview import LogOverview, overview
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.reading.walking import shown
from hil.mcaplog.writing.writer import CONFIG, CUT, RUN, SIZES, UNINDEXED

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from rich.console import Console

    from hil.mcaplog.limits import ReadLimits

LONGEST = 300
"""Letters of what is wrong with a log."""


def info(
    log: LogArgument = None,
    *,
    sizes: Annotated[
        bool, typer.Option("--sizes", help="Find out what each topic takes, even where all has to be read for it.")
    ] = False,
    max_chunk: MaxChunkOption = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
) -> None:
    """Tell what is in a log: how long, which topics, how often, how large.

    Example: hil log info runs/20261128-130501-coach-flat-light
    """
    from hil.replaying.host import why_not  # noqa: PLC0415 - it loads all that the verbs do

    console = common.consoles(as_json=as_json, quiet=quiet)
    found = overview(find(log, console, quiet=quiet), lifted(max_chunk), sizes=sizes)
    if quiet and not as_json:
        typer.echo(found.health)
        return
    obstacle = why_not(found.path, lifted(max_chunk))
    if as_json:
        common.print_json({**_plain(found), "replayable": not obstacle, "not_replayable_because": obstacle or None})
    else:
        _print(found, console)
        console.print(f"replayable: {f'no: it {obstacle}' if obstacle else 'yes (hil replay)'}")


def _plain(found: LogOverview) -> dict[str, Any]:
    return {
        "log": str(found.path),
        "size": found.size,
        "whole": found.whole,
        "health": found.health,
        "indexed": found.indexed,
        "start": found.start,
        "end": found.end,
        "duration": found.duration,
        "entries": found.entries,
        "topics": [
            {
                "topic": one.topic,
                "schema": one.schema,
                "entries": one.entries,
                "rate": _rate(found, one.entries),
                "size": one.size,
            }
            for one in found.topics
        ],
        "series": [{"time": time, "title": title} for time, title in found.series],
        "all_series": found.all_series,
        "attachments": [
            {"name": name, "media_type": media_type, "size": size} for name, (media_type, size) in found.attachments.items()
        ],
        "metadata": found.metadata,
    }


def _rate(found: LogOverview, entries: int) -> float | None:
    """Entries a second; None where there is no time between the first and the last of the log."""
    return entries / found.duration if found.duration > 0 else None


def _print(found: LogOverview, console: Console) -> None:
    console.print(f"{found.health}")
    long = f"{found.duration / 60:.1f} min" if found.duration >= 120 else f"{found.duration:.2f} s"
    console.print(f"{found.entries:,} entries in {long} of log time, from {found.start:.3f} s to {found.end:.3f} s")
    for time, title in found.series[:20]:
        console.print(f"{time:10.3f} s  {shown(title, SHOWN)}")
    if len(found.series) > 20 or not found.all_series:
        console.print("            and perhaps more: the events of so large a log are looked at near its ends only")
    console.print(_topics(found))
    for name, (media_type, size) in found.attachments.items():
        console.print(f"attached: {shown(name)}, {shown(media_type) or 'of no media type'}, {size:,} bytes")
    for name, values in found.metadata.items():
        if name in {RUN, CONFIG}:
            console.print(f"{name}:")
            for key, value in values.items():
                console.print(f"  {shown(key)}: {_short(value)}")
        elif name == SLIM:
            console.print(f"slim: of the topics it has kept {', '.join(map(shown, kept_of(found.metadata) or ()))}")
        elif name == UNINDEXED:
            console.print("unindexed: small, without an index, which hil log recover adds")
        elif name == CUT:
            console.print(f"cut: it ends before the run did; {shown(values.get('why', ''), LONGEST)}")
        elif name != SIZES:
            console.print(f"{shown(name)}: {len(values)} values")


def _topics(found: LogOverview) -> Table:
    sized = any(one.size is not None for one in found.topics)
    table = Table()
    table.add_column("topic", overflow="fold")
    for head in ("entries", "a second", *(("bytes", "share") if sized else ())):
        table.add_column(head, justify="right", no_wrap=True)
    total = sum(one.size or 0 for one in found.topics) or 1
    for one in found.topics:
        rate, size = _rate(found, one.entries), one.size
        row = [shown(one.topic, SHOWN) or "(not described)", f"{one.entries:,}", "" if rate is None else f"{rate:.1f}"]
        if sized:
            row += ["", ""] if size is None else [f"{size:,}", f"{size / total:.1%}"]
        table.add_row(*row)
    return table


def _short(value: str) -> str:
    line = " ".join(value.split())
    return shown(line, SHOWN) if len(line) <= SHOWN else f"{shown(line, SHOWN)}..."


def check(
    log: LogArgument = None,
    *,
    max_chunk: MaxChunkOption = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
) -> int:
    """Check a log against MCAP's rules, and one of this program against its own; exit status 1 where one is broken.

    Example: hil log check tests/logs/coach.mcap
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    path, limits = find(log, console, quiet=quiet), lifted(max_chunk)
    checked = check_log(path, limits)
    health = "" if checked.passed else _health(path, limits)
    broken = [rule for rule in checked.rules.values() if not rule.passed]
    if as_json:
        common.print_json(
            [
                {
                    "name": rule.name,
                    "passed": rule.passed,
                    "detail": rule.demand,
                    "count": rule.count,
                    "findings": [{"byte": found.offset, "text": found.text} for found in rule.findings],
                }
                for rule in checked.rules.values()
            ]
        )
    else:
        for rule in broken:
            console.print(f"BROKEN: {rule.name} (the rule: {rule.demand})", style="bold")
            for found in rule.findings:
                console.print(f"  byte {found.offset:,}: {found.text}")
            if rule.count > len(rule.findings):
                console.print(f"  and {rule.count - len(rule.findings):,} more")
        if not quiet or broken:
            whose = "MCAP's and ours" if checked.ours else "MCAP's"
            holding = f"{len(checked.rules) - len(broken)} of {len(checked.rules)} rules hold ({whose})"
            console.print(f"{holding}, {len(broken)} BROKEN; the log is {health}" if broken else holding)
    return common.EXIT_FELL_SHORT if broken else common.EXIT_DONE


def _health(path: Path, limits: ReadLimits) -> str:
    """What state a log is in, in which a rule is broken.

    Raises:
        UnreadableLogError: Nothing can.
    """
    reader = LogReader(path, limits)
    for _ in reader.raw_entries():
        pass
    reader.require_something()
    return reader.health(most=1)


def recover_log(
    log: LogArgument = None,
    *,
    out: OutLogOption,
    overwrite: OverwriteOption = False,
    max_chunk: MaxChunkOption = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
) -> int:
    """Make a whole log of all that can be read of a damaged one, or of one that was cut off.

    Example: hil log recover runs/20261128-130501-coach-flat-light -o whole.mcap
    """
    return _make(recover, log, out, lifted(max_chunk), overwrite=overwrite, as_json=as_json, quiet=quiet)


def slim_log(
    log: LogArgument = None,
    *,
    out: OutLogOption,
    overwrite: OverwriteOption = False,
    max_chunk: MaxChunkOption = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
) -> int:
    """Make a log small: what running it again needs, and no more.

    Example: hil log slim runs/20261128-130501-coach-flat-light -o tests/logs/coach.mcap
    """
    return _make(slim, log, out, lifted(max_chunk), overwrite=overwrite, as_json=as_json, quiet=quiet)


def _make(
    how: Callable[..., CopiedLog],
    log: Path | None,
    out: Path,
    limits: ReadLimits,
    *,
    overwrite: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Make a log of another, say what became of it, and return the exit status."""
    console = common.consoles(as_json=as_json, quiet=quiet)
    found = find(log, console, quiet=quiet)
    check_output(out, overwrite=overwrite)
    try:
        made = how(found, out, limits, overwrite=overwrite)
    except UnreadableLogError as error:
        common.complain(str(error))
        return common.EXIT_FELL_SHORT
    _tell(made, console, as_json=as_json, quiet=quiet)
    return common.EXIT_DONE


def _tell(made: CopiedLog, console: Console, *, as_json: bool, quiet: bool) -> None:
    """Say what became of a log."""
    if as_json:
        common.print_json(
            {
                "log": str(made.path),
                "size": made.size,
                "entries": made.entries,
                "metadata": made.metadata,
                "attachments": made.attachments,
                "whole": made.whole,
                "health": made.health,
            }
        )
    elif quiet:
        typer.echo(str(made.path))
    else:
        files = f"{made.metadata} metadata records, {made.attachments} attachments"
        console.print(f"Was:  {made.health}")
        console.print(f"New:  {made.path}: {made.entries:,} entries, {files}, {made.size:,} bytes")
