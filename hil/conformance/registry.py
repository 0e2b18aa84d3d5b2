"""What a check is, and how the groups of checks are put together."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil.conformance.subject import Subject

    Run = Callable[[Subject], str]
    """Performs a check; returns what was found, in words; raises CheckFailedError or NotRunError."""

T = TypeVar("T")

ANY_WIRE: Final = ""
"""What a check is about can be seen on every wire."""
ANY_ROLE: Final = ""
"""A check is for every robot."""


class CheckFailedError(Exception):
    """The robot does not do what the protocol demands; the text says what it did instead."""


class NotRunError(Exception):
    """The check cannot be performed with this robot or over this link; the text says why."""


@dataclass(frozen=True)
class Check:
    """One demand of the protocol, and how to see whether it is met.

    Attributes:
        name: Stable name, in kebab case.
        group: Title of the group it belongs to.
        demands: What the protocol demands, in a sentence.
        rule: Where the protocol page says so: a paragraph's first words, a message or a parameter.
        run: Performs it.
        moving: The wheels turn.
        motion: Something is performed for a while: the wheels of a robot that cannot do that standing turn.
        room: Free room that is needed around the robot, in m; 0 where it stays where it is.
        second: A second robot is needed beside it.
        role: Name of the role that it is for; empty is any.
        needs: Checks that must not have failed: what they look at is taken for granted here.
        wire: The wire whose frames it is about, `mavlink` or `can`; empty where it is about messages, on any wire.
        keyed: It is about signatures: without a key it is not run.
    """

    name: str
    group: str
    demands: str
    rule: str
    run: Run
    moving: bool = False
    needs: tuple[str, ...] = ()
    wire: str = ANY_WIRE
    keyed: bool = False
    motion: bool = False
    room: float = 0.0
    second: bool = False
    role: str = ANY_ROLE

    def turns(self, *, stands: bool) -> bool:
        """Whether wheels turn.

        Args:
            stands: The robot can perform something with wheels that stand.
        """
        return self.moving or (self.motion and not stands)


@dataclass(frozen=True)
class Group:
    """Checks of one part of the protocol.

    Attributes:
        title: What they are about.
        wire: The wire whose frames they are about; empty is any.
        role: Name of the role that they are for; empty is any.
        checks: Filled by `check`, in the order of the source.
    """

    title: str
    wire: str = ANY_WIRE
    role: str = ANY_ROLE
    checks: list[Check] = field(default_factory=list)

    def check(
        self,
        name: str,
        *,
        rule: str,
        moving: bool = False,
        needs: tuple[str, ...] = (),
        wire: str | None = None,
        keyed: bool = False,
        motion: bool = False,
        room: float = 0.0,
        second: bool = False,
    ) -> Callable[[Run], Run]:
        """Register the decorated function as a check; see `Check` for the arguments. Its docstring is what is demanded.

        The wire is the group's unless another is named; the role is the group's.
        """

        def register(run: Run) -> Run:
            self.checks.append(
                Check(
                    name=name,
                    group=self.title,
                    demands=run.__doc__ or "",
                    rule=rule,
                    run=run,
                    moving=moving,
                    needs=needs,
                    wire=self.wire if wire is None else wire,
                    keyed=keyed,
                    motion=motion,
                    room=room,
                    second=second,
                    role=self.role,
                )
            )
            return run

        return register


def require(condition: object, detail: str) -> None:
    """See that something holds.

    Args:
        condition: What must be true.
        detail: What was found instead, in words.

    Raises:
        CheckFailedError: It does not hold.
    """
    if not condition:
        raise CheckFailedError(detail)


def given(value: T | None, detail: str) -> T:
    """See that something came.

    Args:
        value: What came; None where nothing did.
        detail: What was found instead, in words.

    Returns:
        The value.

    Raises:
        CheckFailedError: Nothing came.
    """
    if value is None:
        raise CheckFailedError(detail)
    return value
