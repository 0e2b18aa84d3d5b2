"""What guests of a shared link ask, answered for the robots from what is known of them. No I/O, no clock of its own.

A guest looks on. Nothing that it says reaches a robot, but one thing: the emergency stop, which whoever drives is asked for.

    the emergency stop (DO_FLIGHTTERMINATION, param1 1)   asked for; answered as the robot answers, FAILED after `STOP_WAIT`
    REQUEST_MESSAGE                                        the last of its kind; DENIED where none was heard
    every other COMMAND_LONG                               DENIED
    PARAM_REQUEST_LIST, PARAM_REQUEST_READ                 what is known; who drives is asked to read what is not
    PARAM_SET                                              the value in force, which stays
    MISSION_REQUEST_LIST                                   there is none
    ROBOT_SESSION, and whatever else is numbered           refused: the robot is another's
    all else                                               nothing
"""

from __future__ import annotations

from math import nan
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from firmware_protocol.messages import (
    MESSAGES,
    PARAM_TYPE_REAL32,
    ROBOT_COMPONENT,
    AckResult,
    Command,
    CommandAck,
    CommandLong,
    CommandResult,
    MissionCount,
    MissionRequestList,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    ParamValue,
    Reason,
    RobotAck,
)
from firmware_protocol.peer.exchanges.parameter_exchanges import NO_PARAMETER
from hil.bridge.operator import GUEST_STOP, PARAMETERS
from hil.sharing.known import KnownRobots

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.wire.fields import Message
    from hil.sharing.known import KnownRobot

STOP_WAIT: Final = 1.0
"""A robot that has not answered the emergency stop by then has not heard it, as like as not, in s."""
READ_AGAIN: Final = 5.0
"""Parameters of a robot are read for guests at most so often, in s."""


class Asker(NamedTuple):
    """Who asks.

    Attributes:
        guest: Which guest, by number.
        system: The system id that it gives itself.
        component: Its component id.
    """

    guest: int
    system: int
    component: int


class Reply(NamedTuple):
    """What is said to one guest in a robot's stead.

    Attributes:
        guest: Which guest, by number.
        system: System id of the robot.
        message: What.
    """

    guest: int
    system: int
    message: Message


class _AwaitedStop(NamedTuple):
    """An emergency stop that was asked for, and is not answered yet."""

    asker: Asker
    robots: frozenset[int]
    until: float


