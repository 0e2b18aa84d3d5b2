"""Reads a log, whole or cut off, and collects what a report tells."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import (
    HOST_SYSTEM,
    BoutOutcome,
    JuniorSensors,
    JuniorWheels,
    OpponentCode,
    ParamValue,
    Phase,
    RefereeState,
    RobotSession,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.peer.streams import STALE_INTERVALS, STALE_LEAST
from firmware_protocol.wire.fields import Message
from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.reading.reader import LogEntry, LogReader
from hil.mcaplog.records import SERIES, AdviceRecord, EventRecord, RejectedInput, StepRecord, TrialRecord, WireBytes
from hil.mcaplog.writing.joints import PLOTS
from hil.recording.protagonist import Protagonist
from hil.report.learnt import Learnt, read_learnt
from hil.report.link import LinkQuality, LinkWatcher

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

SKIPPED: Final = frozenset({"/bridge/step", "/tf", "/arena/scene", "/junior/joints", *PLOTS})
"""Topics that tell a report nothing it does not know otherwise."""
SENSORS: Final = "/junior/sensors"
UNREAD: Final = frozenset({SENSORS, "/mavlink/heartbeat", "/mavlink/sys_status", "/mavlink/command_ack"})
"""Topics of which only the frames are counted at first; the sensors are read where there is nothing else to report on."""

FARTHEST: Final = 1e4
"""Places farther away than this, in m, are none, and times longer, in s."""
MOST_PARAMETERS: Final = 500
MOST_ODDITIES: Final = 20
_PHASES: Final = frozenset(Phase)
_OUTCOMES: Final = frozenset(BoutOutcome)


@dataclass(frozen=True)
class BoutPath:
    """A bout as the referee saw it.

    Attributes:
        number: In this log, from 1.
        series: Title of the series it belongs to; empty where the log names none.
        opponent: As in REFEREE_STATE.
        outcome: How it ended; UNDECIDED where it was broken off, or where nobody knows what the referee said.
        duration: In s.
        used: Maneuvers the learner had had performed when it began.
        times: Time since the bout began, in s, where both poses are places in the arena; shape (n,).
        junior: x, y in m and heading in rad; shape (n, 3).
        other: The opponent's, likewise.
    """

    number: int
    series: str
    opponent: int
    outcome: BoutOutcome
    duration: float
    used: int
    times: NDArray[np.float64]
    junior: NDArray[np.float64]
    other: NDArray[np.float64]

    @property
    def opponent_name(self) -> str:
        """The opponent's name."""
        return OpponentCode(self.opponent).label if self.opponent in set(OpponentCode) else f"number {self.opponent}"


@dataclass(frozen=True)
class SensorTrack:
    """What the robot sensed, over time.

    Attributes:
        times: Log times in s; shape (n,).
        eye: ADC counts, left and right; shape (n, 2).
        floor: Likewise.
        battery: In V; shape (n,).
        flags: `SensorFlag` bits; shape (n,).
        wheel_times: Log times of wheel commands, in s; shape (m,).
        wheels: Left and right, share of full, and duration in s; shape (m, 3).
    """

    times: NDArray[np.float64]
    eye: NDArray[np.float64]
    floor: NDArray[np.float64]
    battery: NDArray[np.float64]
    flags: NDArray[np.int64]
    wheel_times: NDArray[np.float64]
    wheels: NDArray[np.float64]

    @property
    def gaps(self) -> NDArray[np.float64]:
        """When no reading came for so long that the one before was stale, or until the log ends: from, to; in s; shape (k, 2).

        As `firmware_protocol.peer.streams` has it, with the median for the interval.
        """
        apart = np.diff(self.times)
        if not len(apart):
            return np.empty((0, 2))
        late = np.flatnonzero(apart > max(STALE_INTERVALS * float(np.median(apart)), STALE_LEAST))
        return np.stack((self.times[late], self.times[late + 1]), axis=1)


