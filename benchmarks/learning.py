"""What ways of learning are worth: opponents x objectives x methods x seeds, each coached, then judged by held-out bouts.

Every cell of the table is a coaching run on an emulated robot of its own, and bouts by its advice from poses that no coaching
has seen, the same for all cells. What is made is kept in a file, a line for each cell; a cell that is there is not made
again, so that the command may be broken off and given anew, with more seeds or methods too. Any number of workers makes the
same table.

Differences between methods are paired by seed and opponent. Intervals are 95 %, over seeds.

    python benchmarks/learning.py [--methods before,now] [--against before] [--opponents flat-light,flat-heavy]
        [--objectives outcome] [--seeds 300-323 | --seeds-of COMMIT] [--bouts 200] [--workers 2] [--results learning.jsonl]
        [--budget 1600] [--table]
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict, dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import kept_lines
import numpy as np
from coaching import DUMMIES, JUDGE, Run, coached_team, ring_of, seeds_in

from hil.book.measurement import Measurement, mean_of
from hil.jobs.team import PACES, TEAM_SETTINGS, USUAL_RUNS
from hil.seeds import Branch, bout_seed
from hil.sumo.bouts import Tally, play
from hil.sumo.controllers import AdviceController
from hil.working import open_crew
from pal_advisor.maneuvers import PalSettings
from pal_advisor.maneuvers.settings import BEFORE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

_TEAM: Final = {
    "runs": USUAL_RUNS,
    "paces": list(PACES),
    **{name: getattr(TEAM_SETTINGS, name) for name in ("budget", "robot_time", "end_on_change", "progress_weight")},
}
METHODS: Final[Mapping[str, Mapping[str, Any]]] = {
    "now": {},
    "before": {**BEFORE, "loss": 12.0},
    "no-mirror": {"mirror": False},
    "no-surrogate": {"surrogate": False, "brood": 1},
    "no-again": {"again": 0},
    "no-brood": {"brood": 1},
    "no-whole-exam": {"exam_whole_bout": False},
    "loss-12": {"loss": 12.0},
    "end-on-change": {"end_on_change": True},
    "period-110": {"period": 0.11},
    "period-80": {"period": 0.08},
    "arms": {"arms_in_stimulus": True},
    "time": {"robot_time": 960.0},
    "team": _TEAM,
    "team-one-pace": {**_TEAM, "paces": [PalSettings().period]},
    "team-120": {**_TEAM, "progress_weight": 120.0},
    "team-16min": {**_TEAM, "robot_time": 960.0},
    "team-4": {**_TEAM, "runs": 4},
    "weak-5": {"faults": "wheel:left:0.95"},
    "weak-10": {"faults": "wheel:left:0.9"},
    "weak-15": {"faults": "wheel:left:0.85"},
}
"""What each changes of the settings; `runs`: so many coachings and a team exam, `paces`: time of an action in each, in turn;
`faults`: what is wrong with the robot.

`team` is what `hil coach` does with emulated robots.
"""
NO_SETTINGS: Final = ("runs", "paces", "faults")
"""What is no setting of Pal's."""


@dataclass(frozen=True)
class Cell:
    """A coaching run and what it is judged by.

    Attributes:
        method: Name of the method.
        objective: What a good maneuver is.
        opponent: Against whom.
        seed: Seed of the coaching.
        bouts: Held-out bouts.
        changes: What the method changes of the settings, as JSON: a method that has changed is another.
    """

    method: str
    objective: str
    opponent: str
    seed: int
    bouts: int
    changes: str

    @property
    def settings(self) -> PalSettings:
        """How it is coached."""
        changes = {name: value for name, value in json.loads(self.changes).items() if name not in NO_SETTINGS}
        return PalSettings.from_dict({**changes, "objective": self.objective})

    @property
    def paces(self) -> list[float]:
        """Time of an action in one run after the other, in s."""
        return list(json.loads(self.changes).get("paces", [self.settings.period]))

    @property
    def runs(self) -> int:
        """Coachings that are put together."""
        return int(json.loads(self.changes).get("runs", 1))

    @property
    def faults(self) -> str:
        """What is wrong with the robot."""
        return str(json.loads(self.changes).get("faults", ""))


@dataclass(frozen=True)
class Row:
    """What became of a cell.

    Attributes:
        cell: Which.
        wins: Held-out bouts won.
        losses: Held-out bouts lost.
        time: Median time to win, in s; None where none was won.
        maneuvers: Maneuvers performed in coaching, all runs together.
        robot_seconds: Time that the robot spent coaching and in the team exam, in s.
        advice: What was learnt, as plain values; `robustness.py` has it played elsewhere.
    """

    cell: Cell
    wins: int
    losses: int
    time: float | None
    maneuvers: int
    robot_seconds: float
    advice: Mapping[str, Any] = field(default_factory=dict)


def seeds_of(commit: str, count: int = 24) -> list[int]:
    """Seeds that nobody has chosen.

    Args:
        commit: Hash of the commit that froze the settings, whole, in hexadecimal digits.
        count: How many.
    """
    return [int(word) for word in np.random.SeedSequence(int(commit, 16)).generate_state(count)]


def made(cell: Cell) -> Row:
    """Coach, and play.

    Args:
        cell: Which.
    """
    run = Run(cell.opponent, cell.seed, cell.settings, f"&faults={cell.faults}" if cell.faults else "")
    team = coached_team(run, cell.paces, cell.runs)
    seeds = [bout_seed(JUDGE, Branch.BOUTS, number) for number in range(1, cell.bouts + 1)]
    with ring_of(run.opponent, run.seed, run.options) as ring:
        tally = Tally.of(cell.opponent, list(play(ring, AdviceController(team.advice), seeds)))
    time, seconds = tally.median_time_to_win, round(team.robot_seconds, 3)
    return Row(cell, tally.wins, tally.losses, time, team.maneuvers, seconds, team.advice.to_dict())


