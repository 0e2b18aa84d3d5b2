"""A swarm as a program on the PC holds it: rounds in which all robots are asked, or moved, at once."""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property
from math import floor
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.errors import HilError, LinkError, PeerError, RefusedError
from firmware_protocol.events import PeerBack, PeerFound, PeerLost, Received
from firmware_protocol.messages import (
    ROBOT_COMPONENT,
    AutopilotVersion,
    BoxShape,
    Command,
    CommandLong,
    SwarmFix,
    SwarmMove,
    SwarmObservation,
    SwarmRanges,
    SwarmSense,
    TableKind,
)
from firmware_protocol.messages.swarm import LONG_RANGE
from firmware_protocol.parameters import SWARM_PARAMETERS
from firmware_protocol.peer.fleets.rounds import AskingRound, NumberedRound
from firmware_protocol.peer.timetable import NEVER
from firmware_protocol.vocabulary import MoveOption, RobotClass
from firmware_protocol.wire.rows import ROWS, messages_of, rows_of
from hil.bridge.fleet_bridge import FleetBridge
from hil.bridge.networks import RobotAddress
from hil.connecting.connecting_all import GATHER
from hil.connecting.handles import SETTLE, Answers, RobotHandles
from hil.connecting.serving import WAIT
from hil.safety import Limits
from hil.swarm.attendance import Attendance, NetworkRows
from hil.swarm.errors import DoubleIdError, QuorumError
from hil.swarm.holding import FRAMING, RoundHolder
from hil.swarm.robot import MicroRobot
from hil.swarm.rounds import Round, SwarmMoves
from hil.swarm.tables import TableFaces

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from numpy.typing import ArrayLike, NDArray

    from firmware_protocol.events import Event
    from firmware_protocol.messages import CommandAck
    from firmware_protocol.peer.fleets.steady import SteadyMessages
    from firmware_protocol.vocabulary import Move
    from hil.bridge.networks import Networks

    Numbers = NDArray[np.int64]
    Which = NDArray[np.bool_]
    Pose = tuple[float, float, float]
    """x, y in m and heading in rad."""
    MovesByRobot = Mapping[RobotAddress, Move] | Mapping[int, Move]
    OneNetwork = NumberedRound | AskingRound
    """A round on one network."""

OBSERVING: Final = 3.0
"""Longest that robots are asked for observations, beyond the time of the bytes, in s."""
STOPS: Final = 5
"""So often an emergency stop goes to all before each robot is asked."""
STOPS_WITHIN: Final = 0.1
"""Within so long, in s."""
QUORUM: Final = 0.5
"""Least share of each class that must be there."""
_SLACK: Final = 1e-9
_ROUNDING: Final = 1e-6
"""Slack for quotients of sums of control periods."""
_DEFAULTS: Final = {parameter.name: parameter.default for parameter in SWARM_PARAMETERS}


