"""What any MAVLink host says to a vehicle: commands, requests, parameters; and a robot's state, watched closely."""

from __future__ import annotations

import struct
from contextlib import contextmanager
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, TypeVar

from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    Heartbeat,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    RobotAlive,
    RobotStatus,
    State,
    Timesync,
)
from firmware_protocol.wire.fields import Message
from hil.conformance.examples import JUNIOR_EXAMPLES, Examples
from hil.conformance.probe import TRIES, Probe
from hil.conformance.registry import CheckFailedError, require

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from enum import IntEnum

M = TypeVar("M", bound=Message)

WATCH: Final = 0.01
"""Interval of ROBOT_STATUS while a state is watched, in s."""
SLACK: Final = 0.025
"""How much later than it happens a change of state may be seen, in s: the interval, two control periods, and a full line."""
LIST_WAIT: Final = 0.4
"""A list of parameters is over when nothing has come for so long, in s."""


def named(kind: type[IntEnum], code: int) -> str:
    """The name of a code, or the code itself where nobody knows it."""
    return kind(code).name if code in set(kind) else str(code)


def single(value: float) -> float:
    """The nearest value that a REAL32 can have."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


class Orders(Probe):
    """A probe that knows the standard commands; the same arguments and attributes.

    Attributes:
        examples: What the robot's role has of its own.
        parameters_found: Parameters as they were found, by name.
    """

    examples: Examples = JUNIOR_EXAMPLES
    parameters_found: Mapping[str, float] = MappingProxyType({})

    # --- standard commands -------------------------------------------------------------------------------------------

    def command(
        self, command: int, param1: float = 0.0, param2: float = 0.0, param3: float = 0.0, *, tries: int = 4
    ) -> int | None:
        """Send COMMAND_LONG until it is answered.

        Returns:
            The result; None where there is no answer.
        """
        parameters = (float(param1), float(param2), float(param3))
        message = CommandLong(self.system, ROBOT_COMPONENT, command, 0, *parameters)
        answer = self.ask(message, CommandAck, lambda ack: ack.command == command, tries=tries)
        return None if answer is None else answer.result

    def order(self, command: int, param1: float = 0.0, param2: float = 0.0, param3: float = 0.0) -> None:
        """Send a command that must be accepted.

        Raises:
            CheckFailedError: It is not.
        """
        result = self.command(command, param1, param2, param3)
        words = "not answered" if result is None else f"answered by {named(CommandResult, result)}"
        require(result == CommandResult.ACCEPTED, f"command {command} with {param1:g} was {words}")

    def arm(self) -> None:
        """Arm, as the host whose session is open; it must be accepted."""
        self.order(Command.ARM_DISARM, 1, param3=self.host)

    def requested(self, kind: type[M]) -> M | None:
        """Ask for one message of a kind.

        Returns:
            The first that comes after the command's answer; None where there is none.
        """
        start = len(self.heard)
        if self.command(Command.REQUEST_MESSAGE, kind.ID) != CommandResult.ACCEPTED:
            return None
        for at in range(start, len(self.heard)):
            if isinstance(self.heard[at].message, CommandAck):
                return self.wait(kind, start=at)
        return None

    def status(self) -> RobotStatus:
        """The robot's counters, as they are now."""
        status = self.requested(RobotStatus)
        if status is None:
            raise CheckFailedError("ROBOT_STATUS was requested and did not come")
        return status

    def counted(self, send: Callable[[], None]) -> tuple[RobotStatus, RobotStatus]:
        """The robot's counters before and after, while we say nothing else.

        Args:
            send: Says what is to be counted.
        """
        with self.silence():
            before = self.status()
            send()
            return before, self.status()

    def state(self) -> int:
        """What the robot is doing, as its HEARTBEAT says now."""
        heartbeat = self.requested(Heartbeat)
        if heartbeat is None:
            raise CheckFailedError("HEARTBEAT was requested and did not come")
        return heartbeat.custom_mode

    def expect_state(self, state: State, when: str) -> None:
        """See that the robot is in a state.

        Args:
            state: Which.
            when: What has happened before, in words.
        """
        found = self.state()
        require(found == state, f"{when} it is {named(State, found)}, not {state.name}")

    def clock_reading(self, *before: Message) -> float:
        """The robot's own time, since boot in s, at which it took in the question.

        Args:
            *before: What is said with the question, in one piece, in front of it.
        """
        stamp = int(self.now() * 1e9) + 1
        start = len(self.heard)
        for _ in range(TRIES):
            self.send(*before, Timesync(0, stamp))
            answer = self.wait(Timesync, lambda m: m.tc1 != 0 and m.ts1 == stamp, start=start)
            if answer is not None:
                return answer.tc1 * 1e-9
        raise CheckFailedError("TIMESYNC was not answered")

    def last_word(self) -> float:
        """Say once more that we are there, before silence; the robot's own time at which it took that in, in s."""
        return self.clock_reading(RobotAlive(self.host))

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Inside, ROBOT_STATUS comes every 10 ms, and sensors every 100 ms: a line of 115200 baud has room for that."""
        for kind in self.examples.chatter:
            self.order(Command.SET_MESSAGE_INTERVAL, kind.ID, 100_000)
        self.order(Command.SET_MESSAGE_INTERVAL, RobotStatus.ID, WATCH * 1e6)
        try:
            yield
        finally:
            self.command(Command.SET_MESSAGE_INTERVAL, RobotStatus.ID, 0)
            for kind in self.examples.chatter:
                self.command(Command.SET_MESSAGE_INTERVAL, kind.ID, 0)

    def entered(self, state: State, *, after: float, timeout: float) -> float | None:
        """Wait until the robot is seen in a state; only while it is watched.

        Args:
            state: Which.
            after: Robot time before which nothing counts, in s.
            timeout: Longest wait, in s.

        Returns:
            Robot time at which it was first seen there, in s; None where it was not.
        """
        found = self.wait(RobotStatus, lambda status: status.time >= after and status.state == state, timeout=timeout, start=0)
        return None if found is None else found.time

    # --- parameters --------------------------------------------------------------------------------------------------

    def list_parameters(self) -> list[ParamValue]:
        """Ask for all parameters, once.

        Returns:
            What came, in order.
        """
        start = len(self.heard)
        self.send(ParamRequestList(self.system, ROBOT_COMPONENT))
        while self.wait(ParamValue, timeout=LIST_WAIT) is not None:
            if len(self.got(ParamValue, start)) >= 2 * len(self.examples.parameters):
                break
        return self.got(ParamValue, start)

    def parameter(self, name: str) -> ParamValue:
        """Read one parameter by name."""
        answer = self.ask(ParamRequestRead(self.system, ROBOT_COMPONENT, name), ParamValue, lambda m: m.param_id == name)
        if answer is None:
            raise CheckFailedError(f"reading {name} was not answered")
        return answer

    def set_parameter(self, name: str, value: float) -> float:
        """Set one parameter.

        Returns:
            The value in force, as the answer says.
        """
        answer = self.ask(ParamSet(self.system, ROBOT_COMPONENT, name, value), ParamValue, lambda m: m.param_id == name)
        if answer is None:
            raise CheckFailedError(f"setting {name} was not answered")
        return answer.param_value

    @contextmanager
    def parameters(self, **values: float) -> Iterator[None]:
        """Inside, these parameters have other values."""
        before = {name: self.parameter(name).param_value for name in values}
        try:
            for name, value in values.items():
                require(self.set_parameter(name, value) == single(value), f"{name} did not take {value:g}")
            yield
        finally:
            for name, value in before.items():
                self.set_parameter(name, value)
