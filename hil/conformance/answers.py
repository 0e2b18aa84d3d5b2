"""Whose answer it is: each names the system and the component that asked, also when others ask in between."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeVar

from firmware_protocol.messages import (
    PROTOCOL_MAJOR,
    ROBOT_COMPONENT,
    Command,
    CommandAck,
    CommandLong,
    Heartbeat,
    MissionCount,
    MissionRequestList,
    Ping,
    RobotAck,
    RobotSession,
    Timesync,
)
from firmware_protocol.wire.fields import Message
from hil.conformance.probe import HOST, TRIES
from hil.conformance.registry import CheckFailedError, Group

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.conformance.subject import Subject

M = TypeVar("M", bound=Message)

GROUP: Final = Group("answers")
_NO_COMMAND: Final = 31_010
"""MAV_CMD_USER_1: nothing of ours."""
_MARK: Final = 700
"""Number of the first question that has a number of its own choice."""


def _names(answer: Message) -> tuple[int, int]:
    """Whom an answer is for."""
    return getattr(answer, "target_system", 0), getattr(answer, "target_component", 0)


def expect_named(
    robot: Subject, who: tuple[int, int], question: Message, kind: type[M], match: Callable[[M], bool] = lambda _: True
) -> M:
    """Ask in somebody's name, and see that the answer names that one.

    Args:
        robot: Whom to ask.
        who: System and component of who asks.
        question: What is asked; it must be safe to repeat.
        kind: What the answer is.
        match: What else it must be.

    Returns:
        The answer.

    Raises:
        CheckFailedError: None came, or none that names who asked.
        NotRunError: The link carries CAN frames.
    """
    robot.need_sources()
    start = len(robot.heard)
    for _ in range(TRIES):
        robot.send_as(who, question)
        answer = robot.wait(kind, lambda m: match(m) and _names(m) == who, start=start)
        if answer is not None:
            return answer
    asked = f"asked by system {who[0]}, component {who[1]}"
    others = [_names(answer) for answer in robot.got(kind, start) if match(answer)]
    if not others:
        raise CheckFailedError(f"{question.NAME}, {asked}, was not answered by {kind.NAME}")
    raise CheckFailedError(f"{asked}, {kind.NAME} names system {others[-1][0]}, component {others[-1][1]}")


def askers(robot: Subject) -> tuple[tuple[int, int], ...]:
    """Who asks: system and component, our own first."""
    return (HOST, *robot.strangers)


@GROUP.check("command-ack-addressed", rule="Answers")
def command_ack(robot: Subject) -> str:
    """COMMAND_ACK names who asked, whatever the answer is."""
    for command, param in ((_NO_COMMAND, 0.0), (Command.REQUEST_MESSAGE, Heartbeat.ID)):
        for who in askers(robot):
            question = CommandLong(robot.system, ROBOT_COMPONENT, command, param1=float(param))
            expect_named(robot, who, question, CommandAck, lambda m, command=command: m.command == command)  # type: ignore[misc]
    return "three askers, accepted and refused"


@GROUP.check("timesync-addressed", rule="Answers")
def timesync(robot: Subject) -> str:
    """TIMESYNC names who asked."""
    for mark, who in enumerate(askers(robot), _MARK):
        expect_named(robot, who, Timesync(0, mark), Timesync, lambda m, mark=mark: m.ts1 == mark and m.tc1 != 0)  # type: ignore[misc]
    return "three askers"


@GROUP.check("ping-addressed", rule="Answers")
def ping(robot: Subject) -> str:
    """The answer to PING names who asked."""
    for mark, who in enumerate(askers(robot), _MARK):
        expect_named(robot, who, Ping(time_usec=1, seq=mark), Ping, lambda m, mark=mark: m.seq == mark)  # type: ignore[misc]
    return "three askers"


@GROUP.check("mission-count-addressed", rule="Answers")
def mission_count(robot: Subject) -> str:
    """MISSION_REQUEST_LIST is answered, and MISSION_COUNT names who asked."""
    for who in askers(robot):
        answer = expect_named(robot, who, MissionRequestList(robot.system, ROBOT_COMPONENT), MissionCount)
        if answer.count != 0:
            raise CheckFailedError(f"MISSION_COUNT says {answer.count}")
    return "three askers, no mission"


@GROUP.check("ack-addressed", rule="Answers")
def ack(robot: Subject) -> str:
    """ROBOT_ACK names who asked: for what is refused, what is repeated, and for a session."""
    read = robot.question()
    foreign = robot.question(session=robot.session ^ 1)
    same = RobotSession(robot.session, 0, robot.host, robot.system, ROBOT_COMPONENT, PROTOCOL_MAJOR, robot.minor)
    for question in (read, foreign, same):
        for who in (*askers(robot), HOST):

            def match(m: RobotAck, question: Any = question) -> bool:  # noqa: ANN401 - any numbered message
                return (m.message, m.session, m.sequence) == (question.ID, question.session, question.sequence)

            expect_named(robot, who, question, RobotAck, match)
    return "a repetition, another session, ROBOT_SESSION"
