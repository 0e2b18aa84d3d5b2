"""What workers do for several coachings that are put together, each on a robot of its own, and what comes of it."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from firmware_protocol.messages import BoutOutcome
from hil.seeds import Branch, bout_seed, generator
from hil.sumo.bouts import Bout, play
from hil.sumo.connecting import connect
from hil.sumo.controllers import AdviceController, Controller, RandomController
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import TeamScore

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pal_advisor.maneuvers import Advice

PART: Final = 10
"""Bouts that are played on one emulated robot, whatever the number of workers."""


@dataclass(frozen=True)
class CoachedRun:
    """What came of one of several coachings.

    Attributes:
        seed: Its seed.
        maneuvers: Maneuvers performed.
        bouts: Bouts begun.
        wins: Bouts won while it learnt.
        losses: Bouts lost while it learnt.
        robot_seconds: Time that the robot spent performing, in s.
        json: The advice, as JSON.
        digest: Of all its decisions.
    """

    seed: int
    maneuvers: int
    bouts: int
    wins: int
    losses: int
    robot_seconds: float
    json: str
    digest: str


@dataclass(frozen=True)
class BoutsTask:
    """Bouts that are wanted, for a worker.

    Attributes:
        url: Address of the emulated robot.
        advice: What is played by; None: random maneuvers.
        seed: Seed of the run that they belong to.
        branch: Which of its poses.
        numbers: Numbers of the bouts.
    """

    url: str
    advice: Advice | None
    seed: int
    branch: Branch
    numbers: range

    @property
    def controller(self) -> Controller:
        """Who chooses the maneuvers."""
        if self.advice is None:
            return RandomController(generator(self.seed, Branch.CONTROLLER, self.numbers[0]))
        return AdviceController(self.advice)


@dataclass(frozen=True)
class PlayedBouts:
    """What came of them.

    Attributes:
        outcomes: How each ended, as `BoutOutcome`.
        times: How long each took, in s.
        maneuvers: Maneuvers in each.
    """

    outcomes: tuple[int, ...]
    times: tuple[float, ...]
    maneuvers: tuple[int, ...]


def play_bouts(task: BoutsTask) -> PlayedBouts:
    """Play them.

    Args:
        task: Which.
    """
    seeds = [bout_seed(task.seed, task.branch, number) for number in task.numbers]
    with closing(connect(task.url)) as junior:
        junior.arm()
        bouts = list(play(open_ring(junior), task.controller, seeds, task.numbers[0]))
    return PlayedBouts(
        tuple(int(bout.outcome) for bout in bouts),
        tuple(bout.time for bout in bouts),
        tuple(bout.maneuvers for bout in bouts),
    )


def parts_of(trials: int) -> list[range]:
    """Numbers of bouts, so many at a time as are played on one robot.

    Args:
        trials: Bouts in all.
    """
    return [range(first, min(first + PART, trials + 1)) for first in range(1, trials + 1, PART)]


def bouts_of(played: Sequence[PlayedBouts], seed: int, branch: Branch) -> list[Bout]:
    """The bouts one by one, of all parts in order.

    Args:
        played: What came of the parts.
        seed: Seed of the run.
        branch: Which of its poses.
    """
    each = [bout for part in played for bout in zip(part.outcomes, part.times, part.maneuvers, strict=True)]
    return [
        Bout(number, bout_seed(seed, branch, number), BoutOutcome(outcome), time, maneuvers)
        for number, (outcome, time, maneuvers) in enumerate(each, start=1)
    ]


def score_of(played: Sequence[PlayedBouts]) -> TeamScore:
    """How an advice did.

    Args:
        played: What came of the parts.
    """
    outcomes = [outcome for part in played for outcome in part.outcomes]
    return TeamScore(outcomes.count(BoutOutcome.WIN), len(outcomes), sum(time for part in played for time in part.times))
