"""Moves that are carried out: which way, how far, how fast, and which way round the robot stands then."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import Reason, SwarmObservation, SwarmSense
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.vocabulary import MoveOption
from firmware_protocol.wire.fields import CAN
from hil.conformance.micro.speech import turned
from hil.conformance.registry import Group, require

if TYPE_CHECKING:
    from hil.conformance.subject import Subject

GROUP: Final = Group("moves of a micro-robot", role=MICRO_ROBOT.name)
WAY: Final = 0.06
"""A way to drive, in m."""
ROOM: Final = 0.15
"""Room that a robot needs that drives out and back, in m."""
NEAR: Final = 0.008
"""How far from where it should be a robot may be, in m: where it has arrived, how it stops, and two position fixes."""
STRAIGHT: Final = 0.2
"""How far from where it should point a way may point, in rad: that of `WAY` between two fixes of some mm."""
FACING: Final = 0.12
"""Likewise the nose, in rad."""
BODY: Final = int(MoveOption.BODY)
BACKWARD: Final = int(MoveOption.BACKWARD)
Leg = tuple[float, float]
"""Direction in rad and length in m."""


def leg(before: SwarmObservation, after: SwarmObservation) -> Leg:
    """From where it was to where it is."""
    x, y = (there - here for there, here in zip(after.position, before.position, strict=True))
    return math.atan2(y, x), math.hypot(x, y)


def see_way(found: Leg, way: float, when: str) -> None:
    """See that a way of the length `WAY` went where it should.

    Args:
        found: How it went.
        way: Direction that it should have, in rad.
        when: What was asked for, in words.
    """
    aside = abs(turned(found[0] - way))
    require(
        abs(found[1] - WAY) <= NEAR and aside <= STRAIGHT,
        f"{when} it went {found[1] * 1e3:.0f} mm, {math.degrees(aside):.0f} degrees beside the way of {WAY * 1e3:.0f} mm",
    )


def see_nose(seen: SwarmObservation, heading: float, when: str) -> None:
    """See that the nose points where it should.

    Args:
        seen: Where it is.
        heading: Where the nose should point, in rad.
        when: What was asked for, in words.
    """
    off = abs(turned(seen.heading - heading))
    require(off <= FACING, f"{when} its nose is {math.degrees(off):.0f} degrees off")


@GROUP.check("move-arrives", rule="A move", moving=True, room=ROOM)
def arrives(robot: Subject) -> str:
    """A move drives its distance, turning first, and its observation says so."""
    robot.arm()
    for heading in (0.0, math.pi):
        before = robot.observe()
        told = robot.moved(robot.move(heading, WAY, options=BODY))
        went = leg(before, robot.observe())[1]
        for what, found in (("it went", went), ("it says that it has travelled", told.travelled)):
            require(abs(found - WAY) <= NEAR, f"{what} {found * 1e3:.0f} mm of {WAY * 1e3:.0f} mm")
        require(told.reason == Reason.NONE, f"the reason of a move that has arrived is {told.reason}")
    return f"{WAY * 1e3:.0f} mm out and back"


@GROUP.check("move-in-arena-frame", rule="SWARM_MOVE", moving=True, room=ROOM, needs=("move-arrives",))
def arena(robot: Subject) -> str:
    """A heading is that of the arena's frame, whichever way the nose points."""
    robot.arm()
    start = robot.observe().heading
    for angle in (math.pi / 2, -math.pi / 2, 0.0, math.pi):
        before = robot.observe()
        robot.moved(robot.move(start + angle, WAY))
        after = robot.observe()
        see_way(leg(before, after), start + angle, f"told to drive {math.degrees(angle):.0f} degrees off,")
        see_nose(after, start + angle, "on that way")
    return "out and back, along and across"


@GROUP.check("move-from-nose", rule="SWARM_MOVE", moving=True, room=ROOM, needs=("move-arrives",))
def body(robot: Subject) -> str:
    """With BODY, a heading is counted from the nose."""
    robot.arm()
    for angle in (math.pi / 2,) * 4:
        before = robot.observe()
        robot.moved(robot.move(angle, WAY, options=BODY))
        see_way(leg(before, robot.observe()), before.heading + angle, "told to drive to its left")
    return "four times to the left, in a square"


@GROUP.check("move-along-sector", rule="SWARM_MOVE", moving=True, room=ROOM, needs=("move-arrives",))
def sector(robot: Subject) -> str:
    """A move in a sector goes along the bisector of that sector of the body."""
    robot.arm()
    for number, count in ((1, 4), (3, 4), (7, 8), (1, 1)):
        before = robot.observe()
        robot.moved(robot.move(None, WAY, sector=number, sectors=count))
        way = before.heading + (number - 0.5) * math.tau / count
        see_way(leg(before, robot.observe()), way, f"told to drive in sector {number} of {count}")
        robot.moved(robot.move(math.pi, WAY, options=BODY))
    return "1 of 4, 3 of 4, 7 of 8, 1 of 1"


