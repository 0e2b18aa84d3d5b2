"""What a worker does with a task, wherever it is."""

from __future__ import annotations

import pickle
from typing import TYPE_CHECKING, TypeVar

from hil.working.errors import WorkerError

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")
R = TypeVar("R")


def perform(function: Callable[[T], R], task: T) -> R:
    """Do a task.

    Args:
        function: Does it.
        task: The task.

    Raises:
        WorkerError: It has raised what can't be sent to another process; this has its words.
        Exception: What else it has raised.
    """
    try:
        return function(task)
    except Exception as error:
        if _travels(error):
            raise
        raise WorkerError(f"{type(error).__name__}: {error}") from None


def _travels(error: Exception) -> bool:
    """An error can be sent to another process; one that can't would be taken for the death of a worker."""
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - of what has just been made here
    except Exception:  # noqa: BLE001 - anything can go wrong in it
        return False
    return True
