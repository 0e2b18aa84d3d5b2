"""Values out of range: refused, never clipped, and nothing happens."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import (
    JuniorContest,
    JuniorManeuver,
    JuniorMemoryWrite,
    JuniorWheels,
    State,
)
from firmware_protocol.roles.junior import JUNIOR
from firmware_protocol.vocabulary import Action
from hil.conformance.examples import STAY
from hil.conformance.out_of_range import refused
from hil.conformance.registry import Group, require

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message
    from hil.conformance.out_of_range import Bad
    from hil.conformance.subject import Subject

GROUP: Final = Group("values out of range", role=JUNIOR.name)


@GROUP.check("wheels-range", rule="What is not understood")
def wheels(robot: Subject) -> str:
    """JUNIOR_WHEELS with a value out of range is refused."""
    robot.arm()
    values = [("speed", 1001, 0), ("speed", -1001, 0), ("speed", 1001, 1), ("speed", -32768, 1), ("duration", 5001, 0)]
    words = refused(robot, lambda: robot.numbered(JuniorWheels, speed=(0.0, 0.0), duration=0.1), values)
    robot.expect_state(State.READY, "after refused wheels")
    return words


@GROUP.check("maneuver-range", rule="What is not understood")
def maneuver(robot: Subject) -> str:
    """JUNIOR_MANEUVER with a value out of range is refused."""
    robot.arm()
    before = robot.status().maneuvers
    values: list[Bad] = [("count", 0, 0), ("count", 9, 0), ("count", 255, 0), ("period", 19, 0), ("period", 5001, 0)]
    values += [("options", 32, 0), ("options", 65_535, 0), ("actions", 17, 0), ("actions", 255, 0)]
    with robot.still():
        words = refused(robot, lambda: robot.maneuver(STAY), values)
        count = robot.status().maneuvers - before
        require(count == 0, f"{count} of them were performed")
    robot.expect_state(State.READY, "after refused maneuvers")
    kind: type[Message] = JuniorManeuver
    return f"{kind.NAME}: {words}"


@GROUP.check("memory-range", rule="What is not understood")
def memory(robot: Subject) -> str:
    """JUNIOR_MEMORY_WRITE with a value out of range is refused."""
    robot.need_memory()
    values: list[Bad] = [("count", 9, 0), ("period", 19, 0), ("period", 5001, 0), ("options", 32, 0), ("actions", 17, 0)]
    values += [("current", 16, 0), ("current", 254, 0), ("previous", 16, 0), ("previous", 254, 0)]
    before = len(robot.read_memory())
    words = refused(robot, lambda: robot.write((Action.S,), current=15, previous=15), values)
    require(len(robot.read_memory()) == before, "one of them was stored")
    kind: type[Message] = JuniorMemoryWrite
    return f"{kind.NAME}: {words}"


@GROUP.check("contest-range", rule="What is not understood")
def contest(robot: Subject) -> str:
    """JUNIOR_CONTEST with a value out of range is refused."""
    robot.arm()
    values: list[Bad] = [("command", 2, 0), ("command", 255, 0)]
    words = refused(robot, lambda: robot.numbered(JuniorContest, command=1, countdown=60.0), values)
    robot.expect_state(State.READY, "after refused contests")
    refused(robot, lambda: robot.numbered(JuniorContest, command=1, countdown=1.0), [("countdown", 60_001, 0)])
    return f"{words}, countdown"
