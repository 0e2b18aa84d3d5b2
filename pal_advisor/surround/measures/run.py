"""What is told of a whole run, beside what chapters 7 and 8 of Liu & Wu 2001 claim."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from pal_advisor.fields import Fields
from pal_advisor.surround.measures.steps import dominance, settle_step

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pal_advisor.surround.measures.tracker import RunTracker
    from pal_advisor.surround.tables import StimulusRecord, Tables

NEAR: Final = 2
"""STIMULUS2: one of the other class near. Of its weights 8.8 says that two behaviours dominate."""
DIGITS: Final = 6
"""Decimal places that are told."""
Shares = tuple[float | None, float | None]


@dataclass(frozen=True)
class RunMeasures:
    """What is told of a run; of both classes, RANGERs first.

    Attributes:
        pushed: How often a WILD was pushed by RANGERs together: one for each such WILD and step (7.2.2.3).
        periodic: Share of the robots that have moved to and fro (8.6); None where there is none.
        macro_stable: First steps of the spans in which the swarm was stable in the large and not in its members (8.7).
        dominance: Share of the two largest weights of the RANGERs' STIMULUS2 (8.8); None where it was not met.
        stimuli_met: How many different stimuli were met (8.2).
        settle_step: The step from which on D stays near its last value (8.4); None where D is not always known.
        weights: Least and greatest weight seen of learnt vectors (8.3); None where all have always been uniform, as rule RE
            has it of long range (8.1).
        with_zero: Share of the learnt vectors that have a 0 at the end (8.3); None where nothing is learnt.
    """

    pushed: int
    periodic: Shares
    macro_stable: tuple[int, ...]
    dominance: float | None
    stimuli_met: tuple[int, int]
    settle_step: int | None
    weights: tuple[tuple[float, float] | None, tuple[float, float] | None]
    with_zero: Shares

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "pushed": self.pushed,
            "periodic": _by_class([_rounded(share) for share in self.periodic]),
            "macro_stable": list(self.macro_stable),
            "dominance": _rounded(self.dominance),
            "stimuli_met": _by_class(self.stimuli_met),
            "settle_step": self.settle_step,
            "weights": _by_class([None if seen is None else [_rounded(weight) for weight in seen] for seen in self.weights]),
            "uniform": _by_class([seen is None for seen in self.weights]),
            "with_zero": _by_class([_rounded(share) for share in self.with_zero]),
        }

    @classmethod
    def from_dict(cls, data: object) -> RunMeasures:
        """The inverse of `to_dict`.

        Args:
            data: What it gave.

        Raises:
            FieldError: A field is missing, unknown or wrong; it says which.
        """
        fields = Fields(data)
        pushed, periodic = fields.integer("pushed"), _shares(fields, "periodic")
        spans = fields.elements("macro_stable")
        settled = fields.take("settle_step") if fields.peek("settle_step") is None else fields.integer("settle_step")
        dominant = fields.take("dominance") if fields.peek("dominance") is None else fields.number("dominance", 0.0, 2.0)
        met, weights = fields.table("stimuli_met"), fields.table("weights")
        fields.take("uniform")
        measures = cls(
            pushed,
            periodic,
            tuple(spans.integer(path) for path in spans.names),
            dominant,
            (met.integer("ranger"), met.integer("wild")),
            settled,
            (_pair(weights, "ranger"), _pair(weights, "wild")),
            _shares(fields, "with_zero"),
        )
        fields.done()
        return measures


def measures_of(tracker: RunTracker, distance: Sequence[float | None], tables: Tables) -> RunMeasures:
    """What is told of a run.

    Args:
        tracker: Has followed it.
        distance: D at the start and after every step.
        tables: What was learnt by its end.
    """
    near = tables.rangers.get(NEAR)
    records = [list(tables.of(kind).values()) for kind in RobotClass]
    met_rangers, met_wilds = (sum(record.met > 0 for record in of_class) for of_class in records)
    rangers, wilds = tracker.weights
    zero_rangers, zero_wilds = map(_share_with_zero, records)
    return RunMeasures(
        pushed=tracker.pushed,
        periodic=tracker.periodic,
        macro_stable=tuple(tracker.macro_stable),
        dominance=None if near is None else dominance(np.array(near.weights)),
        stimuli_met=(met_rangers, met_wilds),
        settle_step=None if None in distance else settle_step(np.array(distance, dtype=np.float64)),
        weights=(rangers, wilds),
        with_zero=(zero_rangers, zero_wilds),
    )


def _share_with_zero(records: Sequence[StimulusRecord]) -> float | None:
    feasible = [[weight for weight in record.weights if weight >= 0.0] for record in records]
    learnt = [weights for weights in feasible if any(weight != 1.0 / len(weights) for weight in weights)]
    return sum(0.0 in weights for weights in learnt) / len(learnt) if learnt else None


def _by_class(values: Sequence[Any]) -> dict[str, Any]:
    return {kind.name.lower(): value for kind, value in zip(RobotClass, values, strict=True)}


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, DIGITS)


def _shares(fields: Fields, name: str) -> Shares:
    table = fields.table(name)
    rangers, wilds = (
        table.take(each) if table.peek(each) is None else table.number(each, 0.0, 1.0) for each in ("ranger", "wild")
    )
    table.done()
    return rangers, wilds


def _pair(fields: Fields, name: str) -> tuple[float, float] | None:
    if fields.peek(name) is None:
        fields.take(name)
        return None
    pair = fields.elements(name)
    if len(pair.names) != 2:
        raise fields.wrong(name, "expected two weights")
    low, high = (pair.number(path, 0.0, 1.0) for path in pair.names)
    return low, high
