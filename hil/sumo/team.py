"""What workers do for several coachings that are put together, each on a robot of its own, and what comes of it."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from firmware_protocol.messages import BoutOutcome
from hil.seeds import bout_seed
from hil.sumo.bouts import play
from hil.sumo.connecting import connect
from hil.sumo.controllers import AdviceController
from hil.sumo.ring import open_ring
from pal_advisor.maneuvers import TeamScore

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil.seeds import Branch
    from hil.sumo.bouts import Bout
    from pal_advisor.maneuvers import Advice

LATELY: Final = 20
"""Bouts that the running share of wins is taken over."""
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
        outcomes: How the bouts ended, as `BoutOutcome`, in order; of a run that was gone on with, those since then.
    """

    seed: int
    maneuvers: int
    bouts: int
    wins: int
    losses: int
    robot_seconds: float
    json: str
    digest: str
    outcomes: tuple[int, ...] = ()


@dataclass(frozen=True)
class BoutsTask:
    """Bouts that are wanted, for a worker.

    Attributes:
        url: Address of the emulated robot.
        advice: What is played by.
        seed: Seed of the run that they belong to.
        branch: Which of its poses.
        numbers: Numbers of the bouts.
    """

    url: str
    advice: Advice
    seed: int
    branch: Branch
    numbers: range


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

    @classmethod
    def of(cls, bouts: Sequence[Bout]) -> PlayedBouts:
        """What came of bouts.

        Args:
            bouts: The bouts.
        """
        return cls(
            tuple(int(bout.outcome) for bout in bouts),
            tuple(bout.time for bout in bouts),
            tuple(bout.maneuvers for bout in bouts),
        )


def play_bouts(task: BoutsTask) -> PlayedBouts:
    """Play them.

    Args:
        task: Which.
    """
    seeds = [bout_seed(task.seed, task.branch, number) for number in task.numbers]
    with closing(connect(task.url)) as junior:
        junior.arm()
        return PlayedBouts.of(list(play(open_ring(junior), AdviceController(task.advice), seeds, task.numbers[0])))


def parts_of(trials: int) -> list[range]:
    """Numbers of bouts, so many at a time as are played on one robot.

    Args:
        trials: Bouts in all.
    """
    return [range(first, min(first + PART, trials + 1)) for first in range(1, trials + 1, PART)]


def shares_won(bouts: int, outcomes: Sequence[int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How often a run has won lately, over its bouts.

    Args:
        bouts: Bouts begun.
        outcomes: How those ended that are told of, the last of them.

    Returns:
        Numbers of bouts, and the share of the last `LATELY` won at each; shape (n,), empty where there are too few.
    """
    if len(outcomes) < LATELY:
        return np.empty(0), np.empty(0)
    won = (np.array(outcomes) == BoutOutcome.WIN).astype(np.float64)
    share = np.convolve(won, np.ones(LATELY), mode="valid") / LATELY
    before = max(0, bouts - 1 - len(outcomes))  # the last one begun has not ended
    return np.arange(len(share), dtype=np.float64) + before + LATELY, share


def score_of(played: Sequence[PlayedBouts]) -> TeamScore:
    """How an advice did.

    Args:
        played: What came of the parts.
    """
    outcomes = [outcome for part in played for outcome in part.outcomes]
    return TeamScore(outcomes.count(BoutOutcome.WIN), len(outcomes), sum(time for part in played for time in part.times))
