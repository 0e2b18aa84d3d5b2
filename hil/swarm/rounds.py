"""What a swarm is told, and what comes of it: arrays with a row for each robot, and views of them by address."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from firmware_protocol.messages import ROBOT_COMPONENT, Reason, SwarmMove, SwarmObservation, SwarmRanges
from firmware_protocol.vocabulary import Move, MoveOption
from firmware_protocol.wire.rows import Rows, column, messages_of, rows_of, take_rows

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from hil.bridge.networks import RobotAddress

    Numbers = NDArray[np.int64]
    Lengths = NDArray[np.float64]
    Which = NDArray[np.bool_]

USUAL = MoveOption.STOP_ON_CONTACT | MoveOption.SENSE
"""What most moves end by, and are followed by."""


@dataclass(frozen=True)
class SwarmMoves:
    """SwarmMoves of many robots, a row for each robot of the swarm; every column may be one value for all.

    As `firmware_protocol.vocabulary.Move`, whose None is NaN here.

    Attributes:
        moving: Who moves, shape (robots,).
        distance: Way to drive, in m.
        heading: Which way, in rad; NaN: `sector` says it.
        sector: Sector along whose bisector to drive, from 1; 0: `heading` says it.
        sectors: How many sectors there are.
        face: Heading to turn to when there, in rad; NaN: stay as it came.
        speed: In m/s; 0: the robot's MOVE_SPEED.
        effort: Limit of the wheels' force, in percent; 0 is all of it.
        options: `MoveOption`.
    """

    moving: Which
    distance: Lengths | float = 0.0
    heading: Lengths | float = np.nan
    sector: Numbers | int = 0
    sectors: Numbers | int = 0
    face: Lengths | float = np.nan
    speed: Lengths | float = 0.0
    effort: Numbers | int = 0
    options: Numbers | int = USUAL

    @classmethod
    def of(cls, moves: Mapping[int, Move], robots: int) -> SwarmMoves:
        """SwarmMoves of single robots.

        Args:
            moves: By row.
            robots: How many rows there are.
        """
        moving = np.zeros(robots, bool)
        moving[list(moves)] = True
        names = ("distance", "heading", "sector", "sectors", "face", "speed", "effort", "options")
        columns: dict[str, Any] = {}
        for name in names:
            whole = name in {"sector", "sectors", "effort", "options"}
            values = np.zeros(robots, np.int64 if whole else np.float64)
            for row, move in moves.items():
                value = getattr(move, name)
                values[row] = np.nan if value is None else value
            columns[name] = values
        return cls(moving, **columns)

    def part(self, rows: Numbers) -> dict[str, Any]:
        """The columns of some robots, as `rows_of` takes them.

        Args:
            rows: Their rows.
        """
        names = ("distance", "heading", "sector", "sectors", "face", "speed", "effort", "options")
        return {name: value[rows] if np.ndim(value := np.asarray(getattr(self, name))) else value for name in names}

    def rows(self, rows: Numbers, systems: Numbers) -> Rows:
        """The messages to some robots.

        Args:
            rows: Their rows.
            systems: Their system ids.

        Raises:
            EncodeError: A value can't be sent.
        """
        columns = self.part(rows) | {"target_system": systems, "target_component": ROBOT_COMPONENT}
        return rows_of(SwarmMove, len(rows), columns)

    def longest(self, rows: Numbers, move_speed: float, turn_speed: float) -> Lengths:
        """Longest time that each may take on its robot, in s: see `firmware_protocol.roles.swarm.longest_time`.

        Args:
            rows: Whose.
            move_speed: MOVE_SPEED of the robots, in m/s.
            turn_speed: Their TURN_SPEED, in rad/s.
        """
        part = self.part(rows)
        speed = np.where(np.asarray(part["speed"]) > 0, part["speed"], move_speed)
        turns = 2 - np.isnan(np.asarray(part["face"], np.float64)).astype(np.float64)
        planned = turns * np.pi / turn_speed + np.asarray(part["distance"]) / speed
        times = np.where(np.asarray(part["options"], np.int64) & int(MoveOption.PUSH), 3.0, 2.0)
        return np.broadcast_to(times * planned + 1.0, (len(rows),)).astype(np.float64)


@dataclass(frozen=True)
class Round:
    """What came of asking, or moving, many robots at once. Arrays have a row for each robot of the swarm.

    Rows of who has not answered hold 0, of lengths and angles NaN.

    Attributes:
        addresses: Of the robots, by row.
        asked: Who was asked, or told, shape (robots,).
        there: Whose observation came, same shape.
        reports: The observations as rows in wire units, same shape; zeros where none came.
        reasons: Why a move was refused at once (`Reason`), same shape; 0 where it was not, or no reason was given.
        turned_down: Whose was, same shape.
        seconds: How long it took, in s.
        range_reports: Ranges as rows in wire units, where some were asked for.
        ranged: Whose ranges came, shape (robots,).
    """

    addresses: Sequence[RobotAddress]
    asked: Which
    there: Which
    reports: Rows
    reasons: Numbers
    turned_down: Which
    seconds: float
    range_reports: Rows | None = None
    ranged: Which | None = None
    _columns: dict[str, NDArray[Any]] = field(default_factory=dict, repr=False)

    @cached_property
    def missing(self) -> list[RobotAddress]:
        """Who was asked and has not answered in time."""
        return self._named(self.asked & ~self.there & ~self.turned_down)

    @cached_property
    def refused(self) -> dict[RobotAddress, Reason]:
        """Whose move was refused at once, and why."""
        rows = np.flatnonzero(self.turned_down).tolist()
        known = set(Reason)
        return {
            self.addresses[row]: Reason(reason) if (reason := int(self.reasons[row])) in known else Reason.NONE for row in rows
        }

    @cached_property
    def observations(self) -> dict[RobotAddress, SwarmObservation]:
        """The observations as objects, by address."""
        rows = np.flatnonzero(self.there)
        found = messages_of(SwarmObservation, take_rows(self.reports, rows))
        return {
            self.addresses[row]: said
            for row, said in zip(rows.tolist(), found, strict=True)
            if isinstance(said, SwarmObservation)
        }

    @property
    def position(self) -> Lengths:
        """Of each robot's centre, in m, shape (robots, 2)."""
        return self._column("position")

    @property
    def heading(self) -> Lengths:
        """In rad, shape (robots,)."""
        return self._column("heading")

    @property
    def travelled(self) -> Lengths:
        """Along the move, in m, shape (robots,)."""
        return self._column("travelled")

    @property
    def radius(self) -> Lengths:
        """The radius used now, in m, shape (robots,)."""
        return self._column("radius")

    @property
    def radius_before(self) -> Lengths:
        """The radius that `count_before` used, in m, shape (robots,)."""
        return self._column("radius_before")

    @property
    def near(self) -> Numbers:
        """Sectors with a robot within R0, sector 1 the most significant bit, shape (robots, classes)."""
        return self._column("near")

    @property
    def seen(self) -> Numbers:
        """Sectors with a robot within `radius`, shape (robots, classes)."""
        return self._column("seen")

    @property
    def count(self) -> Numbers:
        """Robots within `radius`, at most 255, shape (robots, classes)."""
        return self._column("count")

    @property
    def count_before(self) -> Numbers:
        """Robots within `radius_before`, at most 255, shape (robots, classes)."""
        return self._column("count_before")

    @property
    def box_bearing(self) -> Lengths:
        """Of the box from the nose, in rad, shape (robots,); NaN: there is none."""
        return self._column("box_bearing")

    @property
    def box_distance(self) -> Lengths:
        """To its surface, in m, shape (robots,); NaN: there is none."""
        return self._column("box_distance")

    @property
    def goal_bearing(self) -> Lengths:
        """Of the goal from the nose, in rad, shape (robots,); NaN: there is none."""
        return self._column("goal_bearing")

    @property
    def fix_age(self) -> Lengths:
        """Age of the position fix, in s, shape (robots,); NaN: there was never one."""
        return self._column("fix_age")

    @property
    def flags(self) -> Numbers:
        """`ObservationFlag`, shape (robots,)."""
        return self._column("flags")

    @property
    def outcome(self) -> Numbers:
        """How each move ended (`SwarmOutcome`), shape (robots,); NONE where no observation of a move came."""
        return self._column("outcome")

    @property
    def reason(self) -> Numbers:
        """Why (`Reason`): of the observation, or where the move was refused at once, of that, shape (robots,)."""
        return np.where(self.turned_down, self.reasons, self._column("reason"))

    @cached_property
    def ranges(self) -> Lengths:
        """Measured ranges, in m, shape (robots, 32): NaN where nothing is in range, or none came."""
        if self.range_reports is None or self.ranged is None:
            return np.full((len(self.addresses), 32), np.nan)
        values = column(SwarmRanges, self.range_reports, "ranges").astype(np.float64)
        values[~self.ranged] = np.nan
        return values

    def _named(self, which: Which) -> list[RobotAddress]:
        return [self.addresses[row] for row in np.flatnonzero(which).tolist()]

    def _column(self, name: str) -> NDArray[Any]:
        found = self._columns.get(name)
        if found is None:
            found = column(SwarmObservation, self.reports, name)
            if found.dtype.kind == "f":
                found[~self.there] = np.nan
            elif found.dtype.kind in "ui":
                found = found.astype(np.int64)
            self._columns[name] = found
        return found
