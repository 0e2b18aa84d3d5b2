"""What a shell is told that completes a command line: options of a verb that is not imported for it.

`completion.json` beside this holds the options of all verbs, as tests/support/completion_table.py reads them off the verbs
themselves; the tests compare the two. A verb that it does not know is imported.
"""

from __future__ import annotations

import inspect
import json
from functools import cache
from importlib.resources import files
from typing import Annotated, Any, Final

import typer
from typer.main import get_command

LINKS: Final = "LINK"
"""In the place of words: the addresses that this machine may have."""


def link_words() -> list[str]:
    """What may stand for an address and is known here: `auto`, and the serial ports."""
    from firmware_protocol.links.serial import list_ports  # noqa: PLC0415 - pyserial takes a moment to load

    return ["auto", *(port.device for port in list_ports())]


@cache
def _table() -> dict[str, list[dict[str, Any]]]:
    found: dict[str, list[dict[str, Any]]] = json.loads(files("hil.cli").joinpath("completion.json").read_text("utf-8"))
    return found


def described(home: str) -> Any:  # noqa: ANN401 - typer brings a click of its own, or not
    """A command that has the options of a verb and does nothing.

    Args:
        home: Where the verb is, as of `Verb`.

    Returns:
        The command; None where the table does not know the verb.
    """
    if home not in _table():
        return None

    def nothing(**_: object) -> None:
        """Do nothing."""

    parameters = [_parameter(f"p{number}", row) for number, row in enumerate(_table()[home])]
    nothing.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    nothing.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    app.command()(nothing)
    return get_command(app)


def _parameter(name: str, row: dict[str, Any]) -> inspect.Parameter:
    """An option or an argument of the table, as typer reads it off a function."""
    words = row.get("words", [])
    told = link_words if words == LINKS else (lambda: list(words)) if words else None
    kind: Any = list[str] | None if row.get("many") else str | None
    if not row["names"]:
        annotation: Any = Annotated[kind, typer.Argument(autocompletion=told)]
        return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)
    if row.get("flag"):
        annotation = Annotated[bool, typer.Option(*row["names"], help=row["help"])]
        return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=annotation)
    annotation = Annotated[kind, typer.Option(*row["names"], help=row["help"], autocompletion=told)]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)
