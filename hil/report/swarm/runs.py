"""The runs of the surround task in a log, as arrays: nothing but what `/surround/state` tells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.errors import HilError
from hil.doors import DocumentError, parse_json
from hil.statistics import Z95
from pal_advisor.fields import FieldError
from pal_advisor.surround import Case, CaseError, Tables
from pal_advisor.surround.measures import RunMeasures
from pal_advisor.surround.places import AREA

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from firmware_protocol.vocabulary import RobotClass
    from hil.mcaplog.records import SurroundStateRecord
    from hil.report.run_data import RunData

MOST_STEP: Final = 10_000_000
MOST_TABLES: Final = 60
"""So many times that tables were told of are drawn."""
FARTHEST: Final = 1e4
"""Places farther away than this, in units, are none; areas and robots are no larger."""
MOST_COUNT: Final = 1e6
"""No class has more robots."""
BODY: Final = 0.1
"""Radius of a robot, in units, where a log has none that makes sense."""


class StepsError(HilError):
    """A log has no such steps."""


@dataclass(frozen=True)
class SurroundRun:
    """One run, or some steps of it.

    Attributes:
        seed: Its seed.
        states: How it stood, step by step, in order; at least one.
        before: How it stood before those that were chosen.
    """

    seed: int
    states: tuple[SurroundStateRecord, ...]
    before: tuple[SurroundStateRecord, ...] = ()

    @property
    def steps(self) -> list[int]:
        """Numbers of the steps."""
        return [state.step for state in self.states]

    @property
    def tables(self) -> str:
        """What was learnt, as JSON, as it was told last; empty where it was not."""
        return next((state.tables for state in reversed((*self.before, *self.states)) if state.tables), "")

    @cached_property
    def learnt(self) -> tuple[tuple[int, Tables], ...]:
        """What was known, and after which step, as far as it can be read: from the last time before the first step on."""
        told = [state for state in self.states if state.tables]
        if not told or told[0].step > self.states[0].step:
            told = [*[state for state in self.before if state.tables][-1:], *told]
        few = sorted({round(index) for index in np.linspace(0, len(told) - 1, MOST_TABLES).tolist()}) if told else []
        read = ((told[index].step, _tables(told[index].tables)) for index in few)
        return tuple((step, tables) for step, tables in read if tables is not None)

    @property
    def measures(self) -> RunMeasures | None:
        """What is told of the run as a whole, as it was told last; None where it was not, or can't be read."""
        text = next((state.measures for state in reversed((*self.before, *self.states)) if state.measures), "")
        try:
            return RunMeasures.from_dict(parse_json(text)) if text else None
        except (FieldError, DocumentError):
            return None

    @property
    def wall(self) -> bool:
        """There is a wall around the area."""
        try:
            return Case.parse(self.states[0].case).wall
        except CaseError:
            return False

    @property
    def area(self) -> tuple[float, float]:
        """Sides of the area; the book's where a log has none that make sense."""
        sides = self.states[0].area
        return (sides[0], sides[1]) if len(sides) == 2 and all(0.0 < side <= FARTHEST for side in sides) else AREA

    @property
    def body(self) -> float:
        """Radius of a robot."""
        return self.states[0].body if 0.0 < self.states[0].body <= FARTHEST else BODY

    def series(self, name: str) -> list[float]:
        """What was measured.

        Args:
            name: Which, as `distance`.

        Returns:
            A number for each state; NaN where there was none.
        """
        return [math.nan if (value := getattr(state, name)) is None else value for state in self.states]

    def counts(self, kind: RobotClass, what: str) -> NDArray[np.float64]:
        """How many robots met each stimulus, or performed each behaviour.

        Args:
            kind: The class.
            what: `stimuli` or `behaviours`.

        Returns:
            A row for each state but the start, in which nobody does anything, shape (T, kinds).
        """
        rows = [getattr(state, f"{kind.name.lower()}_{what}") for state in self.moved]
        width = min(map(len, rows), default=0)
        counts = np.array([row[:width] for row in rows], dtype=np.float64).reshape(len(rows), width)
        return np.clip(counts, 0.0, MOST_COUNT)

    @property
    def moved(self) -> tuple[SurroundStateRecord, ...]:
        """The states but the start."""
        return tuple(state for state in self.states if state.step > 0)

    def positions(self, kind: RobotClass, states: Sequence[SurroundStateRecord]) -> NDArray[np.float64]:
        """Where the robots of a class were.

        Args:
            kind: The class.
            states: At which of the states.

        Returns:
            Positions, shape (states, robots, 2); NaN where nobody knows, or what is told is no place.
        """
        rows = [getattr(state, f"{kind.name.lower()}_positions") for state in states]
        robots = min((len(row) // 2 for row in rows), default=0)
        found = np.array([row[: 2 * robots] for row in rows], dtype=np.float64).reshape(len(rows), robots, 2)
        nowhere = ~(np.abs(found) <= FARTHEST).all(axis=2)
        found[nowhere] = np.nan
        return found

    def between(self, first: int, last: int | None) -> SurroundRun | None:
        """Some steps of the run.

        Args:
            first: The first.
            last: The last; None: to the end.

        Returns:
            The run, cut; None where it has none of these steps.
        """
        states = tuple(state for state in self.states if first <= state.step and (last is None or state.step <= last))
        before = tuple(state for state in self.states if state.step < first)
        return SurroundRun(self.seed, states, before) if states else None


def surround_runs(data: RunData) -> list[SurroundRun]:
    """The runs in a log, in order, or those steps of them that are chosen; steps that are no such numbers are left out.

    Args:
        data: The log.
    """
    found: list[list[SurroundStateRecord]] = []
    for state in data.surround:
        if not 0 <= state.step <= MOST_STEP:
            continue
        if not found or state.step <= found[-1][-1].step or state.seed != found[-1][-1].seed:
            found.append([])
        found[-1].append(state)
    runs = [SurroundRun(states[0].seed, tuple(states)) for states in found]
    if data.steps is None:
        return runs
    return [cut for run in runs if (cut := run.between(*data.steps)) is not None]


def see_steps(data: RunData) -> None:
    """See that a log has those steps that are chosen, if any are.

    Args:
        data: The log.

    Raises:
        StepsError: It has none of them.
    """
    if data.steps is None or surround_runs(data):
        return
    last = max((state.step for state in data.surround if 0 <= state.step <= MOST_STEP), default=None)
    if last is None:
        raise StepsError(f"{data.path} has no run of the surround task: steps can't be chosen of anything else")
    raise StepsError(f"{data.path} has steps 0 to {last}, and none of those that were chosen")


def across(rows: Sequence[Sequence[float] | NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean of several runs, and half of its 95 % interval, as far as all of them go.

    Args:
        rows: What was measured in each, along the first axis.

    Returns:
        Both; the interval of one run is 0.
    """
    least = min(len(row) for row in rows)
    values = np.array([np.asarray(row, dtype=np.float64)[:least] for row in rows])
    half = np.zeros(values.shape[1:]) if len(values) < 2 else Z95 * values.std(axis=0, ddof=1) / math.sqrt(len(values))
    return values.mean(axis=0), half


def _tables(text: str) -> Tables | None:
    try:
        return Tables.from_dict(parse_json(text))
    except (FieldError, DocumentError):
        return None
