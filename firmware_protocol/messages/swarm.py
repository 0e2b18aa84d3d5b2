"""A micro-robot's own messages: where it is to go, what it senses there, and where it is.

Positions are the robot's centre in the arena's frame: x right, y up, origin in the middle. Headings are counter-clockwise
from x. Of N sectors, number k from 1 covers the bearings (k - 1) 2 pi / N to k 2 pi / N of the body; in a mask it is the
bit N - k, so that a mask that is printed in binary reads from sector 1 to N.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

from firmware_protocol.messages.fields import AXES, CLASSES, Sequence, Session, Target, TargetComponent
from firmware_protocol.messages.robot import Reason
from firmware_protocol.vocabulary import LONGEST_MOVE, MAX_RANGES, MAX_SECTORS, MoveOption, ObservationFlag, SwarmOutcome
from firmware_protocol.wire.fields import Direction, Message, Party, Wire

NO_ANGLE: Final = -32768
"""Wire value of an angle that there is none of."""
GREATEST_ANGLE: Final = 3.2767
"""Greatest angle that the wire can carry, in rad: a little more than half a turn."""
LONG_RANGE: Final = 65.535
"""A radius that has no end, or no limit, in m: the greatest that the wire can carry."""
_FINITE: Final = 65.534

Position = Annotated[tuple[float, ...], Wire("i16", "m", 1e-3, count=2, elements=AXES, text="Position of its centre: x, y")]
Heading = Annotated[float, Wire("i16", "rad", 1e-4, -GREATEST_ANGLE, GREATEST_ANGLE, text="Heading of its nose, -pi..pi")]
ObservationTime = Annotated[float, Wire("u64", "s", 1e-6, text="Time since boot")]
Ended = Annotated[int, Wire("u16", text="Of the move that it ends; of what was asked for, the asking's count")]
HeldSession = Annotated[int, Wire("u16", text="Session that is open; 0: none")]


@dataclass(frozen=True)
class SwarmMove(Message, id=47200, direction=Direction.DOWN, numbered=True, party=Party.SWARM):
    """Turn, drive straight, turn to `face`, sense, and report by SWARM_OBSERVATION.

    The same sequence again repeats the answer, never the motion; a new move replaces one under way. Which way is said by
    `heading` or by `sector`. What ends it: the distance over the ground, contact (STOP_ON_CONTACT), or twice the planned time
    and 1 s (with PUSH three times). On CAN a single frame, if it needs no more than that has room for.
    """

    session: Session
    sequence: Sequence
    heading: Annotated[
        float | None,
        Wire(
            "i16", "rad", 1e-4, -GREATEST_ANGLE, GREATEST_ANGLE, invalid=NO_ANGLE,
            text="Which way; with BODY from the nose; none: the sector says it",
        ),
    ]  # fmt: skip
    distance: Annotated[float, Wire("u16", "m", 1e-3, 0.0, LONGEST_MOVE, text="Way to drive; 0 turns only")]
    face: Annotated[
        float | None,
        Wire(
            "i16", "rad", 1e-4, -GREATEST_ANGLE, GREATEST_ANGLE, invalid=NO_ANGLE,
            text="Heading to turn to when there; none: stay as it came",
        ),
    ]  # fmt: skip
    speed: Annotated[float, Wire("u16", "m/s", 1e-3, text="Speed; 0: MOVE_SPEED")]
    target_system: Target
    target_component: TargetComponent
    sector: Annotated[int, Wire("u8", maximum=MAX_SECTORS, text="Sector along whose bisector to drive, from 1; 0: none")]
    sectors: Annotated[int, Wire("u8", maximum=MAX_SECTORS, text="How many sectors there are; 0 only where `sector` is 0")]
    effort: Annotated[int, Wire("u8", "%", maximum=100, text="Limit of the wheels' force; 0: 100")]
    options: Annotated[int, Wire("u8", enum=MoveOption, text="What ends it, and what is sensed then")]


@dataclass(frozen=True)
class SwarmSense(Message, id=47201, direction=Direction.DOWN, numbered=True, party=Party.SWARM):
    """How the ring is read from now on, until the robot restarts: then its parameters say it.

    The radius used is R0 + k dR, with the least k from 0 at which a robot of the other class is inside, and no more than the
    limit; inside is a robot whose distance is less.
    """

    session: Session
    sequence: Sequence
    radius: Annotated[float, Wire("u16", "m", 1e-3, text="Least radius R0; 65.535: long range, sees all")]
    increment: Annotated[float, Wire("u16", "m", 1e-3, text="Increment dR; 0: a fixed radius")]
    limit: Annotated[float, Wire("u16", "m", 1e-3, text="Greatest radius; 65.535: none")]
    target_system: Target
    target_component: TargetComponent
    sectors: Annotated[int, Wire("u8", minimum=1, maximum=MAX_SECTORS, text="How many sectors there are")]
    ranges: Annotated[int, Wire("u8", maximum=MAX_RANGES, text="In how many directions ranges are measured; 0: in none")]


@dataclass(frozen=True)
class SwarmObservation(Message, id=47202, direction=Direction.UP, party=Party.SWARM):
    """What a robot senses: where a move has ended, or because it was asked for (REQUEST_MESSAGE).

    That of a move is repeated 250 ms after it has left, then after 500 ms and every 1 s, until acknowledged (ROBOT_RESULT_ACK)
    or superseded. What was asked for has outcome NONE and, as `sequence`, the asking's count (`param2`).
    """

    time: ObservationTime
    session: HeldSession
    sequence: Ended
    position: Position
    heading: Heading
    travelled: Annotated[float, Wire("u16", "m", 1e-3, text="Way over the ground, along the move")]
    radius: Annotated[float, Wire("u16", "m", 1e-3, text="Radius that is used now")]
    radius_before: Annotated[float, Wire("u16", "m", 1e-3, text="Radius of the last observation but this: of `count_before`")]
    near: Annotated[
        tuple[int, ...], Wire("u16", count=2, elements=CLASSES, text="Sectors with a robot within R0, for each class")
    ]
    seen: Annotated[
        tuple[int, ...], Wire("u16", count=2, elements=CLASSES, text="Sectors with a robot within the radius, for each class")
    ]
    box_bearing: Annotated[
        float | None,
        Wire("i16", "rad", 1e-4, -GREATEST_ANGLE, GREATEST_ANGLE, invalid=NO_ANGLE, text="Bearing of the box from the nose"),
    ]
    box_distance: Annotated[float | None, Wire("u16", "m", 1e-3, 0.0, _FINITE, invalid=65535, text="Distance to its surface")]
    goal_bearing: Annotated[
        float | None,
        Wire("i16", "rad", 1e-4, -GREATEST_ANGLE, GREATEST_ANGLE, invalid=NO_ANGLE, text="Bearing of the goal from the nose"),
    ]
    fix_age: Annotated[
        float | None, Wire("u16", "s", 1e-3, 0.0, _FINITE, invalid=65535, text="Age of the position fix; none: never had one")
    ]
    count: Annotated[
        tuple[int, ...],
        Wire("u8", count=2, elements=CLASSES, text="Robots within the radius, for each class; 255 or more: 255"),
    ]
    count_before: Annotated[
        tuple[int, ...], Wire("u8", count=2, elements=CLASSES, text="Robots within `radius_before`, likewise")
    ]
    flags: Annotated[int, Wire("u8", enum=ObservationFlag, newer=True, text="Contact, position, ring")]
    outcome: Annotated[int, Wire("u8", enum=SwarmOutcome, text="How the move ended; NONE: it was asked for")]
    reason: Annotated[int, Wire("u8", enum=Reason, newer=True, text="Why, where it was refused or stopped")]


@dataclass(frozen=True)
class SwarmRanges(Message, id=47203, direction=Direction.UP, party=Party.SWARM):
    """Ranges round about: with the observation of a move with RANGES, or asked for.

    Direction i of `count`, from 0, looks along heading + i 2 pi / count. Ranges are taken from the robot's centre.
    """

    time: ObservationTime
    robots: Annotated[int, Wire("u32", text="Directions in which what is hit is a robot: bit i for direction i")]
    session: HeldSession
    sequence: Ended
    position: Position
    heading: Heading
    ranges: Annotated[
        tuple[float | None, ...],
        Wire(
            "u16", "m", 1e-3, 0.0, _FINITE, count=MAX_RANGES, invalid=65535,
            text="Ranges, those that are not used 0; none: nothing is in range",
        ),
    ]  # fmt: skip
    count: Annotated[int, Wire("u8", maximum=MAX_RANGES, text="How many are used")]


@dataclass(frozen=True)
class SwarmFix(Message, id=47204, direction=Direction.DOWN, party=Party.SWARM):
    """Where the robot is, where the position system is a camera on the PC's side. Not numbered, not answered.

    One of another session than the open one is ignored, and so is every one by a robot that has a fix of its own. One that
    is older than FIX_AGE counts as none.
    """

    session: Session
    position: Position
    heading: Heading
    age: Annotated[float, Wire("u16", "s", 1e-3, text="How old it is")]
    target_system: Target
    target_component: TargetComponent


SWARM_MESSAGES: Final[tuple[type[Message], ...]] = (SwarmMove, SwarmSense, SwarmObservation, SwarmRanges, SwarmFix)
