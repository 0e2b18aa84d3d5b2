"""A sumo robot's part of a scene: the ring with both robots, its sensors and wheels, its maneuvers."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import (
    HOST_SYSTEM,
    JuniorManeuver,
    JuniorManeuverResult,
    JuniorSensors,
    JuniorWheels,
    ParamValue,
    RefereeState,
    RobotSession,
)
from firmware_protocol.messages.junior import SensorFlag
from firmware_protocol.vocabulary import Action, Outcome, spelled_out
from hil.look.bouts import Bouts, judged
from hil.look.scene import Beam, BodyShape, Ground, Lane, Spot, Terrain, TimeCurves, Track
from hil.mcaplog.records import EventRecord
from hil.recording.protagonist import Protagonist
from hil.recording.scene import junior_outline, opponent_outline, ring_size
from simdevice.junior.profile import JuniorProfile

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.look.scene import Scene
    from hil.mcaplog.reading.reader import LogEntry

TOPICS: Final = (
    "/junior/sensors", "/junior/wheels", "/junior/maneuver", "/junior/maneuver_result", "/referee/state", "/robot/session",
    "/mavlink/param_value",
)  # fmt: skip
SPEED_OVER: Final = 0.1
"""Wheel speeds are taken over so long, in s: travel is told in mm."""
FARTHEST: Final = 1e3
"""Positions farther away are none, in m."""
THRESHOLD: Final = 250.0
"""Of an eye, where the robot has not said its own."""
ENDS: Final = {
    Outcome.COMPLETED: "completed",
    Outcome.STIMULUS_CHANGED: "ended: what it sees had changed",
    Outcome.FLOOR_REFLEX: "ended by its floor reflex, at the border",
    Outcome.STOPPED: "stopped",
    Outcome.REPLACED: "replaced by another command",
    Outcome.REFUSED: "refused",
}
CUTS: Final = {
    Outcome.STIMULUS_CHANGED: " · changed",
    Outcome.FLOOR_REFLEX: " · border",
    Outcome.STOPPED: " · stopped",
    Outcome.REPLACED: " · replaced",
    Outcome.REFUSED: " · refused",
}
"""What is put behind a maneuver's name where it was not performed to its end."""
_ARMS: Final = SensorFlag.ARM_LEFT | SensorFlag.ARM_RIGHT


def spoken(actions: list[int] | tuple[int, ...]) -> str:
    """Actions by their meanings, as `forward; left turn, twice; stop`.

    Args:
        actions: Action codes; unknown ones are said to be.
    """
    known = set(Action)
    runs = groupby(actions, key=lambda code: code in known)
    parts = (spelled_out(map(Action, run)) if there else "; ".join(f"action {code}" for code in run) for there, run in runs)
    return "; ".join(parts)


def letters(actions: list[int] | tuple[int, ...]) -> str:
    """Actions by their names, as `F L S`.

    Args:
        actions: Action codes.
    """
    return " ".join(Action(code).name if code in set(Action) else f"?{code}" for code in actions)


def junior_shape() -> BodyShape:
    """Junior, with its eyes, arms and floor sensors."""
    body = JuniorProfile()
    (x, y), (near, far) = body.eye_position, body.arm_span
    floor_x, floor_y = body.floor_position
    front = body.front
    return BodyShape(
        junior_outline(),
        0.06,
        (
            Beam(x, y, body.eye_angle, body.eye_half_cone, body.eye_range, SensorFlag.EYE_LEFT),
            Beam(x, -y, -body.eye_angle, body.eye_half_cone, body.eye_range, SensorFlag.EYE_RIGHT),
        ),
        (
            Spot("left arm touches", ((front, near), (front, far)), SensorFlag.ARM_LEFT),
            Spot("right arm touches", ((front, -near), (front, -far)), SensorFlag.ARM_RIGHT),
            Spot("left floor sensor is off the ring", ((floor_x, floor_y),), SensorFlag.OFF_RING_LEFT),
            Spot("right floor sensor is off the ring", ((floor_x, -floor_y),), SensorFlag.OFF_RING_RIGHT),
        ),
    )