@dataclass
class RunData:
    """All that a report tells of a log.

    Attributes:
        path: The log.
        health: What state the file is in, in words.
        whole: The file is neither cut off nor damaged.
        metadata: Its metadata records, by name.
        start: First log time, in s.
        end: Last log time, in s.
        generations: Steps of the learner, in order.
        trials: Maneuvers performed for the learner, in order.
        trial_times: Their log times, in s.
        advice: The advice as last recorded; None where there was none that could be read.
        bouts: Bouts, in order.
        link: How good the link was.
        sensors: What the robot sensed.
        events: Log times in s and events.
        parameters: The robot's parameters, as last told.
        oddities: What the log holds that this program does not know or can't draw, in words.
    """

    path: Path
    health: str = ""
    whole: bool = True
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    start: float = 0.0
    end: float = 0.0
    generations: list[StepRecord] = field(default_factory=list)
    trials: list[TrialRecord] = field(default_factory=list)
    trial_times: list[float] = field(default_factory=list)
    advice: Learnt | None = None
    bouts: list[BoutPath] = field(default_factory=list)
    link: LinkQuality = field(default_factory=LinkQuality)
    sensors: SensorTrack | None = None
    events: list[tuple[float, EventRecord]] = field(default_factory=list)
    parameters: dict[str, float] = field(default_factory=dict)
    oddities: list[str] = field(default_factory=list)

    @property
    def duration(self) -> float:
        """Log time from the first entry to the last, in s."""
        return self.end - self.start

    @property
    def learnt(self) -> bool:
        """The log is of a run in which something was learnt."""
        return bool(self.generations or self.trials)


def gather(path: Path, limits: ReadLimits = ReadLimits()) -> RunData:  # noqa: B008 - frozen
    """Read a log.

    Args:
        path: The log.
        limits: What it may unpack to.

    Returns:
        What there is in it, up to damage.

    Raises:
        LogError: It cannot be opened, is not a log, or nothing of it could be read.
    """
    reader = LogReader(path, limits)
    gatherer = _Gatherer(path)
    for entry in reader.entries(leave_out=SKIPPED, unread=UNREAD):
        gatherer.take(entry)
    reader.require_something()
    data = gatherer.finish()
    if not data.learnt and not data.bouts:
        data.sensors = _sensors(LogReader(path, limits), gatherer.robot.system, gatherer.wheels)
    data.metadata, data.health = reader.metadata, reader.health()
    data.whole = reader.whole
    told = {**_numbers(reader.metadata.get("robot", {})), **data.parameters}
    data.parameters = {**{parameter.name: parameter.default for parameter in JUNIOR_PARAMETERS}, **told} if told else {}
    return data


def _numbers(values: dict[str, str]) -> dict[str, float]:
    found = {}
    for name, text in values.items():
        try:
            found[name] = float(text)
        except ValueError:
            continue  # the record also says who the robot is
    return found


