"""Runs checks one after the other, and leaves the robot as it was found on every way out."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Final

from firmware_protocol.wire.fields import CAN, MAVLINK
from hil.conformance.registry import ANY_ROLE, ANY_WIRE, CheckFailedError, NotRunError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.peer.role import Role
    from hil.conformance.registry import Check
    from hil.conformance.subject import Subject

CARRIED: Final = {MAVLINK: "MAVLink bytes", CAN: "CAN frames"}
"""What links carry, in words, by wire."""


class CheckOutcome(Enum):
    """How a check ended."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_RUN = "not run"
    OTHER_ROLE = "not for this role"


@dataclass(frozen=True)
class Verdict:
    """What came of a check.

    Attributes:
        check: Which.
        outcome: How it ended.
        detail: What was found, in words.
    """

    check: Check
    outcome: CheckOutcome
    detail: str

    @property
    def passed(self) -> bool | None:
        """None where it was not run."""
        ran = self.outcome in {CheckOutcome.PASSED, CheckOutcome.FAILED}
        return self.outcome is CheckOutcome.PASSED if ran else None


def perform(
    robot: Subject,
    checks: Sequence[Check],
    last: Check,
    *,
    moving: bool = False,
    told: Callable[[Verdict], None] = lambda _: None,
) -> list[Verdict]:
    """Run checks.

    Args:
        robot: The robot; it has been greeted.
        checks: Which, in order.
        last: Run after all others, and on every other way out: it puts the robot back.
        moving: Run those in which the wheels turn, too.
        told: Called with every verdict as it is known.

    Returns:
        The verdicts.

    Raises:
        LinkError: The link is gone.
        PeerLostError: The robot is gone.
    """
    verdicts: list[Verdict] = []
    failed: set[str] = set()

    def note(verdict: Verdict) -> None:
        verdicts.append(verdict)
        if verdict.outcome is CheckOutcome.FAILED:
            failed.add(verdict.check.name)
        told(verdict)

    try:
        for check in checks:
            if check.role not in {ANY_ROLE, robot.role.name}:
                note(Verdict(check, CheckOutcome.OTHER_ROLE, CheckOutcome.OTHER_ROLE.value))
            elif check.turns(stands=robot.examples.stands) and not moving:
                room = f" and needs {check.room:g} m of free room around it" if check.room else ""
                note(Verdict(check, CheckOutcome.NOT_RUN, f"turns the wheels{room}: --moving"))
            elif check.second and robot.second is None:
                note(Verdict(check, CheckOutcome.NOT_RUN, "needs a second robot: --with ADDRESS"))
            elif check.wire not in {ANY_WIRE, robot.wire}:
                note(Verdict(check, CheckOutcome.NOT_RUN, f"only on links that carry {CARRIED[check.wire]}"))
            elif check.keyed and robot.signing is None:
                note(Verdict(check, CheckOutcome.NOT_RUN, "no key: --signing-key"))
            elif missing := [name for name in check.needs if name in failed]:
                note(Verdict(check, CheckOutcome.NOT_RUN, f"makes no sense as long as {missing[0]} fails"))
            else:
                note(_judge(check, robot))
    finally:
        note(_judge(last, robot))
    return verdicts


def on_wire(checks: Sequence[Check], wire: str) -> list[Check]:
    """Those of the checks that can be run on a wire.

    Args:
        checks: Any.
        wire: `mavlink` or `can`, as a link says.
    """
    return [check for check in checks if check.wire in {ANY_WIRE, wire}]


def for_role(checks: Sequence[Check], role: Role) -> list[Check]:
    """Those of the checks that are for robots of a role.

    Args:
        checks: Any.
        role: A robot's.
    """
    return [check for check in checks if check.role in {ANY_ROLE, role.name}]


def _judge(check: Check, robot: Subject) -> Verdict:
    try:
        robot.fresh()
        with robot.slowly() if check.motion else nullcontext():
            return Verdict(check, CheckOutcome.PASSED, check.run(robot))
    except CheckFailedError as failure:
        return Verdict(check, CheckOutcome.FAILED, str(failure))
    except NotRunError as reason:
        return Verdict(check, CheckOutcome.NOT_RUN, str(reason))
