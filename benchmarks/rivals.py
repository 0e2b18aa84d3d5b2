"""What coaching against robots is worth beside coaching against dummies: the same maneuvers for all, then one tournament.

Each way of coaching is done with several seeds. Judged is what was learnt by a tournament of all of it and the controllers
that are written by hand, in both seats; and by bouts against the five dummies, from poses that no coaching has seen. What is
made is kept in a folder (`METHOD-SEED.toml`, `tournament.json`, `dummies.jsonl`): the command may be broken off and given
anew. Any number of workers makes the same table. Intervals are 95 %, over seeds.

    python benchmarks/rivals.py FOLDER [--methods flat-light,chase2,set,self] [--seeds 500-502] [--bouts 4] [--dummy-bouts 20]
        [--set end_on_change=true] [--workers 1]
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import defaultdict
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Final

import kept_lines
import numpy as np
from coaching import DUMMIES, JUDGE, Run, coached, ring_of, seeds_in

from hil.book.measurement import mean_of
from hil.connecting.connecting_all import connect_all_as
from hil.files.outputs import replace_file
from hil.seeds import Branch, bout_seed
from hil.sumo.advice_file import load_advice, save_advice
from hil.sumo.bouts import Tally, play
from hil.sumo.coaching import Coaching, new_pal
from hil.sumo.controllers import AdviceController
from hil.sumo.rivals.pair import Pair
from hil.sumo.rivals.ring import RivalRing
from hil.sumo.rivals.rivals import SELF, Rivals
from hil.sumo.tournament.checkpoint import TournamentCheckpoint, load_checkpoint
from hil.sumo.tournament.duels import duel_url
from hil.sumo.tournament.entrants import Entrant, EntrantKind
from hil.sumo.tournament.schedule import Tournament, play_part
from hil.sumo.tournament.standings import Standings
from hil.working import open_crew
from pal_advisor.maneuvers import PalSettings

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from hil.working import Crew
    from pal_advisor.maneuvers import Advice

BUILT_IN: Final = ("chase", "chase2", "hobby", "random")
BY_HAND: Final = BUILT_IN[:3]
SAVE_EVERY: Final = 20
"""Pairings, after which the tournament is saved."""
LEARNT: Final = "flat-light"
"""Stands for the coaching against this dummy, with the same seed, in a set of rivals."""
SETS: Final[Mapping[str, tuple[str, ...]]] = {
    "chase": ("chase",),
    "chase2": ("chase2",),
    "hobby": ("hobby",),
    "set": ("chase", "chase2", "hobby", LEARNT),
    "self": (SELF,),
    "set-self": ("chase", "chase2", "hobby", SELF),
}
"""Who is met by each way of coaching against robots; every other method is a dummy's name."""


@dataclass(frozen=True)
class Order:
    """A coaching that is wanted.

    Attributes:
        method: How.
        seed: Its seed.
        settings: How Pal coaches.
        learnt: What was learnt against a dummy with the same seed, where it is met.
    """

    method: str
    seed: int
    settings: PalSettings
    learnt: Advice | None = None


@dataclass(frozen=True)
class DummyBouts:
    """Bouts against a dummy that are wanted.

    Attributes:
        name: Of the advice.
        advice: Plays.
        dummy: Against whom.
        bouts: How many.
    """

    name: str
    advice: Advice
    dummy: str
    bouts: int


def learnt_by(order: Order) -> Advice:
    """Coach.

    Args:
        order: How.
    """
    settings = order.settings
    if order.method not in SETS:
        return coached(Run(order.method, order.seed, settings))
    met = SETS[order.method]
    entrants = [
        Entrant(one, EntrantKind.ADVICE, order.learnt) if one == LEARNT else Entrant(one, EntrantKind(one))
        for one in met
        if one != SELF
    ]
    rivals = Rivals(tuple(entrants), self_play=SELF in met)
    with connect_all_as(Pair, duel_url(order.seed)) as pair:
        pair.home.arm()
        coaching = Coaching(RivalRing(pair, rivals), new_pal(settings, order.seed), seed=order.seed, rivals=rivals)
        coaching.run()
        return coaching.advice()


def won(task: DummyBouts) -> int:
    """Play against a dummy.

    Args:
        task: What.

    Returns:
        How many were won.
    """
    seeds = [bout_seed(JUDGE, Branch.BOUTS, number) for number in range(1, task.bouts + 1)]
    with ring_of(task.dummy, 1) as ring:
        return Tally.of(task.dummy, list(play(ring, AdviceController(task.advice), seeds))).wins


def coach_all(
    folder: Path, methods: Sequence[str], seeds: Iterable[int], settings: PalSettings, crew: Crew
) -> dict[str, Advice]:
    """What was learnt, by method and seed; what is not there is made."""
    wanted = [(method, seed) for method, seed in product(methods, seeds)]
    wanted.sort(key=lambda one: LEARNT in SETS.get(one[0], ()))  # first what others meet
    for dependent in (False, True):
        orders = []
        for method, seed in wanted:
            if (LEARNT in SETS.get(method, ())) is not dependent or (folder / f"{method}-{seed}.toml").exists():
                continue
            orders.append(Order(method, seed, settings, load_advice(folder / f"{LEARNT}-{seed}.toml") if dependent else None))
        for order, advice in zip(orders, crew.in_order(learnt_by, orders), strict=True):
            save_advice(advice, folder / f"{order.method}-{order.seed}.toml")
            sys.stderr.write(f"\rcoached {order.method}-{order.seed}   ")
    return {f"{method}-{seed}": load_advice(folder / f"{method}-{seed}.toml") for method, seed in wanted}


