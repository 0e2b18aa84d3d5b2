"""What is known of the robots on a shared link: the last that each has said of every kind, and its parameters. No I/O."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeVar

from firmware_protocol.messages import (
    GROUND_STATION,
    HOST_SYSTEM,
    ROBOT_COMPONENT,
    AutopilotVersion,
    Heartbeat,
    ParamValue,
    RobotStatus,
    SysStatus,
)
from firmware_protocol.peer.exchanges.answers import ANSWERS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from firmware_protocol.wire.fields import Message

M = TypeVar("M", bound="Message")

ALWAYS: Final = frozenset({Heartbeat, AutopilotVersion, ParamValue, RobotStatus, SysStatus})
"""What is worth knowing when nobody looks on: whoever comes later asks for it."""
PASSING: Final = ANSWERS | {ParamValue}
"""What is said to somebody, or of something: the last of its kind tells nobody else anything."""


class KnownRobot:
    """What is known of one robot.

    Args:
        system: Its system id.

    Attributes:
        system: Likewise.
        parameters: Its parameters as it has said them, by index.
    """

    def __init__(self, system: int) -> None:
        self.system = system
        self.parameters: dict[int, ParamValue] = {}
        self._latest: dict[type[Message], Message] = {}
        self._by_name: dict[str, int] = {}
        self._count: int | None = None

    def heard(self, message: Message) -> None:
        """It has said something.

        Args:
            message: What.
        """
        if isinstance(message, ParamValue):
            if message.param_index < message.param_count:
                self._count = message.param_count
                self.parameters[message.param_index] = message
                self._by_name[message.param_id] = message.param_index
        elif type(message) not in PASSING:
            self._latest[type(message)] = message

    def latest(self, kind: type[M]) -> M | None:
        """The last that it has said of a kind; None where it has said nothing.

        Args:
            kind: The kind of message.
        """
        found: Any = self._latest.get(kind)
        return None if found is None else found

    @property
    def complete(self) -> bool:
        """All its parameters are known."""
        return self._count is not None and len(self.parameters) >= self._count

    def parameter(self, name: str, index: int = -1) -> ParamValue | None:
        """A parameter as it has said it; None where it has not.

        Args:
            name: Its name.
            index: Its index; -1: by name.
        """
        return self.parameters.get(self._by_name.get(name, -1) if index < 0 else index)


class KnownRobots:
    """What is known of all robots on the link."""

    def __init__(self) -> None:
        self._robots: dict[int, KnownRobot] = {}

    def __iter__(self) -> Iterator[KnownRobot]:
        """The robots, by id."""
        return iter([robot for _, robot in sorted(self._robots.items())])

    def heard(self, message: Message, system: int, component: int) -> None:
        """Somebody on the link has said something.

        Args:
            message: What.
            system: Its system id.
            component: Its component id.
        """
        if component != ROBOT_COMPONENT or system == HOST_SYSTEM:
            return
        robot = self._robots.get(system)
        if robot is None:
            if not isinstance(message, Heartbeat) or message.type == GROUND_STATION:
                return
            robot = self._robots[system] = KnownRobot(system)
        robot.heard(message)

    def addressed(self, system: int, component: int) -> list[KnownRobot]:
        """The robots that something is said to.

        Args:
            system: System id that is addressed; 0 is all.
            component: Component id; 0 is all.
        """
        if component not in {0, ROBOT_COMPONENT}:
            return []
        return [robot for robot in self if system in {0, robot.system}]
