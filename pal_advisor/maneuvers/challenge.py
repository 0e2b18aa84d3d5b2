"""The challenge: whether an advice takes another's place, by bouts that the two play in turn and a sequential test.

The champion is the advice that is there, the challenger one that was learnt since. They play in turn, the challenger first, and
two bouts are a pair: from the same poses, as far as anybody can set them up. A pair tells something when only one of its bouts
was won: were both as good, the challenger would win half of those pairs, so that the chance that it wins so many of them, or
more, is a tail of the binomial distribution (a sign test). After each pair from the fifth on:

- the challenger takes the place when that chance is 1/64 or less, and after the last pair when it is 56/1024 or less;
- the champion stays when the challenger leads by no more than a third of the pairs beyond nine, when so much can't be reached
  in the pairs that are left, or after the last pair.

A boundary that is strict but for the last look is Haybittle's and Peto's. Bouts lost and drawn are alike, and time does not
count: so few bouts can't show that the faster of two wins as often.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import comb
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable

FEWEST_PAIRS: Final = 5
"""Pairs that are played before anything is decided."""
MOST_PAIRS: Final = 20
"""Pairs after which the champion stays where nothing is clear."""
CLEAR: Final = 1 / 64
"""Chance, of a challenger that is as good, to win so many pairs: from here on it is held for better at once."""
CLEAR_AT_LAST: Final = 56 / 1024
"""The same after the last pair: 8 of 10 pairs that tell something."""
PATIENCE: Final = 9
"""Pairs after which a challenger must lead, ..."""
PACE: Final = 3
"""... and by one more for each so many pairs beyond."""


class Contender(StrEnum):
    """Which of the two advices."""

    CHALLENGER = "challenger"
    """What was learnt since."""
    CHAMPION = "champion"
    """What was there."""


@dataclass(frozen=True)
class ChallengeVerdict:
    """How the challenge stands after a pair.

    Attributes:
        pair: Number of the pair, from 1.
        ahead: Pairs so far of which only the challenger's bout was won.
        behind: Pairs of which only the champion's was.
        chance: Chance of a challenger that is as good to win so many of these, or more.
        winner: Who has won the challenge; None while it goes on.
    """

    pair: int
    ahead: int
    behind: int
    chance: float
    winner: Contender | None


class Challenge:
    """Says who plays, takes in how it went, and decides.

    Args:
        won: Of the bouts that have been played, in order, whether each was won.

    Attributes:
        verdicts: How it stood after each pair.

    Raises:
        ValueError: There are more bouts than it takes to decide.
    """

    def __init__(self, won: Iterable[bool] = ()) -> None:
        self.verdicts: list[ChallengeVerdict] = []
        self._won: list[bool] = []
        for one in won:
            self.tell(won=one)

    @property
    def bouts(self) -> int:
        """Bouts played."""
        return len(self._won)

    @property
    def pair(self) -> int:
        """Number of the pair that the next bout belongs to, from 1."""
        return self.bouts // 2 + 1

    @property
    def turn(self) -> Contender:
        """Who plays next."""
        return Contender.CHAMPION if self.bouts % 2 else Contender.CHALLENGER

    @property
    def winner(self) -> Contender | None:
        """Who has won; None while it goes on."""
        return self.verdicts[-1].winner if self.verdicts else None

    @property
    def finished(self) -> bool:
        """It is decided."""
        return self.winner is not None

    def wins(self, contender: Contender) -> int:
        """Bouts that an advice has won.

        Args:
            contender: Which.
        """
        return sum(self._won[contender is Contender.CHAMPION :: 2])

    def played(self, contender: Contender) -> int:
        """Bouts that an advice has played.

        Args:
            contender: Which.
        """
        return len(self._won[contender is Contender.CHAMPION :: 2])

    def tell(self, *, won: bool) -> ChallengeVerdict | None:
        """Take in how the bout went of who was to play.

        Args:
            won: It was won.

        Returns:
            How it stands, when a pair is complete.

        Raises:
            ValueError: It is decided already.
        """
        if self.finished:
            raise ValueError(f"the challenge was decided after {self.bouts} bouts")
        self._won.append(won)
        if self.bouts % 2:
            return None
        pairs = list(zip(self._won[::2], self._won[1::2], strict=True))
        ahead, behind = pairs.count((True, False)), pairs.count((False, True))
        verdict = ChallengeVerdict(len(pairs), ahead, behind, chance(ahead, behind), decided(len(pairs), ahead, behind))
        self.verdicts.append(verdict)
        return verdict


def chance(ahead: int, behind: int) -> float:
    """Chance of a challenger that is as good as the champion to win so many pairs, or more, of those that only one has won.

    Args:
        ahead: Pairs that the challenger has won.
        behind: Pairs that the champion has.
    """
    told = ahead + behind
    return sum(comb(told, count) for count in range(ahead, told + 1)) / (1 << told)


def decided(pairs: int, ahead: int, behind: int) -> Contender | None:
    """Who has won after so many pairs; None while it goes on.

    Args:
        pairs: Pairs played.
        ahead: Pairs of which only the challenger's bout was won.
        behind: Pairs of which only the champion's was.
    """
    if pairs < FEWEST_PAIRS:
        return None
    if chance(ahead, behind) <= (CLEAR_AT_LAST if pairs == MOST_PAIRS else CLEAR):
        return Contender.CHALLENGER
    left = MOST_PAIRS - pairs
    hopeless = chance(ahead + left, behind) > CLEAR_AT_LAST
    return Contender.CHAMPION if hopeless or PACE * (ahead - behind) <= pairs - PATIENCE else None
