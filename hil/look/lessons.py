"""What was learnt, and how that went, gathered for a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.vocabulary import ANY_STIMULUS, RobotClass, Speed, Stimulus
from hil.doors import DocumentError, parse_json
from hil.explaining.explanation import explain
from hil.explaining.history import LearningHistory
from hil.explaining.team import TeamHistory
from hil.explaining.words import reasons, runner_up
from hil.look.scene import LearningCurves, LearntManeuver, LearntStep
from hil.mcaplog.records import (
    AdviceRecord,
    CoachedRunRecord,
    StepRecord,
    SurroundGenerationRecord,
    SurroundStateRecord,
    TrialRecord,
)
from hil.report.learnt import Learnt, read_learnt
from hil.sumo.team import LATELY, shares_won
from pal_advisor.surround import Tables, TablesError, rules

if TYPE_CHECKING:
    from firmware_protocol.vocabulary import Action
    from hil.explaining.explanation import Explanation
    from hil.look.scene import Scene
    from hil.mcaplog.reading.reader import LogEntry
    from pal_advisor.maneuvers import Pal

TOPICS: Final = ("/pal/generation", "/pal/trial", "/pal/advice", "/surround/state", "/surround/generation")
SHARES: Final = {Speed.NONE: 0.0, Speed.FAST: 1.0, Speed.MODERATE: 0.7, Speed.SLOW: 0.4, Speed.TURN: 0.5}
"""How fast a wheel is drawn; the robot's parameters say how fast it turns."""
MOST_CURVES: Final = 16
MOST_RULES: Final = 4
"""Situations of each class of a swarm that are told of."""
GREATEST: Final = 1e8
"""Numbers farther from 0 are none that a learner counts."""
SEEN: Final = ("When no eye sees it", "When the left eye sees it", "When the right eye sees it", "When both eyes see it")
TOUCHED: Final = ("", ", left arm touching", ", right arm touching", ", both arms touching")


class LearningPart:
    """Takes the entries of a log that a learner has left.

    Attributes:
        trials: Maneuvers performed for it.
        coached: Several coachings that the log tells of.
    """

    def __init__(self) -> None:
        self.trials = 0
        self._history = LearningHistory()
        self._team = TeamHistory()
        self.coached: list[CoachedRunRecord] = []
        self._steps: list[StepRecord] = []
        self._fitness: list[float] = []
        self._advice = ""
        self._surround: list[SurroundStateRecord] = []
        self._searched: list[SurroundGenerationRecord] = []

    def take(self, entry: LogEntry) -> None:
        """Take an entry."""
        value = entry.value
        self._history.take(entry)
        self._team.take(entry)
        if isinstance(value, StepRecord):
            self._steps.append(value)
        elif isinstance(value, TrialRecord):
            self.trials += 1
            self._fitness.append(value.fitness)
        elif isinstance(value, CoachedRunRecord):
            self.coached.append(value)
        elif isinstance(value, AdviceRecord):
            self._advice = value.json
        elif isinstance(value, SurroundStateRecord):
            self._surround.append(value)
        elif isinstance(value, SurroundGenerationRecord):
            self._searched.append(value)

    def put(self, scene: Scene, pal: Pal | None = None) -> None:
        """Put what was gathered into a scene.

        Args:
            scene: The scene.
            pal: The learner of maneuvers as it was at the end; None where nobody knows, and nothing is explained.
        """
        if self._advice:
            learnt, odd = read_learnt(self._advice)
            scene.notes += odd
            entries = sorted((learnt or Learnt()).entries, key=lambda entry: (entry.current, entry.previous))
            team = self._team.explain(entries) if self._team.members else None
            scene.lessons += [_lesson(one) for one in team or explain(entries, pal, self._history)]
        by_maneuvers = self._by_maneuvers()
        if by_maneuvers.labels:
            scene.curves.append(by_maneuvers)
        if len(self._fitness) > 1:
            scene.curves.append(_trials(self._fitness))
        if (of_runs := _of_runs(self.coached)).labels:
            scene.curves.append(of_runs)
        scene.curves += _surround(self._surround)
        if len(self._searched) > 1:
            scene.curves.append(_search(self._searched))
        tables = next((state.tables for state in reversed(self._surround) if state.tables), "")
        if tables:
            found, odd = rules_of(tables)
            scene.lessons += found
            scene.notes += odd

    def _by_maneuvers(self) -> LearningCurves:
        """Best fitness of each category against the maneuvers performed."""
        found: dict[str, list[StepRecord]] = {}
        for step in sorted((one for one in self._steps if 0 <= one.used <= GREATEST), key=lambda one: one.used):
            before = "" if step.previous == "any" else f", before: {step.previous}"
            found.setdefault(f"{step.current}{before}", []).append(step)
        names = sorted(found, key=lambda name: -len(found[name]))[:MOST_CURVES]
        x = tuple(np.array([step.used for step in found[name]], dtype=np.float64) for name in names)
        y = tuple(np.array([step.best for step in found[name]], dtype=np.float64) for name in names)
        labels = tuple(f"eyes: {name}" for name in names)
        return LearningCurves("Best fitness of each situation", "", "maneuvers performed", labels, x, y)


