"""All that a report tells of a log, gathered."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from firmware_protocol.messages import BoutOutcome, OpponentCode
from firmware_protocol.peer.streams import STALE_INTERVALS, STALE_LEAST
from hil.report.happened.course import Course
from hil.report.link import LinkQuality

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from hil.mcaplog.records import (
        CoachedRunRecord,
        EventRecord,
        StepRecord,
        SurroundConditionRecord,
        SurroundEvaluationRecord,
        SurroundGenerationRecord,
        SurroundStateRecord,
        SwarmRoundRecord,
        TeamVerdictRecord,
        TrialRecord,
    )
    from hil.report.learnt import Learnt


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
        surround: Steps of the surround task, each run's in order, one run after the other.
        evaluations: What was evaluated for searches among conditions, in order.
        search_generations: Generations of genetic ones, in order.
        conditions: What was said of conditions when searches were over.
        steps: First and last of its steps that are shown; None for the last: to the end; None: all.
        rounds: Rounds of a swarm, in order.
        coached: Several coachings of which one advice was made, each with a log of its own, in order.
        verdicts: What their team exam found out, in order.
        advice: The advice as last recorded; None where there was none that could be read.
        bouts: Bouts, in order.
        link: How good the link was.
        sensors: What the robot sensed.
        events: Log times in s and events.
        course: What happened besides: states, emergency stops, keys.
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
    surround: list[SurroundStateRecord] = field(default_factory=list)
    evaluations: list[SurroundEvaluationRecord] = field(default_factory=list)
    search_generations: list[SurroundGenerationRecord] = field(default_factory=list)
    conditions: list[SurroundConditionRecord] = field(default_factory=list)
    steps: tuple[int, int | None] | None = None
    rounds: list[SwarmRoundRecord] = field(default_factory=list)
    coached: list[CoachedRunRecord] = field(default_factory=list)
    verdicts: list[TeamVerdictRecord] = field(default_factory=list)
    advice: Learnt | None = None
    bouts: list[BoutPath] = field(default_factory=list)
    link: LinkQuality = field(default_factory=LinkQuality)
    sensors: SensorTrack | None = None
    events: list[tuple[float, EventRecord]] = field(default_factory=list)
    course: Course = field(default_factory=Course)
    parameters: dict[str, float] = field(default_factory=dict)
    oddities: list[str] = field(default_factory=list)

    @property
    def duration(self) -> float:
        """Log time from the first entry to the last, in s."""
        return self.end - self.start

    @property
    def of_junior(self) -> bool:
        """What a Junior sensed is all that there is to tell of."""
        return not (self.learnt or self.bouts or self.surround or self.evaluations)

    @property
    def learnt(self) -> bool:
        """The log is of a run in which something was learnt."""
        return bool(self.generations or self.trials or self.coached)
