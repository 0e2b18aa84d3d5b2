"""What can go wrong with workers."""

from __future__ import annotations

from firmware_protocol.errors import HilError


class WorkerError(HilError):
    """A worker has ended, can't be had, or could not do its task; the text says which, and what to do.

    Attributes:
        status: Exit status of a program that ends by this.
    """

    def __init__(self, text: str, status: int = 1) -> None:
        super().__init__(text)
        self.status = status
