"""Collects what a report tells, of a log that is read, whole or cut off, or of one that is being written."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import (
    HOST_SYSTEM,
    BoutOutcome,
    JuniorSensors,
    JuniorWheels,
    ParamValue,
    Phase,
    RefereeState,
    RobotSession,
)
from firmware_protocol.parameters import JUNIOR_PARAMETERS
from firmware_protocol.wire.fields import Message
from hil.mcaplog.errors import UnreadableLogError
from hil.mcaplog.limits import ReadLimits
from hil.mcaplog.reading.reader import LogEntry, LogReader
from hil.mcaplog.records import (
    RECORDS,
    SERIES,
    AdviceRecord,
    BridgeOpening,
    BridgeStep,
    CoachedRunRecord,
    EventRecord,
    RejectedInput,
    StepRecord,
    SurroundConditionRecord,
    SurroundEvaluationRecord,
    SurroundGenerationRecord,
    SurroundStateRecord,
    SwarmRoundRecord,
    TeamVerdictRecord,
    TrialRecord,
    WireBytes,
)  # fmt: skip
from hil.mcaplog.writing.joints import PLOTS
from hil.questions import ASKED
from hil.recording.protagonist import Protagonist
from hil.report.happened.course import TELLING, of_the_operator
from hil.report.learnt import read_learnt
from hil.report.link import HEARD, LinkWatcher
from hil.report.report_table import counted, shortened
from hil.report.run_data import BoutPath, RunData, SensorTrack

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from hil.bridge.operator import OperatorInput
    from hil.report.link import Frame

STEPS: Final = "/bridge/step"
SKIPPED: Final = frozenset({"/tf", "/log", "/arena/scene", "/junior/joints", *PLOTS})
"""Topics that tell a report nothing it does not know otherwise: `/log` says again what events and robots say."""
SENSORS: Final = "/junior/sensors"
UNREAD: Final = frozenset({SENSORS, "/mavlink/sys_status", "/mavlink/command_ack"})
"""Topics of which only the frames are counted at first; the sensors are read where there is nothing else to report on."""

TOLD: Final[frozenset[type[Message]]] = HEARD | TELLING | {ParamValue, RefereeState}
"""What is to be known of a robot's messages, but for who has sent the first one."""
FARTHEST: Final = 1e4
"""Places farther away than this, in m, are none, and times longer, in s."""
MOST_TOPICS: Final = 8
"""Topics of somebody else's log that are named."""
MOST_PARAMETERS: Final = 500
MOST_ODDITIES: Final = 20
_KEPT: Final[dict[type, str]] = {
    TrialRecord: "trials", StepRecord: "generations", SurroundStateRecord: "surround", SurroundEvaluationRecord: "evaluations",
    SurroundGenerationRecord: "search_generations", SurroundConditionRecord: "conditions", SwarmRoundRecord: "rounds",
    CoachedRunRecord: "coached", TeamVerdictRecord: "verdicts",
}  # fmt: skip
"""Records that are kept as they are, and under which name."""
_PHASES: Final = frozenset(Phase)
_OUTCOMES: Final = frozenset(BoutOutcome)


class ForeignLogError(UnreadableLogError):
    """There is nothing in a log that this program has written.

    Args:
        path: The log.
        topics: What it holds instead: how many entries of each topic.
    """

    def __init__(self, path: Path, topics: Counter[str]) -> None:
        named = [
            f"{shortened(topic, 80)} ({counted(count, 'entry', 'entries')})" for topic, count in topics.most_common(MOST_TOPICS)
        ]
        more = f", and {counted(len(topics) - MOST_TOPICS, 'topic', 'topics')} more" if len(topics) > MOST_TOPICS else ""
        super().__init__(
            f"there is nothing to report of {path}: nothing in it was recorded by hil. It holds {', '.join(named)}{more}. "
            f"hil log info {path} says more"
        )


def gather(path: Path, limits: ReadLimits = ReadLimits()) -> RunData:  # noqa: B008 - frozen
    """Read a log.

    Args:
        path: The log.
        limits: What it may unpack to.

    Returns:
        What there is in it, up to damage.

    Raises:
        LogError: It cannot be opened, is not a log, nothing of it could be read, or it is somebody else's.
    """
    reader = LogReader(path, limits)
    gatherer = Gatherer(path)
    foreign = Counter[str]()
    ours = False
    for entry in reader.entries(leave_out=SKIPPED, unread=UNREAD, only={STEPS: of_the_operator}):
        ours = ours or entry.sender is not None or isinstance(entry.value, RECORDS)
        if not ours:
            foreign[entry.topic] += 1
        gatherer.take(entry)
    reader.require_something()
    if foreign and not ours:
        raise ForeignLogError(path, foreign)
    return gatherer.finish(reader)


def _numbers(values: dict[str, str]) -> dict[str, float]:
    found = {}
    for name, text in values.items():
        try:
            found[name] = float(text)
        except ValueError:
            continue  # the record also says who the robot is
    return found


