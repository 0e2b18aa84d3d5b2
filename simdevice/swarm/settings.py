"""What an emulated swarm begins with: the one list of what can be chosen of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import TABLE_NODE, TABLE_SYSTEM
from firmware_protocol.wire.fields import CAN, MAVLINK
from simdevice.swarm.profile import PROFILES, MicroProfile

if TYPE_CHECKING:
    from firmware_protocol.faults.spec import FaultSpec
    from simdevice.swarm.rooms import Room

MOST_ROBOTS: Final = {MAVLINK: TABLE_SYSTEM - 1, CAN: TABLE_NODE - 1}
"""Robots that a network has ids for, beside a table, by wire."""


@dataclass(frozen=True)
class SwarmSettings:
    """Micro-robots on a table, and their networks.

    Rows are counted from 0, RANGERs first. With `per` robots a network, row i is id i % per + 1 of network i // per + 1.

    Attributes:
        rangers: Number of RANGERs.
        wilds: Number of WILDs.
        wall: There is a wall around the table.
        seed: Of all noise.
        networks: On how many networks the robots are.
        wire: What goes in and out: MAVLink, or CAN frames in serial form.
        profile: The robots' numbers.
        occlusion: A robot that stands behind something is not seen by a ring.
        ring: The robots have a ring of sensors.
        fixes: They find their position themselves; else SWARM_FIX says it.
        period: Control period, 0.005 or 0.01 s.
        size: Width and height of the table, in m; None: the room's, else 2 x 2.
        rooms: Rooms of its own; the first one stands on the table from the beginning. In TABLE_RESET they are numbered from 4.
        faults: What goes wrong with the first robot, by the table's time; faults of a line are `DisturbedSwarm`'s business.

    Raises:
        ValueError: There is no robot, or there are too many for the networks, or too few; or a fault is none of a micro-robot.
    """

    rangers: int = 25
    wilds: int = 8
    wall: bool = False
    seed: int = 1
    networks: int = 1
    wire: str = MAVLINK
    profile: MicroProfile = PROFILES["default"]
    occlusion: bool = False
    ring: bool = True
    fixes: bool = True
    period: float = 0.005
    size: tuple[float, float] | None = None
    rooms: tuple[Room, ...] = ()
    faults: FaultSpec | None = None

    def __post_init__(self) -> None:
        if self.rangers < 0 or self.wilds < 0 or not self.count:
            raise ValueError(f"a table has at least one robot, not {self.rangers} RANGERs and {self.wilds} WILDs")
        if self.networks < 1:
            raise ValueError(f"there is at least one network, not {self.networks}")
        most = MOST_ROBOTS[self.wire]
        if self.per > most:
            least = -(-self.count // most)
            raise ValueError(f"a network has ids for {most} robots: {self.count} robots need {least} networks or more")
        if self.per * (self.networks - 1) >= self.count:
            raise ValueError(f"{self.count} robots do not fill {self.networks} networks: choose fewer")
        if self.faults is not None and self.faults.stuck:
            raise ValueError(
                f"the fault '{self.faults.stuck[0]}' is one of a Junior's sensor: a micro-robot has none like that"
            )

    @property
    def count(self) -> int:
        """Number of robots."""
        return self.rangers + self.wilds

    @property
    def per(self) -> int:
        """Robots of a network; the last one may have fewer."""
        return -(-self.count // self.networks)
