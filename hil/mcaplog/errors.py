"""What can go wrong with a log file."""

from __future__ import annotations

from firmware_protocol.errors import HilError


class LogError(HilError):
    """A log cannot be written or opened; the text says which, why, and what to do.

    Damage inside a log never raises: the reader gives what it can and says how much that was.
    """


class UnreadableLogError(LogError):
    """There is something in a log, and nothing of it could be read."""
