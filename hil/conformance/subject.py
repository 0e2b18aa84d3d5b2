"""The robot under test: what the checks say to it, and how it is left as it was found."""

from __future__ import annotations

from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Final, TypeVar

from firmware_protocol.errors import NoRobotError, VersionError, WrongRoleError
from firmware_protocol.messages import (
    PROTOCOL_MAJOR,
    ROBOT_COMPONENT,
    AckResult,
    AutopilotVersion,
    Command,
    ContestCommand,
    JuniorContest,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    JuniorMemoryWrite,
    JuniorWheels,
    ManeuverOption,
    Reason,
    RobotAck,
    RobotResultAck,
    RobotSession,
    RobotStatus,
    State,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.peer.role import role_of
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.roles.known import ROLES
from firmware_protocol.versions import other_version, spoken_minor
from firmware_protocol.vocabulary import ANY_STIMULUS, MAX_ACTIONS, Action
from firmware_protocol.wire.fields import Message
from hil.conformance.orders import Orders, named
from hil.conformance.probe import PATIENCE
from hil.conformance.registry import CheckFailedError, require
from hil.connecting.diagnosis import nobody

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from firmware_protocol.clock import Clock
    from firmware_protocol.link import Link
    from firmware_protocol.wire.signing import Signing
    from hil.bridge.operator import Operator
    from hil.bridge.pump import Pump
    from hil.bridge.taps import Tap
    from hil.conformance.probe import Translator

M = TypeVar("M", bound=Message)

REBOOT_WAIT: Final = 8.0
"""How long a robot may take to restart, boot loader and all, in s."""
BY_STIMULI: Final = 255
"""JUNIOR_MEMORY_READ.index: look up by the two stimuli."""


class Subject(Orders):
    """The robot under test.

    Args:
        link: An open link; closed with it.
        clock: Tells the time.
        session: Gives session numbers, 1..65535.
        system: System id of the robot; None takes the first that is heard.
        codec: Speaks the link's language; None is MAVLink.
        taps: What sees everything.
        signing: Signs what is sent, where nothing else speaks the link's language.
        pump: As in `Probe`.
        operator: Likewise.
        network: Likewise.

    Attributes:
        session: Session that is open.
        minor: The newest minor version of the protocol that it and this program know.
        parameters_found: Parameters as they were found, by name.
        memory_found: Maneuver memory as it was found; None where it could not be read, and must be left alone.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        *,
        session: Callable[[], int],
        system: int | None = None,
        codec: Translator | None = None,
        taps: Sequence[Tap] = (),
        signing: Signing | None = None,
        pump: Pump | None = None,
        operator: Operator | None = None,
        network: str | None = None,
    ) -> None:
        super().__init__(
            link,
            clock,
            host=session(),
            system=system,
            codec=codec,
            taps=taps,
            signing=signing,
            pump=pump,
            operator=operator,
            network=network,
        )
        self._draw_session = session
        self._sequence = 0
        self._opened: set[int] = set()
        self.minor = 0
        self.session = 0
        self.parameters_found: dict[str, float] = {}
        self.memory_found: list[JuniorMemoryEntry] | None = None

    # --- before and after --------------------------------------------------------------------------------------------

    def greet(self, timeout: float = 5.0) -> None:
        """Find the robot, stop it, and take down its parameters and its memory.

        Raises:
            NoRobotError: None was heard, or what was heard is no robot of ours.
            WrongRoleError: It has another role.
            VersionError: It speaks a protocol we do not.
            LinkError: The link is gone.
        """
        self.find(timeout)
        version = self.requested(AutopilotVersion)
        if version is not None and version.middleware_sw_version >> 24 != PROTOCOL_MAJOR:
            major, minor = version.middleware_sw_version >> 24, version.middleware_sw_version >> 16 & 0xFF
            if not major:
                raise NoRobotError(nobody(self.seen(wanted=self.system, unusable=[self.system]), timeout))
            raise VersionError(f"{self._link.url}: the robot {other_version(f'{major}.{minor}')}")
        if version is not None and version.product_id != JUNIOR.product:
            name = role_of(version.product_id, ROLES).name
            raise WrongRoleError(f"{self._link.url}: robot {self.system} is a {name}; these checks are for a {JUNIOR.name}")
        self.minor = spoken_minor(0 if version is None else version.middleware_sw_version)
        try:
            self.fresh()
        except CheckFailedError as failure:
            raise NoRobotError(f"{nobody(self.seen(), timeout)} ({failure})") from failure
        self.parameters_found = self._values()
        try:
            self.memory_found = self.read_memory()
        except CheckFailedError:
            self.memory_found = None

    def fresh(self) -> None:
        """Stop whatever goes on, disarm, open a session of our own, and forget what was heard."""
        results = self.got(JuniorManeuverResult)
        with self.silence():
            self.spend(0.03)  # a partial frame of the check before is given up meanwhile
        self.command(Command.ARM_DISARM, 0)
        for result in results[-1:]:
            self.acknowledge(result)
        self.open_session()
        self.forget()

    def restore(self) -> list[str]:
        """Leave the robot disarmed, its parameters and its memory as they were found.

        Returns:
            What is not as it was found, in words.
        """
        self.fresh()
        present = self._values()
        left = [
            f"{name} was {value:g}"
            for name, value in self.parameters_found.items()
            if present.get(name) != value and not self._put_back(name, value)
        ]
        if self.memory_found is not None and not self._restore_memory(self.memory_found):
            left.append(f"the memory held {len(self.memory_found)} maneuvers")
        self.command(Command.ARM_DISARM, 0)
        if self.state() != State.DISARMED:
            left.append("it is not disarmed")
        return left

    def _values(self) -> dict[str, float]:
        """All parameters; those that a bad line swallows from the list are asked for one by one."""
        values = {value.param_id: value.param_value for value in self.list_parameters()}
        for parameter in JUNIOR_PARAMETERS:
            if parameter.name not in values:
                with suppress(CheckFailedError):
                    values[parameter.name] = self.parameter(parameter.name).param_value
        return values

    def _put_back(self, name: str, value: float) -> bool:
        try:
            return self.set_parameter(name, value) == value
        except CheckFailedError:
            return False

    def _restore_memory(self, found: list[JuniorMemoryEntry]) -> bool:
        try:
            present = {_key(entry): _contents(entry) for entry in self.read_memory()}
            wanted = {_key(entry): _contents(entry) for entry in found}
            for previous, current in present.keys() - wanted.keys():
                self.request(self.erase(current, previous))
            for entry in found:
                if present.get(_key(entry)) != _contents(entry):
                    self.request(
                        self.numbered(
                            JuniorMemoryWrite,
                            previous=entry.previous,
                            current=entry.current,
                            period=entry.period,
                            options=entry.options,
                            count=entry.count,
                            actions=entry.actions,
                        )
                    )
            return [_contents(entry) for entry in self.read_memory()] == [_contents(entry) for entry in found]
        except CheckFailedError:
            return False

    def reboot(self) -> RobotStatus:
        """Restart the robot.

        Returns:
            Its status after the restart.
        """
        before = self.status()
        lost = self.lost
        self.order(Command.PREFLIGHT_REBOOT, 1)
        again = self.wait(RobotStatus, lambda status: status.time < before.time, timeout=REBOOT_WAIT)
        require(again is not None, f"it was not back {REBOOT_WAIT:g} s after the order to reboot")
        self.lost = lost  # its frames are counted anew
        self.open_session()
        return self.status()

    # --- numbered messages -------------------------------------------------------------------------------------------

    def open_session(self, session: int | None = None) -> None:
        """Open a session; one that was not open before, unless told which."""
        while session is None:
            drawn = self._draw_session()
            for tap in self._taps:
                tap.session_drawn(drawn)
            session = None if drawn in self._opened else drawn
        self._opened.add(session)
        message = RobotSession(session, 0, self.host, self.system, ROBOT_COMPONENT, PROTOCOL_MAJOR, self.minor)
        self.session, self._sequence = session, 0
        self.expect(message, Reason.NONE)

    def numbered(self, kind: type[M], sequence: int | None = None, **fields: object) -> M:
        """A numbered message of this session, not sent.

        Args:
            kind: Its class.
            sequence: Its number; None is the next.
            **fields: What else it says.
        """
        if sequence is None:
            sequence = self._sequence + 1
        self._sequence = sequence
        head = {
            "session": self.session,
            "sequence": sequence,
            "target_system": self.system,
            "target_component": ROBOT_COMPONENT,
        }
        return kind(**(head | fields))

    def answered(self, message: Message, *, start: int, timeout: float = PATIENCE) -> int | None:
        """Wait for the answer to a numbered message.

        Args:
            message: Which.
            start: Index in `heard` to begin at.
            timeout: Longest wait, in s.

        Returns:
            The reason in it, NONE where it was accepted; None where there is no answer.
        """
        numbers = (getattr(message, "session", None), getattr(message, "sequence", None))

        def is_answer(event: Message) -> bool:
            if isinstance(event, RobotAck):
                return event.message == message.ID and (event.session, event.sequence) == numbers
            return (
                isinstance(event, JuniorMemoryEntry)
                and isinstance(message, JuniorMemoryRead)
                and (event.session, event.sequence) == numbers
            )

        answer = self.wait(Message, is_answer, timeout=timeout, start=start)
        if not isinstance(answer, RobotAck):
            return None if answer is None else Reason.NONE
        accepted = answer.result == AckResult.ACCEPTED
        require(accepted == (answer.reason == Reason.NONE), f"{message.NAME}: result and reason contradict each other")
        return answer.reason

    def request(self, message: Message, *, tries: int = 4) -> int:
        """Send a numbered message until it is answered.

        Returns:
            The reason in the answer, NONE where it was accepted.

        Raises:
            CheckFailedError: There is no answer.
        """
        start = len(self.heard)
        for _ in range(tries):
            self.send(message)
            reason = self.answered(message, start=start)
            if reason is not None:
                return reason
        raise CheckFailedError(f"{message.NAME} was not answered")

    def expect(self, message: Message, reason: Reason, when: str = "") -> None:
        """Send a numbered message and see what the answer is.

        Args:
            message: What to send.
            reason: The reason that must be in the answer; NONE: accepted.
            when: What was special, in words.
        """
        found = self.request(message)
        wanted = "accepted" if reason is Reason.NONE else f"refused by {reason.name}"
        answer = "accepted" if found == Reason.NONE else f"refused by {named(Reason, found)}"
        require(found == reason, f"{message.NAME}{' ' + when if when else ''} was {answer}, not {wanted}")

    def wheels(self, left: float, right: float, duration: float) -> JuniorWheels:
        """Turn the wheels; not sent."""
        return self.numbered(JuniorWheels, speed=(left, right), duration=duration)

    def maneuver(
        self, actions: Sequence[Action], period: float = 0.1, options: int = 0, sequence: int | None = None
    ) -> JuniorManeuver:
        """Perform actions; not sent."""
        return self.numbered(
            JuniorManeuver, sequence, period=period, options=int(options), count=len(actions), actions=_codes(actions)
        )

    def acknowledge(self, result: JuniorManeuverResult) -> None:
        """Say that a result has arrived."""
        self.send(RobotResultAck(result.session, result.sequence, self.system, ROBOT_COMPONENT))

    def result(self, maneuver: JuniorManeuver, timeout: float, *, start: int = 0) -> JuniorManeuverResult:
        """Wait for the result of a maneuver, and acknowledge it."""
        result = self.wait(
            JuniorManeuverResult,
            lambda m: (m.session, m.sequence) == (maneuver.session, maneuver.sequence),
            timeout=timeout + PATIENCE,
            start=start,
        )
        if result is None:
            raise CheckFailedError("the maneuver's result did not come")
        self.acknowledge(result)
        return result

    def contest(self, command: ContestCommand, countdown: float = 0.0) -> JuniorContest:
        """Start or stop a contest; not sent."""
        return self.numbered(JuniorContest, command=int(command), countdown=countdown)

    # --- memory ------------------------------------------------------------------------------------------------------

    def write(
        self,
        actions: Sequence[Action],
        current: int,
        previous: int = ANY_STIMULUS,
        period: float = 0.25,
        options: int = ManeuverOption.EYES,
    ) -> JuniorMemoryWrite:
        """Store a maneuver; not sent."""
        return self.numbered(
            JuniorMemoryWrite,
            previous=previous,
            current=current,
            period=period,
            options=int(options),
            count=len(actions),
            actions=_codes(actions),
        )

    def erase(self, current: int = ANY_STIMULUS, previous: int = ANY_STIMULUS) -> JuniorMemoryWrite:
        """Erase a slot, or all where none is named; not sent."""
        return self.write((), current, previous, period=0.0, options=0)

    def read(self, index: int = BY_STIMULI, current: int = 0, previous: int = ANY_STIMULUS) -> JuniorMemoryEntry | None:
        """Read a slot by index, or by stimuli.

        Returns:
            The slot; None where there is none.
        """
        message = self.numbered(JuniorMemoryRead, index=index, previous=previous, current=current)
        start = len(self.heard)
        reason = self.request(message)
        if reason == Reason.NOT_FOUND:
            return None
        entries = [entry for entry in self.got(JuniorMemoryEntry, start) if entry.sequence == message.sequence]
        require(reason == Reason.NONE and entries, f"JUNIOR_MEMORY_READ was answered by {named(Reason, reason)}")
        return entries[0]

    def read_memory(self) -> list[JuniorMemoryEntry]:
        """Read all slots in use, in order."""
        entries: list[JuniorMemoryEntry] = []
        while len(entries) < BY_STIMULI and (entry := self.read(len(entries))) is not None:
            entries.append(entry)
        return entries

    def need_memory(self) -> None:
        """See that the memory can be put back as it was found.

        Raises:
            CheckFailedError: It could not be read.
        """
        require(self.memory_found is not None, "the memory could not be read, so it is left alone")

    @contextmanager
    def emptied_memory(self) -> Iterator[None]:
        """Inside, the memory is empty."""
        self.need_memory()
        try:
            self.expect(self.erase(), Reason.NONE, "that erases all")
            yield
        finally:
            self.fresh()
            self._restore_memory(self.memory_found or [])


def _codes(actions: Sequence[Action]) -> tuple[int, ...]:
    return (*(int(action) for action in actions), *(0,) * (MAX_ACTIONS - len(actions)))


def _key(entry: JuniorMemoryEntry) -> tuple[int, int]:
    return entry.previous, entry.current


def _contents(entry: JuniorMemoryEntry) -> tuple[object, ...]:
    return (*_key(entry), entry.period, entry.options, entry.count, entry.actions)
