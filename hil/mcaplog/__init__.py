"""Logs as MCAP files with protobuf entries: the only place that knows MCAP, protobuf and Foxglove's schemas.

Names are loaded when they are first used: what writes a log, in a process of its own, does not wait for what reads one.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from hil.mcaplog.attachments import LogAttachment
    from hil.mcaplog.compare import LogComparison, compare_logs, differences
    from hil.mcaplog.errors import LogError, UnreadableLogError
    from hil.mcaplog.reading.reader import LogEntry, LogReader
    from hil.mcaplog.writing.writer import LogWriter

_HOMES: Final = {
    "LogAttachment": "hil.mcaplog.attachments",
    "LogComparison": "hil.mcaplog.compare",
    "LogEntry": "hil.mcaplog.reading.reader",
    "LogError": "hil.mcaplog.errors",
    "LogReader": "hil.mcaplog.reading.reader",
    "LogWriter": "hil.mcaplog.writing.writer",
    "UnreadableLogError": "hil.mcaplog.errors",
    "compare_logs": "hil.mcaplog.compare",
    "differences": "hil.mcaplog.compare",
}

__all__ = [
    "LogAttachment",
    "LogComparison",
    "LogEntry",
    "LogError",
    "LogReader",
    "LogWriter",
    "UnreadableLogError",
    "compare_logs",
    "differences",
]


def __getattr__(name: str) -> object:
    """Load a public name (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
