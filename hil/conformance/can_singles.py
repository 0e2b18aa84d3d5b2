"""On a CAN bus: which frames a robot takes for its own, and those that say all they have to say alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    Command,
    CommandAck,
    Reason,
    RobotAck,
    RobotAlive,
    State,
    Timesync,
)
from firmware_protocol.wire.can import layout
from firmware_protocol.wire.can.frame import MAX_DATA, CanFrame
from firmware_protocol.wire.fields import CAN
from hil.conformance.can_frames import STOP, identifier, readdressed, resized
from hil.conformance.can_transfers import question
from hil.conformance.keeping import expect_not_kept
from hil.conformance.probe import QUIET
from hil.conformance.registry import Group, given, require

if TYPE_CHECKING:
    from hil.conformance.subject import Subject

GROUP: Final = Group("CAN frames", CAN)
_BASE_SHIFT: Final = 18
"""Of a 29-bit identifier, the upper 11 bits are where an 11-bit one would be."""


def _stop(node: int) -> CanFrame:
    return CanFrame(identifier(layout.ESTOP_FUNCTION, node), STOP)


@GROUP.check("stop-frame-stops", rule="JUNIOR_ESTOP is COMMAND_LONG 185")
def stop(robot: Subject) -> str:
    """One JUNIOR_ESTOP stops the robot, and is answered as command 185."""
    robot.arm()
    start = len(robot.heard)
    robot.put(_stop(robot.system))
    ack = robot.wait(CommandAck, lambda m: m.command == Command.FLIGHT_TERMINATION, start=start)
    require(ack is not None, "it was not answered")
    robot.expect_state(State.STOPPED, "after JUNIOR_ESTOP")
    return "stopped by one frame"


@GROUP.check("stop-frame-exact", rule="A single frame of another length")
def stop_exact(robot: Subject) -> str:
    """A JUNIOR_ESTOP of another length or value stops nothing, and is counted."""
    wrong = [b"", b"\0", b"\2", b"\xff", b"\1\0", b"\1" + bytes(7)]
    robot.arm()

    def send() -> None:
        robot.put(*(CanFrame(identifier(layout.ESTOP_FUNCTION, robot.system), data) for data in wrong))

    before, after = robot.counted(send)
    robot.expect_state(State.READY, "after frames that are no JUNIOR_ESTOP")
    count = after.unknown - before.unknown
    require(count == len(wrong), f"ROBOT_STATUS.unknown rose by {count} after {len(wrong)} such frames")
    return f"{len(wrong)} wrong ones"


@GROUP.check("wheels-frame-exact", rule="A single frame of another length")
def wheels_exact(robot: Subject) -> str:
    """A JUNIOR_WHEELS_FRAME or a SWARM_MOVE_FRAME of another length turns nothing, and is counted."""
    robot.arm()
    start = len(robot.heard)

    def send() -> None:
        for length in range(MAX_DATA):
            (frame,) = robot.frames(robot.single(5.0))
            robot.put(resized(frame, length))

    before, after = robot.counted(send)
    require(not robot.got(RobotAck, start), "one was answered")
    robot.expect_state(State.READY, "after frames of a wrong length")
    count = after.unknown - before.unknown
    require(count == MAX_DATA, f"ROBOT_STATUS.unknown rose by {count} after {MAX_DATA} such frames")
    return "lengths 0 to 7"


@GROUP.check("alive-frame-exact", rule="A single frame of another length", motion=True)
def alive_exact(robot: Subject) -> str:
    """A ROBOT_ALIVE of another length is counted, and keeps nothing."""
    (alive,) = robot.frames(RobotAlive(robot.host, robot.system, ROBOT_COMPONENT))
    wrong = [resized(alive, length) for length in range(MAX_DATA + 1) if length != alive.length]
    before, after = robot.counted(lambda: robot.put(*wrong))
    count = after.unknown - before.unknown
    require(count == len(wrong), f"ROBOT_STATUS.unknown rose by {count} after {len(wrong)} such frames")
    expect_not_kept(robot, lambda: robot.put(*wrong), "ROBOT_ALIVE of a wrong length")
    return "lengths 0, 1 and 3 to 8"


@GROUP.check("wheels-frame-in-open-session", rule="JUNIOR_WHEELS_FRAME belongs to the session that is open")
def wheels_session(robot: Subject) -> str:
    """Such a frame is answered in the session that is open, and a late copy from the one before turns nothing."""
    robot.arm()
    wheels = robot.single()
    robot.expect(wheels, Reason.NONE)
    (late,) = robot.frames(wheels)
    robot.open_session()
    start = len(robot.heard)
    robot.put(late)
    ack = given(robot.wait(RobotAck, lambda m: m.message == wheels.ID, start=start), "a late copy was not answered")
    require(ack.session == robot.session, f"a frame was answered in session {ack.session}, and {robot.session} is open")
    require(ack.reason == Reason.DISARMED, f"a late copy was answered with reason {ack.reason}, not DISARMED")
    robot.arm()
    robot.put(late)
    robot.spend(QUIET)
    robot.expect_state(State.READY, "after a late copy came again")
    return "refused as DISARMED, and so when it comes again"


@GROUP.check("foreign-functions-ignored", rule="is other people's")
def foreign_functions(robot: Subject) -> str:
    """Frames under the robots' identifiers, or under functions that mean nothing, are not taken."""
    robot.arm()
    (wheels,) = robot.frames(robot.single(5.0))
    own = wheels.identifier >> layout.FUNCTION_SHIFT
    known = {layout.ESTOP_FUNCTION, own, layout.ALIVE_FUNCTION, layout.TRANSFER_DOWN_FUNCTION}
    foreign = [function for function in range(16) if function not in known]
    robot.forget()
    for function in foreign:
        frames = (_stop(robot.system), wheels, *question(robot, function))
        robot.put(*(readdressed(frame, function, robot.system) for frame in frames))
        robot.spend(0.01)
    robot.spend(QUIET)
    answered = [answer.ts1 for answer in robot.got(Timesync)]
    require(not answered, f"a question under function {answered} was answered")
    require(not robot.got(RobotAck) and not robot.got(CommandAck), "an order was answered")
    robot.expect_state(State.READY, "after orders under identifiers that are not for robots")
    return f"functions {', '.join(map(str, foreign))}"


@GROUP.check("long-identifiers-ignored", rule="is other people's")
def long_identifiers(robot: Subject) -> str:
    """Frames with 29-bit identifiers are not taken, whatever a part of these looks like."""
    robot.arm()
    robot.forget()
    for shift in (0, _BASE_SHIFT):
        for frame in (_stop(robot.system), _stop(0), *question(robot, 1)):
            robot.put(CanFrame(frame.identifier << shift, frame.data, extended=True))
    robot.spend(QUIET)
    require(not robot.got(Timesync), "a question was answered")
    robot.expect_state(State.READY, "after an emergency stop with a 29-bit identifier")
    return "the same bits at either end"


@GROUP.check("node-within-the-bus", rule="A system id above 127")
def node_within(robot: Subject) -> str:
    """A system id that is no node of the bus is refused by SYS_ID."""
    before = robot.parameter("SYS_ID").param_value
    for value in (layout.LAST_NODE + 1.0, 200.0, 254.0):
        found = robot.set_parameter("SYS_ID", value)
        if found != before:
            robot.set_parameter("SYS_ID", before)
        require(found == before, f"SYS_ID took {value:g}")
    return "128, 200 and 254 refused"
