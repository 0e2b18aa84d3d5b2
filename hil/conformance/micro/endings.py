"""How a move ends otherwise than by arriving."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import ROBOT_COMPONENT, Command, ParamSet, Reason, State
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.vocabulary import MoveOption, ObservationFlag, SwarmOutcome
from hil.conformance.micro.drives import BODY, NEAR, ROOM, WAY, leg
from hil.conformance.registry import Group, given, require

if TYPE_CHECKING:
    from collections.abc import Callable

    from firmware_protocol.messages import SwarmMove
    from hil.conformance.subject import Subject

GROUP: Final = Group("how moves end", role=MICRO_ROBOT.name)
TURN_SPEED: Final = 6.28
_CREEP: Final = 0.1
"""Least TURN_SPEED, in rad/s."""
_SPARE: Final = 1.0
_LATE: Final = 0.25
"""How much later than planned a move may be seen to end, in s: the line, and what the robot reckons in whole milliseconds."""
_SLOW: Final = 0.1
"""Speed of a move that is to be stopped, in m/s."""
_TOUCH: Final = 0.041
"""Distance between the centres of two robots that touch, in m: they are 40 mm across."""
CONTACT: Final = int(MoveOption.STOP_ON_CONTACT)


def _overdue(robot: Subject, move: SwarmMove) -> float:
    """Begin a turn, make the robot creep, and see when it gives the turn up, in s of its own time."""
    with robot.parameters(TURN_SPEED=TURN_SPEED):
        start = len(robot.heard)
        begun = robot.clock_reading(move, ParamSet(robot.system, ROBOT_COMPONENT, "TURN_SPEED", _CREEP))
        require(robot.answered(move, start=start) == Reason.NONE, "the move was not accepted")
        told = robot.reported(move, start=start)
    require(told.outcome == SwarmOutcome.TIMED_OUT, f"a move that takes too long ended {robot.outcome(told)}, not TIMED_OUT")
    return told.time - begun


@GROUP.check("move-times-out", rule="SWARM_MOVE", moving=True, needs=("finished-result-repeated",))
def times_out(robot: Subject) -> str:
    """A move that has not arrived after twice its planned time and 1 s has timed out."""
    robot.arm()
    angle = 3.0
    took = _overdue(robot, robot.move(angle, options=BODY))
    wanted = 2 * angle / TURN_SPEED + _SPARE
    require(abs(took - wanted) <= _LATE, f"it timed out after {took:.2f} s, not {wanted:.2f} s")
    return f"after {took:.2f} s"


@GROUP.check("pushing-move-has-longer", rule="SWARM_MOVE", moving=True, needs=("move-times-out",))
def pushing(robot: Subject) -> str:
    """With PUSH a move may take three times its planned time and 1 s."""
    robot.arm()
    angle = 3.0
    took = _overdue(robot, robot.move(angle, options=BODY | MoveOption.PUSH))
    wanted = 3 * angle / TURN_SPEED + _SPARE
    require(abs(took - wanted) <= _LATE, f"it timed out after {took:.2f} s, not {wanted:.2f} s")
    return f"after {took:.2f} s"


@GROUP.check("move-replaced", rule="A move", motion=True, needs=("observation-acknowledged",))
def replaced(robot: Subject) -> str:
    """A new move replaces the one under way, which is told at once, without the ring."""
    robot.arm()
    old = robot.lasting(5.0)
    robot.expect(old, Reason.NONE)
    robot.spend(0.2)
    start = len(robot.heard)
    new = robot.brief()
    robot.expect(new, Reason.NONE, "while a move is under way")
    told = robot.reported(old, 0.0, start=start)
    require(told.outcome == SwarmOutcome.REPLACED, f"the first one ended {robot.outcome(told)}, not REPLACED")
    require(told.flags & ObservationFlag.RING_NOT_READ, "the first one's observation says that the ring was read for it")
    robot.ended(new, 0.5, start=start)
    robot.expect_state(State.READY, "when the new one is over")
    return "REPLACED, and the new one done"


def _driven(robot: Subject, stop: Callable[[], None], reason: Reason, what: str) -> None:
    """Drive, stop, and see that the robot says so and stands."""
    robot.open_session()
    robot.arm()
    begun = robot.observe()
    move = robot.move(0.0, 2 * WAY, speed=_SLOW, options=BODY)
    robot.expect(move, Reason.NONE)
    robot.spend(0.3)
    start = len(robot.heard)
    stop()
    told = robot.results(start) or [robot.ended(move, 0.5, start=start)]
    robot.expect_stopped(told[0], reason)
    robot.spend(0.2)
    first = robot.observe()
    robot.spend(0.5)
    went = leg(first, robot.observe())[1]
    require(went <= NEAR, f"stopped by {what}, it went {went * 1e3:.0f} mm more")
    robot.order(Command.ARM_DISARM, 0)
    robot.arm()
    robot.moved(robot.move(0.0, leg(begun, first)[1], options=BODY | MoveOption.BACKWARD))


@GROUP.check(
    "stopped-move-stands",
    rule="Stopping",
    moving=True,
    room=ROOM,
    needs=(
        "move-arrives",
        "move-from-nose",
        "move-backward",
        "disarming-ends-maneuver",
        "emergency-stop-at-once",
        "watchdog-stops",
    ),
)
def stands(robot: Subject) -> str:
    """Disarmed, stopped, or left by its keeper in mid-move, the robot stands, and says why."""

    def be_silent() -> None:
        with robot.silence():
            robot.spend(0.6)

    with robot.parameters(WATCHDOG=250.0):
        _driven(robot, lambda: robot.order(Command.ARM_DISARM, 0), Reason.DISARMED, "disarming")
        _driven(robot, lambda: robot.order(Command.FLIGHT_TERMINATION, 1), Reason.EMERGENCY_STOP, "an emergency stop")
        _driven(robot, be_silent, Reason.WATCHDOG, "the watchdog")
    return "disarming, emergency stop, watchdog"


@GROUP.check(
    "move-blocked-by-contact", rule="SWARM_MOVE", moving=True, room=ROOM, second=True, needs=("move-arrives", "move-from-nose")
)
def blocked(robot: Subject) -> str:
    """With STOP_ON_CONTACT, contact ahead ends a move as BLOCKED: on the way, and where it is there already."""
    robot.arm()
    robot.set_beside(_TOUCH + WAY / 2)
    told = robot.moved(robot.move(0.0, WAY, options=BODY | CONTACT), SwarmOutcome.BLOCKED, "against a robot")
    require(told.travelled <= WAY / 2 + NEAR, f"it went {told.travelled * 1e3:.0f} mm, with contact after {WAY / 2e-3:.0f} mm")
    wanted = ObservationFlag.CONTACT_AHEAD | ObservationFlag.CONTACT
    require(told.flags & wanted == wanted, f"in contact ahead, the flags are {told.flags}")
    again = robot.moved(robot.move(0.0, WAY, options=BODY | CONTACT), SwarmOutcome.BLOCKED, "in contact from the start")
    require(again.travelled <= NEAR / 2, f"in contact from the start, it went {again.travelled * 1e3:.0f} mm")
    away = robot.moved(robot.move(math.pi, WAY, options=BODY))
    require(not away.flags & ObservationFlag.CONTACT, f"with nobody near, the flags are {away.flags}")
    return "on the way, from the start; away from it, it drives"


@GROUP.check(
    "contact-behind-lets-drive",
    rule="SWARM_MOVE",
    moving=True,
    room=ROOM,
    second=True,
    needs=("move-arrives", "move-from-nose", "move-backward", "move-blocked-by-contact"),
)
def behind(robot: Subject) -> str:
    """Contact that is not within 60 degrees of the way ends no move."""
    robot.arm()
    robot.set_beside(_TOUCH + WAY / 2)
    robot.moved(robot.move(0.0, WAY, options=BODY | CONTACT), SwarmOutcome.BLOCKED, "against a robot")
    back = robot.move(math.pi, WAY, options=BODY | CONTACT | MoveOption.BACKWARD)
    told = robot.moved(back, when="away from contact, which is behind its way,")
    return f"{told.travelled * 1e3:.0f} mm"


@GROUP.check(
    "unasked-contact-ignored",
    rule="SWARM_MOVE",
    moving=True,
    room=ROOM,
    second=True,
    needs=("move-arrives", "move-from-nose", "move-backward", "move-blocked-by-contact"),
)
def pushes(robot: Subject) -> str:
    """Without STOP_ON_CONTACT, and with PUSH, contact ends no move."""
    robot.arm()
    for options in (0, CONTACT | MoveOption.PUSH):
        robot.set_beside(_TOUCH + WAY / 3)
        robot.moved(robot.move(0.0, WAY, options=BODY | options), when=f"into a robot with options {options}")
        robot.moved(robot.move(math.pi, WAY, options=BODY))
        given(robot.observe(), "it does not answer any more")
    return "pushed without STOP_ON_CONTACT, and with PUSH"
