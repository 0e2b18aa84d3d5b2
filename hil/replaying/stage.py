"""The outside as a log has it: the stage on which a recorded job is performed again."""

from __future__ import annotations

from contextlib import contextmanager, nullcontext
from io import StringIO
from typing import TYPE_CHECKING, Any, TypeVar

from rich.console import Console

from firmware_protocol.address import parse_address
from hil.jobs.stage import Stage
from hil.recording.recorder import Recorder
from hil.replaying.network import ReplayOpener

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from contextlib import AbstractContextManager

    from firmware_protocol.address import Address
    from firmware_protocol.faults.spec import FaultSpec
    from firmware_protocol.link import Link
    from firmware_protocol.wire.signing import SigningKey
    from hil.connecting.connecting import NetworkOpener
    from hil.replaying.comparison import Comparison
    from hil.replaying.tape import Tape
    from hil.working.recorded import Recorded

T = TypeVar("T")
R = TypeVar("R")


class ReplayStage(Stage):
    """A recorded run: it shows the job what was seen then, writes nothing, and opens nothing.

    Args:
        url: Address of the robot, which is looked up in the log and nowhere else.
        tape: The log.
        comparison: Compares what is decided.
        key: Key that robot and host signed with; None: nothing was signed.
        faults: What went wrong with the line.
    """

    replayed = True

    def __init__(
        self, url: str, tape: Tape, comparison: Comparison, *, key: SigningKey | None, faults: FaultSpec | None
    ) -> None:
        super().__init__(url, Console(file=StringIO(), quiet=True), quiet=True, key=key)
        self._tape = tape
        self._comparison = comparison
        self._faults = faults

    def interrupts(self) -> AbstractContextManager[None]:
        """Signals are those of the log; what is sent to this process ends it as ever."""
        return nullcontext()

    def connected(self) -> None:
        """Nobody looks on."""

    @contextmanager
    def keys(self) -> Iterator[Callable[[], str] | None]:
        """Keys are those of the log."""
        yield None

    @contextmanager
    def lines(self, address: Address) -> Iterator[Link | None]:  # noqa: ARG002 - nothing is opened
        """What came over it is in the log."""
        yield None

    def opener_of(self, address: Address) -> NetworkOpener:
        """What opens a network of the log."""
        return ReplayOpener(self._tape, address.url, self._faults)

    def results(self, function: Callable[[T], R], tasks: Sequence[T], recorded: Recorded[R], before: int) -> Iterator[R]:  # noqa: ARG002
        """What came of the tasks then."""
        for number in range(len(tasks)):
            yield self._tape.result(recorded, before + number)

    def begin_log(self) -> Recorder | None:
        """A recorder whose entries are compared."""
        address = parse_address(self.url) if self.url else None
        network = "" if address is None else address.url
        return Recorder(
            self._tape.path,
            run={},
            config={},
            link=network,
            lockstep=address is None or address.scheme == "sim" or self._tape.opening(network).lockstep,
            writer=self._comparison,
        )

    def describe(self, **values: Any) -> None:  # noqa: ANN401 - as the stage has it
        """Nobody keeps it."""
