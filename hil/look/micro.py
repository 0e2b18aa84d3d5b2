"""A swarm's part of a scene: the table, and every micro-robot where it last said to be, with what it senses round about."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import ParamValue, SwarmObservation, SwarmRanges, SwarmSense
from firmware_protocol.messages.table import BoxShape, TableKind, TableReset, TableState
from firmware_protocol.vocabulary import MAX_RANGES, MAX_SECTORS, RobotClass
from hil.look.scene import BodyShape, Chapter, Ground, Terrain, TimeCurves, Track
from hil.mcaplog.records import BridgeOpening, BridgeStep, SurroundStateRecord, SwarmRoundRecord
from simdevice.swarm.profile import MicroProfile

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.look.scene import Points, Scene
    from hil.mcaplog.reading.reader import LogEntry

TOPICS: Final = (
    "/swarm/observation", "/swarm/ranges", "/swarm/round", "/surround/state", "/mavlink/table_reset", "/mavlink/table_state",
    "/mavlink/param_value", "/bridge/open", "/swarm/sense",
)  # fmt: skip
FARTHEST: Final = 100.0
"""Positions farther away are none, in m: the wire can carry 33 m."""
MOST_ROBOTS: Final = 2000
LEAST_TABLE: Final = 0.5
ROOMS: Final = ("default", "narrow", "mixed")
"""Rooms that every emulated table knows, by their numbers from 1; what stands in others, a log does not say."""
Robot = tuple[int, int]
"""Number of its network, from 0, and its system."""


class MicroPart:
    """Takes the entries of a log that are of micro-robots.

    A message in a log does not say on which of several networks it came. It came in a step of that network, and that step's
    entry stands before it.
    """

    def __init__(self) -> None:
        self._networks: dict[str, int] = {}
        self._network = 0
        self._rows: list[tuple[float, ...]] = []
        self._index: dict[Robot, int] = {}
        self._classes: dict[Robot, RobotClass] = {}
        self._ranges: dict[Robot, list[tuple[float, SwarmRanges]]] = {}
        self._table: TableReset | None = None
        self._boxes: list[tuple[float, TableState]] = []
        self._states: list[tuple[float, SurroundStateRecord]] = []
        self._missing: list[tuple[float, int]] = []
        self._sectors = 0
        self._left = 0

    @property
    def robots(self) -> int:
        """How many have said where they are."""
        return len(self._index)

    @property
    def classes(self) -> dict[str, int]:
        """How many there are of each class that is known."""
        found: dict[str, int] = {}
        for robot in self._index:
            kind = self._kind(robot)
            found[kind] = found.get(kind, 0) + 1
        return found

    def take(self, entry: LogEntry) -> None:
        """Take an entry."""
        value, time = entry.value, entry.time
        match value:
            case BridgeOpening() | BridgeStep():
                self._network = self._networks.setdefault(value.network, len(self._networks))
            case SwarmObservation() if entry.sender is not None:
                self._observed((self._network, entry.sender[0]), time, value)
            case SwarmRanges() if entry.sender is not None:
                self._ranges.setdefault((self._network, entry.sender[0]), []).append((time, value))
            case ParamValue() if (
                entry.sender is not None and value.param_id == "CLASS" and value.param_value in set(RobotClass)
            ):
                self._classes[self._network, entry.sender[0]] = RobotClass(int(value.param_value))
            case SwarmSense():
                self._sectors = value.sectors
            case TableReset():
                self._table = self._table or value
            case TableState():
                self._boxes.append((time, value))
            case SurroundStateRecord():
                self._states.append((time, value))
            case SwarmRoundRecord():
                self._missing.append((time, len(value.missing) + len(value.refused)))

    def _observed(self, robot: Robot, time: float, seen: SwarmObservation) -> None:
        number = self._index.get(robot)
        if number is None:
            if len(self._index) >= MOST_ROBOTS:
                self._left += 1
                return
            number = self._index[robot] = len(self._index)
        radius = seen.radius if seen.radius < FARTHEST / 2 else np.nan
        self._rows.append((number, time, *seen.position, seen.heading, seen.flags, *seen.seen, radius, seen.outcome))

    def put(self, scene: Scene) -> None:
        """Put what was gathered into a scene whose beginning and end are set."""
        if not self._rows:
            return
        self._states.sort(key=lambda one: one[0])
        rows = np.array(self._rows, dtype=np.float64)
        rows = rows[np.isfinite(rows[:, :5]).all(axis=1) & (np.abs(rows[:, 2:4]) < FARTHEST).all(axis=1)]
        rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
        scene.terrain = self._place(rows)
        if self._table is not None and self._table.map > len(ROOMS):
            scene.notes.append(f"Obstacles stood on the table, of its room {self._table.map}: the log does not say where.")
        shape = BodyShape(radius=MicroProfile().radius, sectors=min(self._sectors, MAX_SECTORS))
        several = len(self._networks) > 1
        numbers = rows[:, 0]
        for robot, number in sorted(self._index.items()):
            first, behind = np.searchsorted(numbers, (number, number + 1))
            if first == behind:
                continue
            network, system = robot
            label = f"{network + 1}.{system}" if several else str(system)
            scene.tracks.append(self._track(robot, label, shape, rows[first:behind]))
        self._box(scene)
        scene.chapters += self._missions(scene.end)
        scene.traces += self._measured()
        if self._left:
            scene.notes.append(f"There are more than {MOST_ROBOTS:,} robots in the log: the others are left out.")

    def _kind(self, robot: Robot) -> str:
        kind = self._classes.get(robot)
        return "robot" if kind is None else kind.name.lower()

    def _track(self, robot: Robot, label: str, shape: BodyShape, rows: NDArray[np.float64]) -> Track:
        kind = self._kind(robot)
        names = ("t", "x", "y", "heading", "flags", "near0", "near1", "radius", "outcome")
        poses = {name: rows[:, column] for column, name in enumerate(names, start=1)}
        name = kind.upper() if kind != "robot" else "robot"
        return Track(label, f"{name} {label}", kind, shape, poses, {}, self._rays(self._ranges.get(robot, [])))

    @staticmethod
    def _rays(told: list[tuple[float, SwarmRanges]]) -> dict[str, NDArray[np.float64]]:
        if not told:
            return {}
        told = sorted(told, key=lambda one: one[0])
        count = min(MAX_RANGES, max(message.count for _, message in told))
        ranges = np.full((len(told), count), np.nan)
        for row, (_, message) in enumerate(told):
            used = min(count, message.count)
            ranges[row, :used] = [np.nan if value is None else value for value in message.ranges[:used]]
        columns = {f"r{direction}": ranges[:, direction] for direction in range(count)}
        hits = np.array([message.robots & (1 << 29) - 1 for _, message in told], dtype=np.float64)
        return {"t": np.array([time for time, _ in told]), "hits": hits, **columns}

    def _place(self, rows: NDArray[np.float64]) -> Terrain:
        if self._table is not None and all(LEAST_TABLE / 10 < side < FARTHEST for side in self._table.size):
            width, height = self._table.size
            return Terrain(Ground.TABLE, width, height, bool(self._table.wall), _obstacles(self._table))
        width, height = 2.2 * np.abs(rows[:, 2:4]).max(axis=0)
        return Terrain(Ground.TABLE, max(LEAST_TABLE, float(width)), max(LEAST_TABLE, float(height)))

    def _box(self, scene: Scene) -> None:
        if self._table is None or self._table.kind != TableKind.BOX or not self._boxes:
            return
        rows = np.array([(time, *state.box, state.box_heading, *state.goal) for time, state in self._boxes])
        rows = rows[np.isfinite(rows).all(axis=1) & (np.abs(rows[:, 1:]) < FARTHEST).all(axis=1)]
        if not len(rows):
            return
        half = MicroProfile().box_half
        square = ((half, half), (-half, half), (-half, -half), (half, -half))
        shape = BodyShape(square if self._table.box == BoxShape.CUBE else (), half)
        poses = {"t": rows[:, 0], "x": rows[:, 1], "y": rows[:, 2], "heading": rows[:, 3]}
        scene.tracks.insert(0, Track("box", "the box", "box", shape, poses))
        goal = {"t": rows[:, 0], "x": rows[:, 4], "y": rows[:, 5], "heading": np.zeros(len(rows))}
        scene.tracks.insert(0, Track("goal", "the goal", "goal", BodyShape(radius=half), goal))

    def _missions(self, last: float) -> list[Chapter]:
        """A chapter for each run of a mission."""
        runs: list[list[tuple[float, SurroundStateRecord]]] = []
        for time, state in self._states:
            before = runs[-1][-1][1] if runs else None
            if before is None or state.seed != before.seed or state.step <= before.step:
                runs.append([])
            runs[-1].append((time, state))
        found = []
        for number, run in enumerate(runs):
            end = runs[number + 1][0][0] if number + 1 < len(runs) else last
            state = run[-1][1]
            story = _story(run[0][1], state)
            found.append(Chapter(_run_name(number + 1, state), "surround", run[0][0], end, story=story))
        return found

    def _measured(self) -> list[TimeCurves]:
        if len(self._states) < 2:
            return []
        times = np.array([time for time, _ in self._states])
        found = []
        for field, name, unit, labels in (
            (("distance", "ranger_distance"), "Mean distance", "units", ("RANGER to nearest WILD", "between RANGERs")),
            (("share_surrounded", "outside"), "Share", "", ("WILDs surrounded", "RANGERs outside the area")),
        ):
            values = tuple(np.array([_or_none(getattr(state, one)) for _, state in self._states]) for one in field)
            found.append(TimeCurves(name, unit, labels, times, values, stepped=True))
        if any(count for _, count in self._missing):
            when, counts = np.array(self._missing, dtype=np.float64).T
            found.append(TimeCurves("Robots without an answer", "", ("missing or refusing",), when, (counts,), stepped=True))
        return found


def _obstacles(table: TableReset) -> tuple[Points, ...]:
    """Outlines of what stands on a table, as far as that is known."""
    if table.kind != TableKind.OBSTACLES or not 0 < table.map <= len(ROOMS):
        return ()
    from simdevice.swarm.rooms import built_in  # noqa: PLC0415 - images are read where there are obstacles only

    outlines: list[list[tuple[float, float]]] = []
    for x, y, next_x, next_y in built_in(ROOMS[table.map - 1]).walls:
        if not outlines or outlines[-1][-1] != (x, y):
            outlines.append([(x, y)])
        outlines[-1].append((next_x, next_y))
    return tuple(tuple(outline) for outline in outlines)


def _run_name(number: int, state: SurroundStateRecord) -> str:
    return f"Run {number}, seed {state.seed}" + (f", {state.case}" if state.case else "")


def _story(first: SurroundStateRecord, last: SurroundStateRecord) -> str:
    """What became of a run in so many steps."""
    parts = []
    if last.share_surrounded is not None:
        parts.append(f"{last.share_surrounded:.0%} of the WILDs were surrounded")
    if first.distance is not None and last.distance is not None:
        went = f"from {first.distance:.2f} to {last.distance:.2f} units"
        parts.append(f"the mean distance from a RANGER to the nearest WILD had gone {went}")
    return f"After {last.step} steps {', and '.join(parts)}." if parts else ""


def _or_none(value: float | None) -> float:
    return np.nan if value is None else value
