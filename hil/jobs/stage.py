"""A verb's job, and what it has of the outside while it runs.

A job is all that was asked for, as plain values: options that were resolved, and the content of files that were read. It
decides by these, and by what the stage lets it see of the world: links, keys, signals. So the same job on a stage that shows it
the recorded world does the same again: nothing in it reads a clock, opens a file, or draws by chance what no seed decides.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

from hil.bridge.operator import KEY, Operator, OperatorInput

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from contextlib import AbstractContextManager
    from typing import Self

    from rich.console import Console

    from firmware_protocol.address import Address
    from firmware_protocol.link import Link
    from firmware_protocol.wire.signing import SigningKey
    from hil.cockpit.snapshot import Snapshot
    from hil.connecting.connecting import NetworkOpener
    from hil.recording.recorder import Recorder
    from hil.working.progress import ProgressBoard
    from hil.working.recorded import Recorded
    from pal_advisor.fields import Fields

T = TypeVar("T")
R = TypeVar("R")


class Job(Protocol):
    """What was asked of a verb.

    Attributes:
        VERB: The verb's name.
        seed: Seed of every random choice.
        reconnect: How long a robot or link that is lost is waited for, in s.
    """

    VERB: ClassVar[str]

    @property
    def seed(self) -> int:
        """Seed of every random choice."""
        ...

    @property
    def reconnect(self) -> float:
        """How long a robot or link that is lost is waited for, in s."""
        ...

    def options(self) -> dict[str, Any]:
        """Everything that decides, as JSON has it, but for what `files` has."""
        ...

    def files(self) -> dict[str, bytes]:
        """The files that decide, by name."""
        ...

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:
        """The inverse of `options` and `files`; what a log says is not trusted.

        Raises:
            FieldError: A field is missing, unknown or wrong.
            HilError: A file is.
        """
        ...

    def perform(self, stage: Stage) -> object:
        """Do it."""
        ...


class Window(Protocol):
    """Where pictures of robots are shown while a job runs; what shows them never keeps the job waiting.

    Attributes:
        there: It is open.
        wanting: It has shown the last picture, and time for the next one has come.
    """

    @property
    def there(self) -> bool:
        """It is open."""
        ...

    @property
    def wanting(self) -> bool:
        """It has shown the last picture, and time for the next one has come."""
        ...

    def show(self, picture: Snapshot) -> None:
        """Show a picture.

        Args:
            picture: What there is to see.
        """
        ...


class Stage(ABC):
    """The outside, as a job sees it.

    Args:
        url: Address of the robot.
        console: Where words and displays go.
        quiet: Nothing but results is wanted.
        key: Key that robot and host sign with.

    Attributes:
        url: Address of the robot.
        console: Where words and displays go.
        quiet: Nothing but results is wanted.
        key: Key that robot and host sign with; None: nothing is signed.
        operator: Whose keys and signals the bridges take in.
        replayed: What is seen is a log's.
    """

    replayed: bool = False

    def __init__(self, url: str, console: Console, *, quiet: bool, key: SigningKey | None) -> None:
        self.url = url
        self.console = console
        self.quiet = quiet
        self.key = key
        self.operator = Operator()

    @property
    def tell(self) -> Callable[[str], None] | None:
        """What says in words how the link fares; None where nothing but the result is wanted."""
        return None if self.quiet else self.say

    def say(self, text: str) -> None:
        """Say something to whoever looks on.

        Args:
            text: What.
        """
        self.console.print(text, markup=False)

    @contextmanager
    def window(self) -> Iterator[Window | None]:
        """Inside, a display is open; None where there is none."""
        yield None

    @abstractmethod
    def connected(self) -> None:
        """Links are open and robots are there: there is something to look at from now on."""

    def pace(self, now: float) -> None:
        """Wait until as much time has passed as an emulated robot has lived through; where nobody looks on, never.

        Args:
            now: Its time, in s.
        """
        del now

    @abstractmethod
    def interrupts(self) -> AbstractContextManager[None]:
        """Inside, signals that ask the program to end are taken in by the bridges' steps."""

    @abstractmethod
    def keys(self) -> AbstractContextManager[Callable[[], str] | None]:
        """Inside, single keys are read from the terminal; gives what reads those that were pressed, None where nothing can."""

    @abstractmethod
    def lines(self, address: Address) -> AbstractContextManager[Link | None]:
        """Inside, a link is open over which another program of this machine tells what it sees; None where a log has it.

        Args:
            address: Address of the link.

        Raises:
            LinkOpenError: It can't be opened.
        """

    @abstractmethod
    def opener_of(self, address: Address) -> NetworkOpener:
        """What opens the link of an address.

        Args:
            address: The address.
        """

    @abstractmethod
    def results(self, function: Callable[[T], R], tasks: Sequence[T], recorded: Recorded[R], before: int) -> Iterator[R]:
        """What comes of tasks that know nothing of each other, and are done by other processes, or on other machines.

        Args:
            function: Does a task; of a module, as are the tasks' types and the results'.
            tasks: The tasks.
            recorded: How a log tells of their results.
            before: How many results of this kind the log tells of before them.

        Yields:
            The results, in the order of the tasks.

        Raises:
            WorkerError: Some can't be had.
            KeyboardInterrupt: The operator asked for it.
        """

    @property
    def board(self) -> ProgressBoard | None:
        """What other processes tell of how far their tasks are; None where nobody tells."""
        return None

    @abstractmethod
    def begin_log(self) -> Recorder | None:
        """Begin the log, with what was asked for; None where there is to be none.

        Raises:
            LogError: It can't be written.
        """

    @abstractmethod
    def describe(self, **values: Any) -> None:  # noqa: ANN401 - fields of the run's record
        """Say more of the run: what only became known by connecting.

        Args:
            **values: Fields of `hil.runs.RunRecord`.
        """


@contextmanager
def keys_taken_in(stage: Stage, aim: Callable[[str], list[str]] | None = None) -> Iterator[None]:
    """Inside, the bridges' steps take in the keys that are pressed.

    Args:
        stage: Has a terminal, or not.
        aim: Says of each of several keys for which robot it is; None: for no one alone.
    """
    operator = stage.operator
    with stage.keys() as read:
        if read is not None:

            def pressed() -> list[OperatorInput]:
                keys = read()
                robots = aim(keys) if keys and aim is not None else [""] * len(keys)
                return [OperatorInput(f"{KEY}{key}", robot) for key, robot in zip(keys, robots, strict=True)]

            operator.keys = pressed
        try:
            yield
        finally:
            operator.keys = None
