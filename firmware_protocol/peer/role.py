"""What one kind of robot brings: as data, so that a peer and a bridge serve it without knowing it by name."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from firmware_protocol.wire.fields import Message


@dataclass(frozen=True)
class Role:
    """One kind of robot.

    Attributes:
        name: What it is called, as `Junior`.
        product: AUTOPILOT_VERSION.product_id of such a robot, by which it is known.
        readings: What it says most often, which carries its clock (`time`, in s): on a slow line it is asked for less of it.
        streams: What a host needs of it, and the intervals in s.
        slowest: Least often that it may say its readings and still be driven: the interval in s.
        results: How something ended that was accepted long before: acknowledged by ROBOT_RESULT_ACK, and repeated until then.
        undisturbed: States in which a new session leaves it armed.
        companions: Components beside it, what they say, and the intervals in s that they are asked for on a slow line.
    """

    name: str
    product: int
    readings: type[Message]
    streams: Mapping[type[Message], float]
    slowest: float
    results: frozenset[type[Message]] = frozenset()
    undisturbed: frozenset[int] = frozenset()
    companions: Mapping[int, Mapping[type[Message], float]] = field(default_factory=dict)
