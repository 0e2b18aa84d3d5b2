"""A duel: two Juniors in one ring, each with a host of its own, and a referee who says who pushed whom out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from firmware_protocol.messages import BoutOutcome, OpponentCode, Phase
from hil.connecting.serving import WAIT
from hil.sumo.ring import SETTLE, RingError

if TYPE_CHECKING:
    from hil.sumo.robots import Robots
    from hil.sumo.tournament.players import Player


@dataclass(frozen=True)
class Duel:
    """A duel that is over.

    Attributes:
        outcome: How it ended, for the robot that the referee belongs to: the home one.
        time: Time it took, in s.
        maneuvers: Maneuvers that the hosts had performed, of the home robot and of the other; 0 for one that plays by itself.
    """

    outcome: BoutOutcome
    time: float
    maneuvers: tuple[int, int]


def duel_url(seed: int) -> str:
    """Address of an emulated ring with two Juniors.

    Args:
        seed: Seed of the emulation.
    """
    return f"sim://junior?networks=2&seed={seed}"


def fight(robots: Robots, home: Player, away: Player, seed: int) -> Duel:
    """Have two robots play one bout against each other.

    Both are set up by the referee, and begin in the same step. A bout that nobody has won when its time is over is drawn.

    Args:
        robots: The two, as `connect_all` has them; the first has the referee.
        home: Plays the first.
        away: Plays the other.
        seed: Decides the start poses, and the noise.

    Raises:
        RingError: There are not two robots, or there is no referee.
        RefusedError: A robot refuses to play.
        PeerError: One is gone or does not answer.
        LinkError: The links are gone.
    """
    both = list(robots)
    if len(both) != 2 or (referee := both[0].referee) is None:
        raise RingError(f"a duel needs two robots, and a referee with the first; there are {len(both)} robots")
    pairs = list(zip(both, (home, away), strict=True))
    for junior, player in pairs:
        player.prepare(junior)
    robots.come_together()
    for error in robots.arm().errors.values():
        raise error
    referee.reset(seed, OpponentCode.JUNIOR)
    robots.wait(SETTLE)
    robots.come_together()
    for junior, player in pairs:
        player.begin(junior)
    while referee.latest.phase != Phase.OVER:
        robots.step(WAIT)
        for junior, player in pairs:
            player.attend(junior)
    robots.come_together()
    over = referee.latest
    return Duel(BoutOutcome(over.outcome), over.elapsed, (home.maneuvers, away.maneuvers))
