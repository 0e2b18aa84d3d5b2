"""One robot, whatever its role, as a program on the PC holds it: arming, parameters, and a safe stop on every way out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

from firmware_protocol.errors import HilError, LinkError, PeerError, PeerGoneError, PeerLostError, RefusedError, VersionError
from firmware_protocol.events import Received
from firmware_protocol.faults.failures import FailureType
from firmware_protocol.messages import Heartbeat, RobotStatus, State
from hil.bridge.networks import RobotAddress
from hil.connecting.finding import find_robot
from hil.connecting.serving import WAIT, Serving
from hil.safety import Limits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType

    from firmware_protocol.events import Event
    from firmware_protocol.messages import CommandAck
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.peer import Peer
    from firmware_protocol.peer.role import Role
    from hil.bridge.bridge import Bridge

T = TypeVar("T")

TAKE_WAIT = 5.0
"""How long a robot that answers is given to open a session, in s."""
STOP_WAIT = 0.5
"""How long a robot is given to acknowledge the stop on the way out, in s."""


def answered(ticket: Ticket[Any]) -> Iterator[None]:
    """Wait for an answer bit by bit: whoever asks for the next bit serves the links between two.

    Args:
        ticket: What was given for the question.

    Raises:
        RefusedError: The robot refused.
        PeerError: It did not answer, or is gone.
        LinkError: The link is gone.
    """
    while not ticket.done:
        yield
    if ticket.error is not None:
        raise ticket.error


class RobotHandle(Serving):
    """A connected robot. Leaving its `with` block stops and disarms it.

    Nothing here asks whether the robot is emulated. Calls block until the robot has answered; in lock-step the world is
    stepped meanwhile, in real time the link is served. What only a robot of one role can do is in the handle of that role.

    Args:
        bridge: Speaks with the robot.
        limits: Bounds on what is asked of it.
        robots: Serve the links of several robots, and hand each its events (`notice`); they close the links, too. None: this
            is the only one, and serves its bridge itself.

    Attributes:
        bridge: Speaks with the robot.
        peer: What is known of the robot.
        address: Where the robot is: its network, and its id there.
        limits: Bounds on what is asked of it.
        between: Called after every step of the bridge, when nothing is under way; not where others serve the links.
        telling: A step is being told of.
    """

    ROLE: ClassVar[Role | None] = None
    """The role that a robot must have to be held by such a handle; None: any."""
    COMPANION_WAIT: ClassVar[float] = 0.0
    """How long what may be beside such a robot is listened for, in s."""
    peer: Peer
    address: RobotAddress

    def __init__(
        self,
        bridge: Bridge,
        limits: Limits = Limits(),  # noqa: B008 - frozen
        robots: Serving | None = None,
    ) -> None:
        self.bridge = bridge
        self.limits = limits
        self._robots = robots
        self._listeners: list[Callable[[Event], None]] = []
        self._closed = False
        self._emergency = False
        self._armed_in: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is not None and issubclass(kind, KeyboardInterrupt):
            self.bridge.operator.interrupted()
        self.close()

    def __repr__(self) -> str:
        """Who it is, where, and how it stands, as far as that is known: nothing is asked."""
        kind = type(self).__name__
        if not hasattr(self, "peer"):
            return f"<{kind} at {self.bridge.link.url}: not found yet>"
        stands = "left" if self._closed else "lost" if self.armed is None else self.state.name.lower()
        return f"<{kind} {self.peer.system} at {self.bridge.link.url}: {stands}>"

    # --- connecting --------------------------------------------------------------------------------------------------

    def find(self, system: int | None = None, timeout: float = 5.0) -> None:
        """Wait for a robot and do the handshake; the bridge speaks with no other robot afterwards.

        Where the bridge opens no sessions by itself, the robot that is taken is the only one that gets one, and the only
        one that is stopped and disarmed.

        Args:
            system: Its system id; None takes the first that answers.
            timeout: Longest wait in s.

        Raises:
            NoRobotError: Nobody answered in time.
            WrongRoleError: Nobody did but robots of other roles than this handle is for.
            VersionError: It speaks a protocol we do not.
            LinkClosedError: The link went away.
        """
        peer = find_robot(self.bridge, self.step, system, timeout, self.ROLE)
        self.adopt(peer)
        self.bridge.keep([peer.system])

    def take(self) -> None:
        """Open a session with a robot that was only being watched: it is stopped and disarmed by that.

        Raises:
            PeerError: It does not answer, or does not want one.
            LinkError: The link is gone.
        """
        self._check_ready()
        self.step(0.0)
        self._serve(self.taking())

    def taking(self) -> Iterator[None]:
        """Take it as `take` does, bit by bit: whoever asks for the next bit serves the links between two. Raises likewise."""
        self._check_ready()
        deadline = self.now() + TAKE_WAIT
        self.peer.take(self.now())
        while not self.peer.session and self.now() < deadline:
            if self.peer.failure is not None:
                raise self.peer.failure
            yield
        if not self.peer.session:
            raise PeerLostError(f"robot {self.peer.system} did not open a session within {TAKE_WAIT:g} s")

    def _check_ready(self) -> None:
        """See that it answers, and may be taken: one that is not there is not taken later, when nobody thinks of it any more.

        Raises:
            PeerError: It does not, or may not.
        """
        if self.bridge.acquaintances.shared:
            raise PeerError(f"robot {self.peer.system} is another program's ({self.bridge.acquaintances.shared})")
        if not self.peer.ready and self.peer.unavailable is not None:
            raise self.peer.unavailable

    def _serve(self, bits: Iterator[None]) -> None:
        """Serve the link until something that is done bit by bit has ended."""
        for _ in bits:
            self.step(WAIT)

    def adopt(self, peer: Peer, network: str | None = None) -> None:
        """Be the handle of this robot.

        Args:
            peer: What the bridge knows of it.
            network: Name of the network that it is on; None is the address of the link.
        """
        self.peer = peer
        self.address = RobotAddress(self.bridge.link.url if network is None else network, peer.system)

    @property
    def complete(self) -> bool:
        """Everything that may be beside a robot of its role has been heard."""
        return True

    @property
    def description(self) -> str:
        """Who this is, in words."""
        version = self.peer.version
        firmware = (
            "" if version is None else f", firmware {version.flight_sw_version >> 24}.{version.flight_sw_version >> 16 & 255}"
        )
        return f"{self.peer.role.name} {self.peer.system} on {self.bridge.link.url}{firmware}"

    @property
    def uid(self) -> str:
        """Its unique id, 16 hexadecimal digits; empty where it does not say any."""
        version = self.peer.version
        return f"{version.uid:016x}" if version is not None and version.uid else ""

    def wait_until_back(self) -> None:
        """Wait until a robot that was lost can be used again: its link is open again, and the handshake done anew.

        It is disarmed then, and whatever it was performing is over. Returns at once where the robot is there. How long it is
        waited for is said to `hil.connect` (`reconnect`); where nothing is, it is not waited for.

        Raises:
            PeerGoneError: It has not come back in time.
            WrongRobotError: Another one answers in its place.
            VersionError: It speaks another protocol now.
            LinkClosedError: Its link could not be opened again in time.
        """
        patience = self.bridge.patience
        deadline = self.deadline(patience)
        while not self.peer.ready:
            failure = self.peer.failure
            if isinstance(failure, VersionError):
                raise failure
            if self.now() >= deadline:
                why = self.peer.unavailable
                if failure is not None:
                    raise failure
                if isinstance(why, LinkError):
                    raise why
                late = f"robot {self.peer.system} did not come back within {patience:g} s"
                raise PeerGoneError(late if patience or why is None else str(why))
            self.step(min(WAIT, deadline - self.now()))

    def status(self) -> RobotStatus:
        """Ask for the robot's counters.

        Raises:
            PeerError: No answer.
            LinkError: The link is gone.
        """
        return self.finish(self.peer.request(RobotStatus))

    @property
    def state(self) -> State:
        """State of the firmware, as of its last heartbeat."""
        heartbeat = self.peer.heartbeat
        return State(heartbeat.custom_mode) if heartbeat is not None and heartbeat.custom_mode in set(State) else State.DISARMED

    @property
    def armed(self) -> bool | None:
        """Its wheels may turn; None while nobody knows: it is lost."""
        return self.peer.armed

    @property
    def stopped(self) -> bool:
        """Its emergency stop is engaged, by its own word, or was asked for here."""
        return self._emergency or self.state is State.STOPPED

    # --- what it does ------------------------------------------------------------------------------------------------

    def arm(self) -> None:
        """Let its wheels turn.

        Raises:
            RefusedError: Its emergency stop is engaged.
            PeerError: The robot is gone or does not answer.
            LinkError: The link is gone.
        """
        self._serve(self.arming())

    def arming(self) -> Iterator[None]:
        """Arm it as `arm` does, bit by bit: see `taking`. Raises likewise."""
        try:
            yield from answered(self.peer.arm())
            self.was_armed()
        except RefusedError as error:
            heartbeat = self.peer.request(Heartbeat)
            yield from answered(heartbeat)
            if heartbeat.value().custom_mode != State.STOPPED:
                raise
            self._emergency = True
            raise RefusedError("arming", "its emergency stop is engaged; make sure that it may move, then disarm it") from error

    def was_armed(self) -> None:
        """Note that it has said that it is armed: no emergency stop is engaged, then, and to be left as it is."""
        self._armed_in = self.peer.session
        self._emergency = False

    def disarm(self) -> None:
        """Stop it, and keep its wheels from turning; ends an emergency stop. Raises as `status` does."""
        self.finish(self.ask_disarm())

    def ask_disarm(self) -> Ticket[CommandAck]:
        """Begin to disarm it, and do not wait for the answer."""
        self._emergency = False
        return self.peer.disarm()

    def emergency_stop(self) -> None:
        """Stop at once; it stays stopped until it is disarmed and armed again. Raises as `status` does."""
        self.finish(self.ask_emergency_stop())

    def ask_emergency_stop(self) -> Ticket[CommandAck]:
        """Ask for the emergency stop, and do not wait for the answer."""
        self._emergency = True
        return self.peer.emergency_stop()

    # --- parameters --------------------------------------------------------------------------------------------------

    def parameters(self) -> dict[str, float]:
        """All parameters by name, read from the robot; raises as `status` does."""
        return self.finish(self.peer.list_parameters())

    def parameter(self, name: str) -> float:
        """Read one parameter.

        Raises:
            RefusedError: It has none of this name.
        """
        return self.finish(self.peer.read_parameter(name))

    def set_parameter(self, name: str, value: float) -> float:
        """Set a parameter.

        Returns:
            The value now in force.

        Raises:
            RefusedError: There is none of this name, or the value is not accepted.
        """
        return self.finish(self.peer.set_parameter(name, value))

    def inject_failure(self, part: str, how: FailureType = FailureType.OFF) -> None:
        """Have a part of the robot fail, or be well again: a rehearsal, which its parameter FAIL_ENABLE must allow.

        Args:
            part: As `eye_left`, `wheel_right`, `battery`, `host`: see `firmware_protocol.faults.failures.INSTANCES`.
            how: How it fails; `FailureType.OK` ends it, and so does a restart.

        Raises:
            RefusedError: It does not allow it, does not know such a failure, is in a contest, or was armed by another.
            ValueError: There is no such part.
        """
        try:
            self.finish(self.peer.inject_failure(part, how))
        except RefusedError as error:
            if self.parameter("FAIL_ENABLE") != 0:
                raise
            raise RefusedError(error.command, "it does not rehearse failures while its parameter FAIL_ENABLE is 0") from error

    # --- time --------------------------------------------------------------------------------------------------------

    def now(self) -> float:
        """Time of the last step, in s: between two steps it stands still, whatever the program does meanwhile."""
        return self.bridge.now if self._robots is None else self._robots.now()

    def step(self, wait: float = WAIT) -> list[Event]:
        """Serve the link once, or all links where there are several robots.

        Args:
            wait: Longest wait for something to come, in s.

        Returns:
            What happened.

        Raises:
            LinkError: The link is gone.
        """
        if self._robots is not None:
            return self._robots.step(wait)
        events = self.bridge.step(wait)
        for event in events:
            self.notice(event)
        if self.between is not None:
            self.between()
        return events

    def listen(self, listener: Callable[[Event], None]) -> None:
        """Have a function called with every event from now on."""
        self._listeners.append(listener)

    def finish(self, ticket: Ticket[T]) -> T:
        """Serve the link until something asked has ended.

        Args:
            ticket: What the peer gave for the question.

        Returns:
            The answer.

        Raises:
            RefusedError: The robot refused.
            PeerError: It did not answer, or is gone.
            LinkError: The link is gone.
        """
        while not ticket.done:
            self.step(WAIT)
        return ticket.value()

    def notice(self, event: Event) -> None:
        """Take in something that has happened on the link; what comes from other robots is none of ours.

        Args:
            event: What happened.
        """
        if isinstance(event, Received):
            self.hear(event)
        if self._listeners:
            self._tell(event)

    def _tell(self, event: Event) -> None:
        """Have every listener hear of it."""
        before, self.telling = self.telling, True
        try:
            for listener in self._listeners:
                listener(event)
        finally:
            self.telling = before

    def hear(self, received: Received) -> None:
        """Take in what somebody on the link has said; what only one role says is the business of its handle.

        Args:
            received: A message of any robot on the link; before the handshake it is not known which of them is ours.
        """

    # --- leaving -----------------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Stop and disarm the robot, and give the link back. Safe to repeat, and when the robot or link is gone.

        The link of several robots stays open for the others.

        A robot that has not been heard for a while is told too: it may hear us. One whose emergency stop is engaged is left
        as it is, since to disarm it would release the stop: that is a person's decision.
        """
        if self._closed:
            return
        ticket = self.ask_to_end()
        self._closed = True
        self._listeners.clear()
        try:
            deadline = self.deadline(STOP_WAIT)
            while ticket is not None and not ticket.done and self.now() < deadline:
                self.step(min(WAIT, deadline - self.now()))
        except (HilError, OSError):
            pass  # the robot stops by its own watchdog
        finally:
            if self._robots is None:
                self.bridge.close()

    def leave(self) -> None:
        """Give the link back and let the robot go on with what it does: a contest, that is; all else ends by its watchdog."""
        self._closed = True
        self._listeners.clear()
        if self._robots is None:
            self.bridge.close()

    def ask_to_end(self) -> Ticket[CommandAck] | None:
        """Ask the robot to stop and disarm because we leave it, and do not wait for the answer.

        Returns:
            None where it is left as it is: it was only watched, was left before, or its emergency stop is engaged.
        """
        if self._closed or not hasattr(self, "peer") or not self.peer.taken or self._emergency:
            return None
        return self.peer.disarm()
