"""Processes of our own that share a computation: the same result however many there are, and none is left behind.

What is to be done is cut into tasks that know nothing of each other, in a way that does not depend on the number of workers.
Tasks and results go between these processes by `pickle`, over pipes that nobody else has: no file, no port.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from threading import Thread
from typing import TYPE_CHECKING, Final, TypeVar

from firmware_protocol.errors import HilError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence
    from types import FrameType

T = TypeVar("T")
R = TypeVar("R")

MOST_WORKERS: Final = 256
_FROM_THE_TERMINAL: Final = ("SIGINT", "SIGHUP")
"""Signals that a terminal sends to every process in it: only the first one acts on them, and ends the others."""


class WorkerError(HilError):
    """A worker has ended, or could not do its task; the text says which, and what to do.

    Attributes:
        status: Exit status of a program that ends by this.
    """

    def __init__(self, text: str, status: int = 1) -> None:
        super().__init__(text)
        self.status = status


def in_order(function: Callable[[T], R], tasks: Sequence[T], workers: int) -> Generator[R]:
    """Do tasks in processes of their own.

    The caller's main module is loaded by them too, so it must do nothing when it is imported.

    Args:
        function: Does a task; of a module, as are the tasks' types and the results'.
        tasks: The tasks.
        workers: Processes, 1..`MOST_WORKERS`; there are never more than tasks.

    Yields:
        The results, in the order of the tasks, each as soon as those before it are there. Closing the generator ends the
        workers.

    Raises:
        WorkerError: A worker has ended before its task was done.
    """
    with _pool(min(workers, len(tasks))) as pool:
        with _kept_from_the_terminal():
            futures = [pool.submit(_perform, function, task) for task in tasks]
        done = 0
        try:
            for future in futures:
                yield future.result()
                done += 1
        except BrokenProcessPool as error:
            raise WorkerError(
                f"a worker's process has ended before its task was done (killed by somebody, or for want of memory?): "
                f"{done} of {len(tasks)} tasks had been done. Try again, with fewer --workers"
            ) from error


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Workers, none of which is left on any way out."""
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"), initializer=_begin)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in set(multiprocessing.active_children()) - others:
            process.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _kept_from_the_terminal() -> Iterator[None]:
    """Processes that are started inside never hear what a terminal sends, not even while they start."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {getattr(signal, name) for name in _FROM_THE_TERMINAL})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Interruption:
    """What a worker does when the first process ends it by SIGTERM: it breaks off what it is at, and begins nothing more."""

    def __init__(self) -> None:
        self.asked = False
        self.at_work = False

    def begin(self) -> None:
        """A task begins.

        Raises:
            KeyboardInterrupt: None is begun any more.
        """
        self.at_work = True
        if self.asked:
            raise KeyboardInterrupt

    def take(self, _number: int, _frame: FrameType | None) -> None:
        """The signal has come."""
        self.asked = True
        if self.at_work:
            raise KeyboardInterrupt


_INTERRUPTION: Final = _Interruption()


def _begin() -> None:
    """Begin as a worker: leave the terminal's signals to the first process, and end when that is no more."""
    for name in _FROM_THE_TERMINAL:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _INTERRUPTION.take)
    Thread(target=_end_with_parent, name="the first process", daemon=True).start()


def _perform(function: Callable[[T], R], task: T) -> R:
    """Do a task, in a worker: tasks that wait for it already are not begun when it is to end."""
    try:
        _INTERRUPTION.begin()
        return function(task)
    except KeyboardInterrupt:
        _INTERRUPTION.asked = True
        raise
    finally:
        _INTERRUPTION.at_work = False


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
