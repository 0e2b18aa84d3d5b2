"""`hil log viewers`: how a log is opened in other people's viewers."""

from __future__ import annotations

import math
import shlex
from typing import TYPE_CHECKING, Final

from hil.cli import common
from hil.cli.log_arguments import LogArgument, MaxChunkOption, find
from hil.look.viewers.layouts import blueprint_for, layout_for
from hil.mcaplog.limits import lifted
from hil.mcaplog.reading.reader import LogReader
from hil.mcaplog.writing.writer import RUN

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

APPLICATION: Final = "hil"
"""By this name Rerun knows which blueprint belongs to which recording."""


def viewers(
    log: LogArgument = None,
    *,
    max_chunk: MaxChunkOption = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
) -> None:
    """Say how to open a log in Foxglove, Lichtblick and Rerun.

    With which layout, and by which commands; for Rerun they make the log's times dates. Nothing is written or started.

    Example: hil log viewers runs/20261128-130501-coach-flat-light
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    found = find(log, console, quiet=True)
    reader = LogReader(found, lifted(max_chunk))
    topics = {entry.topic for entry in reader.raw_entries()}
    layout, blueprint = layout_for(topics), blueprint_for(topics)
    offset = epoch_offset(reader.metadata.get(RUN, {}))
    commands = rerun_commands(found, blueprint, offset, whole=reader.whole)
    if as_json:
        document = {"log": str(found), "layout": str(layout), "blueprint": str(blueprint), "offset_ns": offset}
        common.print_json({**document, "rerun": commands})
        return
    if topics and reader.index is not None and not reader.index.chunk_count:
        console.print("It is small, without the index that viewers go by. First make one that has it, and look at that:")
        console.print(
            f"    {shlex.join(['hil', 'log', 'recover', str(found), '-o', 'indexed.mcap'])}", markup=False, soft_wrap=True
        )
    console.print(f"Foxglove, Lichtblick: open {found}", markup=False, soft_wrap=True)
    console.print(f"    and import the layout {layout}", markup=False, soft_wrap=True)
    console.print("Rerun:")
    for command in commands:
        console.print(f"    {command}", markup=False, soft_wrap=True)


def epoch_offset(about: Mapping[str, str]) -> int | None:
    """What makes a log's times dates, in ns since 1970, to a microsecond; None where the log does not say when it was.

    Args:
        about: Its metadata record of the run.
    """
    try:
        offset = float(about["wall_clock"]) - float(about.get("log_clock", "0"))
    except (KeyError, ValueError):
        return None
    return round(offset * 1e6) * 1000 if math.isfinite(offset) and 0 < offset < 9e9 else None


def rerun_commands(log: Path, blueprint: Path, offset: int | None, *, whole: bool) -> list[str]:
    """What shows a log in Rerun.

    Args:
        log: The log.
        blueprint: Which panel shows what.
        offset: What makes its times dates, in ns; None: nobody knows.
        whole: The log was not cut off.
    """
    recording = log.with_suffix(".rrd")
    dated = [] if offset is None else ["--timestamp-offset-ns", str(offset)]
    cut = [] if whole else ["--recover"]
    convert = ["rerun", "mcap", "convert", str(log), "-o", str(recording), "--application-id", APPLICATION, *dated, *cut]
    return [shlex.join(convert), shlex.join(["rerun", "--bind", "127.0.0.1", str(recording), str(blueprint)])]
