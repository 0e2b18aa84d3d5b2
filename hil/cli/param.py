"""`hil param`: lists, reads and writes a robot's parameters."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tomli_w
import typer
from rich.table import Table

from firmware_protocol.errors import RefusedError
from firmware_protocol.near import did_you_mean
from hil.cli import common, links
from hil.cli.running import running
from hil.cli.stage import LiveStage
from hil.files.outputs import OutputError, check_output, write_output
from hil.files.parameter_loading import KNOWN, read_parameters
from hil.jobs.param import ParamJob

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import Console


def param(
    link: common.RobotArgument,
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="Which parameter; all of them if left out.")] = None,
    value: Annotated[float | None, typer.Argument(metavar="VALUE", help="New value.")] = None,
    *,
    save: Annotated[Path | None, typer.Option("--save", metavar="FILE.toml", help="Write all parameters to a file.")] = None,
    overwrite: common.OverwriteOption = False,
    load: Annotated[
        Path | None,
        typer.Option("--load", metavar="FILE.toml", help="Set parameters from a file: all of them, or, if one fails, none."),
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="With --load: the robot's own SYS_ID too.")] = False,
    yes: links.YesOption = False,
    signing_key: common.SigningKeyOption = None,
    out: common.OutOption = None,
    log: common.LogOption = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,
) -> int:
    """List, read, write, save or load a robot's parameters. The robot keeps them when it is switched off.

    No log is written, unless --log or --out says where.

    Example: hil param /dev/ttyACM0 EYE_L_ON 300
    """
    if name is not None and (save or load):
        raise common.UsageError("give a NAME, or --save or --load, not both")
    if everything and load is None:
        raise common.UsageError("--all goes with --load")
    link = links.settled(link, yes=yes, quiet=quiet, signing_key=signing_key)
    if save:
        check_output(save, overwrite=overwrite)
    wanted = read_parameters(load, everything=everything) if load else None
    console = common.consoles(as_json=as_json, quiet=quiet)
    notices = console if as_json else common.plain_console(stderr=True)  # stdout has values only
    warn = partial(notices.print, markup=False)
    tell = (lambda _: None) if quiet else warn
    job = ParamJob(name, value, wanted, everything, tell=tell, warn=warn)
    with running(
        "param",
        "robot",
        url=link,
        signing_key=signing_key,
        out=out,
        log=log,
        no_log=log is None and out is None,
        overwrite=overwrite,
    ) as run:
        stage = LiveStage(run, job, link, notices, quiet=quiet, signing_key=signing_key, options=config)
        try:
            result = job.perform(stage)
        except RefusedError as error:
            meant = did_you_mean(name, KNOWN) if name is not None and name not in KNOWN else ""
            raise common.UsageError(f"{error}{meant}") from error
        run.finish({"parameters": result})
    if save:
        _save(result, save, console, overwrite=overwrite, quiet=quiet)
    if as_json:
        common.print_json(result)
    elif name is not None:
        typer.echo(result[name])
    elif not quiet:
        _show(console, result)
    return run.ended()


def _save(values: Mapping[str, float], path: Path, console: Console, *, overwrite: bool, quiet: bool) -> None:
    try:
        write_output(path, tomli_w.dumps(values).encode(), overwrite=overwrite)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error
    if not quiet:
        console.print(f"Saved: {path}", markup=False)


def _show(console: Console, values: Mapping[str, float]) -> None:
    table = Table(box=None)
    for head in ("parameter", "value", "unit", "default", "range", "what it does"):
        table.add_column(head, justify="right" if head in {"value", "default"} else "left")
    for key, number in values.items():
        about = KNOWN.get(key)
        if about is None:
            table.add_row(key, str(number), "", "", "", "not known to this program")
            continue
        bounds = "read only" if about.read_only else f"{about.minimum:g} to {about.maximum:g}"
        table.add_row(key, str(number), about.unit, f"{about.default:g}", bounds, about.text)
    console.print(table)
