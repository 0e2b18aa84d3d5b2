"""`hil replay`: a log runs the program again."""

from __future__ import annotations

from contextlib import contextmanager, nullcontext
from enum import StrEnum
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


class Destination(StrEnum):
    """What a log is played to."""

    HOST = "host"
    VIEWER = "viewer"


def replay(
    context: typer.Context,
    log: Annotated[
        Path | None,
        typer.Argument(
            metavar="RUN|LOG", help="A run's folder or a log (.mcap), also one cut off; the newest run if left out."
        ),
    ] = None,
    *,
    to: Annotated[
        Destination,
        typer.Option(
            help="host: the program itself, which decides anew. viewer: Foxglove, where it can be played and searched.",
        ),
    ] = Destination.HOST,
    port: Annotated[
        int,
        typer.Option(min=0, max=65535, metavar="PORT", help="With --to viewer: TCP port on this machine; 0: any that is free."),
    ] = 8765,
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

    Examples: hil replay runs/20261128-130501-coach-flat-light; hil replay --to viewer
    """
    console = common.consoles(as_json=as_json, quiet=quiet)
    found = find(log, console, quiet=True)
    limits = lifted(max_chunk)
    _check_destination(context, to)
    if to is Destination.VIEWER:
        from hil.cli.replay_viewer import stream  # noqa: PLC0415 - likewise

        stream(found, limits, console, port=port, as_json=as_json, quiet=quiet)
        return common.EXIT_DONE
    from hil.replaying.host import replay as replay_log  # noqa: PLC0415 - it loads all verbs' jobs

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


def _check_destination(context: typer.Context, to: Destination) -> None:
    """See that there is no option that goes with another destination.

    Raises:
        UsageError: There is.
    """
    others = {"strict", "rerecord", "signing_key", "overwrite"} if to is Destination.VIEWER else {"port"}
    for name in sorted(others):
        if common.was_given(context, name):
            raise common.UsageError(f"--{name.replace('_', '-')} does not go with --to {to}")


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