class SumoPart:
    """Takes the entries of a log that are of a sumo robot.

    Args:
        robot: System id of the one to show, of several; None: the `Protagonist`.
    """

    def __init__(self, robot: int | None = None) -> None:
        self._robot = Protagonist()
        if robot is not None:
            self._robot.taken(robot)
        self._heard: dict[int, list[tuple[float, JuniorSensors]]] = {}
        self._states: dict[int, list[tuple[float, RefereeState]]] = {}
        self._wheels: list[tuple[float, JuniorWheels]] = []
        self._maneuvers: list[tuple[float, JuniorManeuver]] = []
        self._results: dict[tuple[int, int], tuple[float, int]] = {}
        self._threshold = THRESHOLD
        self._series: list[tuple[float, str]] = []
        self._judged: list[tuple[float, EventRecord]] = []

    def series(self, time: float, title: str) -> None:
        """A series of bouts begins.

        Args:
            time: Log time in s.
            title: Its title.
        """
        self._series.append((time, title))

    def take(self, entry: LogEntry) -> None:
        """Take an entry."""
        value, time = entry.value, entry.time
        system = entry.sender[0] if entry.sender else HOST_SYSTEM
        match value:
            case RobotSession():
                self._robot.taken(value.target_system)
            case JuniorWheels():
                if value.target_system == self._robot.system:
                    self._wheels.append((time, value))
            case JuniorManeuver():
                again = self._maneuvers and self._maneuvers[-1][1].sequence == value.sequence
                if value.target_system == self._robot.system and not again:
                    self._maneuvers.append((time, value))
            case JuniorSensors():
                self._robot.heard(system)
                self._heard.setdefault(system, []).append((time, value))
            case RefereeState():
                self._robot.heard(system)
                self._states.setdefault(system, []).append((time, value))
            case JuniorManeuverResult():
                self._results.setdefault((system, value.sequence), (time, value.outcome))
            case EventRecord(kind="bout"):
                self._judged.append((time, value))
            case ParamValue():
                if value.param_id == "EYE_L_ON":
                    self._threshold = value.param_value

    @property
    def robots(self) -> list[int]:
        """System ids of the sumo robots that have said something of themselves."""
        return sorted(self._heard.keys() | self._states.keys())

    def put(self, scene: Scene) -> None:
        """Put what was gathered into a scene whose beginning and end are set."""
        for readings in self._heard.values():  # a log that somebody else has put together may have them in any order
            readings.sort(key=_time)
        for seen in self._states.values():
            seen.sort(key=_time)
        self._wheels.sort(key=_time)
        self._maneuvers.sort(key=_time)
        system = self._robot.system
        heard = self._heard.get(system, []) if system is not None else []
        states = self._states.get(system, []) if system is not None else []
        if not heard and not states:
            return
        if len(self.robots) > 1:
            which = f"this is robot {system} (--robot ID shows another)"
            scene.notes.append(f"There are {len(self.robots)} sumo robots in the log: {which}.")
        senses = self._senses(heard)
        maneuvers = self._performed(scene.end)
        if states:
            self._ring(scene, states, senses, maneuvers)
        elif heard:
            scene.terrain = Terrain(Ground.NONE, 1.2, 0.9)
            still = {"t": np.array([scene.begin]), "x": np.zeros(1), "y": np.zeros(1), "heading": np.full(1, np.pi / 2)}
            scene.tracks.append(Track("junior", "Junior", "junior", junior_shape(), still, senses))
            scene.chapters += judged(self._judged, self._series)
        if maneuvers is not None:
            scene.lanes.append(maneuvers)
        self._sensed(scene, heard)

    def _senses(self, heard: list[tuple[float, JuniorSensors]]) -> dict[str, NDArray[np.float64]]:
        if not heard:
            return {}
        flags = np.array([message.flags for _, message in heard], dtype=np.float64)
        kept = np.flatnonzero(np.diff(flags, prepend=-1.0))
        last = np.array([len(flags) - 1])  # until then the last is known to be so
        kept = np.union1d(kept, last)
        return {"t": np.array([time for time, _ in heard])[kept], "flags": flags[kept]}

    def _ring(
        self,
        scene: Scene,
        told: list[tuple[float, RefereeState]],
        senses: dict[str, NDArray[np.float64]],
        maneuvers: Lane | None,
    ) -> None:
        width, height = ring_size()
        scene.terrain = Terrain(Ground.RING, width, height)
        rows = np.array(
            [(time, *state.junior, state.junior_heading, *state.opponent, state.opponent_heading) for time, state in told]
        )
        good = np.isfinite(rows).all(axis=1) & (np.abs(rows[:, 1:]) < FARTHEST).all(axis=1)
        if not good.all():
            scene.notes.append(f"{np.count_nonzero(~good):,} poses are no place in an arena, and are left out.")
        bouts = np.array([state.bout for _, state in told], dtype=np.float64)
        rows, bouts = rows[good], bouts[good]
        if not len(rows):
            scene.terrain = None
            return
        gap = (np.diff(bouts, prepend=bouts[0]) != 0).astype(np.float64)
        code = max((state.opponent_code for _, state in told[-1:]), default=0)
        for key, label, shape, at, felt in (
            ("opponent", "Opponent", BodyShape(opponent_outline(code), 0.06), 4, {}),
            ("junior", "Junior", junior_shape(), 1, senses),
        ):
            poses = {"t": rows[:, 0], "x": rows[:, at], "y": rows[:, at + 1], "heading": rows[:, at + 2], "gap": gap}
            scene.tracks.append(Track(key, label, key, shape, poses, felt))
        scene.chapters += Bouts(told, self._series, senses, maneuvers).chapters()
        clear = [width / 2 - np.abs(rows[:, at]) for at in (1, 4)]
        clear = [np.minimum(one, height / 2 - np.abs(rows[:, at])) for one, at in zip(clear, (2, 5), strict=True)]
        begins = np.flatnonzero(gap > 0)  # a curve has a hole between two bouts
        holed = tuple(np.insert(one, begins, np.nan) for one in clear)
        times = np.insert(rows[:, 0], begins, rows[begins, 0])
        name, labels = "Distance to the border", ("Junior", "Opponent")
        scene.traces.append(TimeCurves(name, "m", labels, times, holed, level=0.0, level_name="the border"))

    def _performed(self, last: float) -> Lane | None:
        """The maneuvers as a band; the words are their actions."""
        if not self._maneuvers:
            return None
        begin = np.array([time for time, _ in self._maneuvers])
        following = np.append(begin[1:], last)
        end, codes = np.empty_like(begin), np.empty_like(begin)
        words: dict[tuple[tuple[int, ...], int], int] = {}
        for index, (time, order) in enumerate(self._maneuvers):
            actions = order.actions[: order.count]
            result = self._results.get((order.target_system, order.sequence))
            done = result is not None and time <= result[0] <= time + 60.0
            until = result[0] if result is not None and done else time + order.count * order.period
            end[index] = min(until, following[index])
            how = result[1] if result is not None and done else -1
            key = actions, how
            codes[index] = words.setdefault(key, len(words))
        named = {int(outcome): text for outcome, text in ENDS.items()}
        cut = {int(outcome): text for outcome, text in CUTS.items()}
        return Lane(
            "Maneuver",
            begin,
            end,
            codes,
            tuple(letters(actions) + cut.get(how, "") for actions, how in words),
            tuple(f"{spoken(actions)} ({named.get(how, 'its result is not in the log')})" for actions, how in words),
            tuple("even" if how == Outcome.COMPLETED else "bad" if how == Outcome.FLOOR_REFLEX else "busy" for _, how in words),
        )

    def _sensed(self, scene: Scene, heard: list[tuple[float, JuniorSensors]]) -> None:
        if not heard:
            return
        messages = [message for _, message in heard]
        times = np.array([time for time, _ in heard])

        def columns(values: list[tuple[float, ...]]) -> tuple[NDArray[np.float64], ...]:
            return tuple(np.array(values, dtype=np.float64).T)

        eyes = columns([message.eye for message in messages])
        scene.traces.append(
            TimeCurves("Eyes", "counts", ("Left", "Right"), times, eyes, level=self._threshold, level_name="sees from here on")
        )
        travel = columns([message.travel for message in messages])
        scene.traces.append(TimeCurves("Wheels", "m/s", ("Left", "Right"), times, _speeds(times, travel)))
        scene.traces.append(
            TimeCurves("Floor sensors", "counts", ("Left", "Right"), times, columns([message.floor for message in messages]))
        )
        slow = np.arange(0, len(times), max(1, len(times) // 2000))
        battery = np.array([message.battery for message in messages])[slow]
        scene.traces.append(TimeCurves("Battery", "V", ("Battery",), times[slow], (battery,)))
        if any(order.speed != (0.0, 0.0) for _, order in self._wheels):
            scene.traces.append(_commands(self._wheels))
        scene.lanes += _seen(times, np.array([message.flags for message in messages], dtype=np.int64))


def _time(told: tuple[float, object]) -> float:
    return told[0]


def _speeds(times: NDArray[np.float64], travel: tuple[NDArray[np.float64], ...]) -> tuple[NDArray[np.float64], ...]:
    """Speeds of the wheels over the last tenth of a second; none across a gap, or where the robot has started anew."""
    before = np.maximum(np.searchsorted(times, times - SPEED_OVER - 1e-6), 0)
    apart = times - times[before]
    good = (apart > SPEED_OVER / 2) & (apart < 3 * SPEED_OVER)
    found = []
    for way in travel:
        speed = np.full(len(times), np.nan)
        np.divide(way - way[before], apart, out=speed, where=good)
        speed[np.abs(speed) > 10.0] = np.nan
        found.append(speed)
    return tuple(found)


def _commands(told: list[tuple[float, JuniorWheels]]) -> TimeCurves:
    """What the wheels were told, each command until its time is over or the next one comes."""
    rows: list[tuple[float, ...]] = []
    for index, (time, order) in enumerate(told):
        following = told[index + 1][0] if index + 1 < len(told) else np.inf
        rows.append((time, *order.speed))
        if time + order.duration < following:
            rows.append((time + order.duration, 0.0, 0.0))
    times, left, right = np.array(rows).T
    return TimeCurves("Wheels were told", "share of full", ("Left", "Right"), times, (left, right), stepped=True)


def _seen(times: NDArray[np.float64], flags: NDArray[np.int64]) -> list[Lane]:
    """What eyes and arms tell, as bands."""
    eyes = flags & 3
    arms = (flags & int(_ARMS)) >> 2
    return [
        _band("Eyes see it", times, eyes, ("with the left eye", "with the right eye", "with both eyes")),
        _band("Arms touch", times, arms, ("the left arm touches", "the right arm touches", "both arms touch")),
    ]


def _band(name: str, times: NDArray[np.float64], code: NDArray[np.int64], meanings: tuple[str, str, str]) -> Lane:
    """A band of something that may be on the left, on the right or on both sides, code 1 to 3; nothing is shown for 0."""
    at = np.flatnonzero(np.diff(code, prepend=-1))
    end = np.append(times[at[1:]], times[-1])
    shown = code[at] > 0
    kinds = code[at][shown].astype(np.float64)
    words, tones = ("", "left", "right", "both"), ("quiet", "busy", "even", "good")
    return Lane(name, times[at][shown], end[shown], kinds, words, ("", *meanings), tones)
