"""Fault specifications as a user gives them: as text, or in a TOML or JSON file."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from firmware_protocol.errors import FaultSpecError
from firmware_protocol.faults.spec import FaultSpec
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
    path = _path(text)
    return FaultSpec.parse(text) if path is None else load_faults(path)


def fault_file_of(text: str) -> bytes | None:
    """The content of the file that a user wrote after `faults=`; None where it was none.

    Args:
        text: As for `read_faults`.

    Raises:
        FaultSpecError: It can't be read.
    """
    path = _path(text)
    return None if path is None else DOOR.read(path)


def _path(text: str) -> Path | None:
    """The file that is named; None where the text is a specification."""
    return Path(text.removeprefix("@")) if text.startswith("@") or text.endswith(_SUFFIXES) else None


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
