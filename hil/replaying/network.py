"""A network as a log has it: what a bridge is given in place of a link that is open now."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.errors import HilError, LinkClosedError, LinkTimeoutError
from firmware_protocol.link import Link
from firmware_protocol.wire.signing import may_carry_key
from hil.bridge.operator import INTERRUPTED
from hil.bridge.pump import Back, Lost
from hil.mcaplog.records import UnsentBytes
from hil.replaying.tape import ReplayEndedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.errors import LinkError
    from firmware_protocol.faults.spec import FaultSpec
    from hil.bridge.operator import Operator
    from hil.bridge.pump import Chunk, Pump, Turn
    from hil.bridge.reopening import Reopening
    from hil.mcaplog.records import WireBytes
    from hil.replaying.tape import Step, Tape


class ReplayClock:
    """The recorded readings of a clock.

    Args:
        start: The first one, in s.
    """

    def __init__(self, start: float) -> None:
        self.reading = start

    def now(self) -> float:
        """The reading of the step that was handed out last, in s."""
        return self.reading


class ReplayLink(Link):
    """A link to nobody: it takes what is written as the recorded one did.

    Args:
        url: Address, as the recorded link called itself.
        tape: The log.
        network: Name of the network.
        unlike: Makes the error of what was not recorded so; None: somebody else compares.
    """

    def __init__(
        self,
        url: str,
        tape: Tape,
        network: str,
        unlike: Callable[[Step, bytes | None, bytes | None], HilError] | None,
    ) -> None:
        opening = tape.opening(network)
        self.url = url
        self.lockstep = opening.lockstep
        self.wire = opening.wire
        self._tape = tape
        self._network = network
        self._unlike = unlike

    def write(self, data: bytes) -> None:
        """Take bytes as they were taken then.

        Raises:
            LinkTimeoutError: The other end did not take them in time, then.
            LinkClosedError: The link was gone, then.
            HilError: The program writes something else.
        """
        recorded = self._tape.written(self._network)
        if self._unlike is not None:
            self._compare(recorded, data, self._unlike)
        if isinstance(recorded, UnsentBytes):
            error = LinkTimeoutError if recorded.timeout else LinkClosedError
            raise error(self.url, recorded.error)

    def _compare(
        self,
        recorded: WireBytes | UnsentBytes | None,
        data: bytes,
        unlike: Callable[[Step, bytes | None, bytes | None], HilError],
    ) -> None:
        step = self._tape.current(self._network)
        if recorded is None:
            if self._tape.ended and self._tape.cut_off:
                raise ReplayEndedError(f"{self._tape.path} was cut off here")
            raise unlike(step, None, data)
        if recorded.data != data and not may_carry_key(data):  # of keys a log holds zeros
            raise unlike(step, recorded.data, data)

    def read(self, timeout: float) -> bytes:  # noqa: ARG002 - the pump hands out what came
        """Nothing comes by this way."""
        return b""

    def news(self) -> list[str]:
        """What had happened to the link when the step was taken."""
        return list(self._tape.current(self._network).record.news)

    def close(self) -> None:
        """There is nothing to be closed."""


class ReplayPump:
    """Hands out the steps of a log, one by one, whatever time is given.

    Args:
        tape: The log.
        network: Name of the network.
        clock: Is set to the reading of each step.
        operator: Asks for what was asked for then.
        open_link: Makes the link that is there again, by its address.
        unlike: As in `ReplayLink`.

    Attributes:
        error: As in `hil.bridge.pump.Pump`, and what follows likewise.
        turn: Likewise.
        overrun: Likewise.
    """

    def __init__(
        self,
        tape: Tape,
        network: str,
        clock: ReplayClock,
        *,
        operator: Operator,
        open_link: Callable[[str], Link],
        unlike: Callable[[Step, bytes | None, bytes | None], HilError] | None,
    ) -> None:
        self.error: LinkError | None = None
        self.turn: Turn | None = None
        self.overrun = 0
        self._tape = tape
        self._network = network
        self._clock = clock
        self._operator = operator
        self._open_link = open_link
        self._unlike = unlike
        self._lockstep = tape.opening(network).lockstep
        self._interrupted = False

    @property
    def pending(self) -> bool:
        """The next step need not wait: in real time never, in lock-step where it takes in what was left of the last chunk."""
        if not self._lockstep:
            return True
        chunks = self._tape.current(self._network).record.chunk_times
        if not chunks:
            return False
        following = self._tape.peek(self._network)
        return following is not None and following.record.chunk_times[:1] == chunks[-1:]

    def take(self, wait: float, until: float) -> list[Chunk]:  # noqa: ARG002 - the log knows how long it took
        """The chunks of the next step; see `hil.bridge.pump.Pump.take`.

        Raises:
            KeyboardInterrupt: The program was interrupted before that step.
            ReplayEndedError: There is no further step.
            HilError: The program has not written what was written then.
        """
        following = self._tape.peek(self._network)
        if following is not None and INTERRUPTED in following.record.inputs and not self._interrupted:
            self._interrupted = self._tape.interrupted = True  # the program leaves now, and says so by itself
            raise KeyboardInterrupt
        if self._unlike is not None and (unwritten := self._tape.written(self._network)) is not None:
            raise self._unlike(self._tape.current(self._network), unwritten.data, None)
        step = self._tape.take(self._network)
        record = step.record
        self._clock.reading = record.clock
        for what, robot in zip(record.inputs, record.input_robots, strict=True):
            if what != INTERRUPTED:
                self._operator.ask(what, robot)
        self.overrun += record.dropped
        self.turn = None
        if record.lost_link:
            self.turn = Lost(LinkClosedError(record.lost_link, record.lost))
        elif record.back:
            self.turn = Back(self._open_link(record.back))
        if record.ended_link:
            self.error = LinkClosedError(record.ended_link, record.ended)
        return list(step.chunks)

    def drop(self, error: LinkError, *, refused: bool = False) -> None:  # noqa: ARG002 - the log knows what came of it
        """The link was taken for lost: in lock-step at once, else when its thread had seen to it."""
        if self._lockstep:
            self.turn = Lost(error)

    def wake(self) -> None:
        """Nobody waits."""

    def let_go(self) -> None:
        """There is nothing to be closed."""

    def close(self) -> None:
        """There is nothing to be closed."""


class ReplayOpener:
    """Opens a recorded network; see `hil.connecting.connecting.NetworkOpener`.

    Args:
        tape: The log.
        network: Name of the network.
        faults: What went wrong with the line, as the log's configuration has it.
        unlike: As in `ReplayLink`.

    Raises:
        ReplayEndedError: The log has no such network.
    """

    def __init__(
        self,
        tape: Tape,
        network: str,
        faults: FaultSpec | None = None,
        unlike: Callable[[Step, bytes | None, bytes | None], HilError] | None = None,
    ) -> None:
        opening = tape.opening(network)
        self.faults = faults
        self.clock = ReplayClock(opening.clock)
        self._tape = tape
        self._network = network
        self._unlike = unlike

    @property
    def session(self) -> Callable[[], int]:
        """Gives the numbers that were drawn by chance."""
        return lambda: self._tape.number(self._network)

    def open(self) -> Link:
        """The recorded link."""
        return self._open(self._tape.opening(self._network).link)

    def _open(self, url: str) -> Link:
        return ReplayLink(url, self._tape, self._network, self._unlike)

    def pump(
        self,
        link: Link,  # noqa: ARG002 - it brings nothing
        reopening: Reopening | None,  # noqa: ARG002 - the log knows when it was back
        arrived: Callable[[], None] | None,  # noqa: ARG002 - nobody waits
        operator: Operator,
    ) -> Pump:
        """What hands out the recorded steps."""
        return ReplayPump(self._tape, self._network, self.clock, operator=operator, open_link=self._open, unlike=self._unlike)

    def signing_time(self) -> int:
        """The calendar when the recorded link was opened, in 10 us since 2015-01-01 GMT."""
        return self._tape.opening(self._network).signing_time

    def let_pass(self, duration: float) -> None:
        """The log knows how much time passed."""
