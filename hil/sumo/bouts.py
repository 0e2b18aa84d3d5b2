"""Bouts played by a controller, and what came of them."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import PeerGoneError, PeerLostError, RefusedError
from firmware_protocol.messages import BoutOutcome, Reason
from firmware_protocol.vocabulary import Outcome
from hil.statistics import Rate
from hil.sumo.controllers import Driver

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hil.sumo.controllers import Controller
    from hil.sumo.ring import Encounter, Ring

MOST_LOSSES: Final = 5
"""A robot that is lost so often in a row, and gets nowhere in between, is given up."""


@dataclass(frozen=True)
class Bout:
    """A bout that is over.

    Attributes:
        number: Number in the series, from 1.
        seed: Seed of the start poses.
        outcome: How it ended, for Junior.
        time: Time it took, in s.
        maneuvers: Maneuvers performed; none where the wheels were set.
    """

    number: int
    seed: int
    outcome: BoutOutcome
    time: float
    maneuvers: int


@dataclass(frozen=True)
class Tally:
    """A series of bouts, counted.

    Attributes:
        opponent: Name of the opponent.
        trials: Bouts played.
        wins: Of these, won.
        losses: Lost.
        draws: Neither within the time limit.
        median_time_to_win: In s; None where none was won.
    """

    opponent: str
    trials: int
    wins: int
    losses: int
    draws: int
    median_time_to_win: float | None

    @classmethod
    def of(cls, opponent: str, bouts: Sequence[Bout]) -> Tally:
        """Count.

        Args:
            opponent: Name of the opponent.
            bouts: The series.
        """
        times = [bout.time for bout in bouts if bout.outcome is BoutOutcome.WIN]
        return cls(
            opponent=opponent,
            trials=len(bouts),
            wins=len(times),
            losses=sum(bout.outcome is BoutOutcome.LOSS for bout in bouts),
            draws=sum(bout.outcome is BoutOutcome.DRAW for bout in bouts),
            median_time_to_win=median(times) if times else None,
        )

    @property
    def win_rate(self) -> Rate:
        """Share of bouts won, with its interval."""
        return Rate(self.wins, self.trials)

    def to_dict(self) -> dict[str, object]:
        """As in the JSON output of `hil bout`."""
        return {
            "opponent": self.opponent,
            "trials": self.trials,
            "wins": self.wins,
            "losses": self.losses,
            "draws": self.draws,
            "win_rate": self.win_rate.value,
            "win_rate_ci95": list(self.win_rate.ci95),
            "median_time_to_win_s": self.median_time_to_win,
        }


def check_encounter(encounter: Encounter) -> None:
    """See that a maneuver was performed at all.

    Args:
        encounter: What came of it.

    Raises:
        RefusedError: The robot refused it, or its emergency stop was pressed.
    """
    report = encounter.report
    if report.outcome is Outcome.REFUSED:
        raise RefusedError("a maneuver", report.reason.name.lower().replace("_", " "))
    if report.outcome is Outcome.STOPPED and report.reason is Reason.EMERGENCY_STOP:
        raise RefusedError("to go on", "somebody pressed the emergency stop; disarm and arm the robot")


def play(ring: Ring, controller: Controller | Driver, seeds: Sequence[int], first: int = 1) -> Iterator[Bout]:
    """Play bouts, one after the other. A bout in which the robot was lost is played again, and counts once.

    Args:
        ring: Where; it has a referee, or a bout would not end.
        controller: Chooses the maneuvers, or sets the wheels.
        seeds: One per bout.
        first: Number of the first bout.

    Yields:
        Each bout as it ends.

    Raises:
        RefusedError: The robot was stopped by somebody.
        PeerLostError: It was lost and does not come back (PeerGoneError), or is lost again and again.
    """
    for number, seed in enumerate(seeds, start=first):
        losses = 0
        while True:
            try:
                if losses:
                    ring.recover()
                bout = _play_one(ring, controller, number, seed)
            except PeerGoneError:
                raise
            except PeerLostError:
                losses += 1
                if losses > MOST_LOSSES:
                    raise
            else:
                break
        yield bout


def _play_one(ring: Ring, controller: Controller | Driver, number: int, seed: int) -> Bout:
    """One bout, from its start to its end."""
    current = ring.begin(seed)
    if isinstance(controller, Driver):
        return Bout(number, seed, *ring.steer(controller), maneuvers=0)
    previous = None
    maneuvers = 0
    while True:
        encounter = ring.engage(controller.choose(current, previous))
        check_encounter(encounter)
        maneuvers += 1
        previous, current = current, encounter.stimulus
        if encounter.outcome is not BoutOutcome.UNDECIDED:
            return Bout(number, seed, encounter.outcome, encounter.elapsed or 0.0, maneuvers)
