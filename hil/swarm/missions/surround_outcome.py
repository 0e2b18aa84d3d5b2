"""What comes of a run of the surround task, as plain values."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from firmware_protocol.vocabulary import RobotClass
from hil.statistics import Z95
from hil.swarm.host import Absence
from hil.swarm.missions.surround_history import SERIES, SurroundHistory
from pal_advisor.fields import FieldError, Fields
from pal_advisor.surround import Case, Tables, rules
from pal_advisor.surround.stimuli import stimuli_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

DIGITS = 6
"""Decimal places of what is measured."""


@dataclass(frozen=True)
class SurroundOutcome:
    """What came of a run.

    Attributes:
        seed: Its seed.
        case: The case that was played.
        history: What was measured.
        tables: What was learnt.
        absences: Who was missing, and when.
    """

    seed: int
    case: Case
    history: SurroundHistory
    tables: Tables
    absences: tuple[Absence, ...]

    @property
    def last_share(self) -> float | None:
        """Share of WILDs that are surrounded at the last step; None where there is none."""
        return self.history.series["share_surrounded"][-1]

    def facts(self, order: str) -> dict[str, Any]:
        """As `--json` has it.

        Args:
            order: Which robots moved at once.
        """
        history = self.history
        return {
            "case": str(self.case),
            "seed": self.seed,
            "order": order,
            "steps": history.steps,
            "unit": "book",
            "robots": {"ranger": self.case.rangers, "wild": self.case.wilds},
            **{name: [_rounded(value) for value in history.series[name]] for name in SERIES},
            "stimuli": _stimuli(self.tables, RobotClass.RANGER),
            "wild_stimuli": _stimuli(self.tables, RobotClass.WILD),
            "behaviours": history.behaviours,
            "path": _rounded(history.path),
            "fitness": {str(name): _rounded(value) for name, value in history.fitness.values.items()},
            "measures": history.measures(self.tables).to_dict(),
            "missing": [{"step": one.step, "robot": one.robot, "until": one.until} for one in self.absences],
            "robot_seconds": round(history.seconds, 3),
        }

    def to_dict(self) -> dict[str, Any]:
        """As plain values, to be kept."""
        return {
            "seed": self.seed,
            "case": str(self.case),
            "history": self.history.to_dict(),
            "tables": self.tables.to_dict(),
            "missing": [[one.step, one.robot, one.until] for one in self.absences],
        }

    @classmethod
    def from_fields(cls, fields: Fields) -> SurroundOutcome:
        """The inverse of `to_dict`.

        Args:
            fields: What it gave.

        Raises:
            FieldError: A field is missing, unknown or wrong.
        """
        seed = fields.integer("seed")
        try:
            case = Case.parse(fields.text("case"))
            tables = Tables.from_dict(fields.take("tables"))
        except ValueError as error:
            raise fields.wrong("case", str(error)) from error
        history = SurroundHistory.from_fields(fields.table("history"), case, tables.sectors)
        absences = read_absences(fields)
        fields.done()
        return cls(seed, case, history, tables, absences)


def read_absences(fields: Fields) -> tuple[Absence, ...]:
    """Who was missing, of a field `missing`.

    Args:
        fields: Fields that it is one of.

    Raises:
        FieldError: It is none.
    """
    found = []
    for path, item in fields.items("missing"):
        row = Fields.row(item, ("step", "robot", "until"), path, FieldError)
        until = row.take("until") if row.peek("until") is None else row.integer("until")
        found.append(Absence(row.integer("step"), row.text("robot"), until))
    return tuple(found)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, DIGITS)


def _stimuli(tables: Tables, kind: RobotClass) -> list[dict[str, Any]]:
    """What a class has learnt, by number of the stimulus."""
    stimuli = stimuli_of(tables.sectors)
    return [
        {
            "number": rule.stimulus,
            "pattern": stimuli.text(rule.stimulus),
            "met": rule.met,
            "weights": [round(weight, DIGITS) for weight in tables.of(kind)[rule.stimulus].weights],
            "behaviour": " x ".join(f"B{behaviour}" for behaviour in rule.behaviours),
            "book": None if rule.book is None else rule.book.behaviour,
        }
        for rule in sorted(rules(tables, kind), key=lambda rule: rule.stimulus)
    ]


def over_seeds(outcomes: Sequence[SurroundOutcome]) -> dict[str, Any]:
    """Mean and 95 % interval of what several runs have measured, step by step.

    Args:
        outcomes: The runs, of equal length.

    Returns:
        `mean` and `ci95` (half its width) of `distance` and `share_surrounded`; null where a run had nothing to measure.
    """
    mean: dict[str, list[float | None]] = {}
    half: dict[str, list[float | None]] = {}
    for name in ("distance", "share_surrounded"):
        rows = np.array([outcome.history.series[name] for outcome in outcomes], dtype=np.float64)
        mean[name] = _known(rows.mean(axis=0))
        spread = rows.std(axis=0, ddof=1) if len(rows) > 1 else np.full(rows.shape[1], np.nan)
        half[name] = _known(Z95 * spread / sqrt(len(rows)))
    return {"mean": mean, "ci95": half}


def _known(values: NDArray[np.float64]) -> list[float | None]:
    return [None if np.isnan(value) else round(value, DIGITS) for value in values.tolist()]
