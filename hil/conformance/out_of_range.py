"""Values that no good host would send: refused, never clipped."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import Reason
from hil.conformance.orders import named
from hil.conformance.registry import given, require

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from firmware_protocol.wire.fields import Message
    from hil.conformance.talk import Talk

Bad = tuple[str, int, int]
"""A field, a wire value that it must not have, and the element."""


def refused(robot: Talk, make: Callable[[], Message], values: Sequence[Bad]) -> str:
    """See that a message is refused by BAD_VALUE with each of the values in turn.

    Args:
        robot: The robot.
        make: Makes a good message, each time with the next number.
        values: What is put into it.

    Returns:
        The fields, in words.

    Raises:
        CheckFailedError: One was accepted, refused otherwise, or not answered.
    """
    for name, value, index in values:
        message = make()
        start = len(robot.heard)
        robot.raw(robot.forged(message, name, value, index))
        reason = given(robot.answered(message, start=start), f"{message.NAME} with {name} {value} was not answered")
        words = "accepted" if reason == Reason.NONE else f"refused by {named(Reason, reason)}"
        require(reason == Reason.BAD_VALUE, f"{message.NAME} with {name} {value} was {words}")
    return ", ".join(dict.fromkeys(name for name, _, _ in values))
