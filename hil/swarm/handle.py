"""A swarm as a program on the PC holds it: rounds in which all robots are asked, or moved, at once."""

from __future__ import annotations

from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.errors import LinkError, PeerError, RefusedError
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
from firmware_protocol.peer.commands import NumberedExchange
from firmware_protocol.peer.rounds import AskingRound, NumberedRound
from firmware_protocol.roles.swarm import MICRO_ROBOT
from firmware_protocol.vocabulary import MoveOption, RobotClass
from firmware_protocol.wire.rows import ROWS, messages_of, rows_of
from hil.bridge.fleet_bridge import FleetBridge
from hil.bridge.networks import RobotAddress
from hil.connecting.connecting_all import GATHER
from hil.connecting.handles import SETTLE, Answers, RobotHandles
from hil.safety import Limits
from hil.swarm.errors import DoubleIdError, QuorumError
from hil.swarm.robot import MicroRobot
from hil.swarm.rounds import Round, SwarmMoves
from hil.swarm.tables import TableFaces

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from firmware_protocol.errors import HilError
    from firmware_protocol.events import Event
    from firmware_protocol.messages import CommandAck
    from firmware_protocol.peer.exchange import Ticket
    from firmware_protocol.vocabulary import Move
    from firmware_protocol.wire.fields import Message
    from hil.bridge.networks import Networks

    Numbers = NDArray[np.int64]
    Which = NDArray[np.bool_]
    Pose = tuple[float, float, float]
    """x, y in m and heading in rad."""
    MovesByRobot = Mapping[RobotAddress, Move] | Mapping[int, Move]
    OneNetwork = NumberedRound | AskingRound
    """A round on one network."""

MARGIN: Final = 1.0
"""What a round is given beyond the longest time of its robots and of its bytes, in s."""
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
_BATTERY: Final = 0x2000000
"""MAV_SYS_STATUS_SENSOR_BATTERY: in `onboard_control_sensors_health`, set while the battery is above BATT_LOW."""
_FRAMES: Final = 12
"""Bytes of a frame that are not its payload."""
_DEFAULTS: Final = {parameter.name: parameter.default for parameter in SWARM_PARAMETERS}


class _NetworkRows:
    """The robots of one network: their rows, and their system ids.

    Args:
        bridge: Speaks with them.
        rows: Their rows in the arrays of the swarm.
        systems: Their system ids, in that order.
    """

    def __init__(self, bridge: FleetBridge, rows: Numbers, systems: Numbers) -> None:
        self.bridge = bridge
        self.fleet = bridge.fleet
        self.rows = rows
        self.systems = systems


