"""Tasks for a crew, some of them deadly; here, since workers must be able to import them."""

from __future__ import annotations

import multiprocessing
import os
import signal
from typing import TYPE_CHECKING

from firmware_protocol.errors import AddressError
from hil.working import WorkerError

if TYPE_CHECKING:
    from pathlib import Path


def process_of(_task: int) -> int:
    return os.getpid()


def die_once(task: tuple[Path, int]) -> int:
    """Kill the process that does the task first."""
    mark, number = task
    if number == 2 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def die(task: tuple[Path, int]) -> int:
    """Kill every process that does the fourth task, and leave a mark."""
    folder, number = task
    if number == 3:
        (folder / f"{os.getpid()}").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


class UntoldError(Exception):
    """Can't be made again of its words alone."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(f"{first} {second}")


def complain(task: str) -> str:
    if task == "told":
        raise WorkerError("so it is", 4)
    if task == "ours":
        raise AddressError("nowhere", "is no place", "Look elsewhere")
    raise UntoldError("not", task)


def wait_for_ever(mark: Path) -> None:
    mark.touch()
    multiprocessing.Event().wait()


def wait_or_not(mark: Path) -> str:
    if mark.name != "not":
        wait_for_ever(mark)
    return mark.name
