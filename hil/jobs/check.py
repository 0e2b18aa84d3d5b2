"""Conformance of a robot against the protocol."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Final

from firmware_protocol.address import parse_address
from hil.bridge.clock import LastReading
from hil.conformance import CHECKS, LAST, Check, CheckOutcome, Subject, Verdict, on_wire, perform
from hil.connecting.connecting import asked_for
from hil.connecting.lines import need_full_rate
from hil.jobs.options import MOST_SEED, none_or
from hil.jobs.session import begin_log, nothing_said
from hil.jobs.words import nothing, tell_others
from hil.signing.key_file import open_signing

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Self

    from hil.jobs.stage import Stage
    from pal_advisor.fields import Fields

MOST_SYSTEM: Final = 254
LONGEST: Final = 60.0
"""Longest wait for a robot, in s."""


def chosen_checks(only: tuple[str, ...]) -> list[Check]:
    """The checks that were asked for by name, in the suite's order.

    Args:
        only: Their names; empty where none was named.

    Raises:
        ValueError: There is no such check; the text is its name.
    """
    known = {check.name for check in CHECKS}
    for name in only:
        if name not in known:
            raise ValueError(name)
    return [check for check in CHECKS if check.name in only]


@dataclass(frozen=True)
class Checked:
    """What came of it.

    Attributes:
        verdicts: One for each check.
        lost: Frames that were lost on the way.
        spoilt: Pieces that were damaged.
    """

    verdicts: list[Verdict]
    lost: int
    spoilt: int

    @property
    def failed(self) -> bool:
        """A check failed."""
        return any(verdict.outcome is CheckOutcome.FAILED for verdict in self.verdicts)

    def facts(self) -> list[dict[str, object]]:
        """The verdicts, as plain values."""
        return [{"name": verdict.check.name, "passed": verdict.passed, "detail": verdict.detail} for verdict in self.verdicts]


@dataclass(frozen=True)
class CheckJob:
    """Checks to be made.

    Attributes:
        moving: Also those in which wheels turn.
        only: Names of those to be made; empty makes all.
        system: System id of the robot; None takes the first that answers.
        second: System id of another robot on the link, for the checks that need one; None: there is none.
        timeout: How long to wait for a robot, in s.
        seed: Seed of an emulated robot in this process.
        told: Is told each verdict as it comes.
    """

    VERB: ClassVar[str] = "check"

    moving: bool
    only: tuple[str, ...]
    system: int | None
    second: int | None
    timeout: float
    seed: int
    told: Callable[[Verdict], None] = field(default=nothing, compare=False)

    @property
    def reconnect(self) -> float:
        """A robot that is lost is not waited for, in s."""
        return 0.0

    def options(self) -> dict[str, Any]:
        """Everything that decides."""
        return {
            "moving": self.moving,
            "only": list(self.only),
            "system": self.system,
            "second": self.second,
            "timeout": self.timeout,
            "seed": self.seed,
        }

    def files(self) -> dict[str, bytes]:
        """None."""
        return {}

    @classmethod
    def of_log(cls, options: Fields, files: Mapping[str, bytes]) -> Self:  # noqa: ARG003 - it has none
        """As a log has it; see `Job.of_log`."""
        only = options.texts("only")
        try:
            chosen_checks(only)
        except ValueError as error:
            raise options.wrong("only", f"there is no check {error}") from error
        return cls(
            moving=options.flag("moving"),
            only=only,
            system=none_or(options, "system", lambda fields, name: fields.integer(name, 1, MOST_SYSTEM)),
            second=none_or(options, "second", lambda fields, name: fields.integer(name, 1, MOST_SYSTEM))
            if options.has("second")
            else None,
            timeout=options.number("timeout", 0, LONGEST),
            seed=options.integer("seed", 0, MOST_SEED),
        )

    def perform(self, stage: Stage) -> Checked:
        """Make them."""
        address = parse_address(stage.url)
        with ExitStack() as stack:
            stack.enter_context(stage.interrupts())
            opener = stage.opener_of(address)
            need_full_rate(address, opener.faults, signed=stage.key is not None)
            recorder = begin_log(stack, stage)
            with nothing_said(recorder):
                wire = opener.open()
                stack.callback(wire.close)
                reading = LastReading(opener.clock)
                signing = open_signing(stage.key, wire, reading, opener.signing_time)
            robot = Subject(
                wire,
                reading,
                session=opener.session,
                system=self.system or asked_for(address),
                taps=[recorder] if recorder else [],
                signing=signing,
                pump=opener.pump(wire, None, None, stage.operator),
                operator=stage.operator,
                network=address.url,
                second=self.second,
            )
            stack.callback(robot.close)
            robot.greet(self.timeout)
            if not self.system:
                tell_others(robot.system, robot.others, stage.url, stage.tell)
            checks = chosen_checks(self.only) or on_wire(CHECKS, robot.wire)
            verdicts = perform(robot, checks, LAST, moving=self.moving, told=self.told)
            checked = Checked(verdicts, robot.lost, robot.spoilt)
            if recorder is not None:
                recorder.note("result", "done", checks=checked.facts())
        return checked
