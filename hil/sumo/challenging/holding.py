"""A challenge held in a ring: the two advices play in turn until it is decided."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from hil.sumo.bouts import play
from hil.sumo.controllers import AdviceController
from pal_advisor.maneuvers import Contender

if TYPE_CHECKING:
    from hil.sumo.bouts import Bout
    from hil.sumo.challenging.standing import ChallengeStanding
    from hil.sumo.ring import Ring
    from pal_advisor.maneuvers import Advice, ChallengeVerdict

TITLES: Final = {
    Contender.CHALLENGER: "challenge: bouts played by what was learnt",
    Contender.CHAMPION: "challenge: bouts played by the given advice",
}
"""What their bouts are called in a log."""


class ChallengeObserver(Protocol):
    """Is told of what happens in a challenge."""

    def series(self, title: str) -> None:
        """A bout begins that belongs to these."""
        ...

    def bout(self, bout: Bout) -> None:
        """A bout ended."""
        ...

    def verdict(self, verdict: ChallengeVerdict) -> None:
        """A pair is complete."""
        ...

    def save(self) -> None:
        """What was played is to be kept."""
        ...


def hold(ring: Ring, standing: ChallengeStanding, learnt: Advice, seed: int, observer: ChallengeObserver) -> None:
    """Play until it is decided. A bout in which the robot was lost is played again.

    Args:
        ring: Where; somebody there says how a bout ends.
        standing: How the challenge stands, and then how it has ended.
        learnt: What was learnt: the challenger.
        seed: Seed of the coaching.
        observer: Is told.

    Raises:
        RefusedError: The robot was stopped by somebody.
        PeerError: It was lost and does not come back.
    """
    players = {Contender.CHALLENGER: AdviceController(learnt), Contender.CHAMPION: AdviceController(standing.given)}
    while not standing.challenge.finished:
        contender, number, poses = standing.next(seed)
        observer.series(TITLES[contender])
        for bout in play(ring, players[contender], [poses], number):
            observer.bout(bout)
            verdict = standing.take(bout)
            if verdict is not None:
                observer.verdict(verdict)
            observer.save()
