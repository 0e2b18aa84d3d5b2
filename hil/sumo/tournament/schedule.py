"""Who meets whom: everybody meets everybody else equally often, in both seats.

A round of a pairing is two bouts that begin at the same poses, with the two in each other's place. No poses are used by two
rounds: were they the same for all pairings, chance would favour the same entrants everywhere, and intervals be too narrow.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import BoutOutcome
from hil.seeds import Branch, bout_seed
from hil.sumo.connecting import connect_all
from hil.sumo.tournament.duels import duel_url, fight

if TYPE_CHECKING:
    from hil.sumo.tournament.entrants import Entrant

FEWEST: Final = 2
MOST_ENTRANTS: Final = 64
MOST_SEED: Final = 2**32 - 1
MOST_BOUTS: Final = 10_000
"""Of a pairing."""
PART: Final = 10
"""Bouts that a worker plays at a time, whatever the number of workers: five rounds in both seats."""


@dataclass(frozen=True)
class TournamentBout:
    """A bout that is over.

    Attributes:
        round: Its round, from 1.
        home: Who had the first seat, by number in the tournament.
        away: Who had the second.
        outcome: How it ended, for the home seat.
        time: Time it took, in s.
        maneuvers: Of the home seat, of the other.
    """

    round: int
    home: int
    away: int
    outcome: BoutOutcome
    time: float
    maneuvers: tuple[int, int]

    @property
    def winner(self) -> int | None:
        """Who has won; None where it was drawn."""
        return {BoutOutcome.WIN: self.home, BoutOutcome.LOSS: self.away}.get(self.outcome)

    @property
    def loser(self) -> int | None:
        """Who has lost; None where it was drawn."""
        return {BoutOutcome.WIN: self.away, BoutOutcome.LOSS: self.home}.get(self.outcome)


@dataclass(frozen=True)
class Tournament:
    """A round robin.

    Attributes:
        entrants: Who enters, each of another name.
        bouts: Bouts of each pairing, half of them in each seat.
        seed: Seed of every random choice.

    Raises:
        ValueError: There are too few or too many, two of one name, or a number of bouts that both seats can't share.
    """

    entrants: tuple[Entrant, ...]
    bouts: int
    seed: int

    def __post_init__(self) -> None:
        if not FEWEST <= len(self.entrants) <= MOST_ENTRANTS:
            raise ValueError(f"a tournament has {FEWEST} to {MOST_ENTRANTS} entrants, not {len(self.entrants)}")
        names = [entrant.name for entrant in self.entrants]
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise ValueError(f"two entrants are called {twice}: give one another name, as other={twice}")
        if not 2 <= self.bouts <= MOST_BOUTS or self.bouts % 2:
            raise ValueError(f"a pairing has an even number of bouts, 2 to {MOST_BOUTS}, one in each seat: not {self.bouts}")

    @property
    def total(self) -> int:
        """Bouts there are to be."""
        return len(self.entrants) * (len(self.entrants) - 1) // 2 * self.bouts

    def seed_of(self, number: int, home: int, away: int) -> int:
        """Seed of a round of a pairing: of the start poses and the noise of its two bouts.

        Args:
            number: Number of the round, from 1.
            home: Who has the home seat.
            away: Who has the other; the seed is the same in both seats.
        """
        pairing = min(home, away) * MOST_ENTRANTS + max(home, away)
        return bout_seed(self.seed, Branch.TOURNAMENT, pairing * MOST_BOUTS + number)

    def parts(self) -> list[TournamentPart]:
        """All bouts, cut into parts that know nothing of each other."""
        rounds = self.bouts // 2
        return [
            TournamentPart(self, pair, first, min(PART // 2, rounds - first + 1))
            for pair in combinations(range(len(self.entrants)), 2)
            for first in range(1, rounds + 1, PART // 2)
        ]


@dataclass(frozen=True)
class TournamentPart:
    """Some bouts of one pairing.

    Attributes:
        tournament: The whole.
        pair: Who meets, by number.
        first: The first round.
        rounds: How many; each has two bouts.
    """

    tournament: Tournament
    pair: tuple[int, int]
    first: int
    rounds: int

    @property
    def size(self) -> int:
        """How many bouts."""
        return 2 * self.rounds

    @property
    def fixtures(self) -> list[tuple[int, int, int]]:
        """The bouts, in order: round, who has the home seat, who has the other."""
        seats = (self.pair, self.pair[::-1])
        return [(number, *seat) for number in range(self.first, self.first + self.rounds) for seat in seats]


def play_part(part: TournamentPart) -> list[TournamentBout]:
    """Play bouts, each in an emulated ring of its own: what comes of one depends on nothing but its seed and who plays.

    Args:
        part: Which.
    """
    return [play_bout(part.tournament, *fixture) for fixture in part.fixtures]


def play_bout(tournament: Tournament, number: int, home: int, away: int) -> TournamentBout:
    """Play one bout.

    Args:
        tournament: The whole.
        number: Number of the round.
        home: Who has the first seat.
        away: Who has the second.
    """
    seed = tournament.seed_of(number, home, away)
    first, second = tournament.entrants[home].player(seed, 0), tournament.entrants[away].player(seed, 1)
    with connect_all(duel_url(seed)) as robots:
        duel = fight(robots, first, second, seed)
    return TournamentBout(number, home, away, duel.outcome, duel.time, duel.maneuvers)
