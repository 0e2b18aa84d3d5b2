"""Sessions and sequences: what is done once, what is refused, and what a repetition gets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    PROTOCOL_MAJOR,
    ROBOT_COMPONENT,
    Command,
    Reason,
    RobotSession,
    State,
)
from hil.conformance.orders import named
from hil.conformance.probe import TRIES
from hil.conformance.registry import Group, given, require

if TYPE_CHECKING:
    from hil.conformance.subject import Subject

GROUP: Final = Group("sessions and sequences")


@GROUP.check("other-session-refused", rule="Numbered messages")
def other_session(robot: Subject) -> str:
    """A numbered message of another session is refused."""
    robot.arm()
    message = robot.brief(session=robot.session ^ 1)
    robot.expect(message, Reason.WRONG_SESSION, "of another session")
    robot.expect_state(State.READY, f"after {message.NAME} of another session")
    return message.NAME


@GROUP.check("same-session-only-acknowledged", rule="ROBOT_SESSION")
def same_session(robot: Subject) -> str:
    """Opening the same session again is acknowledged and changes nothing."""
    robot.arm()
    robot.open_session(robot.session)
    robot.expect_state(State.READY, "after its own session was opened again")
    return "it stays armed"


@GROUP.check("new-session-disarms", rule="Numbered messages")
def new_session(robot: Subject) -> str:
    """Opening a new session stops and disarms the robot."""
    robot.arm()
    robot.expect(robot.single(5.0), Reason.NONE)
    robot.open_session()
    robot.expect_state(State.DISARMED, "after a new session was opened")
    return "disarmed"


@GROUP.check("new-session-keeps-stop", rule="ROBOT_SESSION")
def session_keeps_stop(robot: Subject) -> str:
    """An emergency stop stays engaged when a new session is opened."""
    robot.order(Command.FLIGHT_TERMINATION, 1)
    robot.open_session()
    robot.expect_state(State.STOPPED, "after a new session was opened")
    return "still stopped"


@GROUP.check("other-version-refused", rule="In a minute")
def other_version(robot: Subject) -> str:
    """A host of another major version gets no session."""
    before = robot.session
    message = RobotSession(before ^ 2, 0, robot.host, robot.system, ROBOT_COMPONENT, PROTOCOL_MAJOR + 1, 0)
    robot.expect(message, Reason.BAD_VALUE, f"of version {PROTOCOL_MAJOR + 1}")
    found = robot.status().session
    require(found == before, f"the session is {found}, not {before}")
    newer = RobotSession(before, 0, robot.host, robot.system, ROBOT_COMPONENT, PROTOCOL_MAJOR, 255)
    robot.expect(newer, Reason.NONE, "of a newer minor version")
    return f"version {PROTOCOL_MAJOR + 1} refused, {PROTOCOL_MAJOR}.255 taken"


@GROUP.check("host-without-number-refused", rule="ROBOT_SESSION")
def no_host(robot: Subject) -> str:
    """A host that names no number of its own gets no session."""
    before = robot.session
    message = RobotSession(before ^ 2, 0, robot.host, robot.system, ROBOT_COMPONENT, PROTOCOL_MAJOR, robot.minor)
    for _ in range(TRIES):
        start = len(robot.heard)
        robot.raw(robot.forged(message, "host", 0))
        if (reason := robot.answered(message, start=start)) is not None:
            break
    found = given(reason, "ROBOT_SESSION with host 0 was not answered")
    require(found == Reason.BAD_VALUE, f"ROBOT_SESSION with host 0 was answered with {named(Reason, found)}, not BAD_VALUE")
    open_now = robot.status().session
    require(open_now == before, f"the session is {open_now}, not {before}")
    return "host 0"


@GROUP.check("same-sequence-performs-once", rule="Numbered messages")
def performs_once(robot: Subject) -> str:
    """The same message again repeats the answer, and never does the thing twice."""
    robot.arm()
    before = robot.status().maneuvers
    maneuver = robot.brief()
    for _ in range(4):
        start = len(robot.heard)
        robot.send(maneuver)
        reason = given(robot.answered(maneuver, start=start), "a repetition was not answered")
        require(reason == Reason.NONE, f"a repetition was refused by {named(Reason, reason)}")
        robot.spend(0.1)
    count = robot.status().maneuvers - before
    require(count == 1, f"{maneuver.NAME}, sent 4 times, was performed {count} times by ROBOT_STATUS.maneuvers")
    return "sent 4 times, performed once"


@GROUP.check("same-sequence-repeats-refusal", rule="Numbered messages")
def repeats_refusal(robot: Subject) -> str:
    """A refusal is repeated too, whatever has changed meanwhile."""
    maneuver = robot.brief()
    robot.expect(maneuver, Reason.DISARMED, "while disarmed")
    robot.arm()
    robot.expect(maneuver, Reason.DISARMED, "sent again when armed")
    robot.expect_state(State.READY, "after a refused message came again")
    return "DISARMED, and DISARMED again"


@GROUP.check("finished-result-repeated", rule="A maneuver")
def finished_result(robot: Subject) -> str:
    """A maneuver, or a move, that comes again when it is over gets its result again."""
    robot.arm()
    maneuver = robot.brief()
    robot.expect(maneuver, Reason.NONE)
    first = robot.ended(maneuver, 0.05)
    robot.spend(0.3)
    start = len(robot.heard)
    robot.send(maneuver)
    again = robot.wait(robot.examples.result, timeout=0.3, start=start)
    again = given(again, "the result did not come again")
    require(vars(again) == vars(first), f"first {first}, then {again}")
    robot.acknowledge(first)
    return "the same result"


@GROUP.check("older-sequence-refused", rule="Numbered messages")
def older(robot: Subject) -> str:
    """A message older than what was accepted is refused."""
    robot.arm()
    before = robot.status().maneuvers
    robot.expect(robot.brief(100), Reason.NONE)
    for sequence in (99, 50, 1):
        robot.expect(robot.brief(sequence), Reason.OLD_SEQUENCE, f"with sequence {sequence} after 100")
    count = robot.status().maneuvers - before
    require(count == 1, f"{count} of them were performed")
    return "99, 50 and 1 after 100"


@GROUP.check("old-answers-forgotten", rule="Numbered messages", needs=("older-sequence-refused",))
def long_past(robot: Subject) -> str:
    """A repetition of what is long past is refused, or answered as before; it is never done again."""
    robot.arm()
    first = robot.brief()
    robot.expect(first, Reason.NONE)
    for _ in range(40):
        robot.expect(robot.single(0.0), Reason.NONE)
    before = robot.status().maneuvers
    reason = robot.request(first)
    require(reason in {Reason.OLD_SEQUENCE, Reason.NONE}, f"it was refused by {named(Reason, reason)}")
    count = robot.status().maneuvers - before
    require(count == 0, "it was performed again")
    return "after 40 others"


@GROUP.check("former-session-not-repeated", rule="Numbered messages", needs=("older-sequence-refused",))
def former_session(robot: Subject) -> str:
    """Late copies of what opened an earlier session, and of what was said in it, do nothing again."""
    robot.arm()
    former, maneuver = robot.session, robot.brief()
    robot.expect(maneuver, Reason.NONE)
    robot.open_session()
    robot.open_session(former)
    robot.arm()
    before = robot.status().maneuvers
    start = len(robot.heard)
    robot.send(maneuver)
    reason = given(robot.answered(maneuver, start=start), "a late copy was not answered")
    count = robot.status().maneuvers - before
    require(count == 0, "what belongs to an earlier session was performed again")
    return f"answered by {named(Reason, reason)}"


@GROUP.check("sequence-wraps", rule="Numbered messages")
def wraps(robot: Subject) -> str:
    """A sequence may wrap."""
    robot.arm()
    for sequence in (30_000, 60_000, 65_535, 0, 7):
        robot.expect(robot.brief(sequence), Reason.NONE, f"with sequence {sequence}")
    return "65535, 0, 7"


@GROUP.check("same-sequence-other-message-refused", rule="Numbered messages")
def other_message(robot: Subject) -> str:
    """Another message with a sequence that was used is refused."""
    robot.arm()
    robot.expect(robot.brief(1), Reason.NONE)
    other = robot.examples.other(robot, 1)
    robot.expect(other, Reason.OLD_SEQUENCE, "with the sequence of another message")
    return f"{other.NAME} after {robot.brief().NAME}"


@GROUP.check("status-tells-session", rule="ROBOT_STATUS")
def tells_session(robot: Subject) -> str:
    """ROBOT_STATUS says the session and the last sequence accepted."""
    robot.arm()
    sequence = 17
    robot.expect(robot.brief(sequence), Reason.NONE)
    status = robot.status()
    found = (status.session, status.sequence)
    require(found == (robot.session, sequence), f"{found}, not {(robot.session, sequence)}")
    return f"session {status.session}, sequence {status.sequence}"