class Swarm(RobotHandles[MicroRobot]):
    """The micro-robots on one link or several. Leaving its `with` block stops and disarms all.

    Every robot has a row in all arrays, fixed by its address when the swarm was connected: in the order of the networks, as
    they were given, and of the ids there. Who comes later is not taken.

    A robot that does not answer in time is missing: it is left out until it is heard again, is then armed and told again how
    to sense, and takes part from the next round on.

    Args:
        networks: The links, open; their bridges are `FleetBridge`s.
        limits: Not used: what a micro-robot may do is bounded by itself.
        quorum: Least share of each class that must be there.
        patience: How long robots are waited for where fewer are, in s.

    Attributes:
        quorum: As given.
        attendance: Who takes part.
        kinds: Class of each robot (`RobotClass`), by row; -1: it has not said any.
        rings: Who has a ring of sensors, by row.
        there: Who takes part in the next round, by row.
        tables: The emulated table, where they stand on one.
    """

    def __init__(
        self,
        networks: Networks,
        limits: Limits = Limits(),  # noqa: B008 - frozen
        *,
        quorum: float = QUORUM,
        patience: float = 0.0,
    ) -> None:
        super().__init__(MicroRobot, networks, limits)
        self.quorum = quorum
        self.attendance = Attendance()
        self._rounds = RoundHolder(networks, self, self.attendance)
        self.kinds, self.rings, self.there = self.attendance.kinds, self.attendance.rings, self.attendance.there
        self.tables = TableFaces(networks)
        self._patience = patience
        self._uids: dict[RobotAddress, int] = {}
        self._count = 0

    # --- who is there ------------------------------------------------------------------------------------------------

    @property
    def addresses_by_row(self) -> tuple[RobotAddress, ...]:
        """Of the robots, by row."""
        return self.attendance.addresses

    @property
    def needed(self) -> dict[RobotClass, int]:
        """How many robots of each class are needed, for the quorum; a class that is not named: all that there are."""
        return self.attendance.needed

    @needed.setter
    def needed(self, needed: Mapping[RobotClass, int]) -> None:
        self.attendance.needed = dict(needed)

    @property
    def robots(self) -> Mapping[RobotAddress, MicroRobot]:
        """Every robot that has a row and was ever heard, by address, in the order of the rows."""
        return {address: self.members[address] for address in self.addresses_by_row if address in self.members}

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """What each robot is called, by row: NETWORK.ID, or ID where there is one network; networks are counted from 1."""
        numbers = {name: number for number, name in enumerate(self.networks.bridges, 1)}
        if len(numbers) == 1:
            return tuple(str(address.system) for address in self.addresses_by_row)
        return tuple(f"{numbers[address.network]}.{address.system}" for address in self.addresses_by_row)

    def row(self, robot: RobotAddress | int) -> int:
        """The row of a robot.

        Args:
            robot: Its address; its id will do where there is one network.

        Raises:
            KeyError: There is none, or an id alone does not say which one it is.
        """
        return self.attendance.rows[self.address(robot)]

    def find(
        self,
        *,
        settle: float = SETTLE,
        expect: int | Collection[int | RobotAddress] | None = None,
        timeout: float = 5.0,
    ) -> None:
        """Wait for the robots that are there, and give each its row; see `RobotHandles.find`.

        Raises:
            DoubleIdError: Two robots answer by one id.
        """
        super().find(settle=settle, expect=expect, timeout=timeout)
        deadline = self.now() + timeout
        while not all(robot.complete for robot in self.members.values()) and self.now() < deadline:
            self.step(min(0.05, deadline - self.now()))
        self._give_rows()

    def _give_rows(self) -> None:
        """Fix every robot's row."""
        bridges: dict[str, FleetBridge] = {}
        for name, bridge in self.networks.bridges.items():
            if not isinstance(bridge, FleetBridge):
                raise TypeError("a swarm takes bridges that have a fleet")
            bridges[name] = bridge
        order = {name: number for number, name in enumerate(bridges)}
        known = {*self.members, *self._expected}
        addresses = tuple(sorted(known, key=lambda address: (order[address.network], address.system)))
        for name, bridge in bridges.items():
            bridge.keep([address.system for address in addresses if address.network == name])
        self._rounds.attendance = self.attendance = Attendance.of(addresses, bridges, self.members)
        self.kinds, self.rings, self.there = self.attendance.kinds, self.attendance.rings, self.attendance.there

    def observation(self, robot: RobotAddress | int) -> SwarmObservation | None:
        """What a robot observed last; None where nothing has come.

        Args:
            robot: Its address; its id will do where there is one network.
        """
        address = self.address(robot)
        bridge = self.networks.bridges[address.network]
        fleet, system = bridge.fleet, address.system  # type: ignore[attr-defined] # see `_give_rows`
        if not fleet.said[SwarmObservation][system]:
            return None
        (said,) = messages_of(SwarmObservation, fleet.last[SwarmObservation][system : system + 1])
        return said if isinstance(said, SwarmObservation) else None

    def steady_of(self, robot: RobotAddress | int) -> SteadyMessages:
        """What the robots of a robot's network say all the time, by system id.

        Args:
            robot: Its address; its id will do where there is one network.
        """
        bridge = self.networks.bridges[self.address(robot).network]
        return bridge.fleet.steady  # type: ignore[attr-defined,no-any-return] # see `_give_rows`

    # --- time --------------------------------------------------------------------------------------------------------

    def step(self, wait: float = 0.05) -> list[Event]:
        """Serve all links once; who has come back is taken in again. As `RobotHandles.step`.

        Raises:
            DoubleIdError: Two robots answer by one id.
        """
        events = super().step(min(wait, self._stride()))
        if self.attendance.waiting:
            self.attendance.take_back(self.members, self.now())
        return events

    def _stride(self) -> float:
        """How long a step may take at most, in s: several networks in lock-step go on side by side."""
        if len(self.networks.bridges) < 2:
            return NEVER
        bridges = self.networks.alive.values()
        if len(bridges) < 2 or not next(iter(bridges)).link.lockstep:
            return NEVER
        now = self.now()
        return (floor(now / GATHER + _ROUNDING) + 1) * GATHER - now

    def _tell(self, events: list[tuple[str, Event]]) -> None:
        super()._tell(events)
        for network, event in events:
            if isinstance(event, Received):
                self.tables.hear(network, event)
                if isinstance(event.message, AutopilotVersion):
                    self._identify(RobotAddress(network, event.system), event.message.uid)
            elif isinstance(event, PeerFound | PeerBack | PeerLost):
                self._changed(RobotAddress(network, event.system), event)

    def _identify(self, address: RobotAddress, uid: int) -> None:
        """Take down who answers at an address."""
        known = self._uids.setdefault(address, uid)
        if uid and known and uid != known:
            raise DoubleIdError(
                f"two robots answer as {address}: their unique ids are {known:016x} and {uid:016x}. Give one of them another "
                f"id (SYS_ID), each on a cable of its own"
            )

    def _changed(self, address: RobotAddress, event: PeerFound | PeerBack | PeerLost) -> None:
        """A robot was lost, or is there again."""
        if isinstance(event, PeerLost):
            self._uids.pop(address, None)
        row = self.attendance.rows.get(address)
        if row is not None:
            self.attendance.changed(row, self.members[address], event)

    # --- before rounds -----------------------------------------------------------------------------------------------

    def arm(self) -> Answers[CommandAck]:
        """Let the wheels of all that are there turn, and of who comes back; who does not answer is missing."""
        answers = super().arm()
        self.attendance.orders.armed = True
        for address, error in answers.errors.items():
            if address in self.attendance.rows and not isinstance(error, RefusedError):
                self.attendance.miss(self.attendance.rows[address], self.now())
        return answers

    def _arming_time(self, network: str) -> float:
        times = [each.arming_time for each in self.attendance.networks if each.bridge.network == network]
        return max(times, default=0.0)

    def disarm(self) -> Answers[CommandAck]:
        """Stop all, and keep their wheels from turning; ends emergency stops."""
        self.attendance.orders.armed = False
        return super().disarm()

    def sense(
        self, *, radius: float, increment: float = 0.0, limit: float = LONG_RANGE, sectors: int = 8, ranges: int = 0
    ) -> Round:
        """Say to all how their rings are read from now on, and to who comes back.

        Args:
            radius: Least radius R0, in m; `LONG_RANGE` sees all.
            increment: By which it grows until a robot of the other class is inside, in m; 0: it does not.
            limit: Greatest radius, in m; `LONG_RANGE`: none.
            sectors: How many sectors, 1 to 16.
            ranges: In how many directions ranges are measured, 0 to 32.

        Returns:
            Who has refused it, and who is missing; it has no observations.

        Raises:
            EncodeError: A value can't be sent.
        """
        columns: dict[str, Any] = {
            "radius": radius,
            "increment": increment,
            "limit": limit,
            "sectors": sectors,
            "ranges": ranges,
        }
        self.attendance.orders.sensing = columns

        def begin(network: NetworkRows, which: Numbers) -> NumberedRound:
            systems = network.systems[which]
            told = columns | {"target_system": systems, "target_component": ROBOT_COMPONENT}
            return NumberedRound(network.fleet, SwarmSense, systems, rows_of(SwarmSense, len(systems), told))

        return self._rounds.hold(self.there.copy(), begin, OBSERVING, SwarmSense)

    # --- rounds ------------------------------------------------------------------------------------------------------

    def observe(self, robots: Which | Iterable[RobotAddress | int] | None = None) -> Round:
        """Have robots read their rings, and say what they observe.

        One request goes to all robots of a network; who has not answered when no answer has come for 80 ms is asked alone.

        Args:
            robots: Who: a truth value for each row, or addresses; None: all that are there.

        Raises:
            QuorumError: Too few are there.
            LinkError: The last link is gone.
        """
        asked = self._chosen(robots)
        count = self._count = self._count % 0x7FFF + 1

        def begin(network: NetworkRows, which: Numbers) -> AskingRound:
            systems = network.systems[which]
            wait = network.line_time((ROWS[SwarmObservation].itemsize + FRAMING) * len(network.systems))
            return AskingRound(SwarmObservation, systems, count=count, host=_holder(network), wait=wait)

        return self._rounds.hold(asked, begin, OBSERVING, SwarmObservation)

    def move(
        self, moves: SwarmMoves | Mapping[RobotAddress, Move] | Mapping[int, Move], *, deadline: float | None = None
    ) -> Round:
        """Have robots move, and wait for the observations that end the moves.

        Args:
            moves: By row, or by address (by id where there is one network). Who is not there is left out.
            deadline: Longest wait, in s; None: the longest time of the moves, 1 s, and what the line needs.

        Raises:
            EncodeError: A value can't be sent.
            KeyError: There is no such robot.
            QuorumError: Too few are there.
            LinkError: The last link is gone.
        """
        if not isinstance(moves, SwarmMoves):
            moves = SwarmMoves.of({self.row(robot): move for robot, move in moves.items()}, len(self.addresses_by_row))
        self.see_quorum()
        told, asked = moves, moves.moving & self.there
        speeds = _DEFAULTS["MOVE_SPEED"], _DEFAULTS["TURN_SPEED"]
        rows = np.flatnonzero(asked)
        longest = float(told.longest(rows, *speeds).max()) if rows.size else 0.0

        def begin(network: NetworkRows, which: Numbers) -> NumberedRound:
            own, systems = network.rows[which], network.systems[which]
            return NumberedRound(
                network.fleet, SwarmMove, systems, told.rows(own, systems),
                result=SwarmObservation, longest=told.longest(own, *speeds),
            )  # fmt: skip

        found = self._rounds.hold(
            asked, begin, longest if deadline is None else deadline, SwarmObservation, exact=deadline is not None
        )
        options = np.broadcast_to(np.asarray(told.options, np.int64), asked.shape)
        wanted = found.there & ((options & int(MoveOption.RANGES)) != 0)
        return self._with_ranges(found, wanted) if wanted.any() else found

    def _with_ranges(self, found: Round, wanted: Which) -> Round:
        """Add the ranges that came with the observations; those that did not are asked for."""
        reports = np.zeros(len(self.addresses_by_row), ROWS[SwarmRanges])
        came = np.zeros(len(self.addresses_by_row), bool)
        for network in self.attendance.networks:
            last = network.fleet.last[SwarmRanges][network.systems]
            ours = found.reports[network.rows]
            same = (last["session"] == ours["session"]) & (last["sequence"] == ours["sequence"])
            good = network.fleet.said[SwarmRanges][network.systems] & same & wanted[network.rows]
            reports[network.rows[good]] = last[good]
            came[network.rows[good]] = True
        late = wanted & ~came
        if late.any():
            more = self.measure_ranges(late)
            if more.range_reports is not None and more.ranged is not None:
                reports[more.ranged], came = more.range_reports[more.ranged], came | more.ranged
        return Round(
            found.addresses, found.asked, found.there, found.reports, found.reasons, found.turned_down, found.seconds,
            reports, came,
        )  # fmt: skip

    def measure_ranges(self, robots: Which | Iterable[RobotAddress | int] | None = None) -> Round:
        """Have robots measure ranges round about; as `observe`.

        Returns:
            A round without observations, but with ranges.
        """
        asked = self._chosen(robots)
        count = self._count = self._count % 0x7FFF + 1

        def begin(network: NetworkRows, which: Numbers) -> AskingRound:
            wait = network.line_time((ROWS[SwarmRanges].itemsize + FRAMING) * len(network.systems))
            return AskingRound(SwarmRanges, network.systems[which], count=count, host=_holder(network), wait=wait)

        found = self._rounds.hold(asked, begin, OBSERVING, SwarmRanges)
        nothing = np.zeros(len(asked), ROWS[SwarmObservation])
        return Round(
            found.addresses, asked, found.there, nothing, found.reasons, found.turned_down, found.seconds,
            found.reports, found.there,
        )  # fmt: skip

    def fix(self, poses: Mapping[RobotAddress, Pose] | Mapping[int, Pose], age: float = 0.0) -> None:
        """Tell robots where they are, as a camera sees them. It is not answered; it goes out with the next step.

        Args:
            poses: x, y in m and heading in rad, by address (by id where there is one network).
            age: How old that is, in s.

        Raises:
            EncodeError: A value can't be sent.
            KeyError: There is no such robot.
        """
        told = {self.row(robot): pose for robot, pose in poses.items()}
        for network in self.attendance.networks:
            open_ = network.fleet.session[network.systems] > 0
            which = np.array([i for i, row in enumerate(network.rows.tolist()) if row in told and open_[i]], np.int64)
            if not which.size:
                continue
            systems = network.systems[which]
            values = np.array([told[row] for row in network.rows[which].tolist()])
            columns: dict[str, ArrayLike] = {
                "session": network.fleet.session[systems], "position": values[:, :2], "heading": _turned(values[:, 2]),
                "age": age, "target_system": systems, "target_component": ROBOT_COMPONENT,
            }  # fmt: skip
            network.fleet.tell(SwarmFix, rows_of(SwarmFix, len(systems), columns))

    # --- the table ---------------------------------------------------------------------------------------------------

    @property
    def has_table(self) -> bool:
        """The robots stand on an emulated table, which can place them."""
        return bool(self.tables.states)

    def reset_table(
        self,
        seed: int,
        size: tuple[float, float],
        *,
        wall: bool = False,
        kind: TableKind = TableKind.PLAIN,
        box: BoxShape = BoxShape.NONE,
        room: int = 0,
    ) -> None:
        """Set the emulated table up anew; its noise begins from its beginning.

        Args:
            seed: Noise follows from it, 0..2^32 - 1.
            size: Along x, along y, in m.
            wall: A wall runs round it.
            kind: What stands on it.
            box: Shape of the box.
            room: Number of the room whose walls stand on it; 0: none.

        Raises:
            PeerError: There is no table, it refuses, or it does not answer.
        """
        ticket = self.tables.reset(seed, size, wall=wall, kind=kind, box=box, room=room)
        if ticket is None:
            raise PeerError("there is no emulated table that could be set up: the robots stand on a real one")
        while not ticket.done:
            self.step()
        ticket.value()

    def place(self, poses: Mapping[RobotAddress, Pose] | Mapping[int, Pose]) -> dict[RobotAddress, HilError]:
        """Have the emulated table put robots somewhere, their wheels standing.

        Args:
            poses: x, y in m and heading in rad, by address (by id where there is one network).

        Returns:
            Why robots were not placed.

        Raises:
            KeyError: There is no such robot.
            PeerError: There is no table.
        """
        tickets = {}
        for robot, pose in poses.items():
            address = self.attendance.addresses[self.row(robot)]
            ticket = self.tables.put(address.network, address.system, pose)
            if ticket is None:
                raise PeerError("there is no emulated table that could place robots: they stand on a real one")
            tickets[address] = ticket
        while not all(ticket.done for ticket in tickets.values()):
            self.step()
        return {address: ticket.error for address, ticket in tickets.items() if ticket.error is not None}

    # --- who is asked --------------------------------------------------------------------------------------------------

    def _chosen(self, robots: Which | Iterable[RobotAddress | int] | None) -> Which:
        self.see_quorum()
        if robots is None:
            return self.there.copy()
        if isinstance(robots, np.ndarray):
            return robots.astype(bool) & self.there
        chosen = np.zeros(len(self.addresses_by_row), bool)
        chosen[[self.row(robot) for robot in robots]] = True
        return chosen & self.there

    def see_quorum(self) -> None:
        """See that enough robots of each class are there; they are waited for, where that was asked for.

        Raises:
            QuorumError: They are not.
        """
        deadline = self.now() + self._patience
        while too_few := self.attendance.too_few(self.quorum):
            if (left := deadline - self.now()) <= _SLACK:
                raise QuorumError(too_few)
            self.step(min(WAIT, left))

    # --- stopping ----------------------------------------------------------------------------------------------------

    def stop(self) -> Answers[CommandAck]:
        """The emergency stop: to all at once, five times within 100 ms, then to each until it has said so.

        Returns:
            Who has said so; in `errors`, who has not.
        """
        self.attendance.orders.armed = False
        self._tell_all(CommandLong(0, ROBOT_COMPONENT, Command.FLIGHT_TERMINATION, 0, 1.0))
        return self.ask(lambda robot: robot.ask_emergency_stop(), list(self.members.values()))

    def close(self) -> None:
        """Stop and disarm all robots, those that are missing too, and give the links back; see `RobotHandles.close`."""
        if not self._closed and self.attendance.orders.armed:
            with suppress(HilError, OSError):
                self._tell_all(CommandLong(0, ROBOT_COMPONENT, Command.ARM_DISARM))
        super().close()

    def _tell_all(self, command: CommandLong) -> None:
        """Say a command to all robots of all networks, several times within 100 ms."""
        for count in range(STOPS):
            for bridge in self.networks.alive.values():
                with suppress(LinkError):  # its robots stop by their watchdogs; the other links are to be reached all the same
                    bridge.send(command)
            if count < STOPS - 1:
                self.wait(STOPS_WITHIN / (STOPS - 1))


def _holder(network: NetworkRows) -> int:
    """Number of this host as robots are to take it: 0 where they are only watched."""
    return network.bridge.host if network.fleet.session[network.systems].any() else 0


def _turned(heading: NDArray[np.float64]) -> NDArray[np.float64]:
    """Headings within half a turn, in rad."""
    return np.mod(heading + np.pi, 2 * np.pi) - np.pi
