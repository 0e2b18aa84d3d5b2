"""The workers of a Dask cluster that the user has started on machines of theirs; Dask is optional."""

from __future__ import annotations

import logging
import platform
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final, TypeVar
from urllib.parse import urlsplit

from firmware_protocol.errors import AddressError
from hil.versions import versions
from hil.working.errors import WorkerError
from hil.working.task import perform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from concurrent.futures import Executor, Future

T = TypeVar("T")
R = TypeVar("R")

SCHEMES: Final = ("tcp", "tls")
EXAMPLE: Final = "Write it as tcp://127.0.0.1:8786"
GONE: Final = 3
"""Exit status: there is no cluster, or it is lost."""
FINDING: Final = 10.0
"""Longest that a scheduler, and then its first worker, are waited for, in s."""
LONELY: Final = 6
"""Looks in a row without a worker after which none is hoped for."""


def scheduler_address(text: str) -> str:
    """The address of a Dask scheduler, as `tcp://127.0.0.1:8786`.

    Args:
        text: As it was given.

    Raises:
        AddressError: It is none.
    """
    try:
        parts = urlsplit(text)
        complete = parts.scheme in SCHEMES and parts.hostname and parts.port
    except ValueError:  # of the port
        complete = False
    if not complete or text != f"{parts.scheme}://{parts.netloc}" or "@" in parts.netloc:
        raise AddressError(text, "a scheduler has the address tcp://HOST:PORT, or tls://HOST:PORT", EXAMPLE)
    return text


@contextmanager
def open_cluster(address: str) -> Iterator[ClusterHands]:
    """Connect to a cluster whose workers run this version of the program.

    Args:
        address: Of its scheduler, see `scheduler_address`.

    Yields:
        Its hands. What they are at is broken off on every way out; the workers are left to the cluster.

    Raises:
        AddressError: That is none.
        WorkerError: Dask is not installed; nobody answers; there is no worker, or one of another version.
    """
    url = scheduler_address(address)
    try:
        from distributed import Client  # noqa: PLC0415 - optional, and takes a second to load
    except ImportError as error:
        raise WorkerError("--scheduler needs Dask. Install it: pip install 'distributed>=2024.12'", 2) from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it would say is raised here, in words
    try:
        client = Client(url, timeout=FINDING, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise WorkerError(
            f"no Dask scheduler answers at {url}: {error}. Start one on that machine (dask scheduler --host ADDRESS), and "
            f"workers (dask worker {url} --nworkers auto --nthreads 1)",
            GONE,
        ) from error
    try:
        hands = ClusterHands(client, url)
        hands.see_versions()
        yield hands
    finally:
        with suppress(OSError, TimeoutError):
            client.close(timeout=FINDING)


class ClusterHands:
    """A Dask cluster. It does again itself what a worker that died was at, as often as its setting `allowed-failures` says.

    Args:
        client: The connection to it, of Dask.
        url: Address of its scheduler.

    Attributes:
        board: There is none: nobody tells how far a task is.
    """

    board: None = None

    def __init__(self, client: Any, url: str) -> None:  # noqa: ANN401 - Dask is optional, and so are its types
        self._client = client
        self._url = url
        self._executor: Executor = client.get_executor(pure=False)  # the same task twice is done twice
        self._lonely = 0
        self.at_once = 0

    def see_versions(self) -> None:
        """See that there are workers, and that they, and the scheduler, which looks at every task, are of this version.

        Raises:
            WorkerError: They are not.
        """
        try:
            self._client.wait_for_workers(1, timeout=FINDING)
            found: dict[str, object] = self._client.run(versions, on_error="return")
        except (OSError, TimeoutError) as error:
            raise WorkerError(
                f"the Dask scheduler at {self._url} has no worker that answers: start some "
                f"(dask worker {self._url} --nworkers auto --nthreads 1)",
                GONE,
            ) from error
        try:
            scheduler = self._client.run_on_scheduler(versions)
        except Exception as error:  # noqa: BLE001 - whatever went wrong there
            scheduler = error
        places = {f"the Dask scheduler {self._url}": scheduler}
        for place, theirs in {**places, **{f"the Dask worker {worker}": found[worker] for worker in sorted(found)}}.items():
            if not isinstance(theirs, dict):
                raise WorkerError(f"{place} can't run this program: {theirs}. Install junior-hil there, the same version", GONE)
            if differences := _differences(theirs, versions()):
                raise WorkerError(_other_version(place, differences), GONE)

    def submit(self, function: Callable[[T], R], tasks: Sequence[T]) -> list[Future[R]]:
        """See `Hands.submit`."""
        expected = versions()
        try:
            return [self._executor.submit(_perform_alike, expected, function, task) for task in tasks]
        except (OSError, RuntimeError) as error:  # the client is not connected any more
            raise self._lost(0, len(tasks)) from error

    def see(self) -> None:
        """See `Hands.see`."""
        try:
            there = self._client.nthreads()
        except (OSError, TimeoutError, ValueError) as error:
            raise self._lost() from error
        self._lonely = 0 if there else self._lonely + 1
        if self._lonely >= LONELY:
            raise WorkerError(f"the Dask scheduler at {self._url} has no worker any more: start some, and try again", GONE)

    def translate(self, error: BaseException, done: int, tasks: int) -> BaseException:
        """See `Hands.translate`."""
        from distributed import KilledWorker  # noqa: PLC0415 - optional

        if isinstance(error, KilledWorker):
            return WorkerError(
                f"workers of the Dask cluster have died again and again at one task: {done} of {tasks} tasks had been done. "
                f"Their own logs say why (for want of memory?)"
            )
        if isinstance(error, CancelledError):
            return self._lost(done, tasks)
        return error

    def drop(self) -> None:
        """See `Hands.drop`; a task that a worker of the cluster is at comes to its end there, and nobody hears of it."""

    def _lost(self, done: int | None = None, tasks: int = 0) -> WorkerError:
        before = "" if done is None else f": {done} of {tasks} tasks had been done"
        return WorkerError(
            f"the Dask scheduler at {self._url} is lost{before}. See whether it is still running, and try again", GONE
        )


def _differences(theirs: Mapping[str, str], ours: Mapping[str, str]) -> str:
    """Of which package there is which version there, and which here."""
    return ", ".join(
        f"{name} {theirs.get(name, 'none')} instead of {ours.get(name, 'none')}"
        for name in sorted({*ours, *theirs})
        if theirs.get(name) != ours.get(name)
    )


def _other_version(place: str, differences: str) -> str:
    return f"{place} might come to other results: it has {differences}. Install the same there as here"


def _perform_alike(expected: Mapping[str, str], function: Callable[[T], R], task: T) -> R:
    """Do a task, in a worker: also one that has joined since the others were asked is of the same version.

    Raises:
        WorkerError: It is not.
    """
    if differences := _differences(versions(), expected):
        raise WorkerError(_other_version(f"a Dask worker on {platform.node()}", differences), GONE)
    return perform(function, task)
