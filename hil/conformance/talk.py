"""What a host says to any robot of ours within a session: numbered messages, and how what they began has ended."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar, cast

from firmware_protocol.messages import (
    PROTOCOL_MAJOR,
    ROBOT_COMPONENT,
    AckResult,
    Command,
    JuniorMemoryEntry,
    JuniorMemoryRead,
    Reason,
    RobotAck,
    RobotResultAck,
    RobotSession,
)
from firmware_protocol.wire.fields import Message
from hil.conformance.orders import Orders, named
from hil.conformance.probe import PATIENCE
from hil.conformance.registry import CheckFailedError, require

if TYPE_CHECKING:
    from collections.abc import Callable


M = TypeVar("M", bound=Message)


class Result(Protocol):
    """How something ended that was accepted before: JUNIOR_MANEUVER_RESULT, SWARM_OBSERVATION."""

    @property
    def session(self) -> int:
        """Session of what it ends."""
        ...

    @property
    def sequence(self) -> int:
        """Its number in it."""
        ...

    @property
    def outcome(self) -> int:
        """How it ended."""
        ...

    @property
    def reason(self) -> int:
        """Why."""
        ...


class Talk(Orders):
    """A host with a session; the same arguments as `Orders`, and where session numbers come from.

    Attributes:
        session: Session that is open.
        minor: The newest minor version of the protocol that robot and program know.
    """

    minor = 0
    session = 0
    _draw_session: Callable[[], int]
    _sequence = 0
    _opened: set[int]

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

    def acknowledge(self, result: Result) -> None:
        """Say that a result has arrived."""
        self.send(RobotResultAck(result.session, result.sequence, self.system, ROBOT_COMPONENT))

    def results(self, start: int = 0) -> list[Result]:
        """Results that were heard, those that were asked for not among them."""
        return [cast("Result", message) for message in self.got(self.examples.result, start) if self.examples.ends(message)]

    def ended(self, what: Message, timeout: float, *, start: int = 0) -> Result:
        """Wait for the result of something, and acknowledge it.

        Args:
            what: What was accepted.
            timeout: How long it may take, in s.
            start: Index in `heard` to begin at.

        Raises:
            CheckFailedError: It does not come.
        """
        numbers = (getattr(what, "session", None), getattr(what, "sequence", None))

        def is_end(message: Message) -> bool:
            result = cast("Result", message)
            return (result.session, result.sequence) == numbers and self.examples.ends(message)

        result = self.wait(self.examples.result, is_end, timeout=timeout + PATIENCE, start=start)
        if result is None:
            raise CheckFailedError(f"{self.examples.result.NAME} of {what.NAME} did not come")
        self.acknowledge(cast("Result", result))
        return cast("Result", result)

    def expect_stopped(self, result: Result, reason: Reason) -> None:
        """See that something was stopped.

        Args:
            result: How it ended.
            reason: What must have stopped it.
        """
        found = (self.outcome(result), named(Reason, result.reason))
        wanted = (self.outcome_name(self.examples.stopped), reason.name)
        require(found == wanted, f"the outcome is {', '.join(found)}, not {', '.join(wanted)}")

    def outcome(self, result: Result) -> str:
        """The outcome of a result, in words."""
        return named(self.examples.outcomes, result.outcome)

    def outcome_name(self, code: int) -> str:
        """An outcome, in words."""
        return named(self.examples.outcomes, code)

    def fresh(self) -> None:
        """Stop whatever goes on, disarm, open a session of our own, and forget what was heard."""
        results = self.results()
        with self.silence():
            self.spend(0.03)  # a partial frame of the check before is given up meanwhile
        self.command(Command.ARM_DISARM, 0)
        for result in results[-1:]:
            self.acknowledge(result)
        self.open_session()
        self.forget()

    # --- what stands for the messages of a role -------------------------------------------------------------------------

    def brief(self, sequence: int | None = None, **fields: object) -> Message:
        """Something that is performed with wheels that stand, over within 50 ms, and has a result; not sent.

        Args:
            sequence: Its number; None is the next.
            **fields: What else its fields are to be.
        """
        return self.examples.brief(self, sequence, fields)

    def lasting(self, seconds: float) -> Message:
        """Something that is performed for about so long, up to 5 s, and has a result; not sent.

        A Junior stands still meanwhile; a micro-robot turns on the spot: a check that says this is `motion`.
        """
        return self.examples.lasting(self, seconds)

    def single(self, seconds: float = 1.0, **fields: object) -> Message:
        """What is a single frame on CAN, with wheels that stand; not sent.

        Args:
            seconds: How long it holds, where it does.
            **fields: What else its fields are to be.
        """
        return self.examples.single(self, seconds, fields)

    def question(self, **fields: object) -> Message:
        """A numbered message that changes nothing, whoever sends it and when; it is refused by `examples.refusal`; not sent."""
        return self.examples.question(self, fields)
