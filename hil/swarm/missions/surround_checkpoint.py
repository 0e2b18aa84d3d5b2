"""Checkpoints of surround missions: what a run that was cut goes on from."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.errors import HilError
from hil.doors import Document, checkpoint_door
from hil.swarm.missions.surround_history import SurroundHistory
from hil.swarm.missions.surround_outcome import SurroundOutcome, read_absences
from hil.swarm.missions.surround_settings import SurroundSettings
from pal_advisor.fields import FieldError, Fields
from pal_advisor.surround import Case, Surround

if TYPE_CHECKING:
    from pathlib import Path

    from hil.swarm.host import Absence

VERSION: Final = 2
MOST_SEED: Final = 2**32 - 1
MOST_SEEDS: Final = 100_000


class SurroundCheckpointError(HilError):
    """A checkpoint can't be read, or belongs to another run."""


DOOR: Final = checkpoint_door(SurroundCheckpointError, largest=64 << 20)
"""A run of 100 steps takes 20 kB."""


@dataclass(frozen=True)
class StandingRun:
    """Where the run under way stands, after its last whole step.

    Attributes:
        case: The case that is played.
        history: What was measured.
        adviser: State of the adviser, as plain values.
        digest: Of that state.
        absences: Who was missing.
    """

    case: Case
    history: SurroundHistory
    adviser: dict[str, Any]
    digest: str
    absences: tuple[Absence, ...]

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "case": str(self.case),
            "history": self.history.to_dict(),
            "adviser": self.adviser,
            "digest": self.digest,
            "missing": [[one.step, one.robot, one.until] for one in self.absences],
        }


@dataclass(frozen=True)
class SurroundCheckpoint:
    """Runs that were cut.

    Attributes:
        settings: How they go.
        seed: First seed.
        seeds: How many seeds there are to be.
        finished: Runs that have come to their end.
        standing: Where the one under way stands; None where it has not begun.
    """

    settings: SurroundSettings
    seed: int
    seeds: int
    finished: tuple[SurroundOutcome, ...] = ()
    standing: StandingRun | None = None

    @property
    def steps(self) -> int:
        """Steps made, of all runs."""
        under_way = 0 if self.standing is None else self.standing.history.steps
        return sum(outcome.history.steps for outcome in self.finished) + under_way

    def to_bytes(self) -> bytes:
        """As a file holds it."""
        document = {
            "version": VERSION,
            "mission": "surround",
            "settings": self.settings.to_dict(),
            "seed": self.seed,
            "seeds": self.seeds,
            "finished": [outcome.to_dict() for outcome in self.finished],
            "standing": None if self.standing is None else self.standing.to_dict(),
        }
        return json.dumps(document, separators=(",", ":")).encode()


def load_checkpoint(path: Path) -> SurroundCheckpoint:
    """Read a checkpoint.

    Args:
        path: The file.

    Raises:
        SurroundCheckpointError: It can't be read, is of another version or of something else, or is damaged.
    """
    return _of_document(DOOR.document(path, json=True))


def checkpoint_of(data: bytes) -> SurroundCheckpoint:
    """A checkpoint that is held in memory, as a log has it.

    Args:
        data: As a file would hold it.

    Raises:
        SurroundCheckpointError: It is none, is of another version or of something else, or is damaged.
    """
    return _of_document(DOOR.document_of(data, "the checkpoint", json=True))


def _of_document(document: Document) -> SurroundCheckpoint:
    data = document.data
    if isinstance(data, dict) and data.get("mission") == "surround evolution":
        raise SurroundCheckpointError(f"{document.path} is the checkpoint of a search among conditions: go on with --evolve")
    if not isinstance(data, dict) or data.get("version") != VERSION or data.get("mission") != "surround":
        if isinstance(data, dict) and data.get("version") == 1 and data.get("mission") == "surround":
            raise SurroundCheckpointError(
                f"{document.path} is a checkpoint of version 1, of a program that did not follow where robots had been: begin "
                "anew without --resume (--table-in takes what was learnt)"
            )
        raise SurroundCheckpointError(f"{document.path} is no checkpoint of a surround mission of version {VERSION}")
    try:
        return _checkpoint(Fields(data))
    except FieldError as error:
        raise document.wrong(error.path, f"this checkpoint is damaged: {error}") from error


def _checkpoint(fields: Fields) -> SurroundCheckpoint:
    fields.take("version")
    fields.take("mission")
    settings = SurroundSettings.from_fields(fields.table("settings"))
    seed, seeds = fields.integer("seed", 0, MOST_SEED), fields.integer("seeds", 1, MOST_SEEDS)
    finished = tuple(SurroundOutcome.from_fields(Fields(item, path)) for path, item in fields.items("finished"))
    if [outcome.seed for outcome in finished] != list(range(seed, seed + len(finished))) or len(finished) > seeds:
        raise fields.wrong("finished", "the seeds of the runs that are done are others than those that were to be done")
    standing = fields.take("standing") if fields.peek("standing") is None else _standing(fields.table("standing"), settings)
    fields.done()
    return SurroundCheckpoint(settings, seed, seeds, finished, standing)


def _standing(fields: Fields, settings: SurroundSettings) -> StandingRun:
    try:
        case = Case.parse(fields.text("case"))
        adviser = fields.take("adviser")
        Surround.from_state(adviser)
    except ValueError as error:
        raise fields.wrong("adviser", str(error)) from error
    history = SurroundHistory.from_fields(fields.table("history"), case, settings.sectors)
    digest, absences = fields.text("digest"), read_absences(fields)
    fields.done()
    return StandingRun(case, history, adviser, digest, absences)