class _Gatherer:
    """Takes a log's entries in order."""

    def __init__(self, path: Path) -> None:
        self._data = RunData(path)
        self._watcher = LinkWatcher()
        self._span: tuple[float, float] | None = None
        self._series = ""
        self._bout: list[RefereeState] = []
        self._bout_used = 0
        self._advice = ""
        self._odd: Counter[str] = Counter()
        self.wheels: list[tuple[float, JuniorWheels]] = []
        self.robot = Protagonist()

    def take(self, entry: LogEntry) -> None:
        """Take the next entry."""
        first, last = self._span or (entry.time, entry.time)
        self._span = min(first, entry.time), max(last, entry.time)
        value = entry.value
        if value is None or isinstance(value, Message):
            self._message(value, entry)
        elif isinstance(value, WireBytes):
            quality = self._watcher.quality
            if value.direction == "rx":
                quality.bytes_received += len(value.data)
            else:
                quality.bytes_sent += len(value.data)
        elif isinstance(value, RejectedInput):
            self._watcher.rejected(value.reason, entry.time)
        else:
            self._record(value, entry.time)

    def _record(self, value: object, time: float) -> None:
        data = self._data
        if isinstance(value, TrialRecord):
            data.trials.append(value)
            data.trial_times.append(time)
        elif isinstance(value, StepRecord):
            data.generations.append(value)
        elif isinstance(value, AdviceRecord):
            self._advice = value.json
        elif isinstance(value, EventRecord):
            if value.kind == SERIES:
                self._end_bout()
                self._series = value.text
            else:
                data.events.append((time, value))

    def _message(self, message: Message | None, entry: LogEntry) -> None:
        if entry.sender is None:
            return
        if entry.frame is None:
            self._watcher.sent(message, entry.topic, entry.time)
            if isinstance(message, RobotSession):
                self.robot.taken(message.target_system)
            elif isinstance(message, JuniorWheels) and message.target_system == self.robot.system:
                self.wheels.append((entry.time, message))
            return
        self._watcher.received(message, entry.sender, entry.frame, entry.time)
        if entry.sender[0] == HOST_SYSTEM or not self.robot.heard(entry.sender[0]):
            return
        if isinstance(message, RefereeState):
            self._referee(message)
        elif isinstance(message, ParamValue) and message.param_id and len(self._data.parameters) < MOST_PARAMETERS:
            self._data.parameters[message.param_id] = message.param_value

    def _referee(self, state: RefereeState) -> None:
        if self._bout and (state.bout != self._bout[-1].bout or state.elapsed < self._bout[-1].elapsed):
            self._end_bout()
        if state.phase not in _PHASES:
            self._odd[f"phase {state.phase} of a bout, which this program does not know"] += 1
        if state.phase == Phase.IDLE or (state.phase == Phase.OVER and not self._bout):
            return
        if not self._bout:
            self._bout_used = len(self._data.trials)
        self._bout.append(state)
        if state.phase == Phase.OVER:
            self._end_bout()

    def _end_bout(self) -> None:
        states, self._bout = self._bout, []
        if not states:
            return
        last = states[-1]
        if last.outcome not in _OUTCOMES:
            self._odd[f"outcome {last.outcome} of a bout, which this program does not know: it counts as broken off"] += 1
        rows = np.array(
            [(state.elapsed, *state.junior, state.junior_heading, *state.opponent, state.opponent_heading) for state in states],
            dtype=np.float64,
        )
        good = np.isfinite(rows).all(axis=1) & (np.abs(rows) < FARTHEST).all(axis=1)
        if not good.all():
            self._odd["poses that are no place in an arena, left out of the pictures"] += int(np.count_nonzero(~good))
        rows = rows[good]
        self._data.bouts.append(
            BoutPath(
                number=len(self._data.bouts) + 1,
                series=self._series,
                opponent=last.opponent_code,
                outcome=BoutOutcome(last.outcome) if last.outcome in _OUTCOMES else BoutOutcome.UNDECIDED,
                duration=last.elapsed,
                used=self._bout_used,
                times=rows[:, 0],
                junior=rows[:, 1:4],
                other=rows[:, 4:7],
            )
        )

    def finish(self) -> RunData:
        """What has been taken."""
        self._end_bout()
        data = self._data
        if self._advice:
            data.advice, data.oddities = read_learnt(self._advice)
        data.oddities += [f"{count:,} times: {text}." for text, count in self._odd.most_common(MOST_ODDITIES)]
        data.link = self._watcher.quality
        data.start, data.end = self._span or (0.0, 0.0)
        return data


def _sensors(reader: LogReader, system: int | None, wheels: Sequence[tuple[float, JuniorWheels]]) -> SensorTrack | None:
    entries = [(entry.time, entry.value) for entry in reader.entries([SENSORS]) if entry.sender and entry.sender[0] == system]
    readings = [(time, value) for time, value in entries if isinstance(value, JuniorSensors)]
    if not readings:
        return None
    messages = [message for _, message in readings]
    return SensorTrack(
        times=np.array([time for time, _ in readings]),
        eye=np.array([message.eye for message in messages], dtype=np.float64),
        floor=np.array([message.floor for message in messages], dtype=np.float64),
        battery=np.array([message.battery for message in messages], dtype=np.float64),
        flags=np.array([message.flags for message in messages], dtype=np.int64),
        wheel_times=np.array([time for time, _ in wheels]),
        wheels=np.array([(*message.speed, message.duration) for _, message in wheels], dtype=np.float64).reshape(-1, 3),
    )