def kept(results: Path) -> dict[Cell, Row]:
    """What was made before; a last line that was cut short counts as not made.

    Args:
        results: The file.
    """
    rows = {}
    for data in kept_lines.kept(results):
        cell = Cell(**data.pop("cell"))
        rows[cell] = Row(cell, **data)
    return rows


def make(cells: Sequence[Cell], results: Path, workers: int) -> dict[Cell, Row]:
    """Make what is not there.

    Args:
        cells: What is wanted.
        results: The file.
        workers: Processes.
    """
    rows = kept(results)
    missing = [cell for cell in cells if cell not in rows]
    with open_crew(workers) as crew:
        rows.update(kept_lines.make(crew, made, missing, results, lambda _, row: asdict(row)))
    return rows


def table(rows: Mapping[Cell, Row], cells: Sequence[Cell], against: str | None) -> Iterable[str]:
    """Tell of what was made, as a table.

    Args:
        rows: What was made.
        cells: What is wanted.
        against: The method that the others are compared with; None compares none.

    Yields:
        Lines.
    """
    yield "| objective | opponent | method | seeds | won | worst | below .95 | median time, s |"
    yield "|---|---|---|---|---|---|---|---|"
    groups: dict[tuple[str, str, str], list[Row]] = {}
    for cell in cells:
        if cell in rows:
            groups.setdefault((cell.objective, cell.opponent, cell.method), []).append(rows[cell])
    for (objective, opponent, method), group in groups.items():
        rates = np.array([row.wins / row.cell.bouts for row in group])
        times = [row.time for row in group if row.time is not None]
        time = f"{np.mean(times):.2f}" if times else "-"
        below = int(np.count_nonzero(rates < 0.95))
        yield f"| {objective} | {opponent} | {method} | {len(rates)} | {_mean(rates)} | {rates.min():.3f} | {below} | {time} |"
    methods = dict.fromkeys(cell.method for cell in cells)
    if against in methods:
        yield ""
        yield f"| objective | opponent | method | pairs | won, less `{against}` |"
        yield "|---|---|---|---|---|"
        for objective in dict.fromkeys(cell.objective for cell in cells):
            for method in methods:
                if method != against:
                    yield from _differences(groups, objective, method, against)


def _differences(
    groups: Mapping[tuple[str, str, str], Sequence[Row]], objective: str, method: str, against: str
) -> Iterable[str]:
    every: dict[int, list[float]] = {}
    opponents = dict.fromkeys(opponent for wanted, opponent, _ in groups if wanted == objective)
    for opponent in opponents:
        theirs = {row.cell.seed: row for row in groups.get((objective, opponent, against), ())}
        pairs = [
            (row, theirs[row.cell.seed]) for row in groups.get((objective, opponent, method), ()) if row.cell.seed in theirs
        ]
        gains = [(one.wins - other.wins) / one.cell.bouts for one, other in pairs]
        for gain, (one, _) in zip(gains, pairs, strict=True):
            every.setdefault(one.cell.seed, []).append(gain)
        yield f"| {objective} | {opponent} | {method} | {len(gains)} | {_mean(np.array(gains))} |"
    whole = [float(np.mean(gains)) for gains in every.values() if len(gains) == len(opponents)]
    yield f"| {objective} | all | {method} | {len(whole)} | {_mean(np.array(whole))} |"


def _mean(values: np.ndarray[Any, np.dtype[np.float64]]) -> Measurement | str:
    return mean_of(values) if len(values) > 1 else " ".join(f"{value:.3f}" for value in values)


def main() -> int:
    """Make and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--methods", default="before,now", help=f"of {', '.join(METHODS)}; NAME+NAME joins")
    parser.add_argument("--against", default="before", help="compare the others with this method")
    parser.add_argument("--opponents", default=DUMMIES)
    parser.add_argument("--objectives", default="outcome")
    parser.add_argument("--seeds", default="300-323", help="first-last")
    parser.add_argument("--seeds-of", metavar="COMMIT", help="instead, 24 seeds drawn from the hash of a commit")
    parser.add_argument("--bouts", type=int, default=200, help="held-out bouts for each cell")
    parser.add_argument("--budget", type=int, default=PalSettings().budget, help="maneuvers of a coaching, if no method says")
    parser.add_argument("--results", type=Path, default=Path("learning.jsonl"), help="where cells are kept")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--table", action="store_true", help="make nothing: tell of what is there")
    options = parser.parse_args()
    seeds = seeds_of(options.seeds_of) if options.seeds_of else seeds_in(options.seeds)
    cells = [
        Cell(method, objective, opponent, seed, options.bouts, _changes(method, options.budget))
        for seed, opponent, objective, method in product(
            seeds,
            options.opponents.split(","),
            options.objectives.split(","),
            options.methods.split(","),
        )
    ]
    rows = kept(options.results) if options.table else make(cells, options.results, options.workers)
    sys.stdout.write("\n".join(table(rows, cells, options.against)) + "\n")
    return 0


def _changes(method: str, budget: int) -> str:
    changes: dict[str, Any] = {"budget": budget}
    for name in method.split("+"):
        changes |= METHODS[name]
    return json.dumps(changes, sort_keys=True)


if __name__ == "__main__":
    sys.exit(main())
