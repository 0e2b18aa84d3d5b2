"""Signatures, where robot and host share a key: what is believed, what is refused and counted, and what needs no proof."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import ROBOT_COMPONENT, Command, CommandLong, Ping, State
from firmware_protocol.wire.fields import MAVLINK
from hil.conformance.frames import damaged, unsigned
from hil.conformance.probe import QUIET
from hil.conformance.registry import Group, require

if TYPE_CHECKING:
    from hil.conformance.subject import Subject

GROUP: Final = Group("signing", MAVLINK)
_LAST: Final = -1


def _refused(robot: Subject, data: bytes, counter: str, what: str) -> str:
    """See that a PING is refused and counted once, and that one signed as it must be is answered behind it."""
    with robot.silence():
        before = robot.status()
        robot.forget()
        robot.raw(data)
        robot.spend(QUIET)
        require(not robot.got(Ping), f"a PING {what} was answered")
        after = robot.status()
        robot.send(Ping(time_usec=1, seq=2))
        require(
            robot.wait(Ping, lambda ping: ping.seq == 2, start=0), f"a PING signed with the key, behind one {what}, was not"
        )
    count = getattr(after, counter) - getattr(before, counter)
    require(count == 1, f"ROBOT_STATUS.{counter} rose by {count} after one frame {what}")
    return "counted once, and the frame behind it taken"


@GROUP.check("unsigned-refused", rule="Signing", keyed=True)
def unsigned_refused(robot: Subject) -> str:
    """A frame without a signature is not acted on, and is counted."""
    frame = unsigned(robot.frame(Ping(time_usec=1, seq=1)), Ping)
    return _refused(robot, frame, "not_signed", "without a signature")


@GROUP.check("wrongly-signed-refused", rule="Signing", keyed=True)
def wrongly_signed_refused(robot: Subject) -> str:
    """A frame whose signature is not that of the key is not acted on, and is counted."""
    frame = damaged(robot.frame(Ping(time_usec=1, seq=1)), _LAST)
    return _refused(robot, frame, "bad_signature", "with a wrong signature")


@GROUP.check("replayed-refused", rule="Signing", keyed=True)
def replayed_refused(robot: Subject) -> str:
    """A frame that was believed is not acted on when it comes again, and is counted."""
    frame = robot.frame(Ping(time_usec=1, seq=1))
    robot.raw(frame)
    require(robot.wait(Ping, lambda ping: ping.seq == 1, start=0), "a PING signed with the key was not answered")
    return _refused(robot, frame, "replayed", "sent again")


@GROUP.check("unsigned-stop-obeyed", rule="Signing", needs=("unsigned-refused",), keyed=True)
def unsigned_stop_obeyed(robot: Subject) -> str:
    """An emergency stop is obeyed whoever sends it, signed or not; ending it takes a signature."""
    robot.arm()
    stop, disarm = (
        unsigned(robot.frame(CommandLong(robot.system, ROBOT_COMPONENT, command, param1=value)), CommandLong)
        for command, value in ((Command.FLIGHT_TERMINATION, 1.0), (Command.ARM_DISARM, 0.0))
    )
    robot.raw(stop)
    robot.spend(QUIET)
    robot.expect_state(State.STOPPED, "after an emergency stop without a signature")
    robot.raw(disarm)
    robot.spend(QUIET)
    robot.expect_state(State.STOPPED, "after it was disarmed without a signature")
    robot.order(Command.ARM_DISARM, 0)
    robot.expect_state(State.DISARMED, "after it was disarmed with a signature")
    return "stopped, and disarmed by a signed message only"