class FrontDesk:
    """Answers guests.

    Args:
        ask: Asks whoever drives for something: what, and of which robot (empty: of all), as the bridge's operator does.

    Attributes:
        known: What is known of the robots.
    """

    def __init__(self, ask: Callable[[str, str], None]) -> None:
        self.known = KnownRobots()
        self._ask = ask
        self._stops: list[_AwaitedStop] = []
        self._read_at: dict[int, float] = {}
        self._answers: dict[type[Message], Callable[[Asker, Any, KnownRobot, float], list[Message]]] = {
            CommandLong: self._command,
            ParamRequestList: self._list,
            ParamRequestRead: self._read,
            ParamSet: self._set,
            MissionRequestList: lambda asker, message, _robot, _now: [
                MissionCount(asker.system, asker.component, 0, message.mission_type)
            ],
        }

    def heard(self, message: Message, system: int, component: int) -> list[Reply]:
        """Something has passed on the link.

        Args:
            message: What.
            system: System id of who said it.
            component: Its component id.

        Returns:
            What is to be said to guests because of it.
        """
        self.known.heard(message, system, component)
        if not self._stops or component != ROBOT_COMPONENT or not isinstance(message, CommandAck):
            return []
        if message.command != Command.FLIGHT_TERMINATION or message.result == CommandResult.IN_PROGRESS:
            return []
        answered = [stop for stop in self._stops if system in stop.robots]
        self._stops = [stop for stop in self._stops if system not in stop.robots]
        return [Reply(stop.asker.guest, system, _ack(stop.asker, message.command, message.result)) for stop in answered]

    def overdue(self, now: float) -> list[Reply]:
        """Stops that no robot has answered.

        Args:
            now: Time in s, of any clock, the same as of `answer`.

        Returns:
            What is to be said to those who asked.
        """
        late = [stop for stop in self._stops if now >= stop.until]
        self._stops = [stop for stop in self._stops if now < stop.until]
        failed = CommandResult.FAILED
        return [
            Reply(stop.asker.guest, min(stop.robots), _ack(stop.asker, Command.FLIGHT_TERMINATION, failed)) for stop in late
        ]

    def left(self, guest: int) -> None:
        """A guest is there no more.

        Args:
            guest: Its number.
        """
        self._stops = [stop for stop in self._stops if stop.asker.guest != guest]

    def answer(self, asker: Asker, message: Message, now: float) -> list[Reply]:
        """A guest has said something.

        Args:
            asker: Who.
            message: What.
            now: Time in s.

        Returns:
            What is said to it.
        """
        said = cast("Any", message)
        if isinstance(message, CommandLong) and message.command == Command.FLIGHT_TERMINATION and message.param1 == 1.0:
            self._stop(asker, message, now)
            return []
        give = self._refuse if type(message).NUMBERED else self._answers.get(type(message))
        if give is None:
            return []
        addressed = self.known.addressed(said.target_system, said.target_component)
        return [Reply(asker.guest, robot.system, one) for robot in addressed for one in give(asker, message, robot, now)]

    def _stop(self, asker: Asker, message: CommandLong, now: float) -> None:
        """Ask for the stop of all; one that repeats itself has been heard, and waits for the same answer."""
        robots = frozenset(robot.system for robot in self.known.addressed(message.target_system, message.target_component))
        if robots and not any(stop.asker == asker and stop.robots == robots for stop in self._stops):
            self._ask(GUEST_STOP, "")
            self._stops.append(_AwaitedStop(asker, robots, now + STOP_WAIT))

    def _command(self, asker: Asker, message: CommandLong, robot: KnownRobot, _now: float) -> list[Message]:
        wanted = None
        if message.command == Command.REQUEST_MESSAGE and message.param1.is_integer():
            kind = MESSAGES.get(int(message.param1))
            wanted = None if kind is None else robot.latest(kind)
        result = CommandResult.DENIED if wanted is None else CommandResult.ACCEPTED
        ack = _ack(asker, message.command, result)
        return [ack] if wanted is None else [ack, wanted]

    def _list(self, _asker: Asker, _message: ParamRequestList, robot: KnownRobot, now: float) -> list[Message]:
        """What is known; the rest is read, and everybody sees it come."""
        if not robot.complete:
            self._have_read(robot, now)
        return [value for _, value in sorted(robot.parameters.items())]

    def _read(self, _asker: Asker, message: ParamRequestRead, robot: KnownRobot, now: float) -> list[Message]:
        found = robot.parameter(message.param_id, message.param_index)
        if found is not None:
            return [found]
        if not robot.complete:
            self._have_read(robot, now)
            return []
        if message.param_index >= 0:
            return []
        return [ParamValue(message.param_id, nan, PARAM_TYPE_REAL32, len(robot.parameters), NO_PARAMETER)]

    def _set(self, _asker: Asker, message: ParamSet, robot: KnownRobot, now: float) -> list[Message]:
        """The value in force, by which it is seen that it was not set."""
        found = robot.parameter(message.param_id)
        if found is None and not robot.complete:
            self._have_read(robot, now)
        return [] if found is None else [found]

    def _refuse(self, asker: Asker, message: Any, _robot: KnownRobot, _now: float) -> list[Message]:  # noqa: ANN401 - numbered
        return [
            RobotAck(
                message.ID,
                message.session,
                message.sequence,
                asker.system,
                asker.component,
                AckResult.REFUSED,
                Reason.WRONG_SESSION,
            )
        ]

    def _have_read(self, robot: KnownRobot, now: float) -> None:
        """Have whoever drives read its parameters."""
        if now - self._read_at.get(robot.system, float("-inf")) >= READ_AGAIN:
            self._read_at[robot.system] = now
            self._ask(PARAMETERS, str(robot.system))


def _ack(asker: Asker, command: int, result: int) -> CommandAck:
    return CommandAck(command, result, target_system=asker.system, target_component=asker.component)
