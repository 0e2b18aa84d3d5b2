"""Whom an answer is for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from firmware_protocol.messages import MESSAGES
from firmware_protocol.wire.fields import Direction, wire_fields

if TYPE_CHECKING:
    from firmware_protocol.wire.fields import Message

ANSWERS: Final = frozenset(
    message
    for message in MESSAGES.values()
    if message.DIRECTION is not Direction.DOWN and "target_system" in dict(wire_fields(message))
)
"""Messages of a robot that name a system and a component; questions of PING and TIMESYNC name nobody."""


def for_another(message: Message, system: int, component: int) -> bool:
    """Whether a robot's message is an answer to somebody else.

    One that names nobody (0) is taken for ours: foreign robots may leave that out.

    Args:
        message: The message.
        system: Our system id.
        component: Our component id.
    """
    if type(message) not in ANSWERS:
        return False
    answer = cast("Any", message)
    return answer.target_system not in {0, system} or answer.target_component not in {0, component}
