"""What several jobs say in words."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Final

from firmware_protocol.address import parse_address
from firmware_protocol.messages import SensorFlag
from hil.connecting.connecting import asked_for, with_system

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

_SENSED: Final = 0xFF


def tell_others(system: int, others: Collection[int], url: str, tell: Callable[[str], None] | None) -> None:
    """Say which robot was taken, and how to take another, where several are on the link and the user named none.

    Args:
        system: System id of the robot that was taken.
        others: System ids of the others.
        url: Address as the user gave it.
        tell: Says so; None: nobody wants to know.
    """
    if tell is not None and others and asked_for(parse_address(url)) is None:
        named = f"{'robot' if len(others) == 1 else 'robots'} {', '.join(map(str, sorted(others)))}"
        another = shlex.quote(with_system(url, min(others)))
        tell(f"This is robot {system}. Also on this link: {named}. To take another: {another}")


def sensed(flags: int) -> str:
    """What a robot senses.

    Args:
        flags: As in JUNIOR_SENSORS; what they say of how it measures is left out.
    """
    return ", ".join(str(flag.name).lower().replace("_", " ") for flag in SensorFlag(flags & _SENSED)) or "nothing"


def nothing(*_: object) -> None:
    """Say nothing."""
