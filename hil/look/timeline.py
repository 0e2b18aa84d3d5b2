"""What is true of any run, gathered for a scene: its events, what the operator asked for, what state a robot was in."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import HOST_SYSTEM, Heartbeat, RobotAck, Statustext
from firmware_protocol.messages.robot import AckResult, Reason, State
from hil.bridge.operator import KEY, POSE
from hil.look.scene import DECISION, Lane, Mark, TimeCurves
from hil.mcaplog.records import BridgeStep, DecisionRecord, EventRecord, UnsentBytes
from hil.operator_words import INPUTS, key_words
from hil.questions import ASKED

if TYPE_CHECKING:
    from hil.look.scene import Scene
    from hil.mcaplog.reading.reader import LogEntry

TOPICS: Final = (
    "/events", "/bridge/step", "/wire/unsent", "/mavlink/heartbeat", "/mavlink/statustext", "/robot/ack", "/pal/decision",
)  # fmt: skip
MOST_MARKS: Final = 20_000
"""Of one kind; events beyond are counted."""
MOST_LANES: Final = 4
"""Robots whose states are shown one by one; of more it is counted how many are in which."""
SILENCE: Final = 3.0
"""A state counts until the next word of it, for this long in s at most."""
TONES: Final = {
    State.DISARMED: "quiet", State.READY: "even", State.DRIVING: "busy", State.PERFORMING: "busy", State.COUNTDOWN: "even",
    State.CONTEST: "busy", State.STOPPED: "bad",
}  # fmt: skip
MEANINGS: Final = {
    State.DISARMED: "disarmed: its wheels never turn",
    State.READY: "ready: armed, waiting for a command",
    State.DRIVING: "driving: its wheels are told what to do",
    State.PERFORMING: "performing a maneuver",
    State.COUNTDOWN: "counting down to a contest",
    State.CONTEST: "playing a contest by itself",
    State.STOPPED: "stopped by the e-stop, until it is disarmed and armed again",
}


class Timeline:
    """Takes the entries of a log that any run may have."""

    def __init__(self) -> None:
        self._marks: list[Mark] = []
        self._of_kind: Counter[str] = Counter()
        self._questioned = False
        self._networks: dict[str, int] = {}
        self._network = 0
        self._states: dict[tuple[int, int], list[tuple[float, int]]] = {}

    def take(self, entry: LogEntry) -> None:
        """Take an entry."""
        value, time = entry.value, entry.time
        if isinstance(value, BridgeStep):
            self._step(value, time)
        elif isinstance(value, Heartbeat):
            if entry.sender is not None and entry.sender[0] != HOST_SYSTEM and entry.sender[1] == 1:
                self._states.setdefault((self._network, entry.sender[0]), []).append((time, value.custom_mode))
        elif isinstance(value, RobotAck):
            if value.result == AckResult.REFUSED and entry.sender is not None:
                why = Reason(value.reason).name.lower().replace("_", " ") if value.reason in set(Reason) else value.reason
                self._mark(time, "refused", f"robot {entry.sender[0]} refused a command: {why}")
        elif isinstance(value, EventRecord):
            self._questioned |= value.kind == ASKED
            self._mark(time, value.kind, value.text)
        elif isinstance(value, Statustext):
            self._mark(time, "robot", f"robot {entry.sender[0] if entry.sender else '?'}: {value.text}")
        elif isinstance(value, DecisionRecord):
            seen = value.current if value.previous == "any" else f"{value.current}, before: {value.previous}"
            why = f"{value.motive}; arose by: {value.origin}"
            if value.expected is not None and value.error is not None:
                why += f"; expected {value.expected:.1f} +- {value.error:.1f}"
            if value.mirrored:
                why += "; mirrored"
            self._mark(time, DECISION, f"trial {value.trial}, eyes {seen}: {value.actions} ({why})")
        elif isinstance(value, UnsentBytes):
            self._mark(time, "link", f"bytes were not taken by the link: {value.error}")

    def _step(self, step: BridgeStep, time: float) -> None:
        self._network = self._networks.setdefault(step.network, len(self._networks))
        for index, what in enumerate(step.inputs):
            if what.startswith(POSE):
                continue
            robot = step.input_robots[index] if index < len(step.input_robots) else ""
            to = f" (robot {robot})" if robot else ""
            if what.startswith(KEY):
                key = what.removeprefix(KEY)
                self._mark(time, "key", f"key: {key_words(key, questioned=self._questioned)}{to}")
            else:
                self._mark(time, "operator", INPUTS.get(what, what) + to)
        if step.lost:
            self._mark(time, "link", f"the link is lost: {step.lost}")
        if step.back:
            self._mark(time, "link", "the link is back")
        if step.ended:
            self._mark(time, "link", f"the link is gone for good: {step.ended}")
        if step.dropped:
            self._mark(time, "link", f"{step.dropped:,} bytes were given up: too many waited")

    def _mark(self, time: float, kind: str, text: str) -> None:
        self._of_kind[kind] += 1
        if self._of_kind[kind] <= MOST_MARKS:
            self._marks.append(Mark(time, kind, text))

    def put(self, scene: Scene) -> None:
        """Put what was gathered into a scene whose beginning and end are set."""
        for (network, system), told in self._states.items():
            label = f"robot {network + 1}.{system}" if len(self._networks) > 1 else f"robot {system}"
            told.sort(key=lambda one: one[0])
            scene.marks += _stops(told, label)
            if len(self._states) <= MOST_LANES:
                scene.lanes.append(_lane("State" if len(self._states) == 1 else f"State of {label}", told, scene.end))
        if len(self._states) > MOST_LANES:
            scene.traces.append(_counts(list(self._states.values())))
        scene.marks += self._marks
        scene.marks.sort(key=lambda mark: mark.time)
        for kind, count in self._of_kind.items():
            if count > MOST_MARKS:
                scene.notes.append(f"Of {count:,} events of the kind “{kind}” the first {MOST_MARKS:,} are shown.")


def _stops(told: list[tuple[float, int]], who: str) -> list[Mark]:
    """When the e-stop was engaged, and when the robot was told to go on."""
    found = []
    before = None
    for time, state in told:
        if state == State.STOPPED and before not in (None, State.STOPPED):
            found.append(Mark(time, "safety", f"{who} has stopped: its e-stop is engaged"))
        elif before == State.STOPPED and state != State.STOPPED:
            found.append(Mark(time, "safety", f"{who} is no longer stopped by its e-stop"))
        before = state
    return found


def _counts(robots: list[list[tuple[float, int]]]) -> TimeCurves:
    """How many of many robots are in which state."""
    changes: dict[int, list[tuple[float, int]]] = {}
    for told in robots:
        before = -1
        for time, state in told:
            if state != before:
                changes.setdefault(state, []).append((time, 1))
                if before >= 0:
                    changes[before].append((time, -1))
            before = state
    times = np.unique([time for made in changes.values() for time, _ in made])
    values = []
    for made in (changes[state] for state in sorted(changes)):
        when, by = np.array(sorted(made), dtype=np.float64).T
        summed = np.concatenate(([0.0], np.cumsum(by)))
        values.append(summed[np.searchsorted(when, times, side="right")])
    names = tuple(State(state).name.lower() if state in set(State) else f"state {state}" for state in sorted(changes))
    return TimeCurves("Robots in each state", "", names, times, tuple(values), stepped=True)


def _lane(name: str, told: list[tuple[float, int]], last: float) -> Lane:
    """States as stretches: where nothing is said for long there is none."""
    begins: list[float] = []
    ends: list[float] = []
    codes: list[int] = []
    for index, (time, state) in enumerate(told):
        following = told[index + 1][0] if index + 1 < len(told) else last
        until = min(following, time + SILENCE)
        if codes and codes[-1] == state and time - ends[-1] < 1e-6:
            ends[-1] = until
        else:
            begins.append(time)
            ends.append(until)
            codes.append(state)
    words = [*State]
    known = [code if code in set(State) else len(words) for code in codes]
    return Lane(
        name,
        np.array(begins),
        np.array(ends),
        np.array(known, dtype=np.float64),
        (*(state.name.lower() for state in words), "unknown"),
        (*(MEANINGS[state] for state in words), "in a state that this program does not know"),
        (*(TONES[state] for state in words), "quiet"),
    )
