"""Workers that share a computation: the same result however many there are, wherever they are, and though some of them die.

What is to be done is cut into tasks that know nothing of each other, in a way that does not depend on the number of workers.
Workers are behind one interface, `concurrent.futures.Executor`:

    Crew.in_order(function, tasks)          results in the order of submission, deaths counted
      |-- ProcessHands                      processes of our own, spawned, none of which is left behind
      `-- ClusterHands                      a Dask cluster that the user has started

Tasks and results go between these processes by `pickle`: of our own between them over pipes that nobody else has, of a cluster
over the connections that Dask makes. Nothing is read from a file so, and no port is opened here.
"""

from __future__ import annotations

from concurrent.futures import BrokenExecutor, wait
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, Protocol, TypeVar

from hil.working.processes import ProcessHands

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator, Sequence
    from concurrent.futures import Future

    from hil.working.progress import ProgressBoard

T = TypeVar("T")
R = TypeVar("R")

MOST_DEATHS: Final = 3
"""A task that was under way at so many deaths of workers is given up."""
LOOK_EVERY: Final = 5.0
"""While no result comes, workers are seen to as often, in s."""


class Hands(Protocol):
    """Who does the tasks.

    Attributes:
        at_once: As many tasks at most are under way; they are begun in the order in which they were submitted.
        board: What they tell of how far their tasks are; None where nobody tells.
    """

    at_once: int

    @property
    def board(self) -> ProgressBoard | None:
        """What they tell of how far their tasks are."""
        ...

    def submit(self, function: Callable[[T], R], tasks: Sequence[T]) -> list[Future[R]]:
        """Have tasks done, by new workers where the old ones are gone."""
        ...

    def see(self) -> None:
        """Nothing has come for a while.

        Raises:
            WorkerError: There is no hope that anything will.
        """
        ...

    def translate(self, error: BaseException, done: int, tasks: int) -> BaseException:
        """An error that a task has ended with: one of ours where it is the workers', else as it is."""
        ...

    def drop(self) -> None:
        """Break off what is under way. When this returns, nothing is, of what our own processes did."""
        ...


class Crew:
    """Workers, for as many batches of tasks as there are, one after the other.

    Args:
        hands: Who does the tasks.

    Attributes:
        board: What is told of how far tasks are; None where nobody tells.
    """

    def __init__(self, hands: Hands) -> None:
        self._hands = hands
        self.board = hands.board

    def in_order(self, function: Callable[[T], R], tasks: Sequence[T]) -> Generator[R]:
        """Do tasks. One whose worker dies is done again, by another worker, so its result must depend on the task alone.

        The caller's main module is loaded by processes of our own too, so it must do nothing when it is imported.

        Args:
            function: Does a task; of a module, as are the tasks' types and the results'.
            tasks: The tasks.

        Yields:
            The results, in the order of the tasks, each as soon as those before it are there. Closing the generator breaks off
            what is left.

        Raises:
            WorkerError: A worker has died for the third time while a task was under way, or workers are gone for good.
            Exception: What a task itself has raised.
        """
        hands, deaths, done = self._hands, [0] * len(tasks), 0
        futures = hands.submit(function, tasks)
        try:
            while done < len(tasks):
                try:
                    result = self._result(futures[done])
                except BrokenExecutor as error:
                    left = [place for place in range(done, len(tasks)) if _lost(futures[place])]
                    for place in left[: hands.at_once]:  # the others had not been begun
                        deaths[place] += 1
                    hands.drop()
                    if max(deaths) >= MOST_DEATHS:
                        raise hands.translate(error, len(tasks) - len(left), len(tasks)) from error
                    for place, future in zip(left, hands.submit(function, [tasks[place] for place in left]), strict=True):
                        futures[place] = future
                    continue
                except Exception as error:
                    ours = hands.translate(error, sum(not _lost(future) for future in futures), len(tasks))
                    if ours is error:
                        raise
                    raise ours from error
                yield result
                done += 1
        finally:
            under_way = [future for future in futures[done:] if not future.cancel() and not future.done()]
            if under_way:
                hands.drop()

    def _result(self, future: Future[R]) -> R:
        while not wait([future], LOOK_EVERY).done:
            self._hands.see()
        return future.result()


def _lost(future: Future[R]) -> bool:
    """There is no result."""
    return not future.done() or future.cancelled() or future.exception() is not None


@contextmanager
def open_crew(workers: int, scheduler: str | None = None) -> Iterator[Crew]:
    """A crew of workers, none of which is left on any way out.

    Args:
        workers: Processes of our own, 1..`MOST_WORKERS`; they begin when there is something to do.
        scheduler: Address of a Dask scheduler, whose workers do it instead; see `cluster.scheduler_address`.

    Yields:
        The crew.

    Raises:
        WorkerError: There is no such cluster, or a worker of it is of another version.
    """
    if scheduler is None:
        hands = ProcessHands(workers)
        try:
            yield Crew(hands)
        except BaseException:
            hands.drop()
            raise
        finally:
            hands.close()
        return
    from hil.working.cluster import open_cluster  # noqa: PLC0415 - Dask is optional

    with open_cluster(scheduler) as cluster:
        yield Crew(cluster)