@GROUP.check("move-turns-to-face", rule="SWARM_MOVE", moving=True, room=ROOM, needs=("move-arrives",))
def face(robot: Subject) -> str:
    """When there, it turns its nose to `face`, in the arena's frame."""
    robot.arm()
    start = robot.observe().heading
    for way, nose in ((start, start + 2.0), (start + math.pi, start - 1.0)):
        before = robot.observe()
        robot.moved(robot.move(way, WAY, face=nose))
        after = robot.observe()
        see_nose(after, nose, "told to face another way")
        require(abs(leg(before, after)[1] - WAY) <= NEAR, "it did not drive its way before that")
    return "to its left, to its right"


@GROUP.check("move-backward", rule="SWARM_MOVE_OPTION", moving=True, room=ROOM, needs=("move-arrives", "move-in-arena-frame"))
def backward(robot: Subject) -> str:
    """With BACKWARD, it turns its tail to the way and drives in reverse."""
    robot.arm()
    start = robot.observe().heading
    for way in (start + math.pi, start):
        before = robot.observe()
        robot.moved(robot.move(way, WAY, options=BACKWARD))
        after = robot.observe()
        see_way(leg(before, after), way, "told to drive backward")
        see_nose(after, way + math.pi, "driving backward")
    return "tail first, out and back"


@GROUP.check("move-turns-only", rule="SWARM_MOVE", moving=True, room=ROOM, needs=("move-arrives", "move-in-arena-frame"))
def turns(robot: Subject) -> str:
    """A move of distance 0 turns on the spot."""
    robot.arm()
    start = robot.observe()
    for angle in (2.0, -2.0, 0.0):
        robot.moved(robot.move(start.heading + angle))
        after = robot.observe()
        see_nose(after, start.heading + angle, "told to turn")
        require(leg(start, after)[1] <= NEAR, f"it went {leg(start, after)[1] * 1e3:.0f} mm when it was told to turn")
    return "left, right, back"


@GROUP.check("move-speed", rule="SWARM_MOVE", moving=True, room=ROOM, needs=("move-arrives",))
def speed(robot: Subject) -> str:
    """It drives at the speed that the move names; where it names none, at MOVE_SPEED."""
    robot.arm()

    def took(angle: float, speed: float = 0.0) -> float:
        move = robot.move(angle, WAY, speed=speed, options=BODY)
        begun = robot.clock_reading()
        return robot.moved(move).time - begun

    slow, least = 0.04, WAY / 0.04 * 0.8
    took(0.0)
    robot.moved(robot.move(math.pi, options=BODY))
    with robot.parameters(MOVE_SPEED=0.25):
        named = took(0.0, slow)
        robot.moved(robot.move(math.pi, options=BODY))
        quick = took(0.0)
    robot.moved(robot.move(math.pi, options=BODY))
    require(named >= least, f"{WAY * 1e3:.0f} mm at {slow:g} m/s took {named:.2f} s")
    require(quick < least, f"{WAY * 1e3:.0f} mm at a MOVE_SPEED of 0.25 m/s took {quick:.2f} s")
    return f"{named:.2f} s at {slow:g} m/s, {quick:.2f} s at MOVE_SPEED"


@GROUP.check(
    "repeated-move-moves-once",
    rule="A move",
    moving=True,
    room=ROOM,
    needs=("same-sequence-performs-once", "move-arrives", "finished-result-repeated"),
)
def moves_once(robot: Subject) -> str:
    """A move that is sent again repeats its answer, and moves the robot once."""
    robot.arm()
    move = robot.move(0.0, WAY, options=BODY)
    robot.expect(move, Reason.NONE)
    robot.expect(move, Reason.NONE, "sent again when under way")
    robot.reported(move)
    once = robot.observe()
    start = len(robot.heard)
    robot.expect(move, Reason.NONE, "sent again when it was over")
    robot.reported(move, 0.5, start=start)
    robot.spend(0.5)
    went = leg(once, robot.observe())[1]
    require(went <= NEAR, f"sent again, it moved the robot by {went * 1e3:.0f} mm more")
    robot.moved(robot.move(math.pi, WAY, options=BODY))
    return "answered again, and nothing moved"


@GROUP.check("move-frame-taken", rule="SWARM_MOVE_FRAME", moving=True, wire=CAN, needs=("wheels-frame-exact", "move-arrives"))
def frame(robot: Subject) -> str:
    """A SWARM_MOVE_FRAME is a move; its sector is one of those that SWARM_SENSE has told."""
    robot.arm()
    robot.sense(0.2, sectors=4)
    for number in (1, 3, 4):
        before = robot.observe()
        move = robot.move(None, sector=number, sectors=4)
        require(len(robot.frames(move)) == 1, f"{SwarmSense.NAME} told 4 sectors, and a move in one is no single frame")
        robot.moved(move)
        see_nose(robot.observe(), before.heading + (number - 0.5) * math.tau / 4, f"turned to sector {number} of 4")
    return "sectors 1, 3 and 4 of 4"
