"""What one kind of robot brings: as data, so that a peer and a bridge serve it without knowing it by name."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

from firmware_protocol.messages import RobotStatus
from firmware_protocol.peer.exchanges.answers import ANSWERS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from firmware_protocol.wire.fields import Message


def always(message: Any) -> bool:  # noqa: ANN401, ARG001 - any message
    """Every message of this kind is one."""
    return True


@dataclass(frozen=True)
class Role:
    """One kind of robot.

    Attributes:
        name: What it is called, as `Junior`.
        product: AUTOPILOT_VERSION.product_id of such a robot, by which it is known; None: it is no robot, and says none.
        readings: What it says most often, which carries its clock (`time`, in s): on a slow line it is asked for less of it.
        streams: What a host needs of it, and the intervals in s.
        slowest: Least often that it may say its readings and still be driven: the interval in s.
        results: How something ended that was accepted long before: acknowledged by ROBOT_RESULT_ACK, and repeated until then.
        is_result: Whether a message of these classes says how something ended; else it was asked for.
        undisturbed: States in which a new session leaves it armed.
        companions: Components beside it, what they say, and the intervals in s that they are asked for on a slow line.
    """

    name: str
    product: int | None
    readings: type[Message]
    streams: Mapping[type[Message], float]
    slowest: float
    results: frozenset[type[Message]] = frozenset()
    is_result: Callable[[Any], bool] = always
    undisturbed: frozenset[int] = frozenset()
    companions: Mapping[int, Mapping[type[Message], float]] = field(default_factory=dict)

    def ends(self, message: Message, session: int | None) -> bool:
        """Whether a message says to us how something ended.

        Args:
            message: One that is not addressed to somebody else.
            session: Ours with the robot. By that a result is known which names nobody.
        """
        if type(message) not in self.results:
            return False
        return type(message) in ANSWERS or (self.is_result(message) and cast("Any", message).session == session)


def role_of(product: int, roles: Sequence[Role]) -> Role:
    """The role of a robot that has said what it is.

    Args:
        product: AUTOPILOT_VERSION.product_id.
        roles: Those that are known.

    Returns:
        One of them; or else a role with nothing but what any robot has, so that nobody takes it for another.
    """
    return next((role for role in roles if role.product == product), None) or _unknown(product)


def _unknown(product: int) -> Role:
    name = f"robot of product {product}, which this program does not know"
    return Role(name=name, product=product, readings=RobotStatus, streams={RobotStatus: 1.0}, slowest=1.0)
