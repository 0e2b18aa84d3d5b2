"""Checkpoints of searches: all that was evaluated, from which a search that was cut goes on."""

from __future__ import annotations

import json
from dataclasses import asdict, astuple, dataclass, fields
from typing import TYPE_CHECKING, Any, Final

from firmware_protocol.errors import HilError
from hil.doors import Document, checkpoint_door
from hil.swarm.missions.evolving.evaluation import EvaluationResult
from hil.swarm.missions.evolving.evolution import Evolution
from hil.swarm.missions.surround_checkpoint import MOST_SEED, MOST_SEEDS
from hil.swarm.missions.surround_settings import SurroundSettings
from pal_advisor.fields import FieldError, Fields, SettingsError
from pal_advisor.surround.measures import Fitness
from pal_advisor.surround.search import SearchName, SearchSettings
from pal_advisor.surround.search.searches import MOST_BUDGET, MOST_GENERATIONS, MOST_POPULATION, MOST_REPEATS

if TYPE_CHECKING:
    from pathlib import Path

VERSION: Final = 1
MISSION: Final = "surround evolution"
RESULT: Final = tuple(field.name for field in fields(EvaluationResult))
"""What is kept of an evaluation, in order, after its condition and seed."""


class EvolutionCheckpointError(HilError):
    """A checkpoint of a search can't be read, or belongs to another run."""


DOOR: Final = checkpoint_door(EvolutionCheckpointError, largest=256 << 20)
"""An evaluation takes 150 bytes."""


@dataclass(frozen=True)
class EvolutionCheckpoint:
    """Searches that were cut.

    Attributes:
        settings: How runs go.
        search: How the searches go.
        seed: Seed of the first search.
        seeds: How many searches there are to be.
        begun: The searches that have begun; all but the last have come to their end.
    """

    settings: SurroundSettings
    search: SearchSettings
    seed: int
    seeds: int
    begun: tuple[Evolution, ...] = ()

    @property
    def evaluations(self) -> int:
        """Evaluations made, of all searches."""
        return sum(len(evolution.done) for evolution in self.begun)

    @property
    def finished(self) -> bool:
        """Nothing is left to be done."""
        return len(self.begun) == self.seeds and all(evolution.finished for evolution in self.begun)

    def to_bytes(self) -> bytes:
        """As a file holds it."""
        document = {
            "version": VERSION,
            "mission": MISSION,
            "settings": self.settings.to_dict(),
            "search": search_dict(self.search),
            "seed": self.seed,
            "seeds": self.seeds,
            "evaluated": [
                [[str(each.evaluation.condition), each.evaluation.seed, *astuple(each.result)] for each in evolution.done]
                for evolution in self.begun
            ],
        }
        return json.dumps(document, separators=(",", ":")).encode()


def search_dict(search: SearchSettings) -> dict[str, Any]:
    """How a search goes, as plain values.

    Args:
        search: It.
    """
    return {**asdict(search), "fitness": search.fitness.value, "search": search.search.value}


def read_search(found: Fields) -> SearchSettings:
    """The inverse of `search_dict`.

    Args:
        found: What it gave.

    Raises:
        FieldError: A field is missing, unknown or wrong; of the kind that the fields raise.
    """
    try:
        settings = SearchSettings(
            found.one_of("fitness", Fitness),
            found.one_of("search", SearchName),
            population=found.integer("population", 2, MOST_POPULATION),
            generations=found.integer("generations", 1, MOST_GENERATIONS),
            repeats=found.integer("repeats", 1, MOST_REPEATS),
            budget=found.integer("budget", 0, MOST_BUDGET),
        )
    except SettingsError as error:
        raise found.wrong(error.path, str(error).partition(": ")[2]) from error
    found.done()
    return settings


def load_evolution(path: Path) -> EvolutionCheckpoint:
    """Read a checkpoint.

    Args:
        path: The file.

    Raises:
        EvolutionCheckpointError: It can't be read, is of another version or of something else, or is damaged.
    """
    return _of_document(DOOR.document(path, json=True))


def evolution_of(data: bytes) -> EvolutionCheckpoint:
    """A checkpoint that is held in memory, as a log has it.

    Args:
        data: As a file would hold it.

    Raises:
        EvolutionCheckpointError: It is none, is of another version or of something else, or is damaged.
    """
    return _of_document(DOOR.document_of(data, "the checkpoint", json=True))


def _of_document(document: Document) -> EvolutionCheckpoint:
    data = document.data
    if isinstance(data, dict) and data.get("mission") == "surround":
        raise EvolutionCheckpointError(f"{document.path} is the checkpoint of runs, not of a search: go on without --evolve")
    if not isinstance(data, dict) or data.get("version") != VERSION or data.get("mission") != MISSION:
        raise EvolutionCheckpointError(f"{document.path} is no checkpoint of a search among conditions of version {VERSION}")
    try:
        return _checkpoint(Fields(data))
    except FieldError as error:
        raise document.wrong(error.path, f"this checkpoint is damaged: {error}") from error


def _checkpoint(found: Fields) -> EvolutionCheckpoint:
    found.take("version")
    found.take("mission")
    settings = SurroundSettings.from_fields(found.table("settings"))
    search = read_search(found.table("search"))
    seed, seeds = found.integer("seed", 0, MOST_SEED), found.integer("seeds", 1, MOST_SEEDS)
    begun: list[Evolution] = []
    evaluated = found.elements("evaluated")
    if len(evaluated.names) > seeds:
        raise found.wrong("evaluated", "there are more searches than were to be made")
    for number, name in enumerate(evaluated.names):
        if begun and not begun[-1].finished:
            raise evaluated.wrong(name, "it was begun before the search before it was over")
        begun.append(Evolution(settings, search, seed + number))
        for path, row in evaluated.items(name):
            _tell(begun[-1], Fields.row(row, ("condition", "seed", *RESULT), path, FieldError))
    found.done()
    return EvolutionCheckpoint(settings, search, seed, seeds, tuple(begun))


def _tell(evolution: Evolution, row: Fields) -> None:
    """Tell a search of an evaluation, which must be the one that it asks for."""
    condition, seed = row.text("condition"), row.integer("seed", 0, MOST_SEED)
    wanted = evolution.wanted[0] if evolution.wanted else None
    if wanted is None or (str(wanted.condition), wanted.seed) != (condition, seed):
        raise row.wrong(
            "condition",
            f"the search with seed {evolution.seed} does not ask for {condition} with seed {seed} here: it was made by another "
            "version of the program. Begin anew without --resume",
        )
    evolution.tell(
        EvaluationResult(**{name: row.take(name) if row.peek(name) is None else row.number(name, 0.0) for name in RESULT})
    )
