"""Processes of our own that do tasks, none of which is left behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from threading import Event, Thread
from typing import TYPE_CHECKING, Final, TypeVar

from hil.working.errors import WorkerError
from hil.working.progress import ProgressBoard
from hil.working.task import perform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from multiprocessing.process import BaseProcess
    from types import FrameType

T = TypeVar("T")
R = TypeVar("R")

MOST_WORKERS: Final = 256
_FROM_THE_TERMINAL: Final = ("SIGINT", "SIGHUP")
"""Signals that a terminal sends to every process in it: only the first one acts on them, and ends the others."""
_LAST_WORDS: Final = 1.0
"""So long a worker that is to end may take to send the result of its task, in s."""


def cores() -> int:
    """Cores that this process may use, and as many workers as may be at the most."""
    there = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(there, MOST_WORKERS)


class ProcessHands:
    """A pool of processes, made anew where one of them has died.

    Args:
        workers: How many.

    Attributes:
        board: What they tell of how far their tasks are.
    """

    def __init__(self, workers: int) -> None:
        self.at_once = workers
        self.board = ProgressBoard()
        self._pool: ProcessPoolExecutor | None = None
        self._processes: set[BaseProcess] = set()

    def submit(self, function: Callable[[T], R], tasks: Sequence[T]) -> list[Future[R]]:
        """See `Hands.submit`."""
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self.at_once,
                mp_context=multiprocessing.get_context("spawn"),
                initializer=_begin,
                initargs=(self.board,),
            )
        others = set(multiprocessing.active_children()) - self._processes
        try:
            with _kept_from_the_terminal():
                return [self._submitted(self._pool, function, task) for task in tasks]
        finally:
            self._processes |= set(multiprocessing.active_children()) - others

    def _submitted(self, pool: ProcessPoolExecutor, function: Callable[[T], R], task: T) -> Future[R]:
        """Have a task done; where a process has died already, that is what came of it."""
        try:
            return pool.submit(_perform, function, task)
        except BrokenExecutor as error:
            return _failed(error)

    def see(self) -> None:
        """See `Hands.see`: who waits for a process hears of its end."""

    def translate(self, error: BaseException, done: int, tasks: int) -> BaseException:
        """See `Hands.translate`."""
        if not isinstance(error, BrokenExecutor):
            return error
        return WorkerError(
            f"worker processes have ended again and again before a task was done (killed by somebody, or for want of memory?): "
            f"{done} of {tasks} tasks had been done. Try again, with fewer --workers"
        )

    def drop(self) -> None:
        """See `Hands.drop`."""
        for process in self._processes & set(multiprocessing.active_children()):
            process.terminate()
        self.close()

    def close(self) -> None:
        """End the processes when they have done what they are at."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)
            self._pool = None
            self._processes = set()


def _failed(error: BaseException) -> Future[R]:
    future: Future[R] = Future()
    future.set_exception(error)
    return future


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


# --- in a worker's process -----------------------------------------------------------------------------------------------


class _Interruption:
    """What a worker does when the first process ends it by SIGTERM: it begins nothing more, and ends.

    A task that has nothing open ends with its process, at once; one that has is interrupted, once. While a result is sent
    nothing may end, or the first process would wait for the rest of it; and a worker may be waiting for what has died with
    another worker: so one that is not at work is given time, and then ends whatever it is at.

    Attributes:
        asked: The signal has come.
        at_work: A task is being done.
        interrupts: It is one that is interrupted.
    """

    def __init__(self) -> None:
        self.asked = False
        self.at_work = False
        self.interrupts = False
        self._ended = Event()

    def begin(self) -> None:
        """A task begins.

        Raises:
            KeyboardInterrupt: None is begun any more.
        """
        self.at_work = True
        if self.asked:
            raise KeyboardInterrupt

    def end(self) -> None:
        """A task has ended, in whatever way."""
        self.at_work = False
        if self.asked:
            self._ended.set()

    def take(self, _number: int, _frame: FrameType | None) -> None:
        """The signal has come."""
        if self.asked:
            return
        if self.at_work and not self.interrupts:
            os._exit(1)
        self.asked = True
        Thread(target=self._leave, name="the end", daemon=True).start()
        if self.at_work:
            raise KeyboardInterrupt
        self._ended.set()

    def _leave(self) -> None:
        self._ended.wait()
        Event().wait(_LAST_WORDS)
        os._exit(1)


_INTERRUPTION: Final = _Interruption()


@contextmanager
def interruptible() -> Iterator[None]:
    """Inside, a task hears by a KeyboardInterrupt that its process is to end, so that it can close what it has open."""
    _INTERRUPTION.interrupts = True
    try:
        yield
    finally:
        _INTERRUPTION.interrupts = False


_BOARDS: Final[list[ProgressBoard]] = []
"""Where this process tells how far its tasks are; none, where nobody looks on."""


def tell(place: int, *numbers: float) -> None:
    """Tell how far a task is, wherever that is done; see `ProgressBoard.tell`.

    Args:
        place: The task's place.
        *numbers: How far it is, 0..1, and something else.
    """
    for board in _BOARDS:
        board.tell(place, *numbers)


def _begin(board: ProgressBoard) -> None:
    """Begin as a worker: leave the terminal's signals to the first process, and end when that is no more."""
    _BOARDS.append(board)
    for name in _FROM_THE_TERMINAL:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _INTERRUPTION.take)
    Thread(target=_end_with_parent, name="the first process", daemon=True).start()


def _perform(function: Callable[[T], R], task: T) -> R:
    """Do a task, in a worker: tasks that wait for it already are not begun when it is to end."""
    try:
        _INTERRUPTION.begin()
        return perform(function, task)
    finally:
        _INTERRUPTION.end()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
