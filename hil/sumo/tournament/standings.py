"""What a tournament has come to: the table, the matrix, and the bouts that the weaker won."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Any

from firmware_protocol.messages import BoutOutcome
from hil.sumo.tournament.rating import Ratings, rate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hil.sumo.tournament.schedule import Tournament, TournamentBout


@dataclass(frozen=True)
class Score:
    """Bouts, counted for one side.

    Attributes:
        won: How many were won.
        drawn: How many were drawn.
        lost: How many were lost.
    """

    won: int = 0
    drawn: int = 0
    lost: int = 0

    @property
    def played(self) -> int:
        """How many there were."""
        return self.won + self.drawn + self.lost

    @property
    def share(self) -> float:
        """Points, one for a win and half of one for a draw, as a share of what could be had; 0.5 where nothing was played."""
        return (self.won + self.drawn / 2) / self.played if self.played else 0.5

    def to_dict(self) -> dict[str, int]:
        """As plain values."""
        return {"won": self.won, "drawn": self.drawn, "lost": self.lost}


@dataclass(frozen=True)
class Upset:
    """A bout that the weaker has won.

    Attributes:
        bout: The bout.
        probability: How probable it was, by the ratings.
    """

    bout: TournamentBout
    probability: float


@dataclass(frozen=True)
class Standings:
    """How things stand.

    Attributes:
        tournament: Who enters.
        bouts: What was played.
        ratings: How strong each is.
        matrix: Of each against each other, seats together.
        seats: All bouts, for the home seat.
    """

    tournament: Tournament
    bouts: tuple[TournamentBout, ...]
    ratings: Ratings
    matrix: tuple[tuple[Score, ...], ...]
    seats: Score

    @classmethod
    def of(cls, tournament: Tournament, bouts: Sequence[TournamentBout]) -> Standings:
        """Count and rate.

        Args:
            tournament: Who enters.
            bouts: What was played.
        """
        everybody = range(len(tournament.entrants))
        counts = [[[0, 0, 0] for _ in everybody] for _ in everybody]
        of_home = {BoutOutcome.WIN: 0, BoutOutcome.DRAW: 1, BoutOutcome.LOSS: 2}
        seats = [0, 0, 0]
        for bout in bouts:
            place = of_home[bout.outcome]
            counts[bout.home][bout.away][place] += 1
            counts[bout.away][bout.home][2 - place] += 1
            seats[place] += 1
        matrix = tuple(tuple(Score(*counts[row][column]) for column in everybody) for row in everybody)
        return cls(tournament, tuple(bouts), rate(len(everybody), bouts), matrix, Score(*seats))

    @property
    def order(self) -> list[int]:
        """The entrants, the strongest first."""
        strengths = self.ratings.strengths
        return sorted(range(len(strengths)), key=lambda one: (-strengths[one].value, self.name(one)))

    def name(self, entrant: int) -> str:
        """What an entrant is called."""
        return self.tournament.entrants[entrant].name

    def score(self, entrant: int) -> Score:
        """All bouts of an entrant."""
        row = self.matrix[entrant]
        return Score(sum(one.won for one in row), sum(one.drawn for one in row), sum(one.lost for one in row))

    def median_time_to_win(self, entrant: int) -> float | None:
        """Of the bouts that an entrant has won, in s; None where there is none."""
        times = [bout.time for bout in self.bouts if bout.winner == entrant]
        return median(times) if times else None

    def upsets(self, most: int) -> list[Upset]:
        """Bouts that were won by who is rated lower, the least probable first.

        Args:
            most: How many are wanted at most.
        """
        found = []
        strengths = self.ratings.strengths
        for bout in self.bouts:
            winner, loser = bout.winner, bout.loser
            if winner is not None and loser is not None and strengths[winner].value < strengths[loser].value:
                win, _, loss = self.ratings.expected(bout.home, bout.away)
                found.append(Upset(bout, win if winner == bout.home else loss))
        found.sort(key=lambda upset: (upset.probability, upset.bout.round, upset.bout.home, upset.bout.away))
        return found[:most]

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        strengths, seat = self.ratings.strengths, self.ratings.seat
        return {
            "bouts": len(self.bouts),
            "seed": self.tournament.seed,
            "table": [
                {
                    "name": self.name(one),
                    "kind": self.tournament.entrants[one].kind.value,
                    "rating": round(strengths[one].value, 1),
                    "rating_ci95": [round(bound, 1) for bound in strengths[one].ci95],
                    **self.score(one).to_dict(),
                    "points_share": round(self.score(one).share, 4),
                    "median_time_to_win_s": self.median_time_to_win(one),
                }
                for one in self.order
            ],
            "home_seat": {
                "rating": round(seat.value, 1),
                "rating_ci95": [round(bound, 1) for bound in seat.ci95],
                **self.seats.to_dict(),
            },
            "matrix": {
                self.name(row): {
                    self.name(column): self.matrix[row][column].to_dict() for column in self.order if column != row
                }
                for row in self.order
            },
        }
