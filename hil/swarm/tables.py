"""The table of emulated micro-robots as a swarm sees it: one face on every network."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.messages import TABLE_COMPONENT, BoxShape, TableKind, TableState
from firmware_protocol.roles.swarm_table import TABLE, place, reset_table, table_system
from hil.bridge.fleet_bridge import FleetBridge

if TYPE_CHECKING:
    from firmware_protocol.events import Received
    from firmware_protocol.messages import RobotAck
    from firmware_protocol.peer.companion import Companion
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from hil.bridge.networks import Networks


class TableFaces:
    """The faces of the table.

    Args:
        networks: The networks; they may not be open yet.

    Attributes:
        states: What was seen of the table last, by name of the network.
    """

    def __init__(self, networks: Networks) -> None:
        self._networks = networks
        self.states: dict[str, TableState] = {}

    def hear(self, network: str, received: Received) -> None:
        """Take in what was said on a network.

        Args:
            network: Its name.
            received: The message.
        """
        if isinstance(received.message, TableState):
            self.states[network] = received.message

    def face(self, network: str) -> Companion | None:
        """The table as it is to be asked on a network; None: there is none.

        Args:
            network: Its name.
        """
        bridge = self._networks.bridges[network]
        if network not in self.states or not isinstance(bridge, FleetBridge):
            return None
        return bridge.beside(table_system(bridge.link.wire), TABLE_COMPONENT, TABLE)

    def reset(
        self, seed: int, size: tuple[float, float], *, wall: bool, kind: TableKind, box: BoxShape, room: int
    ) -> Ticket[RobotAck] | None:
        """Have it set up anew; see `firmware_protocol.roles.swarm_table.reset_table`.

        Returns:
            The ticket; None: there is no table.
        """
        face = self.face(next(iter(self._networks.bridges)))
        return None if face is None else reset_table(face, seed, size, wall=wall, kind=kind, box=box, room=room)

    def put(self, network: str, system: int, pose: tuple[float, float, float]) -> Ticket[RobotAck] | None:
        """Have something picked up, and put somewhere.

        Args:
            network: Whose robot it is; of box and goal, the first.
            system: System id of the robot, or the box, or the goal.
            pose: x, y in m and heading in rad.

        Returns:
            The ticket; None: there is no table.
        """
        face = self.face(network)
        return None if face is None else place(face, system, pose[:2], pose[2])