class Gatherer:
    """Takes what a log holds, in order: its entries, or what they are made of, as it is recorded.

    Args:
        path: The log.
    """

    def __init__(self, path: Path) -> None:
        self._data = RunData(path)
        self._watcher = LinkWatcher()
        self._first, self._last = math.inf, -math.inf
        self._series = ""
        self._bout: list[RefereeState] = []
        self._bout_used = 0
        self._advice = ""
        self._odd: Counter[str] = Counter()
        self.wheels: list[tuple[float, JuniorWheels]] = []
        self.robot = Protagonist()

    def take(self, entry: LogEntry) -> None:
        """Take the next entry of a log that is read."""
        value, sender = entry.value, entry.sender
        if value is None or isinstance(value, Message):
            if sender is None:
                self._seen(entry.time)
            elif entry.frame is None:
                self.sent(value, entry.topic, entry.time)
            else:
                self.came([(sender, entry.frame, entry.time)])
                self.received(value, sender, entry.time)
        elif isinstance(value, WireBytes):
            self.wire(value.direction, len(value.data), entry.time)
        else:
            self.record(value, entry.time)

    def _seen(self, time: float) -> None:
        """There is something of a log time, in s."""
        self._last = max(self._last, time)
        self._first = min(self._first, time)

    def wire(self, direction: str, size: int, time: float) -> None:
        """Bytes went over the link.

        Args:
            direction: `rx` or `tx`.
            size: How many.
            time: Log time in s.
        """
        self._seen(time)
        if direction == "rx":
            self._watcher.quality.bytes_received += size
        else:
            self._watcher.quality.bytes_sent += size

    def record(self, value: object, time: float) -> None:
        """Something else was recorded.

        Args:
            value: One of `hil.mcaplog.records`, or what another program has written.
            time: Log time in s.
        """
        self._seen(time)
        data = self._data
        kept = _KEPT.get(type(value))
        if kept is not None:
            getattr(data, kept).append(value)
            if kept == "trials":
                data.trial_times.append(time)
        elif isinstance(value, AdviceRecord):
            self._advice = value.json
        elif isinstance(value, BridgeStep):
            data.course.asked(time, value.inputs, value.input_robots)
        elif isinstance(value, BridgeOpening):
            data.course.networks += 1
        elif isinstance(value, RejectedInput):
            self._watcher.rejected(value.reason, time)
        elif isinstance(value, EventRecord):
            if value.kind == SERIES:
                self._end_bout()
                self._series = value.text
                data.course.chapters.append((time, value.text))
            else:
                data.course.questioned |= value.kind == ASKED
                data.events.append((time, value))

    def asked(self, inputs: Sequence[OperatorInput], time: float) -> None:
        """The operator asked for something in a step of the bridge.

        Args:
            inputs: For what.
            time: Log time in s.
        """
        self._data.course.asked(time, [one.what for one in inputs], [one.robot for one in inputs])

    def sent(self, message: Message | None, topic: str, time: float) -> None:
        """A message was sent.

        Args:
            message: The message; None where it was not read.
            topic: Its topic.
            time: Log time in s.
        """
        self._seen(time)
        self._watcher.sent(message, topic, time)
        self._data.course.sent(message, time)
        if isinstance(message, RobotSession):
            self.robot.taken(message.target_system)
        elif isinstance(message, JuniorWheels) and message.target_system == self.robot.system:
            self.wheels.append((time, message))

    def came(self, frames: Sequence[Frame]) -> None:
        """Good frames came.

        Args:
            frames: Them, in order.
        """
        for _, _, time in frames:
            self._seen(time)
        self._watcher.came(frames)

    def received(self, message: Message | None, sender: tuple[int, int], time: float) -> None:
        """A good frame held a message.

        Args:
            message: It; None where it was not read.
            sender: System and component.
            time: Log time in s.
        """
        self._watcher.received(message, time)
        self._data.course.received(message, sender, time)
        if sender[0] == HOST_SYSTEM or not self.robot.heard(sender[0]):
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

    def so_far(self, metadata: dict[str, dict[str, str]]) -> RunData:
        """What has been taken until now, as it stands; what is taken later does not change it.

        Args:
            metadata: What the log's metadata records say.
        """
        data = self._data
        copy = replace(
            data,
            metadata=metadata,
            generations=list(data.generations),
            trials=list(data.trials),
            trial_times=list(data.trial_times),
            bouts=list(data.bouts),
            surround=list(data.surround),
            rounds=list(data.rounds),
            events=list(data.events),
            parameters=_parameters(metadata, data.parameters),
        )
        if self._advice:
            copy.advice, copy.oddities = read_learnt(self._advice)
        return copy

    def finish(self, reader: LogReader) -> RunData:
        """All that has been taken, nothing coming any more.

        Args:
            reader: The log, which has been read.

        Raises:
            LogError: It can't be read again, where nothing but the sensors is left to tell of.
        """
        self._end_bout()
        data = self._data
        if self._advice:
            data.advice, data.oddities = read_learnt(self._advice)
        data.oddities += [f"{count:,} times: {text}." for text, count in self._odd.most_common(MOST_ODDITIES)]
        data.link = self._watcher.quality
        data.start, data.end = (self._first, self._last) if self._first <= self._last else (0.0, 0.0)
        if data.of_junior:
            data.sensors = _sensors(LogReader(data.path, reader.limits), self.robot.system, self.wheels)
        data.metadata, data.health, data.whole = reader.metadata, reader.health(), reader.whole
        data.parameters = _parameters(reader.metadata, data.parameters)
        return data


def _parameters(metadata: dict[str, dict[str, str]], told: dict[str, float]) -> dict[str, float]:
    """The robot's parameters; none where nothing is known of any."""
    found = {**_numbers(metadata.get("robot", {})), **told}
    return {**{parameter.name: parameter.default for parameter in JUNIOR_PARAMETERS}, **found} if found else {}


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
