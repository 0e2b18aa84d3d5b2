"""Fault specifications as a user gives them: as text, or in a TOML or JSON file."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from firmware_protocol.errors import FaultSpecError
from firmware_protocol.faults import FaultSpec
from hil.doors import Door

_SUFFIXES: Final = (".toml", ".json")
DOOR: Final = Door("fault file", FaultSpecError, largest=1 << 16, infinite=True)
"""A fault takes 60 bytes; one without an end lasts for an infinite time."""


def read_faults(text: str) -> FaultSpec:
    """Read what a user wrote after `faults=` or `--faults`.

    Args:
        text: A specification such as `drop:0.05,stuck:eye_left@5+3`, or `@` and the path of a file; the `@` may be left out
            where the path ends in `.toml` or `.json`.

    Returns:
        The specification.

    Raises:
        FaultSpecError: Something is wrong with it; the text says where, in a file by its line.
    """
    if not text.startswith("@") and not text.endswith(_SUFFIXES):
        return FaultSpec.parse(text)
    return load_faults(Path(text.removeprefix("@")))


def load_faults(path: Path) -> FaultSpec:
    """Read a fault file.

    Args:
        path: The file; JSON where it ends in `.json`, else TOML.

    Returns:
        The specification.

    Raises:
        FaultSpecError: It can't be read, is no TOML or JSON, or something in it is wrong; the text says in which line.
    """
    document = DOOR.document(path)
    try:
        return FaultSpec.from_table(document.data)
    except FaultSpecError as error:
        raise FaultSpecError(str(document.wrong(error.path, str(error))), error.path) from error
