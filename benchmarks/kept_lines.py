"""What a benchmark has made, kept in a file, a line of JSON for each piece, so that it goes on where it was broken off."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from hil.working import Crew

T = TypeVar("T")
R = TypeVar("R")


def kept(path: Path) -> Iterator[Any]:
    """What was made before, as plain values; a last line that was cut short counts as not made.

    Args:
        path: The file, which need not be there.

    Yields:
        What each line says.
    """
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            yield json.loads(line)
        except ValueError:
            continue


def make(
    crew: Crew, function: Callable[[T], R], tasks: Sequence[T], path: Path, line: Callable[[T, R], Any]
) -> Iterator[tuple[T, R]]:
    """Make what is missing; each is kept as soon as it is made, and how many there are is told.

    Args:
        crew: Who makes it.
        function: Makes one.
        tasks: What is missing.
        path: The file.
        line: What is kept of a task and its result, as plain values.

    Yields:
        Task and result, in order.
    """
    cut_short = path.exists() and not path.read_bytes().endswith(b"\n")
    with path.open("a", encoding="utf-8") as file:
        if cut_short:
            file.write("\n")
        for number, (task, result) in enumerate(zip(tasks, crew.in_order(function, tasks), strict=True), start=1):
            file.write(json.dumps(line(task, result)) + "\n")
            file.flush()
            sys.stderr.write(f"\r{number}/{len(tasks)} ")
            yield task, result
