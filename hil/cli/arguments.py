"""What the command line and a configuration file may say, beyond what typer sees to."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer
from typer.core import TyperCommand

from hil.cli.help_page import HelpContext
from hil.files import config_file

if TYPE_CHECKING:
    from collections.abc import Callable

_NEGATIVE: Final = re.compile(r"-(?:\d|\.\d)")
"""How a negative number begins: no option of ours does."""
_TABLES: Final = {"junior": "emulate", "swarm": "emulate-swarm"}
"""Tables of the sub-commands of `hil emulate` in a configuration file."""


class Subcommand(TyperCommand):
    """A sub-command whose arguments may be negative numbers."""

    context_class = HelpContext

    def collect_usage_pieces(self, ctx: Any) -> list[str]:  # noqa: ARG002, ANN401 - typer brings a click of its own, or not
        """Name the arguments as a user reads them: one that may be left out in brackets."""
        pieces = ["[OPTIONS]"]
        for parameter in self.params:
            if parameter.param_type_name == "argument":
                name = parameter.metavar or str(parameter.name).upper()
                name = name if parameter.required else f"[{name}]"
                pieces.append(name if parameter.nargs == 1 else f"{name}...")
        return pieces

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer brings a click of its own, or not
        """Take the command line apart; a number with a minus sign is no option."""
        taking = {name for parameter in self.params if not getattr(parameter, "is_flag", False) for name in parameter.opts}
        before = ["", *args]
        numbers = [
            f" {word}" if _NEGATIVE.match(word) and last not in taking else word
            for last, word in zip(before, args, strict=False)
        ]
        return super().parse_args(ctx, numbers)


def load_config(context: typer.Context, path: Path | None) -> Path | None:
    """Take option values from a TOML file; what stands on the command line wins.

    Args:
        context: The sub-command being parsed.
        path: The file.

    Returns:
        The path, unchanged.

    Raises:
        typer.BadParameter: The file can't be read, is no TOML, or has a key or a value that the sub-command does not take.
    """
    if path is None:
        return None
    options = {parameter.name: _taker(context, parameter) for parameter in context.command.params if parameter.name}
    try:
        name = str(context.info_name)
        found = config_file.load_config(path, _TABLES.get(name, name), options)
    except config_file.ConfigFileError as error:
        raise typer.BadParameter(str(error)) from error
    context.default_map = {**(context.default_map or {}), **found}
    return path


def _taker(context: typer.Context, parameter: Any) -> Callable[[object], object]:  # noqa: ANN401 - click's, whoever brings it
    """What makes the value of a file one that an option takes."""

    def one(value: object) -> object:
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise ValueError(f"expected a text or a number, not {_shown(value)}")  # noqa: TRY004 - as it is asked for
        try:
            parameter.process_value(context, [str(value)] if many else str(value))
        except typer.BadParameter as error:
            raise ValueError(error.message[:300]) from error
        return str(value)

    flag = bool(getattr(parameter, "is_flag", False))
    many = bool(getattr(parameter, "multiple", False)) or parameter.nargs != 1

    def take(value: object) -> object:
        if flag:
            if not isinstance(value, bool):
                raise ValueError(f"expected true or false, not {_shown(value)}")
            return value
        if many:
            if not isinstance(value, list):
                raise ValueError(f"expected a list, not {_shown(value)}")
            return [one(item) for item in value]
        return one(value)

    return take


def _shown(value: object) -> str:
    """A value of a file, short."""
    if isinstance(value, list | dict):
        return "a list" if isinstance(value, list) else "a table"
    return str(value).lower() if isinstance(value, bool) else repr(value)[:60]
