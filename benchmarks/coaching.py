"""What coaching is worth: coach with several seeds, then play held-out bouts with each advice.

The bouts have seeds that no coaching uses. Settings come as `--set NAME=VALUE` (see `PalSettings`), so that one lever can be
judged at a time; tune on some seeds, judge on others. Several workers give the same figures as one: each is given a whole
coaching run, and after it ten held-out bouts at a time, each ten on a new emulated robot.

    python benchmarks/coaching.py [--opponents flat-light,flat-heavy] [--seeds 1-8] [--bouts 500] [--set phases=basic]
        [--workers 2]
"""

from __future__ import annotations

import argparse
import json
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain, cycle, islice
from statistics import mean, stdev
from typing import TYPE_CHECKING, Final

import hil
from hil.seeds import Branch, bout_seed, run_seed
from hil.sumo.bouts import Tally, play
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.controllers import AdviceController
from hil.sumo.ring import open_ring
from hil.sumo.team import PlayedBouts, score_of
from hil.working import open_crew
from pal_advisor.maneuvers import PalSettings, TeamExam
from pal_advisor.maneuvers.team import BOUTS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hil.sumo.bouts import Bout
    from hil.sumo.ring import Ring
    from pal_advisor.maneuvers import Advice

DUMMIES = "flat-light,flat-heavy,curved-light,corner-light,point-light"
JUDGE = 77
"""Seed of the held-out bouts."""


PART: Final = 10
"""Held-out bouts on one emulated robot."""


@dataclass(frozen=True)
class Run:
    """A coaching run.

    Attributes:
        opponent: Against whom.
        seed: Seed of the coaching.
        settings: How to coach.
        options: What else the address of the robot says, from `&` on.
    """

    opponent: str
    seed: int
    settings: PalSettings
    options: str = ""


@dataclass(frozen=True)
class Part:
    """Held-out bouts by what was learnt in a coaching run.

    Attributes:
        run: The run.
        advice: What was learnt.
        numbers: Numbers of the bouts.
    """

    run: Run
    advice: Advice
    numbers: range


@dataclass(frozen=True)
class CoachedTeam:
    """What came of several coachings.

    Attributes:
        advice: The best of what was learnt.
        maneuvers: Maneuvers performed in coaching, all runs together.
        robot_seconds: Time that the robot spent coaching and in the team exam, in s.
    """

    advice: Advice
    maneuvers: int
    robot_seconds: float


@contextmanager
def ring_of(opponent: str, seed: int, options: str = "") -> Iterator[Ring]:
    """A new emulated robot in a ring.

    Args:
        opponent: Against whom.
        seed: Of the robot.
        options: As for `Run`.
    """
    with hil.connect(f"sim://junior?opponent={opponent}&seed={seed}{options}") as junior:
        junior.arm()
        yield open_ring(junior)


def seeds_in(text: str) -> range:
    """Seeds as a command line has them: `FIRST-LAST`, or a single one.

    Args:
        text: What is given.
    """
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def coached(run: Run) -> Advice:
    """Coach once."""
    with ring_of(run.opponent, run.seed, run.options) as ring:
        coaching = Coaching(ring, new_pal(run.settings, run.seed), seed=run.seed)
        coaching.run()
        return coaching.advice()


def coached_team(run: Run, paces: Sequence[float], runs: int, exam_options: str = "") -> CoachedTeam:
    """Coach several times, and hold the team exam where there are several runs.

    Args:
        run: How; each coaching has a seed of its own, made of this one.
        paces: Time of an action in one coaching after the other, in turn, in s.
        runs: How many coachings.
        exam_options: What the address says in the exam besides.
    """
    advices, maneuvers, seconds = [], 0, 0.0
    for number, pace in enumerate(islice(cycle(paces), runs), start=1):
        seed = run_seed(run.seed, number)
        with ring_of(run.opponent, seed, run.options) as ring:
            coaching = Coaching(ring, new_pal(replace(run.settings, period=pace), seed), seed=seed)
            coaching.run()
        advices.append(coaching.advice())
        maneuvers += coaching.pal.used
        seconds += coaching.progress.robot_seconds
    exam = TeamExam(advices)
    poses = [bout_seed(run.seed, Branch.VALIDATION, number) for number in range(1, BOUTS + 1)]
    while runs > 1 and not exam.finished:
        scores = []
        for advice in exam.wanted:
            with ring_of(run.opponent, run.seed, run.options + exam_options) as ring:
                scores.append(score_of([PlayedBouts.of(list(play(ring, AdviceController(advice), poses)))]))
        seconds += sum(score.seconds for score in scores)
        exam.tell(scores)
    return CoachedTeam(exam.best, maneuvers, seconds)


def played(part: Part) -> list[Bout]:
    """Play."""
    with ring_of(part.run.opponent, part.run.seed, part.run.options) as ring:
        seeds = [bout_seed(JUDGE, Branch.BOUTS, number) for number in part.numbers]
        return list(play(ring, AdviceController(part.advice), seeds, part.numbers[0]))


def judged(runs: Sequence[Run], bouts: int, workers: int) -> list[Tally]:
    """Coach, and play held-out bouts.

    Args:
        runs: The coaching runs.
        bouts: Bouts for each of them.
        workers: Processes.
    """
    ranges = [range(first, min(first + PART, bouts + 1)) for first in range(1, bouts + 1, PART)]
    with open_crew(workers) as crew:
        learnt = list(zip(runs, crew.in_order(coached, runs), strict=True))
        parts = [Part(run, advice, numbers) for run, advice in learnt for numbers in ranges]
        results = list(crew.in_order(played, parts))
    each = [results[first : first + len(ranges)] for first in range(0, len(results), len(ranges))]
    return [Tally.of(run.opponent, list(chain.from_iterable(results))) for run, results in zip(runs, each, strict=True)]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--opponents", default=DUMMIES)
    parser.add_argument("--seeds", default="1-8", help="first-last")
    parser.add_argument("--bouts", type=int, default=500, help="held-out bouts for each seed")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of Pal's")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    options = parser.parse_args()
    changes = dict(change.split("=", 1) for change in options.set)
    plain = {name: value if name in {"phases", "objective"} else json.loads(value) for name, value in changes.items()}
    settings = PalSettings.from_dict(plain)
    seeds = seeds_in(options.seeds)
    print(f"{settings.budget} maneuvers, objective {settings.objective}, changed: {plain or 'nothing'}")
    print(f"{options.bouts} held-out bouts each, seeds {options.seeds}")
    for opponent in options.opponents.split(","):
        tallies = judged([Run(opponent, seed, settings) for seed in seeds], options.bouts, options.workers)
        rates = [tally.win_rate.value for tally in tallies]
        spread = stdev(rates) if len(rates) > 1 else 0.0
        times = [tally.median_time_to_win for tally in tallies if tally.median_time_to_win is not None]
        time = f"{mean(times):.1f} s" if times else "-"
        each = " ".join(f"{rate:.3f}" for rate in rates)
        print(f"  {opponent:13} {mean(rates):.3f} +- {spread:.3f}, won in {time} by the median; each: {each}", flush=True)


if __name__ == "__main__":
    main()
