"""What the ring sees of a second robot: sectors, the radius that grows, and who is counted within which."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages.swarm import LONG_RANGE
from firmware_protocol.roles.swarm import MICRO_ROBOT
from hil.conformance.micro.drives import ROOM
from hil.conformance.registry import Group, require

if TYPE_CHECKING:
    from hil.conformance.subject import Subject

GROUP: Final = Group("ring and neighbours", role=MICRO_ROBOT.name)
_DISTANCE: Final = 0.13
"""At which the second robot stands, in m."""
_EXACT: Final = 0.02
"""How near to a radius it may stand that it is seen on the right side of it, in m."""


def _beside(robot: Subject, bearing: float = 0.0) -> int:
    """Have the second robot stand there; its class."""
    robot.need_ring()
    robot.arm()
    robot.set_beside(_DISTANCE, bearing)
    robot.sense(_DISTANCE + _EXACT)
    counts = robot.observe().count
    require(sum(counts) == 1, f"of a robot at {_DISTANCE:g} m, within {_DISTANCE + _EXACT:g} m it counts {counts}")
    return counts.index(1)


@GROUP.check("neighbour-in-its-sector", rule="SWARM_OBSERVATION", moving=True, room=ROOM, second=True)
def sectors(robot: Subject) -> str:
    """A robot is seen in the sector of the body where it stands; sector 1 is the mask's highest bit."""
    for number, count in ((1, 8), (2, 8), (8, 8), (4, 5)):
        group = _beside(robot, (number - 0.5) * math.tau / count)
        robot.sense(_DISTANCE + _EXACT, sectors=count)
        seen = robot.observe()
        for name, mask in (("near", seen.near), ("seen", seen.seen)):
            wanted = 1 << (count - number)
            require(mask[group] == wanted, f"in sector {number} of {count}, `{name}` is {mask[group]:0{count}b}")
            require(mask[1 - group] == 0, f"`{name}` has a robot of the class that nobody is of")
    return "1, 2 and 8 of 8, 4 of 5"


@GROUP.check(
    "radius-grows",
    rule="SWARM_SENSE",
    moving=True,
    room=ROOM,
    second=True,
    needs=("neighbour-in-its-sector", "watcher-moves-nothing"),
)
def grows(robot: Subject) -> str:
    """The radius grows from R0 by increments until a robot of the other class is inside, and no further than the limit."""
    group = _beside(robot)
    least, increment = 0.05, 0.05
    with robot.parameters(CLASS=float(1 - group)):
        robot.sense(least, increment)
        seen = robot.observe()
        wanted = least + math.ceil((_DISTANCE - least) / increment) * increment
        found = (round(seen.radius, 3), seen.near[group] != 0, seen.seen[group] != 0, seen.count[group])
        require(
            found == (round(wanted, 3), False, True, 1),
            f"at {_DISTANCE:g} m the radius is {seen.radius:g} m, not {wanted:g} m; near, seen, count are {found[1:]}",
        )
        for limit, most in ((0.11, 0.10), (0.04, least)):
            robot.sense(least, increment, limit)
            found_radius = round(robot.observe().radius, 3)
            require(found_radius == most, f"with a limit of {limit:g} m the radius is {found_radius:g} m, not {most:g} m")
        robot.sense(least)
        require(robot.observe().radius == least, "a fixed radius has grown")
    return f"{least:g} to {wanted:g} m, to its limit, not at all"


@GROUP.check("radius-ignores-own-class", rule="SWARM_SENSE", moving=True, room=ROOM, second=True, needs=("radius-grows",))
def own_class(robot: Subject) -> str:
    """A robot of the own class does not end the growing: without a limit it becomes long range."""
    group = _beside(robot)
    with robot.parameters(CLASS=float(group)):
        robot.sense(0.05, 0.05, 0.25)
        found = robot.observe().radius
        require(round(found, 3) == 0.25, f"with nobody of the other class and a limit of 0.25 m it is {found:g} m")
    return "to its limit"


@GROUP.check("long-range-sees-all", rule="SWARM_SENSE", moving=True, room=ROOM, second=True, needs=("neighbour-in-its-sector",))
def long_range(robot: Subject) -> str:
    """A radius of 65.535 m is long range: it sees all, however far."""
    group = _beside(robot)
    robot.sense(LONG_RANGE)
    seen = robot.observe()
    require(seen.radius == LONG_RANGE and seen.count[group] >= 1, f"radius {seen.radius:g} m, count {seen.count}")
    return f"{sum(seen.count)} seen"


@GROUP.check(
    "counts-before-and-after",
    rule="Asking for an observation",
    moving=True,
    room=ROOM,
    second=True,
    needs=("neighbour-in-its-sector", "watcher-moves-nothing"),
)
def before(robot: Subject) -> str:
    """`count` is of the radius used now, `count_before` of the one used before."""
    group = _beside(robot)
    inside, outside = _DISTANCE + _EXACT, _DISTANCE - _EXACT
    for first, second in ((inside, outside), (outside, inside), (outside, outside)):
        robot.sense(first)
        robot.observe(host=robot.host)
        robot.sense(second)
        seen = robot.observe(host=robot.host)
        found = (seen.count_before[group], seen.count[group])
        wanted = (int(first == inside), int(second == inside))
        require(found == wanted, f"within {first:g} m before and {second:g} m now it counts {found}, not {wanted}")
    return "in and out, out and in, out"
