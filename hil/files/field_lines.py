"""Where in a TOML or JSON file a field stands, for messages to people."""

from __future__ import annotations

import re


def line_of(text: str, path: str) -> int:
    """Find a field.

    Args:
        text: Text of the file, TOML or indented JSON.
        path: The field, as `entries[3].actions[1]`.

    Returns:
        Its line, from 1, or else that of its table; 0 where it can't be told.
    """
    lines = text.splitlines()
    start, within = 0, _top(lines)
    for name, index in re.findall(r"([\w-]+)(?:\[(\d+)\])?", path):
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
