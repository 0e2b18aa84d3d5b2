"""Runs of the surround task made up for tests of the report: whatever is not named is plain and small."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from hil.mcaplog.records import (
    SurroundConditionRecord,
    SurroundEvaluationRecord,
    SurroundGenerationRecord,
    SurroundStateRecord,
)
from hil.mcaplog.schemas import record_schema
from hil.mcaplog.writing.encode import compile_encoder
from hil.mcaplog.writing.writer import LogWriter
from pal_advisor.surround import StimulusRecord, Tables

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

KINDS = 6
"""Stimuli of four sectors, with which these runs are made."""


def tables(rangers: Mapping[int, tuple[int, tuple[float, ...]]], wilds: Mapping[int, Any] | None = None) -> str:
    """What was learnt, as a log has it: how often a stimulus was met, and its weights, by number."""
    known = ({number: StimulusRecord(*record) for number, record in of_class.items()} for of_class in (rangers, wilds or {}))
    sectors = len(next(iter(rangers.values()))[1])
    return json.dumps(Tables(sectors, "R2W1", *known).to_dict())


def state(step: int, **changes: Any) -> SurroundStateRecord:  # noqa: ANN401 - any field
    """A state of two RANGERs and a WILD."""
    values: dict[str, Any] = {
        "seed": 1, "case": "B2C1D3L1R2S1W1", "area": (10.0, 10.0), "body": 0.1, "step": step, "steps": 20,
        "distance": 3.0 / (1 + abs(step)), "ranger_distance": 2.0, "share_surrounded": 0.0, "outside": 0.0,
        "ranger_stimuli": (2, 0, 0, 0, 0, 0) if step else (0,) * KINDS, "ranger_behaviours": (1, 1, 0, 0) if step else (0,) * 4,
        "wild_stimuli": (0,) * KINDS, "wild_behaviours": (0,) * 4,
        "ranger_positions": (-4.0 + 0.1 * step, 1.0, 4.0 - 0.1 * step, 2.0), "wild_positions": (0.0, 0.0),
        "tables": "", "measures": "", "digest": "",
    }  # fmt: skip
    return SurroundStateRecord(**{**values, **changes})


def evaluation(number: int, case: str, contact: float | None, **changes: Any) -> SurroundEvaluationRecord:  # noqa: ANN401 - any field
    """What came of a run for a search."""
    values: dict[str, Any] = {
        "search_seed": 1, "number": number, "generation": 0, "case": case, "seed": number, "contact": contact, "surround": 0.1,
        "chase": 0.2, "focus": 0.3, "distance": 1.0, "share_surrounded": 0.5, "seconds": 30.0,
    }  # fmt: skip
    return SurroundEvaluationRecord(**{**values, **changes})


TOPICS = {
    SurroundStateRecord: "/surround/state",
    SurroundEvaluationRecord: "/surround/evaluation",
    SurroundGenerationRecord: "/surround/generation",
    SurroundConditionRecord: "/surround/condition",
}


def write_log(path: Path, entries: Iterable[object], search: Mapping[str, str] | None = None) -> Path:
    """A log of nothing but such entries, as workers leave it, or a search."""
    writer = LogWriter(path, run={})
    if search is not None:
        writer.metadata("search", search)
    for number, one in enumerate(entries):
        schema = record_schema(type(one))
        writer.write(writer.channel(TOPICS[type(one)], schema), float(number), compile_encoder(schema)(one))
    writer.close()
    return path
