"""Advice files: what was learnt, for people to read and for robots to play by (`*.advice.toml` or `.json`)."""

from __future__ import annotations

import json
import re
import tomllib
from typing import TYPE_CHECKING, Any

import tomli_w

from firmware_protocol.errors import HilError
from hil.files import replace_file
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
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise AdviceFileError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise AdviceFileError(f"{path} is no text file: {error}") from error
    try:
        data: Any = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise AdviceFileError(f"{path}: {error}") from error
    except RecursionError as error:
        raise AdviceFileError(f"{path} is no advice: it is nested too deeply") from error
    try:
        return Advice.from_dict(data)
    except AdviceError as error:
        line = _line_of(text, error.path)
        where = f"{path}, line {line}" if line else str(path)
        raise AdviceFileError(f"{where}: {error}") from error


def _line_of(text: str, path: str) -> int:
    """Line (from 1) where a field such as `entries[3].actions[1]` stands, or else its table; 0 where it can't be told."""
    lines = text.splitlines()
    start, within = 0, _top(lines)
    for name, index in re.findall(r"(\w+)(?:\[(\d+)\])?", path):
        header = re.compile(rf'^\s*(?:\[+{re.escape(name)}\]+|\[[\w.]*\b{re.escape(name)}\]|"?{re.escape(name)}"?\s*[=:])')
        found = [number for number in within if header.match(lines[number])]
        if not found:
            break
        element = int(index) if index else 0
        tables = [number for number in found if lines[number].lstrip().startswith("[[")]
        start = tables[element] if element < len(tables) else found[0]
        if index and not tables:
            start = _element(lines, start, element)
        within = [*range(start + 1, _end(lines, start))]
    else:
        return start + 1
    return start + 1 if start else 0


def _top(lines: list[str]) -> list[int]:
    """Lines of fields and tables that are not within a table."""
    if lines and lines[0].startswith("{"):
        depth = _indent(lines[1]) if len(lines) > 1 else 0
        return [number for number in range(1, len(lines)) if _indent(lines[number]) == depth]
    first = next((number for number, line in enumerate(lines) if line.startswith("[")), len(lines))
    return [number for number, line in enumerate(lines) if number < first or line.startswith("[")]


def _end(lines: list[str], start: int) -> int:
    """Where the table or list that begins at a line ends: the line behind it."""
    if lines[start].lstrip().startswith("["):  # TOML: at the next table
        after = (number for number in range(start + 1, len(lines)) if lines[number].lstrip().startswith("["))
    else:  # a list, or JSON: at the bracket that stands no deeper
        depth = _indent(lines[start])
        after = (number for number in range(start + 1, len(lines)) if _indent(lines[number]) <= depth)
    return next(after, len(lines))


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _element(lines: list[str], start: int, index: int) -> int:
    """Line of the index-th element of a JSON list of objects, or of a list with one element a line."""
    if lines[start].rstrip().endswith("["):
        indent = _indent(lines[start + 1]) if start + 1 < len(lines) else 0
        same = [
            number
            for number in range(start + 1, len(lines))
            if _indent(lines[number]) == indent and not re.match(r"\s*[\]}]", lines[number])
        ]
        if index < len(same):
            return same[index]
    return start
