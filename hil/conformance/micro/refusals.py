"""What a micro-robot refuses: values out of range, the fence, a position that it does not know; and whom it believes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import ROBOT_COMPONENT, ParamSet, Reason, State, SwarmFix, SwarmObservation, SwarmSense
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.vocabulary import ObservationFlag, SwarmOutcome
from hil.conformance.micro.drives import BODY, NEAR, ROOM, WAY, leg
from hil.conformance.orders import named
from hil.conformance.out_of_range import refused
from hil.conformance.probe import TRIES
from hil.conformance.registry import Group, NotRunError, require

if TYPE_CHECKING:
    from hil.conformance.out_of_range import Bad
    from hil.conformance.subject import Subject

GROUP: Final = Group("refusals, fence and fix", role=MICRO_ROBOT.name)
_YOUNG: Final = 0.01
"""Least FIX_AGE, in s: most fixes are older."""
_SLOW: Final = 0.1
"""Speed of a move during which something changes, in m/s."""
_OLD: Final = 0.2
_NARROW: Final = 0.001
"""Least half of a fence, in m."""


@GROUP.check("move-range", rule="What is not understood")
def move_range(robot: Subject) -> str:
    """SWARM_MOVE with a value out of range is refused, and nothing moves."""
    robot.arm()
    before = robot.status().maneuvers
    values: list[Bad] = [("distance", 60_001, 0), ("distance", 65_535, 0), ("effort", 101, 0), ("sectors", 17, 0)]
    values += [("options", 64, 0), ("options", 255, 0)]
    words = refused(robot, robot.brief, values)
    words += ", " + refused(
        robot, lambda: robot.brief(heading=None, sector=1, sectors=4), [("sector", 5, 0), ("sectors", 0, 0)]
    )
    count = robot.status().maneuvers - before
    require(count == 0, f"{count} of them were performed")
    robot.expect_state(State.READY, "after refused moves")
    return words


@GROUP.check("move-needs-a-way", rule="SWARM_MOVE")
def needs_way(robot: Subject) -> str:
    """A move with neither heading nor sector is refused by BAD_VALUE."""
    robot.arm()
    robot.expect(robot.move(None, WAY, speed=0.001, sectors=8), Reason.BAD_VALUE, "with neither heading nor sector")
    robot.expect_state(State.READY, "after a refused move")
    return "BAD_VALUE"


@GROUP.check("sense-range", rule="What is not understood")
def sense_range(robot: Subject) -> str:
    """SWARM_SENSE with a value out of range is refused, and changes nothing."""
    before = robot.observe().radius

    def make() -> SwarmSense:
        return robot.numbered(SwarmSense, radius=1.5, increment=0.0, limit=0.0, sectors=8, ranges=0)

    robot.told_to_sense = True
    words = refused(robot, make, [("sectors", 0, 0), ("sectors", 17, 0), ("ranges", 33, 0)])
    after = robot.observe().radius
    require(after == before or after < 1.5, f"a refused SWARM_SENSE set the radius to {after:g} m")
    return words


def _outward(x: float, y: float) -> float:
    """The heading along the greater of two coordinates, away from the origin, in rad."""
    if abs(x) >= abs(y):
        return 0.0 if x >= 0 else math.pi
    return math.copysign(math.pi / 2, y)


@GROUP.check("fence-refuses-moves-out", rule="The fence")
def fence(robot: Subject) -> str:
    """A move whose way ends beyond the fence is refused by BAD_VALUE, and the robot stands."""
    x, y = robot.need_fix().position
    robot.arm()
    with robot.parameters(FENCE_X=abs(x) + 0.125, FENCE_Y=abs(y) + 0.125):
        for heading in (0.0, math.pi / 2, math.pi, -math.pi / 2):
            robot.expect(robot.move(heading, 3.0 + 2 * max(abs(x), abs(y))), Reason.BAD_VALUE, "to beyond the fence")
        robot.expect(robot.brief(), Reason.NONE, "that turns, inside the fence")
    return "four ways"


def _set_outside(robot: Subject) -> tuple[float, str]:
    """Drive out along an axis, so that a fence can be behind.

    Returns:
        The heading outward in rad, and the fence's parameter on that axis.
    """
    x, y = robot.need_fix().position
    out = _outward(x, y)
    robot.moved(robot.move(out, WAY))
    return out, "FENCE_X" if abs(x) >= abs(y) else "FENCE_Y"


@GROUP.check(
    "fence-lets-back-in", rule="The fence", moving=True, room=ROOM, needs=("fence-refuses-moves-out", "move-in-arena-frame")
)
def back_in(robot: Subject) -> str:
    """From outside, a move that ends nearer to the inside is accepted, and one that leads further out is refused."""
    robot.arm()
    out, side = _set_outside(robot)
    with robot.parameters(**{side: _NARROW * 8}):
        robot.expect(robot.move(out, WAY / 2), Reason.BAD_VALUE, "further out")
        robot.moved(robot.move(out + math.pi, WAY / 2), when="back to the inside")
    robot.moved(robot.move(out + math.pi, WAY / 2))
    return "in, and not out"


@GROUP.check("fence-stops-outward", rule="The fence", moving=True, room=ROOM, needs=("fence-lets-back-in",))
def stops_outward(robot: Subject) -> str:
    """A robot that is outside and goes outward stops, and says BAD_VALUE."""
    robot.arm()
    out, side = _set_outside(robot)
    begun = robot.observe()
    move = robot.move(out, WAY, speed=_SLOW)
    try:
        robot.expect(move, Reason.NONE)
        robot.spend(0.2)
        robot.send(ParamSet(robot.system, ROBOT_COMPONENT, side, _NARROW * 8))
        told = robot.reported(move)
    finally:
        robot.set_parameter(side, robot.parameters_found.get(side, 0.0))
    robot.expect_stopped(told, Reason.BAD_VALUE)
    robot.moved(robot.move(out + math.pi, WAY + leg(begun, robot.observe())[1]))
    return f"after {told.travelled * 1e3:.0f} of {WAY * 1e3:.0f} mm"


@GROUP.check("fence-needs-fix", rule="The fence", moving=True, room=ROOM, needs=("fence-refuses-moves-out", "move-arrives"))
def fence_needs_fix(robot: Subject) -> str:
    """With a fence and no fix for FIX_AGE, a robot only turns: a move is refused by NOT_FOUND, and one under way ends so."""
    robot.need_fix()
    robot.arm()
    with robot.parameters(FENCE_X=30.0):
        with robot.parameters(FIX_AGE=_YOUNG):
            reasons = [robot.request(robot.move(0.0, 0.001, options=BODY)) for _ in range(8)]
            robot.expect(robot.brief(), Reason.NONE, "that turns")
        if Reason.NOT_FOUND not in reasons and robot.observe().fix_age == 0:
            raise NotRunError("its position fix is never older than 10 ms")
        require(Reason.NOT_FOUND in reasons, f"a move was answered by {', '.join({named(Reason, one) for one in reasons})}")
        move = robot.move(0.0, WAY, speed=_SLOW, options=BODY)
        robot.expect(move, Reason.NONE)
        robot.spend(0.2)
        with robot.parameters(FIX_AGE=_YOUNG):
            told = robot.reported(move)
    found = (robot.outcome(told), named(Reason, told.reason))
    wanted = (SwarmOutcome.REFUSED.name, Reason.NOT_FOUND.name)
    require(found == wanted, f"a move that lost its fix ended {', '.join(found)}, not {', '.join(wanted)}")
    robot.moved(robot.move(math.pi, told.travelled, options=BODY))
    return "refused, and given up under way"


@GROUP.check("dead-reckoning-told", rule="SWARM_OBSERVATION_FLAG")
def dead_reckoning(robot: Subject) -> str:
    """An observation says that it goes by dead reckoning when its fix is FIX_AGE old, or older, and else does not."""
    for limit in (1.0, _YOUNG):
        with robot.parameters(FIX_AGE=limit):
            for _ in range(8):
                seen = robot.observe()
                old = seen.fix_age is None or seen.fix_age >= limit
                told = bool(seen.flags & ObservationFlag.DEAD_RECKONING)
                age = "never" if seen.fix_age is None else f"{seen.fix_age:g} s old"
                require(told == old, f"with a fix that is {age} and FIX_AGE {limit:g} s, DEAD_RECKONING is {told}")
                robot.spend(0.013)
    return "by the age of the fix"


def _fixed(robot: Subject, session: int, age: float = 0.0) -> bool:
    """Say that the robot is elsewhere, and see whether it believes that."""
    before = robot.observe()
    x, y = before.position
    there = (x + 0.5 if x < 0 else x - 0.5, y)
    told = SwarmFix(session, there, before.heading, age, robot.system, ROBOT_COMPONENT)
    for _ in range(TRIES):  # a fix of its own may follow at once
        request = robot.asking(SwarmObservation)
        robot.send(told, request)
        after = robot.wait(SwarmObservation, lambda m, count=request.param2: m.sequence == count)  # type: ignore[misc]
        if after is not None and leg(before, after)[1] > 5 * NEAR:
            return True
        robot.spend(0.017)
    return False


def _has_own_fix(robot: Subject) -> bool:
    """It finds its position itself: nobody has told it for a while, and it knows."""
    with robot.parameters(FIX_AGE=1.0):
        robot.spend(1.1)
        return not robot.observe().flags & ObservationFlag.DEAD_RECKONING


@GROUP.check("own-fix-believed", rule="SWARM_FIX")
def own_fix(robot: Subject) -> str:
    """A robot that finds its position itself ignores SWARM_FIX."""
    if not _has_own_fix(robot):
        raise NotRunError("it does not find its position itself")
    require(not _fixed(robot, robot.session), "it believed SWARM_FIX, and finds its position itself")
    return "it stays where it is"


@GROUP.check("fix-believed", rule="SWARM_FIX")
def believed(robot: Subject) -> str:
    """A robot that does not find its position itself is where SWARM_FIX of the open session says."""
    _need_no_fix(robot)
    require(_fixed(robot, robot.session), "it is not where SWARM_FIX says")
    require(not robot.observe().flags & ObservationFlag.DEAD_RECKONING, "told where it is, it goes by dead reckoning")
    return "there"


@GROUP.check("fix-of-other-session-ignored", rule="SWARM_FIX", needs=("fix-believed",))
def other_session(robot: Subject) -> str:
    """SWARM_FIX of another session than the open one is ignored."""
    _need_no_fix(robot)
    require(not _fixed(robot, robot.session ^ 1), "it believed SWARM_FIX of another session")
    return "ignored"


@GROUP.check("old-fix-ignored", rule="SWARM_FIX", needs=("fix-believed",))
def old(robot: Subject) -> str:
    """SWARM_FIX that is older than FIX_AGE counts as none."""
    _need_no_fix(robot)
    with robot.parameters(FIX_AGE=0.1):
        require(not _fixed(robot, robot.session, _OLD), f"it believed a fix that is {_OLD:g} s old, and FIX_AGE is 0.1 s")
    return f"{_OLD:g} s old"


def _need_no_fix(robot: Subject) -> None:
    if _has_own_fix(robot):
        raise NotRunError("it finds its position itself")
