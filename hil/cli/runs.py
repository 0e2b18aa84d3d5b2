"""`hil runs`: what was run, and what came of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from hil import runs as folders
from hil.cli import common
from hil.going_on import can_go_on, successor

if TYPE_CHECKING:
    from hil.runs import Run

KEEP = 10
CONTINUED = "continued"


def runs(
    *,
    prune: Annotated[
        bool, typer.Option("--prune", help="Remove old runs; those that go on, or can be gone on with, stay.")
    ] = False,
    keep: Annotated[
        int, typer.Option("--keep", min=0, metavar="N", help="With --prune: the newest so many of every kind stay.")
    ] = KEEP,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="With --prune: do not ask.")] = False,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """List the runs in ./runs, the newest first: when, what, with what result, how large.

    Example: hil runs --prune --keep 5
    """
    among = list(folders.all_runs())
    found = among
    console = common.consoles(as_json=as_json, quiet=quiet)
    if prune:
        found = _old(among, keep)
        if found and not yes:
            size = _size(sum(run.size for run in found))
            for run in found:
                typer.echo(str(run.folder), err=True)
            typer.confirm(f"Remove these {len(found)} runs, {size}?", abort=True, err=True)
        for run in found:
            run.remove()
    if as_json:
        common.print_json([_plain(run, among) for run in found])
    elif quiet:
        for run in found:
            typer.echo(str(run.folder))
    elif prune:
        console.print(f"Removed {len(found)} runs." if found else "Nothing to remove.")
    elif not found:
        console.print(f"There are no runs in {folders.RUNS}.")
    else:
        for line in _lines(found, among):
            console.print(line, markup=False)


def _old(found: list[Run], keep: int) -> list[Run]:
    """Of runs, the newest first, those that go."""
    kept: dict[tuple[str, str], int] = {}
    old = []
    for run in found:
        kind = (run.record.verb, run.record.what)
        kept[kind] = kept.get(kind, 0) + 1
        if kept[kind] <= keep or run.state == folders.RUNNING:
            continue
        later = successor(run, found)
        if later.state != folders.RUNNING if later is not None else not can_go_on(run):
            old.append(run)
    return old


def _state(run: Run, found: list[Run]) -> str:
    """How it stands; one that was cut, and that another has gone on from, needs nothing any more."""
    return run.state if run.state in {folders.RUNNING, folders.DONE} or successor(run, found) is None else CONTINUED


def _result(run: Run) -> str:
    result = run.record.result
    if run.record.state == "failed" and run.record.error:
        return " ".join(run.record.error.split())
    if "win_rate" in result:
        return f"won {result['wins']} of {result['trials']}"
    held_out = result.get("held_out")
    if isinstance(held_out, dict) and "win_rate" in held_out:
        return f"{result.get('maneuvers')} maneuvers, won {held_out['wins']} of {held_out['trials']}"
    if "maneuvers" in result:
        return f"{result['maneuvers']} maneuvers"
    return str(result.get("summary", "")) or run.record.error


def _size(size: float) -> str:
    return f"{size / 1e6:.1f} MB"


def _lines(found: list[Run], among: list[Run]) -> list[str]:
    """A table in which no line is broken, so that a folder can be copied out of it."""
    rows = [("when", "verb", "what", "state", "size", "result", "folder")]
    for run in found:
        record = run.record
        when = record.started.replace("T", " ")[:19]
        rows.append((when, record.verb, record.what, _state(run, among), _size(run.size), _result(run), str(run.folder)))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def _plain(run: Run, among: list[Run]) -> dict[str, object]:
    record = run.record
    return {
        "folder": str(run.folder),
        "started": record.started,
        "verb": record.verb,
        "what": record.what,
        "state": _state(run, among),
        "status": record.status,
        "error": record.error,
        "opponent": record.opponent,
        "robot": record.robot,
        "result": record.result,
        "size": run.size if run.folder.exists() else 0,
    }
