"""`hil replay`: a log runs the program again."""

from __future__ import annotations

from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from hil.cli import common
from hil.cli.log_arguments import MaxChunkOption, find
from hil.mcaplog.limits import lifted
from hil.signing.key_file import load_key

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from rich.console import Console


def replay(
    log: Annotated[
        Path | None,
        typer.Argument(
            metavar="RUN|LOG", help="A run's folder or a log (.mcap), also one cut off; the newest run if left out."
        ),
    ] = None,
    *,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Compare every entry byte for byte, pictures and words too, not only what was decided."),
    ] = False,
    rerecord: Annotated[
        Path | None,
        typer.Option(
            "--rerecord",
            metavar="OUT.mcap",
            help="Instead: do the same again on the same emulated robot, write a new log, and show what differs in the two.",
        ),
    ] = None,
    signing_key: Annotated[
        Path | None, typer.Option("--signing-key", metavar="FILE", help="Key file of a run whose frames were signed.")
    ] = None,
    max_chunk: MaxChunkOption = None,
    overwrite: common.OverwriteOption = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> int:
    """Do again what a log has recorded, on what it has recorded, and compare what is decided, up to the first difference.

    No robot is needed, nothing that the log names is opened, and nothing is written. Exit status: 0 the same, 1 there is a
    difference, 2 this log can't be replayed.

    Example: hil replay runs/20261128-130501-coach-flat-light
    """
    from hil.replaying.host import replay as replay_log  # noqa: PLC0415 - it loads all verbs' jobs

    console = common.consoles(as_json=as_json, quiet=quiet)
    found = find(log, console, quiet=True)
    limits = lifted(max_chunk)
    if rerecord is not None:
        from hil.cli.rerecord import rerecorded  # noqa: PLC0415 - likewise

        if strict:
            raise common.UsageError("--strict and --rerecord exclude each other: a new log is compared whole")
        return rerecorded(found, rerecord, limits, console, overwrite=overwrite, as_json=as_json, quiet=quiet)
    key = load_key(signing_key) if signing_key is not None else None
    with _progress(console, quiet=quiet) as told:
        report = replay_log(found, strict=strict, signing_key=key, limits=limits, progress=told)
    if as_json:
        common.print_json(report.to_dict())
    elif not quiet or not report.same:
        typer.echo(str(report))
    return common.EXIT_DONE if report.same else common.EXIT_FELL_SHORT


def _progress(console: Console, *, quiet: bool) -> AbstractContextManager[Callable[[float], object] | None]:
    """A bar that follows the reading of the log, where there is a terminal for it."""
    if quiet or not console.is_terminal:
        return nullcontext()
    return _bar(console)


@contextmanager
def _bar(console: Console) -> Iterator[Callable[[float], object]]:
    columns = TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn()
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("Replaying", total=1.0)
        yield lambda share: progress.update(task, completed=share)
