"""The whole suite, in the order in which it is run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from hil.conformance import (
    answers,
    can_singles,
    can_transfers,
    framing,
    keeping,
    numbering,
    parameters,
    signatures,
    standard,
    stopping,
    streams,
)
from hil.conformance.junior import contest, maneuvers, memory, sensors, values, wheels
from hil.conformance.junior import stopping as junior_stopping
from hil.conformance.micro import drives, endings, neighbours, observing, refusals
from hil.conformance.registry import Check, Group, require

if TYPE_CHECKING:
    from hil.conformance.subject import Subject

_AFTERWARDS: Final = Group("afterwards")
_MODULES: Final = (
    signatures,
    framing,
    can_singles,
    can_transfers,
    standard,
    sensors,
    streams,
    parameters,
    numbering,
    answers,
    values,
    stopping,
    keeping,
    junior_stopping,
    maneuvers,
    memory,
    contest,
    wheels,
    observing,
    drives,
    refusals,
    endings,
    neighbours,
)


@_AFTERWARDS.check("left-as-found", rule="Stopping")
def left_as_found(robot: Subject) -> str:
    """The suite leaves the robot disarmed, its parameters and its memory as they were."""
    left = robot.restore()
    require(not left, f"not restored: {'; '.join(left)}")
    memory = "" if robot.memory_found is None else f", {len(robot.memory_found)} maneuvers"
    return f"{len(robot.parameters_found)} parameters{memory}"


LAST: Final[Check] = _AFTERWARDS.checks[0]
"""Run after all others."""
CHECKS: Final[tuple[Check, ...]] = tuple(check for module in _MODULES for check in module.GROUP.checks)
"""All others."""
