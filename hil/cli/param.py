"""`hil param`: lists, reads and writes a robot's parameters."""

from __future__ import annotations

import tomllib
from functools import partial
from pathlib import Path
from typing import Annotated

import tomli_w
import typer
from rich.console import Console
from rich.table import Table

from firmware_protocol.address import parse_address
from firmware_protocol.errors import RefusedError
from firmware_protocol.parameters import PARAMETERS
from hil.cli import common
from hil.cli.session import others_beside
from hil.connecting import connect
from hil.files import replace_file


def param(
    link: Annotated[str, typer.Argument(metavar="LINK", help="Address of the robot, as serial:///dev/ttyACM0:115200.")],
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="Which parameter; all of them if left out.")] = None,
    value: Annotated[float | None, typer.Argument(metavar="VALUE", help="New value.")] = None,
    *,
    save: Annotated[Path | None, typer.Option("--save", metavar="FILE.toml", help="Write all parameters to a file.")] = None,
    load: Annotated[Path | None, typer.Option("--load", metavar="FILE.toml", help="Set parameters from a file.")] = None,
    signing_key: common.SigningKeyOption = None,
    as_json: common.JsonOption = False,
    quiet: common.QuietOption = False,
    config: common.ConfigOption = None,  # noqa: ARG001 - handled while parsing
) -> None:
    """List, read, write, save or load a robot's parameters. The robot keeps them when it is switched off.

    Example: hil param serial:///dev/ttyACM0:115200 EYE_L_ON 300
    """
    if name is not None and (save or load):
        raise common.UsageError("give a NAME, or --save or --load, not both")
    wanted = _read(load) if load else {}
    console = common.consoles(as_json=as_json, quiet=quiet)
    with connect(link, signing_key=signing_key) as junior:
        if not quiet:
            notices = console if as_json else Console(stderr=True, highlight=False, soft_wrap=True)  # stdout has values only
            if junior.bridge.pace is not None:
                notices.print(f"{link}: {junior.bridge.pace.text}", markup=False)
            common.tell_others(
                junior.peer.system, others_beside(junior, parse_address(link)), link, partial(notices.print, markup=False)
            )
        try:
            if name is not None:
                result = {name: junior.parameter(name) if value is None else junior.set_parameter(name, value)}
            else:
                for key, number in wanted.items():
                    junior.set_parameter(key, number)
                result = junior.parameters()
        except RefusedError as error:
            raise common.UsageError(str(error)) from error
    if save:
        try:
            replace_file(save, tomli_w.dumps(result).encode())
        except OSError as error:
            raise common.UsageError(f"cannot write {save}: {error.strerror}") from error
    if as_json:
        common.print_json(result)
    elif name is not None:
        typer.echo(f"{result[name]:g}")
    elif not quiet:
        _show(console, result)


def _read(path: Path) -> dict[str, float]:
    read_only = {parameter.name for parameter in PARAMETERS if parameter.read_only}
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise common.UsageError(f"cannot read {path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise common.UsageError(f"{path} is no valid TOML: {error}") from error
    for key, number in document.items():
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise common.UsageError(f"{path}: {key} must be a number, not {number!r}")
    return {key: float(number) for key, number in document.items() if key not in read_only}


def _show(console: Console, values: dict[str, float]) -> None:
    known = {parameter.name: parameter for parameter in PARAMETERS}
    table = Table(box=None)
    for head in ("parameter", "value", "unit", "default", "range", "what it does"):
        table.add_column(head, justify="right" if head in {"value", "default"} else "left")
    for key, number in values.items():
        about = known.get(key)
        if about is None:
            table.add_row(key, f"{number:g}", "", "", "", "not known to this program")
            continue
        bounds = "read only" if about.read_only else f"{about.minimum:g} to {about.maximum:g}"
        table.add_row(key, f"{number:g}", about.unit, f"{about.default:g}", bounds, about.text)
    console.print(table)