class _Joining:
    """A robot on its way back: armed again, and told again how to sense.

    Attributes:
        tickets: What it has been asked, and must have answered.
    """

    def __init__(self, tickets: list[Ticket[Any]]) -> None:
        self.tickets = tickets


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
        addresses_by_row: Of the robots, by row.
        kinds: Class of each robot (`RobotClass`), by row; -1: it has not said any.
        rings: Who has a ring of sensors, by row.
        there: Who takes part in the next round, by row.
        tables: The emulated table, where they stand on one.
        needed: How many robots of each class the mission needs; a class that is not named: all that there are.
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
        self.needed: dict[RobotClass, int] = {}
        self.addresses_by_row: tuple[RobotAddress, ...] = ()
        self.kinds: Numbers = np.zeros(0, np.int64)
        self.rings: Which = np.zeros(0, bool)
        self.there: Which = np.zeros(0, bool)
        self.tables = TableFaces(networks)
        self._patience = patience
        self._by_network: list[_NetworkRows] = []
        self._rows: dict[RobotAddress, int] = {}
        self._joining: dict[int, _Joining] = {}
        self._silent_since: dict[int, float] = {}
        self._flat: Which = np.zeros(0, bool)
        self._may_move = False
        self._sensing: dict[str, Any] | None = None
        self._uids: dict[RobotAddress, int] = {}
        self._count = 0

    # --- who is there ------------------------------------------------------------------------------------------------

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
        return self._rows[self.address(robot)]

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
        order = {name: number for number, name in enumerate(self.networks.bridges)}
        known = {*self.members, *self._expected}
        self.addresses_by_row = tuple(sorted(known, key=lambda address: (order[address.network], address.system)))
        self._rows = {address: row for row, address in enumerate(self.addresses_by_row)}
        count = len(self.addresses_by_row)
        self.there, self.rings, self._flat = (np.zeros(count, bool) for _ in range(3))
        self.kinds = np.full(count, -1, np.int64)
        for name, bridge in self.networks.bridges.items():
            rows = [row for row, address in enumerate(self.addresses_by_row) if address.network == name]
            systems = [self.addresses_by_row[row].system for row in rows]
            bridge.keep(systems)
            if not isinstance(bridge, FleetBridge):
                raise TypeError("a swarm takes bridges that have a fleet")
            self._by_network.append(_NetworkRows(bridge, np.array(rows, np.int64), np.array(systems, np.int64)))
        for address, robot in self.members.items():
            robot.row = self._rows[address]
            self._know(robot.row, robot)
            self.there[robot.row] = robot.peer.ready

    def _know(self, row: int, robot: MicroRobot) -> None:
        self.kinds[row] = -1 if robot.kind is None else robot.kind
        self.rings[row] = robot.ring

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

    # --- time --------------------------------------------------------------------------------------------------------

    def step(self, wait: float = 0.05) -> list[Event]:
        """Serve all links once; who has come back is taken in again. As `RobotHandles.step`.

        Raises:
            DoubleIdError: Two robots answer by one id.
        """
        events = super().step(wait)
        if self._joining or self._silent_since:
            self._take_back()
        return events

    def _tell(self, events: list[tuple[str, Event]]) -> None:
        super()._tell(events)
        for network, event in events:
            if isinstance(event, Received):
                self.tables.hear(network, event)
                if isinstance(event.message, AutopilotVersion):
                    self._identify(RobotAddress(network, event.system), event.message.uid)
            elif isinstance(event, PeerFound | PeerBack | PeerLost):
                for address, row in self._rows.items():
                    if address.network == network and address.system == event.system:
                        self._changed(row, address, event)

    def _identify(self, address: RobotAddress, uid: int) -> None:
        """Take down who answers at an address."""
        known = self._uids.setdefault(address, uid)
        if uid and known and uid != known:
            raise DoubleIdError(
                f"two robots answer as {address}: their unique ids are {known:016x} and {uid:016x}. Give one of them another "
                f"id (SYS_ID), each on a cable of its own"
            )

    def _changed(self, row: int, address: RobotAddress, event: Event) -> None:
        """A robot was lost, or is there again."""
        self._joining.pop(row, None)
        self._silent_since.pop(row, None)
        self.there[row] = False
        if isinstance(event, PeerLost):
            self._uids.pop(address, None)
        if not isinstance(event, PeerLost):
            robot = self.members[address]
            robot.row = row
            self._rejoin(row, robot)

    def _rejoin(self, row: int, robot: MicroRobot) -> None:
        """Have a robot made ready for the next round."""
        tickets: list[Ticket[Any]] = []
        if robot.kind is None:
            robot.read()
            tickets += robot.reading
        if self._may_move:
            tickets.append(robot.peer.arm())
        if self._sensing is not None:
            message = SwarmSense(0, 0, target_system=robot.peer.system, target_component=ROBOT_COMPONENT, **self._sensing)
            tickets.append(robot.peer.ask(NumberedExchange("how to sense", message, robot.peer.numbering), MICRO_ROBOT))
        self._joining[row] = _Joining(tickets)

    def _take_back(self) -> None:
        """Look who of those that were missing has been heard again, and who is ready."""
        for network in self._by_network if self._silent_since else ():
            for row, system in zip(network.rows.tolist(), network.systems.tolist(), strict=True):
                since = self._silent_since.get(row)
                if since is not None and network.fleet.steady.heard[system] > since and network.fleet.usable[system]:
                    del self._silent_since[row]
                    self._rejoin(row, self.members[self.addresses_by_row[row]])
        for row, joining in list(self._joining.items()):
            if all(ticket.done for ticket in joining.tickets):
                del self._joining[row]
                robot = self.members[self.addresses_by_row[row]]
                if any(ticket.error is not None for ticket in joining.tickets):
                    self._miss(row)
                else:
                    self._know(row, robot)
                    self.there[row] = not self._flat[row]

    def _miss(self, row: int) -> None:
        """A robot has not answered in time: it is left out until it is heard again."""
        self.there[row] = False
        if row not in self._joining:
            self._silent_since[row] = self.now()

    # --- before rounds -----------------------------------------------------------------------------------------------

    def arm(self) -> Answers[CommandAck]:
        """Let the wheels of all that are there turn, and of who comes back; who does not answer is missing."""
        answers = super().arm()
        self._may_move = True
        for address, error in answers.errors.items():
            if address in self._rows and not isinstance(error, RefusedError):
                self._miss(self._rows[address])
        return answers

    def disarm(self) -> Answers[CommandAck]:
        """Stop all, and keep their wheels from turning; ends emergency stops."""
        self._may_move = False
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
        self._sensing = columns

        def begin(network: _NetworkRows, which: Numbers) -> NumberedRound:
            systems = network.systems[which]
            told = columns | {"target_system": systems, "target_component": ROBOT_COMPONENT}
            return NumberedRound(network.fleet, SwarmSense, systems, rows_of(SwarmSense, len(systems), told))

        return self._hold(self.there.copy(), begin, OBSERVING, SwarmSense)

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

        def begin(network: _NetworkRows, which: Numbers) -> AskingRound:
            systems = network.systems[which]
            wait = self._line_time(network, (ROWS[SwarmObservation].itemsize + _FRAMES) * len(network.systems))
            host = network.bridge.host
            return AskingRound(SwarmObservation, systems, count=count, host=host, wait=wait)

        return self._hold(asked, begin, OBSERVING, SwarmObservation)

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
        told, asked = moves, moves.moving & self.there
        speeds = _DEFAULTS["MOVE_SPEED"], _DEFAULTS["TURN_SPEED"]
        rows = np.flatnonzero(asked)
        longest = float(told.longest(rows, *speeds).max()) if rows.size else 0.0

        def begin(network: _NetworkRows, which: Numbers) -> NumberedRound:
            own, systems = network.rows[which], network.systems[which]
            return NumberedRound(
                network.fleet, SwarmMove, systems, told.rows(own, systems),
                result=SwarmObservation, longest=told.longest(own, *speeds),
            )  # fmt: skip

        found = self._hold(
            asked, begin, longest if deadline is None else deadline, SwarmObservation, exact=deadline is not None
        )
        options = np.broadcast_to(np.asarray(told.options, np.int64), asked.shape)
        wanted = found.there & ((options & int(MoveOption.RANGES)) != 0)
        return self._with_ranges(found, wanted) if wanted.any() else found

    def _with_ranges(self, found: Round, wanted: Which) -> Round:
        """Add the ranges that came with the observations; those that did not are asked for."""
        reports = np.zeros(len(self.addresses_by_row), ROWS[SwarmRanges])
        came = np.zeros(len(self.addresses_by_row), bool)
        for network in self._by_network:
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

        def begin(network: _NetworkRows, which: Numbers) -> AskingRound:
            wait = self._line_time(network, (ROWS[SwarmRanges].itemsize + _FRAMES) * len(network.systems))
            return AskingRound(SwarmRanges, network.systems[which], count=count, host=network.bridge.host, wait=wait)

        found = self._hold(asked, begin, OBSERVING, SwarmRanges)
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
        for network in self._by_network:
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
            address = self.addresses_by_row[self.row(robot)]
            ticket = self.tables.put(address.network, address.system, pose)
            if ticket is None:
                raise PeerError("there is no emulated table that could place robots: they stand on a real one")
            tickets[address] = ticket
        while not all(ticket.done for ticket in tickets.values()):
            self.step()
        return {address: ticket.error for address, ticket in tickets.items() if ticket.error is not None}

    # --- how a round goes --------------------------------------------------------------------------------------------

    def _chosen(self, robots: Which | Iterable[RobotAddress | int] | None) -> Which:
        if robots is None:
            return self.there.copy()
        if isinstance(robots, np.ndarray):
            return robots.astype(bool) & self.there
        chosen = np.zeros(len(self.addresses_by_row), bool)
        chosen[[self.row(robot) for robot in robots]] = True
        return chosen & self.there

    def _hold(
        self,
        asked: Which,
        begin: Callable[[_NetworkRows, Numbers], OneNetwork],
        longest: float,
        kind: type[Message],
        *,
        exact: bool = False,
    ) -> Round:
        """Hold a round.

        Args:
            asked: Who takes part.
            begin: Begins it on one network, with some of its robots.
            longest: How long the robots may take, in s.
            kind: What they report.
            exact: That is the deadline; else it is given a margin.
        """
        self.see_quorum()
        self._align()
        start = self.now()
        rounds: list[tuple[_NetworkRows, OneNetwork]] = []
        lines = 0.0
        try:
            for network in self._by_network:
                which = np.flatnonzero(asked[network.rows])
                if which.size:
                    one = begin(network, which)
                    network.fleet.begin(one)
                    rounds.append((network, one))
                    frames = ROWS[SwarmObservation].itemsize + ROWS[SwarmMove].itemsize + 3 * _FRAMES + 20
                    lines = max(lines, self._line_time(network, 2 * frames * len(which)))
            deadline = start + longest + (0.0 if exact else MARGIN + lines)
            while any(one.open.any() for _, one in rounds) and (left := deadline - self.now()) > _SLACK:
                self.step(left)
                for network, one in rounds:
                    if network.bridge.lost is not None or network.bridge.network in self.networks.failures:
                        one.drop(np.ones(len(one.open), bool))
                    else:
                        one.drop(~network.fleet.usable)
        finally:
            for network, one in rounds:
                network.fleet.end(one)
        return self._account(asked, rounds, kind, self.now() - start)

    def _account(
        self,
        asked: Which,
        rounds: Sequence[tuple[_NetworkRows, OneNetwork]],
        kind: type[Message],
        seconds: float,
    ) -> Round:
        """What has come of a round, by row; who has not answered is missing from now on."""
        count = len(asked)
        reports = np.zeros(count, ROWS[kind])
        there, refused = np.zeros(count, bool), np.zeros(count, bool)
        reasons = np.zeros(count, np.int64)
        for network, one in rounds:
            rows, systems = network.rows, network.systems
            answered = one.answered[systems]
            there[rows] = answered
            if kind is one.report:
                reports[rows] = one.reports[systems]
            if isinstance(one, NumberedRound):
                refused[rows], reasons[rows] = one.refused[systems], one.reason[systems]
        there &= asked
        for row in np.flatnonzero(asked & ~there & ~refused).tolist():
            self._miss(row)
        self._see_batteries()
        if kind is not SwarmObservation and kind is not SwarmRanges:
            reports = np.zeros(count, ROWS[SwarmObservation])
        return Round(self.addresses_by_row, asked, there, reports, reasons, refused, seconds)

    def _align(self) -> None:
        """Begin a round in lock-step on all networks at once, and at a time to which what comes is gathered.

        So it begins at the same time wherever the other business of the bridges has cut the gathering short.
        """
        bridges = list(self.networks.alive.values())
        if bridges and bridges[0].link.lockstep:
            latest = ceil(max(bridge.now for bridge in bridges) / GATHER - _ROUNDING) * GATHER
            while (left := latest - self.now()) > _SLACK:
                self.step(left)

    def _line_time(self, network: _NetworkRows, length: int) -> float:
        """Time that a line needs for bytes, in s; 0 where nobody knows its rate."""
        return length / network.fleet.capacity if network.fleet.capacity else 0.0

    def _see_batteries(self) -> None:
        """Who has a flat battery is missing; who has one no more is there again."""
        for network in self._by_network:
            health = [network.fleet.steady.health[system] for system in network.systems.tolist()]
            low = np.array([value is not None and not value & _BATTERY for value in health], bool)
            rows = network.rows
            self.there[rows[self._flat[rows] & ~low]] = True
            self._flat[rows] = low
            self.there[rows[low]] = False

    def see_quorum(self) -> None:
        """See that enough robots of each class are there; they are waited for, where that was asked for.

        Raises:
            QuorumError: They are not.
        """
        if self._enough():
            return
        deadline = self.now() + self._patience
        while not self._enough():
            if (left := deadline - self.now()) <= _SLACK:
                raise QuorumError(self._few())
            self.step(min(0.05, left))

    def _enough(self) -> bool:
        return all(there >= least for _, there, least in self._shares())

    def _shares(self) -> list[tuple[int, int, float]]:
        """Of each class: which, how many are there, how many must be."""
        found = []
        for kind in set(self.kinds.tolist()):
            of_kind = self.kinds == kind
            total = self.needed.get(RobotClass(kind), int(of_kind.sum())) if kind >= 0 else 0
            found.append((int(kind), int((of_kind & self.there).sum()), self.quorum * total))
        return found

    def _few(self) -> str:
        parts = [
            f"{there} {RobotClass(kind).name}s are there, and at least {least:g} must be"
            for kind, there, least in self._shares()
            if kind >= 0 and there < least
        ]
        gone = [str(self.addresses_by_row[row]) for row in np.flatnonzero(~self.there)[:10]]
        return f"too few robots are there to go on: {'; '.join(parts)}. Missing: {', '.join(gone)}"

    # --- stopping ----------------------------------------------------------------------------------------------------

    def stop(self) -> Answers[CommandAck]:
        """The emergency stop: to all at once, five times within 100 ms, then to each until it has said so.

        Returns:
            Who has said so; in `errors`, who has not.
        """
        self._may_move = False
        command = CommandLong(0, ROBOT_COMPONENT, Command.FLIGHT_TERMINATION, 0, 1.0)
        for count in range(STOPS):
            for bridge in self.networks.alive.values():
                try:
                    bridge.send(command)
                except LinkError:
                    continue  # its robots stop by their watchdogs; the other links are to be reached all the same
            if count < STOPS - 1:
                self.wait(STOPS_WITHIN / (STOPS - 1))
        return self.ask(lambda robot: robot.ask_emergency_stop(), list(self.members.values()))


def _turned(heading: NDArray[np.float64]) -> NDArray[np.float64]:
    """Headings within half a turn, in rad."""
    return np.mod(heading + np.pi, 2 * np.pi) - np.pi
