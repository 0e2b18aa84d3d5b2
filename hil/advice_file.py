"""Advice files: what was learnt, for people to read and for robots to play by (`*.advice.toml` or `.json`)."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import tomli_w

from firmware_protocol.errors import HilError
from hil.field_lines import line_of
from hil.files import read_document, replace_file
from pal_advisor.maneuvers import Advice, AdviceError

if TYPE_CHECKING:
    from pathlib import Path

HEADER = """\
# Advice for Junior: for every situation the maneuver that Pal found best.
# "current" is what the eyes (and arms) sense now, "previous" what they sensed when the last maneuver began.
"""


class AdviceFileError(HilError):
    """An advice file can't be read, or a field of it is wrong; the text names the file, the line and the field."""


def save_advice(advice: Advice, path: Path) -> None:
    """Write an advice file, whole or not at all.

    Args:
        advice: What was learnt.
        path: Where to; `.json` writes JSON, anything else TOML.

    Raises:
        AdviceFileError: It can't be written.
    """
    data = advice.to_dict()
    text = json.dumps(data, indent=2) + "\n" if path.suffix == ".json" else HEADER + tomli_w.dumps(data)
    try:
        replace_file(path, text.encode())
    except OSError as error:
        raise AdviceFileError(f"cannot write {path}: {error.strerror}") from error


def load_advice(path: Path) -> Advice:
    """Read and validate an advice file.

    Args:
        path: The file.

    Returns:
        The advice.

    Raises:
        AdviceFileError: It can't be read, is no TOML or JSON, or a field is missing, unknown or wrong.
    """
    text, data = read_document(path, AdviceFileError, kind="advice")
    try:
        return Advice.from_dict(data)
    except AdviceError as error:
        line = line_of(text, error.path)
        where = f"{path}, line {line}" if line else str(path)
        raise AdviceFileError(f"{where}: {error}") from error