def _of_runs(runs: list[CoachedRunRecord]) -> LearningCurves:
    """How often each of several runs won while it learnt."""
    found = [(f"run {run.number}", *shares_won(run.bouts, run.outcomes)) for run in runs[:MOST_CURVES]]
    found = [curve for curve in found if len(curve[1])]
    labels, x, y = (tuple(part) for part in zip(*found, strict=True)) if found else ((), (), ())
    return LearningCurves(f"Share of the last {LATELY} bouts won while learning", "", "bouts of the run", labels, x, y)


def _trials(fitness: list[float]) -> LearningCurves:
    """What the trials were worth on the average."""
    values = np.clip(np.nan_to_num(np.array(fitness, dtype=np.float64)), -GREATEST, GREATEST)
    over = min(len(values), max(10, len(values) // 20))
    summed = np.concatenate(([0.0], np.cumsum(values)))
    mean = (summed[over:] - summed[:-over]) / over
    x = np.arange(over, len(values) + 1, dtype=np.float64)
    return LearningCurves("Fitness of what was tried", "", "maneuvers performed", (f"mean of the last {over}",), (x,), (mean,))


def _surround(states: list[SurroundStateRecord]) -> list[LearningCurves]:
    runs: list[list[SurroundStateRecord]] = []
    for state in states:
        if not runs or state.seed != runs[-1][-1].seed or state.step <= runs[-1][-1].step:
            runs.append([])
        runs[-1].append(state)
    runs = [run for run in runs if len(run) > 1][:MOST_CURVES]
    if len(runs) < 2:  # one is a curve over time already
        return []
    x = tuple(np.array([state.step for state in run], dtype=np.float64) for run in runs)
    found = []
    for field, name, unit in (
        ("distance", "Mean distance from a RANGER to the nearest WILD", "units"),
        ("share_surrounded", "Share of WILDs that are surrounded", ""),
    ):
        y = tuple(np.array([_or_none(getattr(state, field)) for state in run]) for run in runs)
        labels = tuple(f"seed {run[0].seed}" for run in runs)
        found.append(LearningCurves(name, unit, "steps", labels, x, y))
    return found


def _search(generations: list[SurroundGenerationRecord]) -> LearningCurves:
    """How a search among conditions went."""
    rows = sorted((one.number, one.best, one.mean) for one in generations if 0 <= one.number <= GREATEST)
    x, best, mean = np.array(rows, dtype=np.float64).reshape(-1, 3).T
    return LearningCurves("Fitness of the conditions searched", "", "generation", ("best", "mean"), (x, x), (best, mean))


def _or_none(value: float | None) -> float:
    return np.nan if value is None else value


def _why(one: Explanation) -> tuple[str, ...]:
    """Why it is this maneuver, and what came next."""
    return (*reasons(one), *(f"Next: {runner_up(rival)}." for rival in one.rivals)) if one.known or one.run else ()


def _lesson(one: Explanation) -> LearntManeuver:
    entry = one.entry
    before = "" if entry.previous == ANY_STIMULUS else f" (before: {Stimulus(entry.previous).label})"
    when = SEEN[entry.current & 3] + TOUCHED[entry.current >> 2 & 3] + before
    steps = tuple(step_of(action) for action in entry.actions)
    times = "once" if entry.evaluations == 1 else f"{entry.evaluations:,} times"
    return LearntManeuver(when, steps, entry.in_words, f"worth {entry.fitness:.2f}, tried {times}", _why(one))


def rules_of(text: str) -> tuple[list[LearntManeuver], list[str]]:
    """What a swarm has learnt for the situations that it met most.

    Args:
        text: Its tables, as they were recorded.

    Returns:
        It, and what can't be read, in words.
    """
    try:
        tables = Tables.from_dict(parse_json(text))
    except (TablesError, DocumentError) as error:
        return [], [f"What was learnt can't be read: {error}."]
    found = []
    for kind in RobotClass:
        for rule in [one for one in rules(tables, kind) if one.met][:MOST_RULES]:
            situation, _, does = rule.words.partition(": ")
            times = "once" if rule.met == 1 else f"{rule.met:,} times"
            found.append(LearntManeuver(f"A {kind.name}: {situation}", (), does, f"weight {rule.weight:.2f}, met {times}"))
    return found, []


def step_of(action: Action) -> LearntStep:
    """An action as it is drawn.

    Args:
        action: The action.
    """
    spec = action.spec
    share = SHARES[spec.speed]
    return LearntStep(action.name, spec.meaning, spec.left * share, spec.right * share)