def meet(folder: Path, advices: Mapping[str, Advice], bouts: int, crew: Crew) -> Standings:
    """The tournament; what of it is not there is played."""
    path = folder / "tournament.json"
    entrants = [Entrant(name, EntrantKind.ADVICE, advice) for name, advice in advices.items()]
    entrants += [Entrant(name, EntrantKind(name)) for name in BUILT_IN]
    saved = load_checkpoint(path) if path.exists() else TournamentCheckpoint(Tournament(tuple(entrants), bouts, JUDGE))
    played, left = list(saved.bouts), len(saved.bouts)
    parts = []
    for part in saved.tournament.parts():
        if left < part.size:
            parts.append(part)
        left = max(0, left - part.size)
    for number, more in enumerate(crew.in_order(play_part, parts), start=1):
        played += more
        if number % SAVE_EVERY == 0 or number == len(parts):
            replace_file(path, TournamentCheckpoint(saved.tournament, tuple(played)).to_bytes())
            sys.stderr.write(f"\r{len(played)}/{saved.tournament.total} bouts   ")
    return Standings.of(saved.tournament, played)


def play_dummies(folder: Path, advices: Mapping[str, Advice], bouts: int, crew: Crew) -> dict[tuple[str, str], int]:
    """Bouts won, by advice and dummy; what is not there is played."""
    path = folder / "dummies.jsonl"
    found = {(name, dummy): wins for name, dummy, many, wins in kept_lines.kept(path) if many == bouts}
    tasks = [
        DummyBouts(name, advice, dummy, bouts)
        for name, advice in advices.items()
        for dummy in DUMMIES.split(",")
        if (name, dummy) not in found
    ]
    for task, wins in kept_lines.make(crew, won, tasks, path, lambda task, wins: [task.name, task.dummy, bouts, wins]):
        found[task.name, task.dummy] = wins
    return found


def table(standings: Standings, dummies: Mapping[tuple[str, str], int], bouts: int, methods: Sequence[str]) -> Iterable[str]:
    """Each method: ratings, and shares of the points against groups of others.

    Yields:
        Lines.
    """
    names = [entrant.name for entrant in standings.tournament.entrants]
    of_method = {method: [place for place, name in enumerate(names) if name.rpartition("-")[0] == method] for method in methods}
    groups: dict[str, list[int]] = {name: [names.index(name)] for name in BY_HAND}
    groups["taught by dummies"] = [one for method in methods if method not in SETS for one in of_method[method]]
    groups["taught by robots"] = [one for method in methods if method in SETS for one in of_method[method]]
    yield f"| coached against | rating | {' | '.join(f'points: {group}' for group in groups)} | won: dummies |"
    yield "|---" * (3 + len(groups)) + "|"
    strengths = standings.ratings.strengths
    for method, places in of_method.items():
        cells: dict[str, list[float]] = defaultdict(list)
        for place in places:
            cells["rating"].append(strengths[place].value)
            for group, others in groups.items():
                scores = [standings.matrix[place][other] for other in others if other not in places]
                if scores:
                    played = sum(score.played for score in scores)
                    cells[group].append(sum(score.share * score.played for score in scores) / played)
            each = [dummies[names[place], dummy] / bouts for dummy in DUMMIES.split(",")]
            cells["dummies"].append(float(np.mean(each)))
        shown = [_mean(cells["rating"]), *(_mean(cells[name], share=True) for name in (*groups, "dummies"))]
        yield f"| {method} | {' | '.join(shown)} |"
    for name in BUILT_IN:
        strength = strengths[names.index(name)]
        yield f"| (by hand: {name}) | {strength.value:.0f} ({strength.ci95[0]:.0f} to {strength.ci95[1]:.0f}) |"


def _mean(values: Sequence[float], *, share: bool = False) -> str:
    if len(values) < 2:
        return " ".join(f"{value:.3f}" for value in values)
    mean = mean_of(np.array(values))
    return str(replace(mean, low=max(mean.low, 0.0), high=min(mean.high, 1.0)) if share else mean)


def main() -> int:
    """Coach, judge and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--methods", default="flat-light,flat-heavy,curved-light,chase,chase2,set,self")
    parser.add_argument("--seeds", default="500-502", help="first-last")
    parser.add_argument("--bouts", type=int, default=4, help="of each pairing of the tournament")
    parser.add_argument("--dummy-bouts", type=int, default=20, help="against each dummy")
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of Pal's, all coachings alike"
    )
    parser.add_argument("--workers", type=int, default=1, help="processes")
    options = parser.parse_args()
    methods, folder = options.methods.split(","), options.folder
    settings = PalSettings.from_dict({name: json.loads(value) for name, value in (one.split("=", 1) for one in options.set)})
    folder.mkdir(parents=True, exist_ok=True)
    with open_crew(options.workers) as crew:
        advices = coach_all(folder, methods, seeds_in(options.seeds), settings, crew)
        standings = meet(folder, advices, options.bouts, crew)
        dummies = play_dummies(folder, advices, options.dummy_bouts, crew)
    sys.stderr.write("\n")
    sys.stdout.write("\n".join(table(standings, dummies, options.dummy_bouts, methods)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
