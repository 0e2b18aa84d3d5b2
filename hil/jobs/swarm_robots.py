"""The robots of a swarm: who they are, and which of them is which."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import radians
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.roles.swarm import longest_time, move
from firmware_protocol.vocabulary import Move, MoveOption

if TYPE_CHECKING:
    from hil.swarm.handle import Swarm

NOT_KNOWN: Final = 0xFFFF
"""Voltage of a battery that nobody measures, in mV."""
TURN: Final = radians(20)
"""How far a robot turns to show which one it is, in rad."""
_MOVE_SPEED: Final = 0.2
_TURN_SPEED: Final = 1.0
"""Slower than robots turn, for a robot that is slow, in rad/s."""


@dataclass(frozen=True)
class RobotOverview:
    """One robot.

    Attributes:
        address: NETWORK.ID, or ID where there is one network.
        uid: Its unique id, 16 hexadecimal digits; empty where it does not say any.
        kind: Its class, as `ranger`; empty where it has not said any.
        ring: A ring of sensors is fitted.
        battery: In V; None where it has not said.
        fix_age: Age of its position fix, in s; None where it never had one.
        fence: Half the sides of its fence, in m, 0 for none; None where it has not said.
        armed: Its wheels may turn; None where nobody knows.
    """

    address: str
    uid: str
    kind: str
    ring: bool
    battery: float | None
    fix_age: float | None
    fence: tuple[float, float] | None
    armed: bool | None

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        values = asdict(self)
        values["class"] = values.pop("kind")
        return values


def robots_of(swarm: Swarm) -> list[RobotOverview]:
    """Everybody who is there, in the order of their addresses.

    Args:
        swarm: The robots; that they are watched will do.
    """
    seen = swarm.observe().observations
    fences = [swarm.ask(lambda robot, name=name: robot.peer.read_parameter(name)).values for name in ("FENCE_X", "FENCE_Y")]  # type: ignore[misc]
    found = []
    for label, (address, robot) in zip(swarm.labels, swarm.robots.items(), strict=True):
        voltage = swarm.steady_of(address).voltage[address.system]
        fence = [values[address] for values in fences if address in values]
        found.append(
            RobotOverview(
                address=label,
                uid=robot.uid,
                kind="" if robot.kind is None else robot.kind.name.lower(),
                ring=robot.ring,
                battery=None if voltage is None or voltage == NOT_KNOWN else voltage * 1e-3,
                fix_age=seen[address].fix_age if address in seen else None,
                fence=(fence[0], fence[1]) if len(fence) == len(fences) else None,
                armed=robot.armed,
            )
        )
    return found


def show_which(swarm: Swarm, row: int) -> None:
    """Have a robot turn a little to the left and to the right; no other one is stopped, or moves.

    Args:
        swarm: The robots, watched.
        row: Row of the robot.

    Raises:
        PeerError: It does not answer, or refuses.
        LinkError: Its link is gone.
    """
    robot = swarm.members[swarm.addresses_by_row[row]]
    robot.take()
    robot.arm()
    for turn in (TURN, -2 * TURN, TURN):
        way = Move(heading=turn, options=MoveOption.BODY)
        robot.finish(move(robot.peer, way, longest_time(way, _MOVE_SPEED, _TURN_SPEED)))
    robot.disarm()
