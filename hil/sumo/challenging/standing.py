"""How a challenge stands, as a run keeps it: the advice that was given, and the bouts played so far."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from firmware_protocol.messages import BoutOutcome
from hil.seeds import Branch, bout_seed
from hil.sumo.bouts import Bout
from pal_advisor.fields import FieldError, Fields
from pal_advisor.maneuvers import Advice, AdviceError, Challenge, ChallengeVerdict, Contender

if TYPE_CHECKING:
    from collections.abc import Sequence

_OUTCOMES = (BoutOutcome.WIN, BoutOutcome.LOSS, BoutOutcome.DRAW)


class ChallengeStanding:
    """An advice that a coaching began from, and how it holds its place.

    Args:
        given: The advice, which is the champion.
        bouts: Bouts that the two have played already, in turn, what was learnt first.

    Attributes:
        given: The advice.
        bouts: The bouts.
        challenge: Decides.

    Raises:
        ValueError: There are more bouts than it takes to decide.
    """

    def __init__(self, given: Advice, bouts: Sequence[Bout] = ()) -> None:
        self.given = given
        self.bouts = list(bouts)
        self.challenge = Challenge(bout.outcome is BoutOutcome.WIN for bout in bouts)

    @property
    def beaten(self) -> bool:
        """What was learnt has taken its place."""
        return self.challenge.winner is Contender.CHALLENGER

    def next(self, seed: int) -> tuple[Contender, int, int]:
        """Who plays the next bout, its number from 1, and the seed of its poses, which is that of both bouts of a pair.

        Args:
            seed: Seed of the coaching.
        """
        challenge = self.challenge
        return challenge.turn, challenge.bouts + 1, bout_seed(seed, Branch.CHALLENGE, challenge.pair)

    def take(self, bout: Bout) -> ChallengeVerdict | None:
        """Take in a bout.

        Args:
            bout: It, which is over.

        Returns:
            How the challenge stands, when a pair is complete.
        """
        verdict = self.challenge.tell(won=bout.outcome is BoutOutcome.WIN)
        self.bouts.append(bout)
        return verdict

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        bouts = [[int(bout.outcome), bout.time, bout.maneuvers] for bout in self.bouts]
        return {"given": self.given.to_dict(), "bouts": bouts}

    @classmethod
    def of_fields(cls, fields: Fields, seed: int) -> ChallengeStanding:
        """The inverse of `to_dict`.

        Args:
            fields: The plain values.
            seed: Seed of the coaching.

        Raises:
            FieldError: A field is missing, unknown or wrong.
        """
        try:
            given = Advice.from_dict(fields.take("given"))
        except AdviceError as error:
            raise fields.wrong("given", str(error)) from error
        bouts = []
        for number, (at, item) in enumerate(fields.items("bouts"), start=1):
            row = Fields.row(item, ("outcome", "time", "maneuvers"), at, FieldError)
            outcome = BoutOutcome(row.integer("outcome", min(_OUTCOMES), max(_OUTCOMES)))
            poses = bout_seed(seed, Branch.CHALLENGE, (number + 1) // 2)
            bouts.append(Bout(number, poses, outcome, row.number("time", 0.0), row.integer("maneuvers")))
        try:
            standing = cls(given, bouts)
        except ValueError as error:
            raise fields.wrong("bouts", str(error)) from error
        fields.done()
        return standing
