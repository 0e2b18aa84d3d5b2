"""Configuration files: values for the options of a sub-command (`--config FILE.toml`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.errors import HilError
from firmware_protocol.near import did_you_mean
from hil.doors import Door

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path


class ConfigFileError(HilError):
    """A configuration file can't be read, or sets something that is no option or not as it should be."""


DOOR: Final = Door("configuration file", ConfigFileError, largest=1 << 16)


def load_config(path: Path, verb: str, options: Mapping[str, Callable[[object], object]]) -> dict[str, Any]:
    """Read the options of a sub-command from a TOML file.

    A table named as the sub-command holds its options; keys outside any table apply where they fit.

    Args:
        path: The file.
        verb: The sub-command.
        options: By name, with underscores, what makes a value one that the option takes; it raises ValueError, with what was
            expected, where there is none.

    Returns:
        Values by name, with underscores: each is one that its option takes.

    Raises:
        ConfigFileError: The file can't be read, is no TOML, or has a key that is no option or a value that none takes.
    """
    document = DOOR.document(path, json=False)
    data: dict[str, Any] = document.data
    table = data.get(verb, {})
    if not isinstance(table, dict):
        raise document.wrong(verb, f"[{verb}] must be a table")
    found: dict[str, Any] = {}
    general = {key: value for key, value in data.items() if not isinstance(value, dict)}
    for values, inside in ((general, ""), (table, f"{verb}.")):
        for key, value in values.items():
            name = key.replace("-", "_")
            if name not in options or name == "config":
                known = sorted(name.replace("_", "-") for name in options if name != "config")
                meant = did_you_mean(key, known)
                raise document.wrong(inside + key, f"unknown option {key[:40]!r}; known are {', '.join(known)}{meant}")
            try:
                found[name] = options[name](value)
            except ValueError as error:
                raise document.wrong(inside + key, f"--{name.replace('_', '-')}: {error}") from error
    return found
