"""Who of a swarm takes part in the next round: who is missing, who is on the way back, who must charge, and is it enough."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.events import PeerLost
from firmware_protocol.messages import ROBOT_COMPONENT, CommandLong, SwarmSense
from firmware_protocol.peer.exchanges.commands import NumberedExchange
from firmware_protocol.peer.pacing import frame_length
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.vocabulary import RobotClass

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from firmware_protocol.events import Event
    from firmware_protocol.peer.exchanges.exchange import Ticket
    from firmware_protocol.peer.fleets.fleet import Fleet
    from hil.bridge.fleet_bridge import FleetBridge
    from hil.bridge.networks import RobotAddress
    from hil.swarm.robot import MicroRobot

_BATTERY: Final = 0x2000000
"""MAV_SYS_STATUS_SENSOR_BATTERY: in `onboard_control_sensors_health`, set while the battery is above BATT_LOW."""


@dataclass(frozen=True)
class NetworkRows:
    """The robots of one network.

    Attributes:
        bridge: Speaks with them.
        rows: Their rows in the arrays of the swarm.
        systems: Their system ids, in that order.
    """

    bridge: FleetBridge
    rows: NDArray[np.int64]
    systems: NDArray[np.int64]

    @property
    def fleet(self) -> Fleet:
        """The robots as arrays."""
        return self.bridge.fleet

    def line_time(self, length: int) -> float:
        """Time that the line needs for bytes, in s; 0 where nobody knows its rate.

        Args:
            length: How many.
        """
        return length / self.fleet.capacity if self.fleet.capacity else 0.0

    @property
    def arming_time(self) -> float:
        """Time that the line needs to have all of them armed, in s; 0 where nobody knows its rate."""
        command = frame_length(CommandLong, signed=self.bridge.signing is not None)
        return self.line_time(2 * command * len(self.systems))  # with the request for the state; the answers take less


@dataclass
class StandingOrders:
    """What all robots have been told, and who comes back is told too.

    Attributes:
        armed: Their wheels may turn.
        sensing: The fields of SWARM_SENSE; None: nothing was said of it.
    """

    armed: bool = False
    sensing: dict[str, Any] | None = None


@dataclass
class Attendance:
    """The robots of a swarm by row, and how things stand with each.

    Attributes:
        addresses: Of the robots, by row.
        networks: The networks that they are on.
        kinds: Class of each robot (`RobotClass`), by row; -1: it has not said any.
        rings: Who has a ring of sensors, by row.
        there: Who takes part in the next round, by row.
        orders: What all have been told.
        needed: How many robots of each class are needed; a class that is not named: all that there are.
    """

    addresses: tuple[RobotAddress, ...] = ()
    networks: tuple[NetworkRows, ...] = ()
    kinds: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    rings: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, bool))
    there: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, bool))
    orders: StandingOrders = field(default_factory=StandingOrders)
    needed: dict[RobotClass, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.rows = {address: row for row, address in enumerate(self.addresses)}
        self._joining: dict[int, list[Ticket[Any]]] = {}
        self._silent_since: dict[int, float] = {}
        self._flat = np.zeros(len(self.addresses), bool)
        self._returned: set[int] = set()

    @classmethod
    def of(
        cls, addresses: tuple[RobotAddress, ...], bridges: Mapping[str, FleetBridge], robots: Mapping[RobotAddress, MicroRobot]
    ) -> Attendance:
        """The robots of some networks, as they are found.

        Args:
            addresses: Of the robots, in the order of their rows.
            bridges: The networks, by name.
            robots: The robots that have been heard.
        """
        networks = []
        for name, bridge in bridges.items():
            rows = [row for row, address in enumerate(addresses) if address.network == name]
            systems = [addresses[row].system for row in rows]
            networks.append(NetworkRows(bridge, np.array(rows, np.int64), np.array(systems, np.int64)))
        count = len(addresses)
        unknown = np.full(count, -1, np.int64)
        found = cls(addresses, tuple(networks), unknown, np.zeros(count, bool), np.zeros(count, bool))
        for address, robot in robots.items():
            row = found.rows[address]
            found.know(row, robot)
            found.there[row] = robot.peer.ready
        return found

    def know(self, row: int, robot: MicroRobot) -> None:
        """A robot has said what it is.

        Args:
            row: Its row.
            robot: The robot.
        """
        self.kinds[row] = -1 if robot.kind is None else robot.kind
        self.rings[row] = robot.ring

    # --- leaving and coming ------------------------------------------------------------------------------------------

    def changed(self, row: int, robot: MicroRobot, event: Event) -> None:
        """A robot was lost, found, or is there again.

        Args:
            row: Its row.
            robot: The robot.
            event: Which it is.
        """
        self._joining.pop(row, None)
        self._silent_since.pop(row, None)
        self.there[row] = False
        if not isinstance(event, PeerLost):
            self._rejoin(row, robot)

    def miss(self, row: int, now: float) -> None:
        """A robot has not answered in time: it is left out until it is heard again.

        Args:
            row: Its row.
            now: Time in s.
        """
        self.there[row] = False
        if row not in self._joining:
            self._silent_since[row] = now

    @property
    def waiting(self) -> bool:
        """Somebody is missing, or on the way back."""
        return bool(self._joining or self._silent_since)

    def take_back(self, robots: Mapping[RobotAddress, MicroRobot], now: float) -> None:
        """Look who of those that were missing has been heard again, and who is ready.

        Args:
            robots: The robots, by address.
            now: Time in s.
        """
        for network in self.networks if self._silent_since else ():
            fleet = network.fleet
            for row, system in zip(network.rows.tolist(), network.systems.tolist(), strict=True):
                since = self._silent_since.get(row)
                if since is not None and fleet.steady.heard[system] > since and fleet.usable[system]:
                    del self._silent_since[row]
                    self._rejoin(row, robots[self.addresses[row]])
        for row, tickets in list(self._joining.items()):
            if not all(ticket.done for ticket in tickets):
                continue
            del self._joining[row]
            if any(ticket.error is not None for ticket in tickets):
                self.miss(row, now)
            else:
                self.know(row, robots[self.addresses[row]])
                self.there[row] = not self._flat[row]
                self._returned.add(row)

    def _rejoin(self, row: int, robot: MicroRobot) -> None:
        """Have a robot made ready for the next round."""
        tickets: list[Ticket[Any]] = []
        if robot.kind is None:
            robot.read()
            tickets += robot.reading
        if self.orders.armed:
            tickets.append(robot.peer.arm())
        if self.orders.sensing is not None:
            told = self.orders.sensing
            message = SwarmSense(0, 0, target_system=robot.peer.system, target_component=ROBOT_COMPONENT, **told)
            tickets.append(robot.peer.ask(NumberedExchange("how to sense", message, robot.peer.numbering), MICRO_ROBOT))
        self._joining[row] = tickets

    # --- rounds ------------------------------------------------------------------------------------------------------

    def round_begins(self) -> None:
        """Who comes back from now on has not been asked in it."""
        self._returned.clear()

    def round_ends(self, silent: NDArray[np.bool_], now: float) -> None:
        """A round is over.

        Args:
            silent: Who has not answered, by row. Of these, who has come back meanwhile takes part in the next one.
            now: Time in s.
        """
        for row in np.flatnonzero(silent).tolist():
            if row not in self._returned:
                self.miss(row, now)
        self._see_batteries()

    def _see_batteries(self) -> None:
        """Who has a flat battery is missing; who has one no more is there again."""
        for network in self.networks:
            health = [network.fleet.steady.health[system] for system in network.systems.tolist()]
            flat = np.array([value is not None and not value & _BATTERY for value in health], bool)
            rows = network.rows
            charged = rows[self._flat[rows] & ~flat]
            self._flat[rows] = flat
            self.there[rows[flat]] = False
            for row in charged.tolist():
                self.there[row] = row not in self._joining and row not in self._silent_since

    # --- is it enough ------------------------------------------------------------------------------------------------

    def too_few(self, quorum: float) -> str:
        """Of which classes too few are there, in words; empty where enough are.

        Args:
            quorum: Least share of each class that must be there.
        """
        parts = []
        for kind in RobotClass:
            of_kind = self.kinds == kind
            least = quorum * self.needed.get(kind, int(of_kind.sum()))
            there = int((of_kind & self.there).sum())
            if there < least:
                parts.append(f"{there} {kind.name}s are there, and at least {least:g} must be")
        if not parts:
            return ""
        gone = ", ".join(_named(self.addresses, ~self.there))
        return f"too few robots are there to go on: {'; '.join(parts)}. Missing: {gone}"


def _named(addresses: Sequence[RobotAddress], which: NDArray[np.bool_]) -> list[str]:
    rows = np.flatnonzero(which).tolist()
    names = [str(addresses[row]) for row in rows[:10]]
    return names if len(rows) <= len(names) else [*names, f"and {len(rows) - len(names)} more"]
