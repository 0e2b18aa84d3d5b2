"""Checkpoints of tournaments: who enters, and all bouts that were played, from which one that was cut goes on."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import HilError
from firmware_protocol.messages import BoutOutcome
from hil.doors import checkpoint_door
from hil.sumo.tournament.entrants import Entrant
from hil.sumo.tournament.schedule import MOST_BOUTS, MOST_SEED, Tournament, TournamentBout
from pal_advisor.fields import FieldError, Fields

if TYPE_CHECKING:
    from pathlib import Path

VERSION: Final = 1
MISSION: Final = "tournament"
BOUT: Final = ("round", "home", "away", "outcome", "time", "home_maneuvers", "away_maneuvers")
"""What is kept of a bout, in order."""
_DECIDED: Final = {outcome.name.lower(): outcome for outcome in BoutOutcome if outcome is not BoutOutcome.UNDECIDED}
_LONGEST: Final = 3600.0
_MOST_MANEUVERS: Final = 1_000_000


class TournamentCheckpointError(HilError):
    """A checkpoint of a tournament can't be read, or belongs to something else."""


DOOR: Final = checkpoint_door(TournamentCheckpointError, largest=256 << 20)
"""A bout takes 40 bytes, an entrant's advice up to 100 kB."""


@dataclass(frozen=True)
class TournamentCheckpoint:
    """A tournament that was cut.

    Attributes:
        tournament: Who enters, and how often all meet.
        bouts: What was played: whole parts, in order.
    """

    tournament: Tournament
    bouts: tuple[TournamentBout, ...] = ()

    @property
    def finished(self) -> bool:
        """Nothing is left to be played."""
        return len(self.bouts) >= self.tournament.total

    def to_bytes(self) -> bytes:
        """As a file holds it."""
        tournament = self.tournament
        document = {
            "version": VERSION,
            "mission": MISSION,
            "entrants": [entrant.to_dict() for entrant in tournament.entrants],
            "bouts": tournament.bouts,
            "seed": tournament.seed,
            "played": [
                [one.round, one.home, one.away, one.outcome.name.lower(), one.time, *one.maneuvers] for one in self.bouts
            ],
        }
        return json.dumps(document, separators=(",", ":")).encode()


def load_checkpoint(path: Path) -> TournamentCheckpoint:
    """Read a checkpoint.

    Args:
        path: The file.

    Raises:
        TournamentCheckpointError: It can't be read, is of another version or of something else, or is damaged.
    """
    document = DOOR.document(path, json=True)
    data = document.data
    if not isinstance(data, dict) or data.get("version") != VERSION or data.get("mission") != MISSION:
        raise TournamentCheckpointError(f"{path} is no checkpoint of a tournament of version {VERSION}")
    try:
        return _checkpoint(Fields(data))
    except FieldError as error:
        raise document.wrong(error.path, f"this checkpoint is damaged: {error}") from error


def _checkpoint(found: Fields) -> TournamentCheckpoint:
    found.take("version")
    found.take("mission")
    entrants = tuple(Entrant.from_fields(Fields(one, path)) for path, one in found.items("entrants"))
    bouts, seed = found.integer("bouts", 2, MOST_BOUTS), found.integer("seed", 0, MOST_SEED)
    try:
        tournament = Tournament(entrants, bouts, seed)
    except ValueError as error:
        raise found.wrong("entrants", str(error)) from error
    played = [_bout(Fields.row(row, BOUT, path, FieldError), tournament) for path, row in found.items("played")]
    found.done()
    wanted = [fixture for part in tournament.parts() for fixture in part.fixtures]
    if [(one.round, one.home, one.away) for one in played] != wanted[: len(played)]:
        raise FieldError("played", "the bouts are not those of this tournament, in order")
    return TournamentCheckpoint(tournament, tuple(played))


def _bout(row: Fields, tournament: Tournament) -> TournamentBout:
    last = len(tournament.entrants) - 1
    number, home, away = row.integer("round", 1, tournament.bouts), row.integer("home", 0, last), row.integer("away", 0, last)
    outcome = row.text("outcome")
    if outcome not in _DECIDED:
        raise row.wrong("outcome", f"expected one of {', '.join(_DECIDED)}, not {outcome!r}")
    time = row.number("time", 0, _LONGEST)
    maneuvers = row.integer("home_maneuvers", 0, _MOST_MANEUVERS), row.integer("away_maneuvers", 0, _MOST_MANEUVERS)
    return TournamentBout(number, home, away, _DECIDED[outcome], time, maneuvers)
