"""Logs as MCAP files with protobuf entries: the only place that knows MCAP, protobuf and Foxglove's schemas."""

from hil.mcaplog.attachments import LogAttachment
from hil.mcaplog.compare import LogComparison, compare_logs, differences
from hil.mcaplog.errors import LogError, UnreadableLogError
from hil.mcaplog.reader import LogEntry, LogReader
from hil.mcaplog.writer import LogWriter

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
