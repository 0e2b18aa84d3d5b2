"""Several robots of one role, on one link or more, as a program on the PC holds them: who is there, and calls for many."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Generic, Self, TypeVar

from firmware_protocol.errors import HilError, LinkClosedError, LinkError, NoRobotError, PeerError
from firmware_protocol.events import PeerFound
from firmware_protocol.messages import ROBOT_COMPONENT, Command, CommandLong
from hil.bridge.networks import Networks, RobotAddress
from hil.connecting.diagnosis import nobody, seen_by
from hil.connecting.finding import named, wrong_role
from hil.connecting.handle import STOP_WAIT, RobotHandle
from hil.connecting.serving import WAIT, Serving
from hil.safety import Limits

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator
    from types import TracebackType

    from firmware_protocol.events import Event
    from firmware_protocol.messages import CommandAck
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.peer.role import Role

T = TypeVar("T")
R = TypeVar("R")
H = TypeVar("H", bound=RobotHandle)

SETTLE = 1.5
"""Every robot says once a second that it is there: when nobody new was heard for this long, all are there, in s."""


@dataclass(frozen=True)
class Answers(Generic[T]):
    """What came of asking several robots; each is in one of the two.

    Attributes:
        values: The answers.
        errors: Why there is none.
    """

    values: dict[RobotAddress, T] = field(default_factory=dict)
    errors: dict[RobotAddress, HilError] = field(default_factory=dict)


class RobotHandles(Serving, Generic[H]):
    """The robots on one link or several. Leaving its `with` block stops and disarms all.

    Iterating gives the handle of every robot that is there now, in order. Robots come and go: one that is heard for the
    first time joins, one that falls silent leaves and may come back, and its handle stays the same. A call that waits for
    one robot serves all of them.

    Args:
        make: The kind of handle that each robot gets.
        networks: The links, open.
        limits: Bounds on what is asked of each robot.

    Attributes:
        networks: The links.
        limits: Bounds on what is asked of each robot.
        members: Every robot that was ever there.
        between: Called after every step of the links, when nothing is under way.
        telling: A step is being told of.
    """

    def __init__(self, make: type[H], networks: Networks, limits: Limits = Limits()) -> None:  # noqa: B008 - frozen
        self._make = make
        self.networks = networks
        self.limits = limits
        self.members: dict[RobotAddress, H] = {}
        self._expected: frozenset[RobotAddress] = frozenset()
        self._listeners: list[Callable[[str, Event], None]] = []
        self._closed = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is not None and issubclass(kind, KeyboardInterrupt):
            for bridge in self.networks.bridges.values():
                bridge.operator.interrupted()
        self.close()

    # --- who is there ------------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        """How many robots there are, and on how many networks."""
        there, missing = self.addresses, self.missing
        where = len({address.network for address in (*there, *missing)})
        on = f" on {where} networks" if where > 1 else ""
        return f"<{type(self).__name__}: {len(there)} there{f', {len(missing)} missing' if missing else ''}{on}>"

    def __iter__(self) -> Iterator[H]:
        return iter([handle for _, handle in sorted(self.members.items()) if handle.peer.ready])

    def __len__(self) -> int:
        return sum(handle.peer.ready for handle in self.members.values())

    def __contains__(self, robot: RobotAddress | int) -> bool:
        """It is there now."""
        address = self.address(robot)
        return address in self.members and self.members[address].peer.ready

    def __getitem__(self, robot: RobotAddress | int) -> H:
        """The handle of a robot that is or was there.

        Args:
            robot: Its address; its id will do where there is one network.

        Raises:
            KeyError: It was never there.
        """
        address = self.address(robot)
        if address not in self.members:
            known = ", ".join(str(each.system) for each in sorted(self.members)) or "none"
            raise KeyError(f"{address} was never heard; robots heard: {known}")
        return self.members[address]

    def address(self, robot: RobotAddress | int) -> RobotAddress:
        """The address of a robot.

        Args:
            robot: Its address, or its id where there is one network.

        Raises:
            KeyError: An id alone does not say which one it is.
        """
        if isinstance(robot, RobotAddress):
            return robot
        if len(self.networks.bridges) != 1:
            raise KeyError(f"there is a robot {robot} on each of several networks: use RobotAddress(network, {robot})")
        return RobotAddress(next(iter(self.networks.bridges)), robot)

    @property
    def addresses(self) -> list[RobotAddress]:
        """Of the robots that are there."""
        return sorted(address for address, handle in self.members.items() if handle.peer.ready)

    @property
    def missing(self) -> list[RobotAddress]:
        """Robots that were expected by id, or that were there, and are not there now."""
        return sorted((self._expected | set(self.members)) - set(self.addresses))

    @property
    def refused(self) -> dict[RobotAddress, HilError]:
        """Who answers but can't be spoken with, or is of another role, and why."""
        found: dict[RobotAddress, HilError] = {}
        for name, bridge in self.networks.bridges.items():
            for system, peer in bridge.peers.items():
                if peer.failure is not None:
                    found[RobotAddress(name, system)] = peer.failure
                elif peer.ready and (needed := self._needed_of(peer)) is not None:
                    found[RobotAddress(name, system)] = wrong_role(name, peer, needed)
        return found

    def find(
        self, *, settle: float = SETTLE, expect: int | Collection[int | RobotAddress] | None = None, timeout: float = 5.0
    ) -> None:
        """Wait for the robots that are there.

        Args:
            settle: It is over when nobody new was heard for this long, in s.
            expect: How many, or which, are expected: it is over when they are there, and no sooner.
            timeout: Longest wait in s; those who are there by then are taken.

        Raises:
            NoRobotError: Nobody answered.
            VersionError: Nobody did but robots that can't be spoken with.
            LinkError: The links are gone.
        """
        if not isinstance(expect, int | None):
            self._expected = frozenset(self.address(robot) for robot in expect)
        deadline = self.now() + timeout
        heard, news = 0, self.now()
        while self.now() < deadline:
            known = sum(len(bridge.peers) for bridge in self.networks.bridges.values()) + len(self)
            if known != heard:
                heard, news = known, self.now()
            quiet = self.now() - news
            complete = len(self) > 0 and quiet >= settle if expect is None else self._complete(expect)
            if complete and (quiet >= self._make.COMPANION_WAIT or all(handle.complete for handle in self)):
                return
            try:
                self.step(min(WAIT, deadline - self.now()))
            except LinkClosedError as error:
                if len(self) or not any(bridge.farewell for bridge in self.networks.bridges.values()):
                    raise
                raise NoRobotError(self._nobody(timeout)) from error
        if not len(self):
            if any(bridge.acquaintances.shared for bridge in self.networks.bridges.values()):
                raise NoRobotError(self._nobody(timeout))
            failures = [named(address.network, failure) for address, failure in self.refused.items()]
            raise next(iter(failures), NoRobotError(self._nobody(timeout)))

    def _complete(self, expect: int | Collection[int | RobotAddress]) -> bool:
        return len(self) >= expect if isinstance(expect, int) else self._expected.issubset(self.addresses)

    def _nobody(self, timeout: float) -> str:
        return ". ".join(nobody(replace(seen_by(bridge), url=name), timeout) for name, bridge in self.networks.bridges.items())

    # --- time --------------------------------------------------------------------------------------------------------

    def step(self, wait: float = WAIT) -> list[Event]:
        """Serve all links once; every robot gets what is for it.

        Args:
            wait: Longest wait for something to come, in s.

        Returns:
            What happened.

        Raises:
            LinkError: The last link is gone.
        """
        events = self.networks.step(wait)
        before, self.telling = self.telling, True
        try:
            self._tell(events)
        finally:
            self.telling = before
        if self.between is not None:
            self.between()
        return [event for _, event in events]

    def _tell(self, events: list[tuple[str, Event]]) -> None:
        """Have every robot and every listener hear of what has happened."""
        for network, event in events:
            system = getattr(event, "system", None)
            if isinstance(event, PeerFound):
                self._join(network, event.system)
            handle = None if system is None else self.members.get(RobotAddress(network, system))
            if handle is not None:
                handle.notice(event)
            for listener in self._listeners:
                listener(network, event)

    def _needed_of(self, peer: Peer) -> Role | None:
        """The role that a robot had to have to be held here; None where it may be."""
        needed = self._make.ROLE
        return None if peer.role is needed else needed

    def _join(self, network: str, system: int) -> None:
        bridge = self.networks.bridges[network]
        if self._needed_of(bridge.peers[system]) is not None:
            return
        handle = self._make(bridge, self.limits, self)
        handle.adopt(bridge.peers[system], network)
        self.members[RobotAddress(network, system)] = handle

    def now(self) -> float:
        """Time of the last step, in s; in lock-step that of the network furthest behind."""
        return self.networks.now()

    def listen(self, listener: Callable[[str, Event], None]) -> None:
        """Have a function called with every event from now on, and the name of its network.

        `PeerFound` says that a robot has joined, `PeerLost` that it is gone, `PeerBack` that it is there again.
        """
        self._listeners.append(listener)

    # --- calls for many ----------------------------------------------------------------------------------------------

    def as_answered(
        self, question: Callable[[H], Ticket[T]], among: Iterable[H] | None = None
    ) -> Iterator[tuple[H, Ticket[T]]]:
        """Ask several robots at once, and get the answers in the order in which they come.

        Args:
            question: Asks one robot: `lambda robot: robot.peer.arm()`.
            among: Whom to ask; None asks all that are there.

        Returns:
            Robots with their tickets, which are done, each as soon as it has answered, refused or is lost. All are asked
            at once; between two of them the links are served only inside this iterator.
        """
        pending = [(handle, question(handle)) for handle in (self if among is None else among)]
        return self._answered(pending)

    def _answered(self, pending: list[tuple[H, Ticket[T]]]) -> Iterator[tuple[H, Ticket[T]]]:
        while pending:
            done = [pair for pair in pending if self._over(*pair)]
            pending = [pair for pair in pending if not pair[1].done]
            yield from done
            if pending and not done:
                self.step(WAIT)

    def _over(self, handle: H, ticket: Ticket[T]) -> bool:
        """Whether a question has ended: also one that was asked of a robot whose network is gone."""
        if not ticket.done and (failure := self.networks.failures.get(handle.address.network)) is not None:
            ticket.done, ticket.error = True, failure
        return ticket.done

    def ask(
        self, question: Callable[[H], Ticket[T]], among: Iterable[H] | None = None, *, timeout: float | None = None
    ) -> Answers[T]:
        """Ask several robots at once, and wait for all answers.

        Args:
            question: As for `as_answered`.
            among: Likewise.
            timeout: Longest wait in s; None waits until each has answered or is given up.

        Returns:
            The answers, and the errors of those who refused, are lost, or are too slow.
        """
        return self._gather(question, lambda answer: answer, among, timeout)

    def _gather(
        self,
        question: Callable[[H], Ticket[T]],
        convert: Callable[[T], R],
        among: Iterable[H] | None,
        timeout: float | None,
    ) -> Answers[R]:
        asked = [(handle, question(handle)) for handle in (self if among is None else among)]
        deadline = float("inf") if timeout is None else self.deadline(timeout)
        while not all(self._over(*pair) for pair in asked) and (left := deadline - self.now()) > 0:
            self.step(min(WAIT, left))
        answers: Answers[R] = Answers()
        for handle, ticket in asked:
            address = handle.address
            if not ticket.done:
                answers.errors[address] = PeerError(f"{address} has not answered {ticket.name} within {timeout:g} s")
            elif ticket.error is not None:
                answers.errors[address] = ticket.error
            else:
                answers.values[address] = convert(ticket.value())
        return answers

    def arm(self) -> Answers[CommandAck]:
        """Let the wheels of all that are there turn."""
        answers = self.ask(lambda handle: handle.peer.arm(self._arming_time(handle.address.network)))
        for address in answers.values:
            self.members[address].was_armed()
        return answers

    def _arming_time(self, network: str) -> float:  # noqa: ARG002 - some know more of their networks
        """Time that the line of a network needs to have all on it armed, in s; 0 where nobody knows."""
        return 0.0

    def disarm(self) -> Answers[CommandAck]:
        """Stop all, and keep their wheels from turning; ends emergency stops."""
        return self.ask(lambda handle: handle.ask_disarm())

    def emergency_stop(self) -> Answers[CommandAck]:
        """Stop everything that hears us at once, robots of others on the same links included, until disarmed and armed again.

        One message goes to all; then each robot that was ever there is asked to confirm.
        """
        self.call_emergency_stop()
        return self.ask(lambda handle: handle.ask_emergency_stop(), list(self.members.values()))

    def call_emergency_stop(self) -> None:
        """Send the one message that stops everything that hears us; nobody is asked to confirm."""
        for bridge in self.networks.alive.values():
            try:
                bridge.send(CommandLong(0, ROBOT_COMPONENT, Command.FLIGHT_TERMINATION, 0, 1.0))
            except LinkError:
                continue  # its robots stop by their watchdogs; the other links are to be reached all the same

    # --- leaving -----------------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Stop and disarm all robots, and give the links back. Safe to repeat, and when robots or links are gone.

        Lost robots are told too: they may hear us. As with one robot, an emergency stop that is engaged stays.
        """
        if self._closed:
            return
        self._closed = True
        self._listeners.clear()
        try:
            asked = [(handle, handle.ask_to_end()) for handle in self.members.values()]
            awaited = [ticket for handle, ticket in asked if ticket is not None and handle.peer.ready]
            deadline = self.deadline(STOP_WAIT) if asked else 0.0
            while asked and (left := deadline - self.now()) > 0:
                self.step(min(WAIT, left))
                if all(ticket.done for ticket in awaited):
                    break
        except (HilError, OSError):
            pass  # the robots stop by their own watchdogs
        finally:
            self.networks.close()
