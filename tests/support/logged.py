"""What is in a log, as tests compare it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil.mcaplog.reading.reader import LogReader

if TYPE_CHECKING:
    from pathlib import Path


def inputs_of(log: Path) -> list[str]:
    """What the bridge was asked for from outside, in order."""
    return [what for entry in LogReader(log).entries(["/bridge/step"]) for what in entry.value.inputs]


def entries_of(log: Path) -> list[tuple[str, int, bytes]]:
    """Topic, log time in ns, and bytes of every entry, in order."""
    return [(entry.topic, entry.log_time, bytes(entry.data)) for entry in LogReader(log).raw_entries()]
